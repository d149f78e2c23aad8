"""Collection: searches that make the records of many models, an index with one line per search (its result, or why it has no
record), and a summary.
"""

import io
from collections import Counter
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from time import process_time

import numpy as np

from mdp.batch.rows import read_rows, write_rows
from mdp.learning.command import table
from mdp.learning.models import coarser, oriented, read_model
from mdp.search.search import SearchRequest, decompose
from profiles.errors import UserError
from profiles.profile import DEFAULTS, Profile, load

INDEX = "index.csv"
LOCK = "index.lock"
NO_RISK, NO_CUT, NO_SIDE, FAILED = "no risky face", "nothing feasible", "no further side to rest on", "failed: "
STAYS = (NO_RISK, NO_CUT, NO_SIDE)  # reasons that hold however often the search is repeated
HEADS = ("terms", "settings", "searches", "models", "records", "lists", "mean length", "mean J", "core h", "late")
MOST_NAMES = 20  # greatest number of failed searches that are named: about a screen


Key = tuple[str, int, str]  # a model, the number of its orientation, and the terms of the search


@dataclass(frozen=True)
class Row:
    """The result of a search. settings: the settings shared by all searches of a collection; faces, faces_after: of the model as
    read and as searched; candidates: number of evaluated candidates; seconds: processor time; outcome: least cost as a share of
    the risky area; late: 1 if the time limit ended the search; excluded: why there is no record, "" if there is one.
    """

    id: str
    orientation: int
    terms: str
    settings: str
    faces: int = 0
    faces_after: int = 0
    stages: int = 0
    candidates: int = 0
    lists: int = 0
    mean_list_length: float = 0.0
    seconds: float = 0.0
    outcome: float = 1.0
    late: int = 0
    excluded: str = ""

    @property
    def key(self) -> Key:
        """Key of the row's search."""
        return self.id, self.orientation, self.terms

    @property
    def file(self) -> str:
        """The name of the search's record file."""
        return f"{self.id}.{self.orientation}.{self.terms}.npz"

    @property
    def in_words(self) -> str:
        """The result in words, for the progress display."""
        return self.excluded or f"J {self.outcome:.4f}, {self.lists} lists, {self.seconds:.0f} s"


def read_index(folder: Path) -> list[Row]:
    """The rows of a collection, the last one of each search; empty if there is no index.

    Raises UserError for a damaged index.
    """
    return list({row.key: row for row in read_rows(folder / INDEX, Row)}.values())


def write_index(folder: Path, rows: Iterable[Row]) -> None:
    """Write the index of a collection, sorted by model, orientation and terms."""
    write_rows(folder / INDEX, Row, sorted(rows, key=lambda row: row.key))


def unfinished(folder: Path, rows: Iterable[Row], wanted: Iterable[Key]) -> list[Key]:
    """The searches without a line, without a record file, or that failed."""
    done = {row.key for row in rows if (not row.excluded and (folder / row.file).is_file()) or row.excluded in STAYS}
    return [key for key in wanted if key not in done]


def summary(rows: Sequence[Row]) -> Iterator[str]:
    """The number of searches for each set of terms, then the reasons for missing records."""
    yield table(HEADS, [_of_terms([row for row in rows if row.terms == terms]) for terms in sorted({row.terms for row in rows})])
    reasons = Counter((row.terms, row.excluded.partition(":")[0]) for row in rows if row.excluded)
    if reasons:
        yield table(("terms", "no record because", "searches"), [(*key, str(count)) for key, count in sorted(reasons.items())])
    failed = [f"- {row.file}: {row.excluded.removeprefix(FAILED)}" for row in rows if row.excluded.startswith(FAILED)]
    more = [f"- and {len(failed) - MOST_NAMES} more"] if len(failed) > MOST_NAMES else []
    if failed:
        yield "\n".join([*failed[:MOST_NAMES], *more])


