"""Index: one line a search of a collection of records, what came of it and why it has no record."""

from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path

from mdp.batch.rows import read_rows, write_rows

INDEX = "index.csv"
LOCK = "index.lock"


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

    Raises BatchError for a damaged one.
    """
    return list({row.search: row for row in read_rows(folder / INDEX, Row)}.values())


def write_index(folder: Path, rows: Iterable[Row]) -> None:
    """The index of a collection, in the order of models, orientations and terms."""
    write_rows(folder / INDEX, Row, sorted(rows, key=lambda row: (row.id, row.orientation, row.terms)))


def unfinished(folder: Path, rows: Iterable[Row], wanted: Iterable[Search]) -> list[Search]:
    """The searches that have no line yet, whose record is gone, or that failed."""
    done = {row.search for row in rows if (not row.excluded and (folder / row.search.file).is_file()) or is_settled(row)}
    return [search for search in wanted if search not in done]


NO_RISK, NO_CUT, NO_SIDE, FAILED = "no risky face", "nothing feasible", "no further side to rest on", "failed: "


def is_settled(row: Row) -> bool:
    """Whether a search has no record for a reason that stays."""
    return row.excluded in (NO_RISK, NO_CUT, NO_SIDE)
