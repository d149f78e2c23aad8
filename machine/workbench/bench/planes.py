"""Planes: cuts that a person moves, adds, takes away and puts into another order; whether they can be cut, a trial says.

The edits take the bench, on which a model lies, and what is asked, and give the cuts. They raise PlanError for what makes no
sense.
"""

from dataclasses import replace

from machine.workbench.bench.bench import Bench
from machine.workbench.bench.values import MOST_MM, Asked, number, unit_vector, vector, whole
from mdp.plane import Plane
from mdp.search.plan_file import PlannedPart
from profiles.errors import PlanError
from profiles.part_settings import MOST_PARTS

Cuts = tuple[PlannedPart, ...]


def add_plane(bench: Bench, asked: Asked) -> Cuts:
    """The plane `normal`, `offset_mm` for a new part printed after part `after`, without that as the last one."""
    cuts = bench.cuts or ()
    index = added_part(bench, asked) - 2
    if len(cuts) + 2 > MOST_PARTS:
        raise PlanError(f"there are {len(cuts) + 1} parts: {MOST_PARTS} are allowed")
    return *cuts[:index], _plane(asked), *cuts[index:]


def added_part(bench: Bench, asked: Asked) -> int:
    """The number that the new part has."""
    most = len(bench.cuts or ()) + 1
    return whole({"after": most, **asked}, "after", 1, most) + 1


def added_anywhere(bench: Bench, asked: Asked) -> list[tuple[Cuts, int]]:
    """The planes with the new one in every place of the print order, the one asked for first, each with its part's number."""
    wanted = added_part(bench, asked)
    numbers = sorted(range(2, len(bench.cuts or ()) + 3), key=lambda number: abs(number - wanted))
    return [(add_plane(bench, {**asked, "after": number - 1}), number) for number in numbers]


def moved_alone(bench: Bench, asked: Asked) -> list[tuple[Cuts, int]]:
    """The planes with that of `part` moved, and its number."""
    return [(move_plane(bench, asked), check_unlocked(bench, asked))]


def move_plane(bench: Bench, asked: Asked) -> Cuts:
    """The plane of `part` becomes `normal`, `offset_mm`; its limbs stay."""
    return _replaced(bench, asked, replace(_plane(asked), limbs_mm=planned_part(bench, asked).limbs_mm))


def choose_limb(bench: Bench, asked: Asked) -> Cuts:
    """`part` becomes the piece above its plane at `point_mm` alone, or without a point all that lies above."""
    limbs_mm = () if asked.get("point_mm") is None else (vector(asked, "point_mm", MOST_MM),)
    return _replaced(bench, asked, replace(planned_part(bench, asked), limbs_mm=limbs_mm))


def remove_plane(bench: Bench, asked: Asked) -> Cuts:
    """Without the plane of `part`."""
    return _replaced(bench, asked)


def reorder(bench: Bench, asked: Asked) -> Cuts:
    """`part` is printed as number `to`."""
    moved = planned_part(bench, asked)
    others = [part for part in bench.cuts or () if part is not moved]
    others.insert(whole(asked, "to", 2, bench.parts) - 2, moved)
    return tuple(others)


def snap(bench: Bench, asked: Asked, plane: Plane) -> Cuts:
    """The plane of `part` becomes another one."""
    return _replaced(bench, asked, PlannedPart.of(plane))


def planned_part(bench: Bench, asked: Asked) -> PlannedPart:
    """The `part`, which has a plane. Raises PlanError."""
    return (bench.cuts or ())[whole(asked, "part", 2, bench.parts) - 2]


def check_unlocked(bench: Bench, asked: Asked) -> int:
    """The number of the `part`, whose plane must not be locked. Raises PlanError."""
    if planned_part(bench, asked) in bench.locked:
        raise PlanError(f"the plane of part {asked['part']} is locked: unlock it first")
    return int(asked["part"])


def _replaced(bench: Bench, asked: Asked, *instead: PlannedPart) -> Cuts:
    index, cuts = check_unlocked(bench, asked) - 2, bench.cuts or ()
    return *cuts[:index], *instead, *cuts[index + 1 :]


def _plane(asked: Asked) -> PlannedPart:
    return PlannedPart(unit_vector(asked, "normal"), number(asked, "offset_mm", -MOST_MM, MOST_MM))
