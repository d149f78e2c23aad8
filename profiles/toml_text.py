"""TOML text: read in one way for all files and options, and values written so that they can be read back; every error is one
short reason.
"""

import json
import re
import tomllib
from collections.abc import Mapping, Sequence
from typing import Any

BARE = re.compile(r"[A-Za-z0-9_-]+")
DELETE = "\x7f"  # the one character that JSON keeps and TOML forbids


def read_toml(text: str) -> dict[str, Any]:
    """The tables in a text, with or without a byte order mark. Raises ValueError with a reason of one line."""
    try:
        return tomllib.loads(text.removeprefix("\ufeff"))
    except RecursionError:
        raise ValueError("it is nested too deep") from None
    except tomllib.TOMLDecodeError as error:
        raise ValueError(" ".join(str(error).split())[:200]) from None
    except ValueError:  # Python's limit for the digits of a number
        raise ValueError("a number in it has too many digits") from None


def read_value(text: str) -> Any:
    """A single TOML value; other text is a string. A table in braces may have several lines, as in TOML 1.1."""
    line = text.replace("\n", " ") if text.startswith("{") else text
    try:
        return read_toml(f"value = {line}")["value"]
    except ValueError:
        return text


def value_text(value: Any) -> str:
    """A value of a profile in one line of TOML."""
    if isinstance(value, Mapping):
        return f"{{{', '.join(f'{key_text(key)} = {value_text(entry)}' for key, entry in value.items())}}}"
    if isinstance(value, list | tuple):
        return f"[{', '.join(map(value_text, value))}]"
    return json.dumps(value, ensure_ascii=False).replace(DELETE, "\\u007f")


def rows_text(value: Mapping[str, Any] | Sequence[Any]) -> str:
    """A list or a table as TOML, one line per item."""
    if isinstance(value, Mapping):
        rows = ",\n".join(f"  {key_text(key)} = {value_text(entry)}" for key, entry in value.items())
        return f"{{\n{rows}\n}}" if rows else "{}"
    rows = "".join(f"  {value_text(entry)},\n" for entry in value)
    return f"[\n{rows}]" if rows else "[]"


def key_text(key: str) -> str:
    """A key of a table, in quotation marks if necessary."""
    return key if BARE.fullmatch(key) else value_text(key)
