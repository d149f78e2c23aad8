"""Index: one line a search of a collection of records, what came of it and why it has no record."""

import csv
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from dataclasses import asdict, dataclass, fields
from pathlib import Path
from typing import Any, get_type_hints

from profiles.errors import LearningError

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


COLUMNS = [field.name for field in fields(Row)]


@contextmanager
def writing_alone(folder: Path) -> Iterator[None]:
    """A folder, made where it is missing, that nobody else writes into meanwhile.

    Raises LearningError when somebody does, and for what cannot be written.
    """
    try:
        folder.mkdir(parents=True, exist_ok=True)
        with (folder / LOCK).open("w") as lock:
            try:
                _lock(lock.fileno())
            except (BlockingIOError, PermissionError):
                raise LearningError(f"folder {folder}: another collection writes into it; wait for it or take another") from None
            yield
    except OSError as error:
        raise LearningError(f"folder {folder}: cannot be written ({error})") from None


def _lock(descriptor: int) -> None:
    """Raises OSError where another process holds the file; given back when it is closed."""
    try:
        import fcntl
    except ImportError:  # Windows
        import msvcrt

        msvcrt.locking(descriptor, msvcrt.LK_NBLCK, 1)  # type: ignore[attr-defined]
    else:
        fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)


def read_index(folder: Path) -> list[Row]:
    """The rows of a collection, the last one of each search; none where there is no index.

    Raises LearningError for a damaged one.
    """
    path = folder / INDEX
    if not path.is_file():
        return []
    kinds: dict[str, Callable[[str], Any]] = get_type_hints(Row)
    rows: dict[Search, Row] = {}
    with path.open(newline="", encoding="utf-8") as file:
        lines = csv.DictReader(file)
        if lines.fieldnames != COLUMNS:
            raise LearningError(f"{path}: its columns are not {', '.join(COLUMNS)}: it is not an index of this version")
        for line in lines:
            try:
                row = Row(**{name: kinds[name](line[name]) for name in COLUMNS})
            except (TypeError, ValueError):
                if next(lines, None) is None:  # cut off while it was written: that search is done again
                    break
                raise LearningError(f"{path}: line {lines.line_num} is not an index line: {line}") from None
            rows[row.search] = row
    return list(rows.values())


def write_index(folder: Path, rows: Iterable[Row]) -> None:
    """The index of a collection, in the order of models, orientations and terms, written beside and renamed."""
    beside = folder / f"{INDEX}.new"
    with beside.open("w", newline="", encoding="utf-8") as file:
        writer = csv.DictWriter(file, COLUMNS, lineterminator="\n")
        writer.writeheader()
        writer.writerows(asdict(row) for row in sorted(rows, key=lambda row: (row.id, row.orientation, row.terms)))
    beside.replace(folder / INDEX)


def append_row(folder: Path, row: Row) -> None:
    """One more line of an index that exists."""
    with (folder / INDEX).open("a", newline="", encoding="utf-8") as file:
        csv.DictWriter(file, COLUMNS, lineterminator="\n").writerow(asdict(row))


def unfinished(folder: Path, rows: Iterable[Row], wanted: Iterable[Search]) -> list[Search]:
    """The searches that have no line yet, whose record is gone, or that failed."""
    done = {row.search for row in rows if (not row.excluded and (folder / row.search.file).is_file()) or is_settled(row)}
    return [search for search in wanted if search not in done]


NO_RISK, NO_CUT, FAILED = "no risky face", "nothing feasible", "failed: "


def is_settled(row: Row) -> bool:
    """Whether a search has no record for a reason that stays."""
    return row.excluded in (NO_RISK, NO_CUT)
