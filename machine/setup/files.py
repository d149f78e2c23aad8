"""Files of setup: sheets that the user fills in, and profiles of the user.

A sheet is a TOML file written with numbers left open, and read again when they are filled in. The readers raise ProfileError
naming the file and the fault.
"""

import tomllib
from collections.abc import Mapping, MutableMapping, Sequence
from math import isfinite
from pathlib import Path
from typing import Any

import tomlkit

from profiles.errors import ProfileError
from profiles.places import PARENT, merged, own, own_folder, parse, shipped


def quoted(text: str) -> str:
    """A text as a TOML value, literal if possible."""
    return tomlkit.string(text, literal=text.isprintable() and "'" not in text).as_string()


def read_document(path: Path, keys: Sequence[str], of: str) -> Mapping[str, Any]:
    """A sheet with only these keys; of: its owner, for messages."""
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
    """Raise ProfileError for a table with other keys."""
    unknown = [key for key in row if key not in keys]
    if unknown:
        allowed = f"{', '.join(keys[:-1])} and {keys[-1]}"
        raise ProfileError(f"{path}: {label}: {unknown[0]} is not known: allowed are {allowed}")


def number(path: Path, key: str, value: object) -> float:
    """A finite number. Raises ProfileError."""
    if isinstance(value, bool) or not isinstance(value, int | float) or not isfinite(value):
        raise ProfileError(f"{path}: {key} is {value!r}: it must be a number")
    return float(value)


def own_profile(kind: str, name: str, parent: str, tables: Mapping[str, Any]) -> tuple[Path, str]:
    """Path and new text of a user's profile: its present content, comments included, with the new tables over it."""
    file = own_folder(kind) / f"{name}.toml"
    if name not in own(kind):
        known = parent in (*shipped(kind), *own(kind))
        return file, tomlkit.dumps({PARENT: parent if known else str(Path(parent).resolve()), **tables})
    whole = merged(parse(file), tables)
    document = tomlkit.parse(file.read_text(encoding="utf-8"))
    _overlay(document, tables)
    text = tomlkit.dumps(document)
    # With dotted keys tomlkit puts a new table before the keys that follow: then the comments are lost.
    return file, text if tomllib.loads(text) == whole else tomlkit.dumps(whole)


def _overlay(table: MutableMapping[str, Any], values: Mapping[str, Any]) -> None:
    """Put values into a table and keep its other keys."""
    for key, value in values.items():
        below = table.get(key)
        if isinstance(value, Mapping) and isinstance(below, MutableMapping):
            _overlay(below, value)
        else:
            table[key] = value
