"""Types of the arguments of page commands; invalid values are refused in sentences like those of profiles."""

from collections.abc import Callable, Iterable, Mapping
from dataclasses import replace
from inspect import Parameter, signature
from typing import TYPE_CHECKING, Annotated, Any, TypeVar

import numpy as np
from pydantic import AfterValidator, BaseModel, ConfigDict, Field, ValidationError, create_model

from mdp.plane import unit_direction
from profiles.errors import PlanError
from profiles.frozen import Vector
from profiles.wording import sentences

if TYPE_CHECKING:
    from _typeshed import DataclassInstance

Whole = TypeVar("Whole", bound="DataclassInstance")
Asked = dict[str, Any]  # a command `{"do": NAME, ...}` from a page
MOST_MM = 1e5
ROTATION_ERROR = 1e-6


def _direction(values: Vector) -> Vector:
    direction = unit_direction(*values)
    if direction is None:
        raise ValueError(f"{list(values)} is not a direction: a length of about 1 is expected")
    return direction


def _rotation(rows: tuple[Vector, Vector, Vector]) -> tuple[Vector, Vector, Vector]:
    matrix = np.array(rows)
    if not np.allclose(matrix @ matrix.T, np.eye(3), atol=ROTATION_ERROR) or np.linalg.det(matrix) < 0.0:
        raise ValueError("its rows are not a rotation")
    return rows


Mm = Annotated[float, Field(ge=-MOST_MM, le=MOST_MM)]
Point = Annotated[tuple[Mm, Mm, Mm], Field(strict=False)]  # a list in JSON
Direction = Annotated[tuple[float, float, float], Field(strict=False), AfterValidator(_direction)]  # normalised
Row = Annotated[tuple[float, float, float], Field(strict=False)]
Rotation = Annotated[tuple[Row, Row, Row], Field(strict=False), AfterValidator(_rotation)]


class Arguments(BaseModel):
    """The arguments of a page command. Fields that its function does not take, such as the name of the page, are ignored."""

    model_config = ConfigDict(frozen=True, strict=True, allow_inf_nan=False)


def arguments_of(command: Callable[..., Any], base: type[Arguments] = Arguments) -> type[Arguments]:
    """Argument type of a command: the keyword-only parameters of its function, in addition to the base."""
    parameters = [given for given in signature(command).parameters.values() if given.kind is Parameter.KEYWORD_ONLY]
    fields: dict[str, Any] = {
        given.name: (given.annotation, ... if given.default is Parameter.empty else given.default) for given in parameters
    }
    return create_model(command.__name__, __base__=base, **fields)


def read_command(asked: Asked, commands: Mapping[str, type[Arguments]]) -> tuple[str, Arguments]:
    """Name and arguments of a page command. Raises PlanError."""
    name = asked.get("do")
    if not isinstance(name, str):
        raise PlanError("what the page has sent names no command: docs/workbench-protocol.md lists them")
    if name not in commands:
        raise PlanError(f"{name!r} is not a command: docs/workbench-protocol.md lists them")
    try:
        return name, commands[name].model_validate(asked)
    except ValidationError as error:
        raise PlanError(sentences(error.errors(), commands[name])[0]) from None


def check_number(key: str, value: int, least: int, most: int) -> int:
    """Return a number from `least` to `most`; `most` below `least` means that there is nothing to number. Raises PlanError."""
    if not least <= value <= most:
        allowed = f"{least} to {most} is allowed" if least <= most else "there is none yet"
        raise PlanError(f"{key} is {value}: {allowed}")
    return value


def with_value(whole: Whole, name: str, value: object) -> Whole:
    """A copy of a dataclass with another value of one field, named at run time."""
    change: dict[str, Any] = {name: value}
    return replace(whole, **change)


def vector_of(values: Iterable[float]) -> Vector:
    x, y, z = map(float, values)
    return x, y, z
