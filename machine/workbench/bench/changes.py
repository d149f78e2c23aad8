"""Changes: the commands that change the bench at once, each with the new bench that it makes. Nothing here writes or waits.

All are given the bench, on which a model lies, and give the same bench where they change nothing; they raise PlanError for what
cannot be done.
"""

from dataclasses import replace
from math import radians
from typing import Annotated, ClassVar, Literal

import numpy as np
from pydantic import Field

from machine.pipeline.requests import MOST_COPIES
from machine.planning.stops import parse_stops
from machine.workbench.bench.bench import Bench, laid_down, with_parts, with_rotation
from machine.workbench.bench.part_settings import with_part_setting, without_part_settings
from machine.workbench.bench.planes import planned_part
from machine.workbench.bench.values import Command, Direction, Rotation, check_number
from mdp.mesh import Floats
from mdp.pose import about
from profiles.errors import PlanError
from profiles.messages import option
from profiles.profile import Profile

TURN_DIGITS = 15  # so that quarter turns are exact
MOST_STOPS = 1000


class Change(Command):
    """A command that makes another bench at once."""

    def change(self, bench: Bench) -> Bench:
        """The bench after it."""
        raise NotImplementedError


class Turn(Change):
    """Turn the model about an axis of the machine."""

    do: Literal["turn"] = "turn"
    word: ClassVar = "turn the model"
    axis: Literal["x", "y", "z"]
    deg: Annotated[float, Field(ge=-360, le=360)]

    def change(self, bench: Bench) -> Bench:
        axis = np.eye(3)["xyz".index(self.axis)]
        return with_rotation(bench, _rounded(about(axis, radians(self.deg)) @ np.array(bench.rotation)))


class Stand(Change):
    """Turn the model as the rows of a rotation say."""

    do: Literal["stand"] = "stand"
    word: ClassVar = "lay the model down"
    rotation: Rotation

    def change(self, bench: Bench) -> Bench:
        return with_rotation(bench, self.rotation)


class Lay(Change):
    """Lay the model down on a side of this outward normal, in its own frame."""

    do: Literal["lay"] = "lay"
    word: ClassVar = "lay a face down"
    normal: Direction

    def change(self, bench: Bench) -> Bench:
        return with_rotation(bench, _rounded(laid_down(bench, np.array(self.normal))))


class Take(Change):
    """Take the row of the front that has this number of parts."""

    do: Literal["take"] = "take"
    word: ClassVar = "take another number of parts"
    parts: int

    def change(self, bench: Bench) -> Bench:
        numbers = [row.parts for row in bench.rows]
        if self.parts not in numbers:
            allowed = ", ".join(map(str, numbers)) or "nothing, for no parts have been found,"
            raise PlanError(f"parts is {self.parts}: {allowed} is allowed")
        taken = with_parts(bench, self.parts)
        return bench if taken.cuts == bench.cuts else taken


class Lock(Change):
    """Lock the plane of a part, or unlock it."""

    do: Literal["lock"] = "lock"
    word: ClassVar = "lock a plane"
    part: int
    locked: bool = False

    def change(self, bench: Bench) -> Bench:
        part = planned_part(bench, self.part)
        locked = bench.locked | {part} if self.locked else bench.locked - {part}
        return bench if locked == bench.locked else replace(bench, locked=locked)


class SetPart(Change):
    """Give a part alone another value of a key of the process; null: as all parts have it."""

    do: Literal["set_part"] = "set_part"
    word: ClassVar = "set a part"
    part: int
    key: str
    value: str | None = None

    def change(self, bench: Bench) -> Bench:
        return _with_settings(bench, with_part_setting(bench.profile, _part(bench, self.part), self.key, self.value))


class ResetPart(Change):
    """Clear what a part has of its own."""

    do: Literal["reset_part"] = "reset_part"
    word: ClassVar = "take a part's changes back"
    part: int

    def change(self, bench: Bench) -> Bench:
        return _with_settings(bench, without_part_settings(bench.profile, _part(bench, self.part)))


class AddStop(Change):
    """A pause before a layer or height, written as the options of `export` take it; pauses come first, as they do there."""

    do: Literal["add_stop"] = "add_stop"
    word: ClassVar = "add a pause"
    kind: Literal["pause", "filament_change"]
    at: str

    def change(self, bench: Bench) -> Bench:
        (stop,) = parse_stops([self.at], []) if self.kind == "pause" else parse_stops([], [self.at])
        if stop in bench.stops:
            return bench
        if len(bench.stops) >= MOST_STOPS:
            raise PlanError(f"there are {len(bench.stops)} pauses: {MOST_STOPS} are allowed")
        return replace(bench, stops=tuple(sorted((*bench.stops, stop), key=lambda stop: stop.change)))


class RemoveStop(Change):
    """Take a pause away, numbered from 1."""

    do: Literal["remove_stop"] = "remove_stop"
    word: ClassVar = "take a pause away"
    number: int

    def change(self, bench: Bench) -> Bench:
        number = check_number("number", self.number, 1, len(bench.stops))
        return replace(bench, stops=(*bench.stops[: number - 1], *bench.stops[number:]))


class Copies(Change):
    """Another number of copies on the plate."""

    do: Literal["copies"] = "copies"
    word: ClassVar = "print another number of copies"
    count: int

    def change(self, bench: Bench) -> Bench:
        count = check_number(option("copies"), self.count, 1, MOST_COPIES)  # as the option is refused
        return bench if count == bench.copies else replace(bench, copies=count)


CHANGES = (Turn, Stand, Lay, Take, Lock, SetPart, ResetPart, AddStop, RemoveStop, Copies)


def _part(bench: Bench, part: int) -> int:
    return check_number("part", part, 1, max(bench.parts, 1))  # an uncut model is part 1


def _with_settings(bench: Bench, profile: Profile) -> Bench:
    return bench if profile.parts == bench.profile.parts else replace(bench, profile=profile)


def _rounded(matrix: Floats) -> list[list[float]]:
    """Rows of a rotation made orthogonal again after many turns, without the noise of the last digit."""
    left, _, right = np.linalg.svd(matrix)
    rows: list[list[float]] = (np.round(left @ right, TURN_DIGITS) + 0.0).tolist()
    return rows
