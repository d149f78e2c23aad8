"""Answers: values out of a server's JSON, which may be of any shape."""

from collections.abc import Mapping
from math import isfinite
from typing import Any

from machine.link.protocol.events import Temperature


def temperature(nozzle: Any, bed: Any, now: str, target: str) -> Temperature:
    """What two JSON objects tell of nozzle and bed under these keys."""
    return Temperature(*(number(table(heater).get(key)) for heater in (nozzle, bed) for key in (now, target)))


def table(value: Any) -> Mapping[str, Any]:
    """A JSON object; an empty one where it is none."""
    return value if isinstance(value, dict) else {}


def entry(value: Any, index: Any) -> Any:
    """An entry of a JSON array; None where there is none."""
    return value[index] if isinstance(value, list) and isinstance(index, int) and 0 <= index < len(value) else None


def number(value: Any) -> float | None:
    """A JSON number; None where it is none."""
    if not isinstance(value, int | float) or isinstance(value, bool):
        return None
    try:
        read = float(value)
    except OverflowError:  # an integer of hundreds of digits
        return None
    return read if isfinite(read) else None


def whole(value: Any) -> int | None:
    """The same, without its fraction."""
    read = number(value)
    return None if read is None else int(read)
