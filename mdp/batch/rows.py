"""Rows: the table of a batch, a line of CSV for every call that is done; whatever ends the batch, what stands in it is whole."""

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

NO_TEXT = "surrogateescape"  # names of files may be no text

Row = TypeVar("Row")  # a dataclass of text and numbers


@contextmanager
def writing_alone(folder: Path, lock: str) -> Iterator[None]:
    """A folder, made where it is missing, that nobody else writes into meanwhile. lock: name of the file that says so.

    Raises UserError when somebody does, and for what cannot be written.
    """
    try:
        folder.mkdir(parents=True, exist_ok=True)
        with (folder / lock).open("w") as file:
            if not locked(file.fileno()):
                raise UserError(f"folder {folder}: another run writes into it; wait for it or take another")
            yield
    except OSError as error:
        raise UserError(f"folder {folder}: cannot be written ({error})") from None


def read_rows(path: Path, kind: type[Row]) -> list[Row]:
    """The rows of a table, in its order; none where there is no table, and none for a last line that was cut off.

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
            raise UserError(f"{path}: its columns are not {', '.join(columns)}: it is no table of this version")
        for line in lines:
            number = lines.line_num
            try:
                rows.append(kind(**{name: types[name](line[name]) for name in columns}))
            except (TypeError, ValueError):
                if next(lines, None) is None:  # cut off while it was written: that call is done again
                    break
                raise UserError(f"{path}: line {number} is not of this table: {line}") from None
    return rows


def write_rows(path: Path, kind: type[Row], rows: Iterable[Row]) -> None:
    """A whole table, written beside and renamed."""
    header = io.StringIO()
    csv.writer(header, lineterminator="\n").writerow(_columns(kind))
    text = header.getvalue() + "".join(map(_line, rows))
    write_whole(path, text.encode("utf-8", NO_TEXT), SHARED)


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
