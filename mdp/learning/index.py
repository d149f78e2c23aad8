"""Index: one line a search of a collection of records, what came of it and why it has no record; a summary of all lines."""

from collections import Counter
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from mdp.batch.rows import read_rows, write_rows

INDEX = "index.csv"
LOCK = "index.lock"
NO_RISK, NO_CUT, NO_SIDE, FAILED = "no risky face", "nothing feasible", "no further side to rest on", "failed: "
STAYS = (NO_RISK, NO_CUT, NO_SIDE)  # reasons for which a search has no record however often it is made
HEADS = ("terms", "settings", "searches", "models", "records", "lists", "mean length", "mean J", "core h", "late")
MOST_NAMES = 20  # of searches that failed: about a screen


@dataclass(frozen=True)
class Search:
    """A model in one orientation, searched on some terms."""

    id: str
    orientation: int
    terms: str

    @property
    def file(self) -> str:
        """The name of its record."""
        return f"{self.id}.{self.orientation}.{self.terms}.npz"


@dataclass(frozen=True)
class Row:
    """What came of a search. settings: what all searches of a collection share; faces, faces_after: of the model as read and as
    searched; candidates: that were looked at; seconds: of processor time; outcome: least cost as share of the risky area;
    late: the time limit ended it; excluded: why there is no record, "" where there is one."""

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
    def search(self) -> Search:
        """The search that the row is of."""
        return Search(self.id, self.orientation, self.terms)

    @property
    def in_words(self) -> str:
        """What came of it, for a person who waits."""
        return self.excluded or f"J {self.outcome:.4f}, {self.lists} lists, {self.seconds:.0f} s"


def read_index(folder: Path) -> list[Row]:
    """The rows of a collection, the last one of each search; none where there is no index.

    Raises UserError for a damaged one.
    """
    return list({row.search: row for row in read_rows(folder / INDEX, Row)}.values())


def write_index(folder: Path, rows: Iterable[Row]) -> None:
    """The index of a collection, in the order of models, orientations and terms."""
    write_rows(folder / INDEX, Row, sorted(rows, key=lambda row: (row.id, row.orientation, row.terms)))


def unfinished(folder: Path, rows: Iterable[Row], wanted: Iterable[Search]) -> list[Search]:
    """The searches that have no line yet, whose record is gone, or that failed."""
    done = {row.search for row in rows if (not row.excluded and (folder / row.search.file).is_file()) or row.excluded in STAYS}
    return [search for search in wanted if search not in done]


def summary(rows: Sequence[Row]) -> Iterator[str]:
    """The number of searches on each of the terms, then which of them have no record and why."""
    yield table(HEADS, [_of_terms([row for row in rows if row.terms == terms]) for terms in sorted({row.terms for row in rows})])
    reasons = Counter((row.terms, row.excluded.partition(":")[0]) for row in rows if row.excluded)
    if reasons:
        yield table(("terms", "no record because", "searches"), [(*key, str(count)) for key, count in sorted(reasons.items())])
    failed = [f"- {row.search.file}: {row.excluded.removeprefix(FAILED)}" for row in rows if row.excluded.startswith(FAILED)]
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


def table(heads: Sequence[str], lines: Sequence[Sequence[str]]) -> str:
    """A table in Markdown."""
    rows = [f"| {' | '.join(cells)} |" for cells in (heads, *lines)]
    return "\n".join([rows[0], "|" + "---|" * len(heads), *rows[1:]])
