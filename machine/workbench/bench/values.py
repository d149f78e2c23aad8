"""Values: what typed commands of a page are made of; what they do not allow is refused in a sentence like those of profiles."""

from collections.abc import Iterable
from typing import Annotated, Any, ClassVar, Self, TypeGuard

import numpy as np
from pydantic import AfterValidator, BaseModel, ConfigDict, Field, ValidationError

from mdp.plane import unit_direction
from profiles.errors import PlanError
from profiles.frozen import Vector
from profiles.wording import sentences

Asked = dict[str, Any]  # a command `{"do": NAME, ...}` as it comes from a page
MOST_MM = 1e5
MOST_NUMBER = 1e300  # an int of a page may be longer than any float
ROTATION_ERROR = 1e-6


def _direction(values: Vector) -> Vector:
    direction = unit_direction(*values)
    if direction is None:
        raise ValueError(f"{list(values)} is no direction: a length of about 1 is expected")
    return direction


def _rotation(rows: tuple[Vector, Vector, Vector]) -> tuple[Vector, Vector, Vector]:
    matrix = np.array(rows)
    if not np.allclose(matrix @ matrix.T, np.eye(3), atol=ROTATION_ERROR) or np.linalg.det(matrix) < 0.0:
        raise ValueError("its rows are no rotation")
    return rows


Mm = Annotated[float, Field(ge=-MOST_MM, le=MOST_MM)]
Point = Annotated[tuple[Mm, Mm, Mm], Field(strict=False)]  # a list in JSON
Direction = Annotated[tuple[float, float, float], Field(strict=False), AfterValidator(_direction)]  # its length is made 1
Row = Annotated[tuple[float, float, float], Field(strict=False)]
Rotation = Annotated[tuple[Row, Row, Row], Field(strict=False), AfterValidator(_rotation)]


class Command(BaseModel):
    """What a page asks for. `do` of each kind is its name; what else a page may say is not read. word: for its step in the
    history."""

    model_config = ConfigDict(frozen=True, strict=True, allow_inf_nan=False)
    word: ClassVar[str] = ""
    do: str

    @classmethod
    def of(cls, asked: Asked) -> Self:
        """The command that a page has sent. Raises PlanError."""
        try:
            return cls.model_validate(asked)
        except ValidationError as error:
            raise PlanError(sentences(error.errors(), cls)[0]) from None


def check_number(key: str, value: int, least: int, most: int) -> int:
    """A number from `least` to `most`; where that is less there is nothing to be numbered. Raises PlanError."""
    if not least <= value <= most:
        allowed = f"{least} to {most} is allowed" if least <= most else "there is none yet"
        raise PlanError(f"{key} is {value}: {allowed}")
    return value


def is_number(value: Any) -> TypeGuard[int | float]:
    """Whether a value of a page's is a number to reckon with: no more digits than a float has."""
    return isinstance(value, int | float) and not isinstance(value, bool) and abs(value) <= MOST_NUMBER


def is_small_number(text: str) -> bool:
    """Whether the text of an address is a number of so few digits that it may be one of ours."""
    return text.isascii() and text.isdigit() and len(text) < 6


def vector_of(values: Iterable[float]) -> Vector:
    """Three numbers as floats."""
    x, y, z = map(float, values)
    return x, y, z
