"""Planes: the commands that move, add, take away and reorder cuts; whether the cuts can be made, a trial says.

All are given the bench, on which a model lies, and give the cuts. They raise PlanError for what makes no sense.
"""

from dataclasses import replace
from typing import Any, ClassVar, Literal

from machine.workbench.bench.bench import Bench
from machine.workbench.bench.values import Command, Direction, Mm, Point, check_number
from mdp.search.plan_file import PlannedPart
from profiles.errors import PlanError
from profiles.part_settings import MOST_PARTS

Cuts = tuple[PlannedPart, ...]


class Edit(Command):
    """A command that gives other cuts, which are tried first."""

    near: bool = False  # whether the nearest place will do, of a plane that is put somewhere

    @property
    def instead(self) -> str:
        """How the reason begins why that cannot be done, where the planes alone do not say it."""
        return ""

    @property
    def nearer(self) -> dict[str, Any] | None:
        """The command that puts the plane at the nearest place; None: it puts none anywhere."""
        return None

    def cuts(self, bench: Bench) -> Cuts:
        """The cuts after it."""
        return self.orders(bench)[0][0]

    def orders(self, bench: Bench) -> list[tuple[Cuts, int]]:
        """The cuts with the plane that is put somewhere, each time with the number of its part, in the print orders that will do,
        the wanted one first."""
        raise NotImplementedError


class PlacedPlane(Edit):
    """One that puts a plane somewhere."""

    normal: Direction
    offset_mm: Mm

    @property
    def nearer(self) -> dict[str, Any] | None:
        return self.model_copy(update={"near": True}).model_dump(mode="json", exclude_none=True)

    @property
    def plane(self) -> PlannedPart:
        """The plane."""
        return PlannedPart(self.normal, self.offset_mm)


class Add(PlacedPlane):
    """A plane for a new part printed after the part `after`, without that as the last one."""

    do: Literal["add"] = "add"
    word: ClassVar = "add a plane"
    after: int | None = None

    def orders(self, bench: Bench) -> list[tuple[Cuts, int]]:
        cuts = bench.cuts or ()
        most = len(cuts) + 1
        wanted = most + 1 if self.after is None else check_number("after", self.after, 1, most) + 1
        if len(cuts) + 2 > MOST_PARTS:
            raise PlanError(f"there are {len(cuts) + 1} parts: {MOST_PARTS} are allowed")
        numbers = sorted(range(2, len(cuts) + 3), key=lambda number: abs(number - wanted))
        return [((*cuts[: number - 2], self.plane, *cuts[number - 2 :]), number) for number in numbers]


class Move(PlacedPlane):
    """The plane of a part becomes another one; its limbs stay."""

    do: Literal["move"] = "move"
    word: ClassVar = "move a plane"
    part: int

    def orders(self, bench: Bench) -> list[tuple[Cuts, int]]:
        limbs_mm = planned_part(bench, self.part).limbs_mm
        return [(_replaced(bench, self.part, replace(self.plane, limbs_mm=limbs_mm)), self.part)]


class Snap(Move):
    """The plane of a part moved to the neck that was found near it."""

    word: ClassVar = "snap to the neck"

    @property
    def instead(self) -> str:
        return f"the neck near the plane of part {self.part} is no place for a cut: "

    def orders(self, bench: Bench) -> list[tuple[Cuts, int]]:
        return [(_replaced(bench, self.part, self.plane), self.part)]


class Limb(Edit):
    """A part becomes the piece above its plane at a point alone, or without a point all that lies above."""

    do: Literal["limb"] = "limb"
    word: ClassVar = "choose a limb"
    part: int
    point_mm: Point | None = None

    def cuts(self, bench: Bench) -> Cuts:
        limbs_mm = () if self.point_mm is None else (self.point_mm,)
        return _replaced(bench, self.part, replace(planned_part(bench, self.part), limbs_mm=limbs_mm))


class Remove(Edit):
    """Without the plane of a part."""

    do: Literal["remove"] = "remove"
    word: ClassVar = "remove a plane"
    part: int

    def cuts(self, bench: Bench) -> Cuts:
        return _replaced(bench, self.part)


class Reorder(Edit):
    """A part is printed as number `to`."""

    do: Literal["reorder"] = "reorder"
    word: ClassVar = "print a part at another time"
    part: int
    to: int

    @property
    def instead(self) -> str:
        return f"part {self.part} cannot be printed as number {self.to}, for then "

    def cuts(self, bench: Bench) -> Cuts:
        moved = planned_part(bench, self.part)
        others = [part for part in bench.cuts or () if part is not moved]
        others.insert(check_number("to", self.to, 2, bench.parts) - 2, moved)
        return tuple(others)


EDITS = (Add, Move, Limb, Remove, Reorder)


def planned_part(bench: Bench, part: int) -> PlannedPart:
    """The part of a number, which has a plane. Raises PlanError."""
    return (bench.cuts or ())[check_number("part", part, 2, bench.parts) - 2]


def check_unlocked(bench: Bench, part: int) -> int:
    """The number of a part, whose plane must not be locked. Raises PlanError."""
    if planned_part(bench, part) in bench.locked:
        raise PlanError(f"the plane of part {part} is locked: unlock it first")
    return part


def _replaced(bench: Bench, part: int, *instead: PlannedPart) -> Cuts:
    index, cuts = check_unlocked(bench, part) - 2, bench.cuts or ()
    return *cuts[:index], *instead, *cuts[index + 1 :]
