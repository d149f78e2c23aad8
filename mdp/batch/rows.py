"""Rows: the table of a batch, a line of CSV for every completed call; its lines stay complete however the batch ends."""

import csv
import io
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from dataclasses import asdict, fields
from pathlib import Path
from typing import Any, TypeVar, get_type_hints

from profiles.errors import UserError
from profiles.files import SHARED, write_whole
from profiles.files import lock as locked

NO_TEXT = "surrogateescape"  # file names may not be valid text

Row = TypeVar("Row")  # a dataclass of text and numbers


@contextmanager
def writing_alone(folder: Path, lock: str) -> Iterator[None]:
    """Create a folder if it is missing and lock it against other runs. lock: name of the lock file.

    Raises UserError if another run holds the lock or the folder cannot be written.
    """
    try:
        folder.mkdir(parents=True, exist_ok=True)
        with (folder / lock).open("w") as file:
            if not locked(file.fileno()):
                raise UserError(f"folder {folder}: another run writes into it; wait for it or take another")
            yield
    except OSError as error:
        raise UserError(f"folder {folder} cannot be written ({error})") from None


def read_rows(path: Path, kind: type[Row]) -> list[Row]:
    """The rows of a table in file order; empty if there is no table. A last line that was cut off is skipped.

    Raises UserError for a damaged table.
    """
    if not path.is_file():
        return []
    columns = _columns(kind)
    types: dict[str, Callable[[str], Any]] = get_type_hints(kind)
    rows: list[Row] = []
    with path.open(newline="", encoding="utf-8", errors=NO_TEXT) as file:
        lines = csv.DictReader(file)
        if lines.fieldnames != columns:
            raise UserError(f"{path}: its columns are not {', '.join(columns)}: it is not a table of this version")
        for line in lines:
            number = lines.line_num
            try:
                rows.append(kind(**{name: types[name](line[name]) for name in columns}))
            except (TypeError, ValueError):
                if next(lines, None) is None:  # cut off while it was written: that call is repeated
                    break
                raise UserError(f"{path}: line {number} does not fit the columns of this table: {line}") from None
    return rows


def write_rows(path: Path, kind: type[Row], rows: Iterable[Row]) -> None:
    """Write a whole table: to a temporary file, which then replaces the old one."""
    header = io.StringIO()
    csv.writer(header, lineterminator="\n").writerow(_columns(kind))
    text = header.getvalue() + "".join(map(_line, rows))
    write_whole(path, text.encode("utf-8", NO_TEXT), SHARED)


def append_row(path: Path, row: Any) -> None:
    """Append a line to an existing table and write it at once."""
    with path.open("a", newline="", encoding="utf-8", errors=NO_TEXT) as file:
        file.write(_line(row))


def _columns(kind: type[Any]) -> list[str]:
    return [field.name for field in fields(kind)]


def _line(row: Any) -> str:
    text = io.StringIO()
    csv.writer(text, lineterminator="\n").writerow(asdict(row).values())
    return text.getvalue()
