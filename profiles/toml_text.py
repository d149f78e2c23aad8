"""TOML text: what a person has written, read once for all files and options; whatever is wrong with it is one short reason."""

import tomllib
from typing import Any


def read_toml(text: str) -> dict[str, Any]:
    """The tables of a text, with or without a byte order mark. Raises ValueError with a reason of one line."""
    try:
        return tomllib.loads(text.removeprefix("\ufeff"))
    except RecursionError:
        raise ValueError("it is nested too deep") from None
    except tomllib.TOMLDecodeError as error:
        raise ValueError(" ".join(str(error).split())[:200]) from None
    except ValueError:  # Python reads no number of more digits
        raise ValueError("a number in it has too many digits") from None


def read_value(text: str) -> Any:
    """A single value as TOML has it; what is no TOML is text."""
    try:
        return read_toml(f"value = {text}")["value"]
    except ValueError:
        return text
