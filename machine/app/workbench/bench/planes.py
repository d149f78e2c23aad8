"""Planes: cuts that a person moves, adds, takes away and puts into another order; whether they can be cut, a trial says."""

from math import hypot
from typing import Any, TypeGuard

import numpy as np

from machine.app.workbench.bench.bench import Bench
from mdp.plane import Plane
from mdp.plans.plan_file import PlannedPart
from profiles.errors import PlanError
from profiles.frozen import Vector
from profiles.part_settings import MOST_PARTS

Cuts = tuple[PlannedPart, ...]
MOST_MM = 1e5
MOST_NUMBER = 1e300  # an int of a page may be longer than any float
LEAST_NORMAL, MOST_NORMAL = 1e-6, 1e6
ROTATION_ERROR = 1e-6


def edited(bench: Bench, asked: dict[str, Any]) -> tuple[str, Cuts]:
    """A word for what a command does to the cuts, and the cuts after it. Raises PlanError for what makes no sense.

    move: the plane of `part` becomes `normal`, `offset_mm`; add: such a plane for a new part printed after part `after`; remove:
    `part`; reorder: `part` is printed as number `to`.
    """
    if bench.model is None:
        raise PlanError("there is no model on the workbench yet: choose a file first")
    cuts = bench.cuts or ()
    match asked.get("do"):
        case "add":
            place = _number(asked.get("after", len(cuts) + 1), "after", 1, len(cuts) + 1) - 1
            if len(cuts) + 2 > MOST_PARTS:
                raise PlanError(f"there are {len(cuts) + 1} parts: {MOST_PARTS} are allowed")
            return "add a plane", (*cuts[:place], _plane(asked), *cuts[place:])
        case "move":
            place = free_place(bench, asked.get("part"))
            return "move a plane", (*cuts[:place], _plane(asked), *cuts[place + 1 :])
        case "remove":
            place = free_place(bench, asked.get("part"))
            return "remove a plane", (*cuts[:place], *cuts[place + 1 :])
        case _:
            moved = planned_part(bench, asked.get("part"))
            others = [part for part in cuts if part is not moved]
            others.insert(_number(asked.get("to"), "to", 2, len(cuts) + 1) - 2, moved)
            return "print a part at another time", tuple(others)


def instead_of(asked: dict[str, Any]) -> str:
    """How the reason begins why a command cannot be done, where the planes alone do not say it."""
    if asked.get("do") != "reorder":
        return ""
    return f"part {asked.get('part')} cannot be printed as number {asked.get('to')}, for then "


def moved_to(bench: Bench, number: Any, plane: Plane) -> Cuts:
    """The cuts with another plane for the part of a number. Raises PlanError."""
    x, y, z = (float(value) for value in plane.normal)
    place, cuts = free_place(bench, number), bench.cuts or ()
    return (*cuts[:place], PlannedPart((x, y, z), float(plane.offset_mm)), *cuts[place + 1 :])


EDITS = ("add", "move", "remove", "reorder")


def planned_part(bench: Bench, number: Any) -> PlannedPart:
    """The part of a number, which has a plane. Raises PlanError."""
    return (bench.cuts or ())[_number(number, "part", 2, bench.parts) - 2]


def free_place(bench: Bench, number: Any) -> int:
    """The place among the cuts of a part whose plane is not locked."""
    if planned_part(bench, number) in bench.locked:
        raise PlanError(f"the plane of part {number} is locked: unlock it first")
    return int(number) - 2


def _plane(asked: dict[str, Any]) -> PlannedPart:
    normal, offset_mm = asked.get("normal"), asked.get("offset_mm")
    if not isinstance(normal, list) or len(normal) != 3 or not all(map(is_number, normal)):
        raise PlanError("normal: three numbers are expected")
    length = hypot(*normal)
    if not LEAST_NORMAL <= length <= MOST_NORMAL:
        raise PlanError(f"normal is {normal}: a direction of a length of about 1 is expected")
    if not is_number(offset_mm) or abs(offset_mm) > MOST_MM:
        raise PlanError(f"offset_mm is {offset_mm!r}: a number from {-MOST_MM:g} to {MOST_MM:g} is allowed")
    x, y, z = (float(value) / length for value in normal)
    return PlannedPart((x, y, z), float(offset_mm))


def rotation_rows(given: Any, key: str) -> tuple[Vector, Vector, Vector]:
    """The rows of a rotation that a page has sent. Raises PlanError for what is none."""
    rows = given if isinstance(given, list) and len(given) == 3 else []
    if not rows or not all(isinstance(row, list) and len(row) == 3 and all(map(is_number, row)) for row in rows):
        raise PlanError(f"{key}: three rows of three numbers are expected")
    matrix = np.array(rows, dtype=np.float64)
    if not np.allclose(matrix @ matrix.T, np.eye(3), atol=ROTATION_ERROR) or np.linalg.det(matrix) < 0.0:
        raise PlanError(f"{key}: its rows are no rotation")
    x, y, z = ((float(row[0]), float(row[1]), float(row[2])) for row in matrix)
    return x, y, z


def _number(value: Any, key: str, least: int, most: int) -> int:
    if not isinstance(value, int) or isinstance(value, bool) or not least <= value <= most:
        allowed = f"{least} to {most} is allowed" if least <= most else "there is none yet"
        raise PlanError(f"{key} is {value!r}: {allowed}")
    return value


def is_number(value: Any) -> TypeGuard[int | float]:
    """Whether a value of a page's is a number to reckon with: no more digits than a float has."""
    return isinstance(value, int | float) and not isinstance(value, bool) and abs(value) <= MOST_NUMBER
