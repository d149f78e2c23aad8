"""Project record: the content of a project's `work.json`, and its checks."""

from pathlib import Path
from typing import Annotated, Any, Self

import numpy as np
from pydantic import BaseModel, BeforeValidator, Field, ValidationError, model_validator

from machine.pipeline.requests import MOST_COPIES
from machine.planning.stops import Stop, parse_stops
from profiles.errors import PlanError, SliceError
from profiles.part_settings import MOST_PARTS
from profiles.places import KINDS
from profiles.wording import LONGEST_VALUE, sentences

VERSION = 3  # 2: other models without their cuts
VERSION_OF_ONE_MODEL = 1  # version for a project without other models, which older versions of this program can read
RECORD = "work.json"
NESTED = ("beside", "figures", "own_profiles")  # keys whose values are tables; a table's keys may be free
LONGEST_NAME = 255  # bytes of a file name on any disk


class NewerError(PlanError):
    """A record from a newer version of this program."""


def _not_newer(value: object) -> object:
    if isinstance(value, int) and not isinstance(value, bool) and value > VERSION:
        raise NewerError(f"{RECORD} has version {value}")
    return value


class GivenRecord(BaseModel, strict=True, frozen=True):
    """Names of profiles or of the project's files, and KEY=VALUE settings over them."""

    machine: str
    material: str
    process: str
    settings: list[str]


class ModelRecord(BaseModel, strict=True, frozen=True, allow_inf_nan=False):
    """One of the models of a project. model: a file of the project; "": a demo."""

    name: str
    model: str
    rotation: list[list[float]]
    plan: bool
    parts: Annotated[int, Field(ge=0, le=MOST_PARTS)]
    locked: list[Annotated[int, Field(ge=0)]]
    copies: Annotated[int, Field(ge=1, le=MOST_COPIES)]
    recommended: Annotated[int, Field(ge=0, le=MOST_PARTS)] = 0

    @model_validator(mode="after")
    def _is_possible(self) -> Self:
        matrix = np.array(self.rotation) if [len(row) for row in self.rotation] == [3, 3, 3] else np.zeros((3, 3))
        matrix = np.clip(matrix, -2.0, 2.0)  # no entry of a rotation is that large, and products of larger numbers overflow
        if not np.allclose(matrix @ matrix.T, np.eye(3), atol=1e-6) or np.linalg.det(matrix) < 0.0:
            raise ValueError(f"rotation is {self.rotation}: it must be three rows of a rotation")
        if any(k >= max(self.parts, 1) - 1 for k in self.locked):
            raise ValueError(f"locked is {self.locked}: it must be places of the {max(self.parts, 1) - 1} planes, from 0")
        if not is_file_name_anywhere(self.name):
            raise ValueError(f"name is {self.name!r}: it must be the name of a file")
        return self


def _of_version_2(value: object) -> object:
    """Another model on the plate; older versions wrote its name, model and number of copies alone."""
    if not isinstance(value, list) or len(value) != 3:
        return value
    uncut = {"rotation": np.eye(3).tolist(), "plan": False, "parts": 0, "locked": []}
    return {"name": value[0], "model": value[1], "copies": value[2], **uncut}


class Record(ModelRecord, frozen=True):
    """A project's record, with the values of machine.pipeline.project.Project; those of ModelRecord are of the first model on the
    plate."""

    version: Annotated[int, BeforeValidator(_not_newer), Field(ge=1)]
    program: str = ""
    given: GivenRecord
    own_profiles: dict[str, str]
    pauses: list[str]
    changes: list[str]
    beside: list[Annotated[ModelRecord, BeforeValidator(_of_version_2)]] = []
    worked_on: Annotated[int, Field(ge=0)] = 0
    plate: Annotated[int, Field(ge=0)] | None = None
    marks_in_plan: bool = True
    figures: dict[str, float] = {}

    @model_validator(mode="after")
    def _agrees(self) -> Self:
        if not self.own_profiles.keys() <= set(KINDS):
            raise ValueError(f"own_profiles is of {', '.join(self.own_profiles)}: {', '.join(KINDS)} are known")
        _ = self.stops
        names = [each.name for each in self.beside]
        if len({self.name, *names}) <= len(names):
            raise ValueError(f"beside names {', '.join(names)} next to {self.name}: each model must occur once")
        if self.worked_on > len(names):
            raise ValueError(f"worked_on is {self.worked_on}: it must be one of the {len(names) + 1} models, from 0")
        return self

    @property
    def stops(self) -> tuple[Stop, ...]:
        """Where the print waits for the user. Raises ValueError."""
        try:
            return parse_stops(self.pauses, self.changes)
        except SliceError as error:
            raise ValueError(f"pauses and changes: {str(error).partition(' ')[2]}") from None


def is_file_name_anywhere(name: str) -> bool:
    """Whether a name is valid for a file on any disk."""
    try:
        size = len(name.encode())
    except UnicodeEncodeError:
        return False
    control = any(ord(letter) < 32 for letter in name)
    return Path(name).name == name and name not in ("", "..") and not control and size <= LONGEST_NAME


def read_record(folder: Path) -> Record:
    """The record of a project in a folder.

    Raises OSError, NewerError for a newer version, and PlanError with a sentence about its first problem.
    """
    text = (folder / RECORD).read_bytes()
    try:
        return Record.model_validate_json(text)
    except ValidationError as error:
        raise PlanError(_in_words(error)) from None


def checked_record(**values: Any) -> Record:
    """The record of these values. Raises PlanError with a sentence about its first problem."""
    try:
        return Record(**values)
    except ValidationError as error:
        raise PlanError(_in_words(error)) from None


def _in_words(error: ValidationError) -> str:
    """A sentence about the first problem of a record."""
    problem: Any = error.errors(include_url=False)[0]
    *_, last = path = problem["loc"] or ("",)
    if problem["type"] == "json_invalid":
        return f"{RECORD} is not JSON"
    if not problem["loc"] and problem["type"] != "value_error":
        return f"{RECORD} is {str(problem['input'])[:LONGEST_VALUE]}: a table of keys is expected"
    if isinstance(last, int) or path[0] in NESTED:
        key, expected = ".".join(map(str, path)), problem["msg"].removeprefix("Input should be ")
        return f"{RECORD}: {key} is {str(problem['input'])[:LONGEST_VALUE]}: it must be {expected}"
    return f"{RECORD}: {sentences([problem], Record)[0]}"
