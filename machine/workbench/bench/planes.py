"""Planes: the commands that move, add, take away and reorder cuts; whether the cuts can be made, a trial says.

Each takes a bench on which a model lies, and what the page sends by name. They raise PlanError for what makes no sense.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace

from machine.workbench.bench.bench import Bench
from machine.workbench.bench.values import Direction, Mm, Point, check_number
from mdp.search.plan_file import PlannedPart
from profiles.errors import PlanError
from profiles.part_settings import MOST_PARTS

Cuts = tuple[PlannedPart, ...]


@dataclass(frozen=True)
class Edit:
    """Other cuts, which are tried before they are taken.

    word: for its step in the history. orders: the cuts in the print orders that will do, the wanted one first, each with the
    number of the part whose plane is put somewhere, 0: none is. near: the nearest place that can be cut will do for that plane.
    reason: how the sentence begins that tells why it cannot be done, where the planes alone do not say it.
    """

    word: str
    orders: list[tuple[Cuts, int]]
    near: bool = False
    reason: str = ""

    @property
    def cuts(self) -> Cuts:
        """The cuts that are wanted."""
        return self.orders[0][0]


def add(bench: Bench, *, normal: Direction, offset_mm: Mm, after: int | None = None, near: bool = False) -> Edit:
    """A plane for a new part printed after the part `after`, without that as the last one."""
    cuts, plane = bench.cuts or (), PlannedPart(normal, offset_mm)
    most = len(cuts) + 1
    wanted = most + 1 if after is None else check_number("after", after, 1, most) + 1
    if most + 1 > MOST_PARTS:
        raise PlanError(f"there are {most} parts: {MOST_PARTS} are allowed")
    numbers = sorted(range(2, most + 2), key=lambda number: abs(number - wanted))
    return Edit("add a plane", [((*cuts[: number - 2], plane, *cuts[number - 2 :]), number) for number in numbers], near)


def move(bench: Bench, *, part: int, normal: Direction, offset_mm: Mm, near: bool = False) -> Edit:
    """The plane of a part becomes another one; its limbs stay."""
    plane = PlannedPart(normal, offset_mm, limbs_mm=planned_part(bench, part).limbs_mm)
    return Edit("move a plane", [(_replaced(bench, part, plane), part)], near)


def snap(bench: Bench, part: int, neck: PlannedPart) -> Edit:
    """The plane of a part becomes the neck that was found near it."""
    reason = f"the neck near the plane of part {part} is no place for a cut: "
    return Edit("snap to the neck", [(_replaced(bench, part, neck), part)], reason=reason)


def limb(bench: Bench, *, part: int, point_mm: Point | None = None) -> Edit:
    """A part becomes the piece above its plane at a point alone, or without a point all that lies above."""
    limbs_mm = () if point_mm is None else (point_mm,)
    return Edit("choose a limb", [(_replaced(bench, part, replace(planned_part(bench, part), limbs_mm=limbs_mm)), 0)])


def remove(bench: Bench, *, part: int) -> Edit:
    """Without the plane of a part."""
    return Edit("remove a plane", [(_replaced(bench, part), 0)])


def reorder(bench: Bench, *, part: int, to: int) -> Edit:
    """A part is printed as number `to`."""
    moved = planned_part(bench, part)
    others = [cut for cut in bench.cuts or () if cut is not moved]
    others.insert(check_number("to", to, 2, bench.parts) - 2, moved)
    reason = f"part {part} cannot be printed as number {to}, for then "
    return Edit("print a part at another time", [(tuple(others), 0)], reason=reason)


EDITS: dict[str, Callable[..., Edit]] = {"add": add, "move": move, "limb": limb, "remove": remove, "reorder": reorder}


def planned_part(bench: Bench, part: int) -> PlannedPart:
    """The part of a number, which has a plane. Raises PlanError."""
    return (bench.cuts or ())[check_number("part", part, 2, bench.parts) - 2]


def check_unlocked(bench: Bench, part: int) -> None:
    """Raises PlanError where the plane of a part is locked, or it has none."""
    if planned_part(bench, part) in bench.locked:
        raise PlanError(f"the plane of part {part} is locked: unlock it first")


def _replaced(bench: Bench, part: int, *instead: PlannedPart) -> Cuts:
    check_unlocked(bench, part)
    index, cuts = part - 2, bench.cuts or ()
    return *cuts[:index], *instead, *cuts[index + 1 :]
