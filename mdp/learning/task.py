"""Task: one search of a collection, from the model's file to its record, in whatever process it runs."""

import io
from dataclasses import dataclass, replace
from pathlib import Path
from time import process_time

import numpy as np

from mdp.learning.index import FAILED, NO_CUT, NO_RISK, NO_SIDE, Row, Search
from mdp.learning.models import coarser, oriented, read_model
from mdp.search.search import SearchRequest, decompose
from profiles.errors import UserError
from profiles.profile import DEFAULTS, Profile, load

PAPER_TERMS = ("search.objective=risky", "search.count_platform_faces=true", "search.clearance=false")
TERMS = {"paper": ("search.method=published", *PAPER_TERMS), "best": PAPER_TERMS, "ours": ()}
UNPOLISHED = "search.polish=false"  # a record holds what the beam saw; polishing comes after it


@dataclass(frozen=True)
class Settings:
    """What all searches of a collection share. most_faces: None for any number; time_limit_s: None for as long as it takes;
    machine, material, process: names or files of profiles; own: KEY=VALUE as of --set."""

    beam_width: int = 50
    most_faces: int | None = None
    time_limit_s: float | None = None
    machine: str = DEFAULTS["machine"]
    material: str = DEFAULTS["material"]
    process: str = DEFAULTS["process"]
    own: tuple[str, ...] = ()

    @property
    def in_words(self) -> str:
        """What a record depends on."""
        faces = [] if self.most_faces is None else [f"faces<={self.most_faces}"]
        profiles = [f"{kind}={getattr(self, kind)}" for kind, usual in DEFAULTS.items() if getattr(self, kind) != usual]
        return " ".join((f"B={self.beam_width}", *faces, *profiles, *self.own))

    def profile(self, terms: str) -> Profile:
        """The profile of a search on some terms."""
        limit = () if self.time_limit_s is None else (f"search.time_limit_s={self.time_limit_s}",)
        fixed = (*TERMS[terms], UNPOLISHED, f"search.beam_width={self.beam_width}", *limit)
        return load(self.machine, self.material, self.process, (*self.own, *fixed))


@dataclass(frozen=True)
class Result:
    """A line of the index, and the content of the record that it tells of, empty where there is none."""

    row: Row
    record: bytes = b""


def run(search: Search, path: Path, settings: Settings) -> Result:
    """Search one model; what is wrong with the model becomes a line, a bug is raised."""
    row, began = Row(search.id, search.orientation, search.terms, settings.in_words), process_time()
    try:
        profile = settings.profile(search.terms)
        mesh = read_model(path)
        row = replace(row, faces=len(mesh.faces), faces_after=len(mesh.faces))
        if settings.most_faces is not None:
            mesh = coarser(mesh, settings.most_faces)
            row = replace(row, faces_after=len(mesh.faces))
        resting = oriented(mesh, search.orientation, profile.process.self_supporting_angle_deg)
        if resting is None:
            return Result(replace(row, excluded=NO_SIDE, seconds=round(process_time() - began, 2)))
        records: list[bytes] = []
        decomposition = decompose(resting, search.id, profile, SearchRequest(on_record=records.append))
    except UserError as error:
        return Result(replace(row, excluded=f"{FAILED}{error}", seconds=round(process_time() - began, 2)))
    limit_s = settings.time_limit_s
    late = int(limit_s is not None and decomposition.search_s >= limit_s)
    row = replace(row, candidates=decomposition.candidates_evaluated, late=late, seconds=round(process_time() - began, 2))
    with np.load(io.BytesIO(records[0])) as record:
        outcome, stage, risky = float(record["node_outcome"][0]), record["stage"], float(record["risky_mm2"]) > 0.0
    if len(stage) == 0:
        return Result(replace(row, excluded=NO_CUT if risky else NO_RISK))
    lists = len(np.unique(stage))
    length = round(len(stage) / lists, 2)
    row = replace(row, stages=decomposition.rounds, lists=lists, mean_list_length=length, outcome=round(outcome, 6))
    return Result(row, records[0])