def _of_terms(rows: Sequence[Row]) -> tuple[str, ...]:
    recorded = [row for row in rows if not row.excluded]
    lists = sum(row.lists for row in recorded)
    means = ("-", "-")
    if lists:
        length = sum(row.lists * row.mean_list_length for row in recorded) / lists
        means = (f"{length:.1f}", f"{np.mean([row.outcome for row in recorded]):.4f}")
    settings = ", ".join(sorted({row.settings for row in rows}))
    counts = (len(rows), len({row.id for row in rows}), len(recorded), lists)
    hours = sum(row.seconds for row in rows) / 3600.0
    return (rows[0].terms, settings, *map(str, counts), *means, f"{hours:.2f}", str(sum(row.late for row in rows)))


PAPER_TERMS = ("search.objective=risky", "search.count_platform_faces=true", "search.clearance=false")
TERMS = {"paper": ("search.method=published", *PAPER_TERMS), "best": PAPER_TERMS, "ours": ()}
UNPOLISHED = "search.polish=false"  # a record holds what the beam saw; polishing comes later


@dataclass(frozen=True)
class Settings:
    """Settings shared by all searches of a collection. most_faces, time_limit_s: None for no limit; machine, material, process:
    names or files of profiles; own: KEY=VALUE as for --set.
    """

    beam_width: int = 50
    most_faces: int | None = None
    time_limit_s: float | None = None
    machine: str = DEFAULTS["machine"]
    material: str = DEFAULTS["material"]
    process: str = DEFAULTS["process"]
    own: tuple[str, ...] = ()

    @property
    def in_words(self) -> str:
        """The settings in words, as stored with each record."""
        faces = [] if self.most_faces is None else [f"faces<={self.most_faces}"]
        profiles = [f"{kind}={getattr(self, kind)}" for kind, usual in DEFAULTS.items() if getattr(self, kind) != usual]
        return " ".join((f"B={self.beam_width}", *faces, *profiles, *self.own))

    def profile(self, terms: str) -> Profile:
        """The profile of a search on some terms."""
        limit = () if self.time_limit_s is None else (f"search.time_limit_s={self.time_limit_s}",)
        fixed = (*TERMS[terms], UNPOLISHED, f"search.beam_width={self.beam_width}", *limit)
        return load(self.machine, self.material, self.process, (*self.own, *fixed))


def run(row: Row, path: Path, settings: Settings) -> tuple[Row, bytes]:
    """Run a search: its complete row, and its record, empty if there is none. row: the known part of the row.

    An invalid model gives a row; a bug raises.
    """
    began, records = process_time(), list[bytes]()
    try:
        profile, mesh = settings.profile(row.terms), read_model(path)
        row = replace(row, faces=len(mesh.faces), faces_after=len(mesh.faces))
        if settings.most_faces is not None:
            mesh = coarser(mesh, settings.most_faces)
            row = replace(row, faces_after=len(mesh.faces))
        resting = oriented(mesh, row.orientation, profile.process.self_supporting_angle_deg)
        if resting is None:
            return replace(row, excluded=NO_SIDE, seconds=round(process_time() - began, 2)), b""
        decomposition = decompose(resting, row.id, profile, SearchRequest(on_record=records.append))
    except UserError as error:
        return replace(row, excluded=f"{FAILED}{error!s}", seconds=round(process_time() - began, 2)), b""
    late = int(settings.time_limit_s is not None and decomposition.search_s >= settings.time_limit_s)
    row = replace(row, candidates=decomposition.candidates_evaluated, late=late, seconds=round(process_time() - began, 2))
    with np.load(io.BytesIO(records[0])) as record:
        outcome, stage, risky = float(record["node_outcome"][0]), record["stage"], float(record["risky_mm2"]) > 0.0
    if len(stage) == 0:
        return replace(row, excluded=NO_CUT if risky else NO_RISK), b""
    lists = len(np.unique(stage))
    length = round(len(stage) / lists, 2)
    row = replace(row, stages=decomposition.rounds, lists=lists, mean_list_length=length, outcome=round(outcome, 6))
    return row, records[0]
