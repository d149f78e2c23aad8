"""Toml: tables written as TOML text, so that a profile can be saved (the standard library only reads it)."""

import json
import re
from collections.abc import Iterator, Mapping
from typing import Any

BARE = re.compile(r"^[A-Za-z0-9_-]+$")


def toml(document: Mapping[str, Any]) -> str:
    """The document as TOML: plain values first, then its tables; numbers keep all their digits."""
    return "\n".join(_table(document, ())).strip() + "\n"


def _table(table: Mapping[str, Any], path: tuple[str, ...]) -> Iterator[str]:
    for key, value in table.items():
        if not isinstance(value, Mapping) and not _tables(value):
            yield f"{_key(key)} = {_value(value)}"
    for key, value in table.items():
        name = ".".join(map(_key, (*path, key)))
        if isinstance(value, Mapping):
            yield from ("", f"[{name}]") if not value or not all(isinstance(each, Mapping) for each in value.values()) else ()
            yield from _table(value, (*path, key))
        elif _tables(value):
            for each in value:
                yield from ("", f"[[{name}]]")
                yield from _table(each, (*path, key))


def _tables(value: Any) -> bool:
    return isinstance(value, list) and bool(value) and all(isinstance(each, Mapping) for each in value)


def _key(key: str) -> str:
    return key if BARE.match(key) else _value(key)


def _value(value: Any) -> str:
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, str):
        return json.dumps(value, ensure_ascii=False).replace("\x7f", "\\u007F")
    if isinstance(value, list | tuple):
        return f"[{', '.join(map(_value, value))}]"
    return repr(value)
