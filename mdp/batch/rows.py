"""Rows: the table of a batch, a line of CSV for every call that is done; whatever ends the batch, what stands in it is whole."""

import csv
import io
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from dataclasses import asdict, fields
from pathlib import Path
from typing import Any, TypeVar, get_type_hints

from profiles.errors import BatchError

NO_TEXT = "surrogateescape"  # names of files may be no text

Row = TypeVar("Row")  # a dataclass of text and numbers


@contextmanager
def writing_alone(folder: Path, lock: str) -> Iterator[None]:
    """A folder, made where it is missing, that nobody else writes into meanwhile. lock: name of the file that says so.

    Raises BatchError when somebody does, and for what cannot be written.
    """
    try:
        folder.mkdir(parents=True, exist_ok=True)
        with (folder / lock).open("w") as file:
            try:
                _lock(file.fileno())
            except (BlockingIOError, PermissionError):
                raise BatchError(f"folder {folder}: another run writes into it; wait for it or take another") from None
            yield
    except OSError as error:
        raise BatchError(f"folder {folder}: cannot be written ({error})") from None


def _lock(descriptor: int) -> None:
    """Raises OSError where another process holds the file; given back when it is closed."""
    try:
        import fcntl
    except ImportError:  # Windows
        import msvcrt

        msvcrt.locking(descriptor, msvcrt.LK_NBLCK, 1)  # type: ignore[attr-defined]
    else:
        fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)


def read_rows(path: Path, kind: type[Row]) -> list[Row]:
    """The rows of a table, in its order; none where there is no table, and none for a last line that was cut off.

    Raises BatchError for a damaged table.
    """
    if not path.is_file():
        return []
    columns = _columns(kind)
    types: dict[str, Callable[[str], Any]] = get_type_hints(kind)
    rows: list[Row] = []
    with path.open(newline="", encoding="utf-8", errors=NO_TEXT) as file:
        lines = csv.DictReader(file)
        if lines.fieldnames != columns:
            raise BatchError(f"{path}: its columns are not {', '.join(columns)}: it is no table of this version")
        for line in lines:
            number = lines.line_num
            try:
                rows.append(kind(**{name: types[name](line[name]) for name in columns}))
            except (TypeError, ValueError):
                if next(lines, None) is None:  # cut off while it was written: that call is done again
                    break
                raise BatchError(f"{path}: line {number} is not of this table: {line}") from None
    return rows


def write_rows(path: Path, kind: type[Row], rows: Iterable[Row]) -> None:
    """A whole table, written beside and renamed."""
    beside = path.with_name(f"{path.name}.new")
    header = io.StringIO()
    csv.writer(header, lineterminator="\n").writerow(_columns(kind))
    beside.write_text(header.getvalue() + "".join(map(_line, rows)), encoding="utf-8", errors=NO_TEXT, newline="")
    beside.replace(path)


def append_row(path: Path, row: Any) -> None:
    """One more line of a table that exists, written at once."""
    with path.open("a", newline="", encoding="utf-8", errors=NO_TEXT) as file:
        file.write(_line(row))


def _columns(kind: type[Any]) -> list[str]:
    return [field.name for field in fields(kind)]


def _line(row: Any) -> str:
    text = io.StringIO()
    csv.writer(text, lineterminator="\n").writerow(asdict(row).values())
    return text.getvalue()
