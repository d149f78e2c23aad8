"""Values: what a page has sent with a command, checked one by one; each raises PlanError with a sentence for what it is not."""

from collections.abc import Iterable
from typing import Any, TypeGuard

import numpy as np

from mdp.plane import unit_direction
from profiles.errors import PlanError
from profiles.frozen import Vector

Asked = dict[str, Any]  # a command `{"do": NAME, ...}` as it comes from a page
MOST_MM = 1e5
MOST_NUMBER = 1e300  # an int of a page may be longer than any float
ROTATION_ERROR = 1e-6


def is_number(value: Any) -> TypeGuard[int | float]:
    """Whether a value of a page's is a number to reckon with: no more digits than a float has."""
    return isinstance(value, int | float) and not isinstance(value, bool) and abs(value) <= MOST_NUMBER


def is_small_number(text: str) -> bool:
    """Whether the text of an address is a number of so few digits that it may be one of ours."""
    return text.isascii() and text.isdigit() and len(text) < 6


def whole(asked: Asked, key: str, least: int, most: int) -> int:
    """A whole number from `least` to `most`; where that is less there is nothing to be numbered."""
    value = asked.get(key)
    if not isinstance(value, int) or isinstance(value, bool) or not least <= value <= most:
        allowed = f"{least} to {most} is allowed" if least <= most else "there is none yet"
        raise PlanError(f"{key} is {value!r}: {allowed}")
    return value


def number(asked: Asked, key: str, least: float, most: float) -> float:
    """A number from `least` to `most`."""
    value = asked.get(key)
    if not is_number(value) or not least <= value <= most:
        raise PlanError(f"{key} is {value!r}: {least:g} to {most:g} is allowed")
    return float(value)


def vector(asked: Asked, key: str, most: float = MOST_NUMBER) -> Vector:
    """Three numbers, none farther from 0 than `most`."""
    value = asked.get(key)
    if not isinstance(value, list) or len(value) != 3 or not all(map(is_number, value)):
        raise PlanError(f"{key}: three numbers are expected")
    if max(map(abs, value)) > most:
        raise PlanError(f"{key} is {value}: {-most:g} to {most:g} is allowed")
    return vector_of(value)


def unit_vector(asked: Asked, key: str) -> Vector:
    """A direction, whose length is made 1."""
    direction = unit_direction(*vector(asked, key))
    if direction is None:
        raise PlanError(f"{key} is {asked[key]}: a direction of a length of about 1 is expected")
    return direction


def vector_of(values: Iterable[float]) -> Vector:
    """Three numbers as floats."""
    x, y, z = map(float, values)
    return x, y, z


def rotation_rows(asked: Asked, key: str) -> tuple[Vector, Vector, Vector]:
    """The rows of a rotation."""
    rows = asked.get(key)
    if not isinstance(rows, list) or len(rows) != 3:
        raise PlanError(f"{key}: three rows of three numbers are expected")
    x, y, z = (vector({key: row}, key) for row in rows)
    matrix = np.array((x, y, z))
    if not np.allclose(matrix @ matrix.T, np.eye(3), atol=ROTATION_ERROR) or np.linalg.det(matrix) < 0.0:
        raise PlanError(f"{key}: its rows are no rotation")
    return x, y, z


def text_or_none(asked: Asked, key: str) -> str | None:
    """A text, None where the page has sent null or nothing."""
    value = asked.get(key)
    return None if value is None else str(value)
