"""Sheets: TOML files that the program writes with numbers left open, and reads again when a person has filled them in.

Every function raises ProfileError that names the file and what is wrong in it.
"""

from collections.abc import Mapping, Sequence
from math import isfinite
from pathlib import Path
from typing import Any

import tomlkit

from profiles.errors import ProfileError
from profiles.places import parse


def quoted(text: str) -> str:
    """A text as a value of TOML, as it is typed where that is possible."""
    return tomlkit.string(text, literal=text.isprintable() and "'" not in text).as_string()


def read_document(path: Path, keys: Sequence[str], of: str) -> Mapping[str, Any]:
    """A sheet that has no keys but these; of: whose sheet it is, for the message."""
    document = parse(path, "sheet")
    unknown = [key for key in document if key not in keys]
    if unknown:
        raise ProfileError(f"{path}: {', '.join(unknown)} is not a key of {of} sheet: allowed are {', '.join(keys)}")
    return document


def rows_of(path: Path, document: Mapping[str, Any], key: str) -> list[Mapping[str, Any]]:
    """The [[key]] tables of a sheet."""
    rows = document.get(key, [])
    if not isinstance(rows, list) or not all(isinstance(row, Mapping) for row in rows):
        raise ProfileError(f"{path}: {key} must be a list of tables, [[{key}]]")
    return rows


def check_row(path: Path, label: str, row: Mapping[str, Any], keys: Sequence[str]) -> None:
    """Refuse a table that has other keys."""
    unknown = [key for key in row if key not in keys]
    if unknown:
        allowed = f"{', '.join(keys[:-1])} and {keys[-1]}"
        raise ProfileError(f"{path}: {label}: {unknown[0]} is not known: allowed are {allowed}")


def number(path: Path, key: str, value: object) -> float:
    """A finite number."""
    if isinstance(value, bool) or not isinstance(value, int | float) or not isfinite(value):
        raise ProfileError(f"{path}: {key} is {value!r}: it must be a number")
    return float(value)
