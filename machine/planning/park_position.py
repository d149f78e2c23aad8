"""Park position: where the tip waits during a pause, and stays when the print is done: straight up along the nozzle and aside.

The way is clear of table, cradle and print: up at the place where the print stopped, across at a height above which nothing
stands, and back the same way.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import product

import numpy as np

from machine.kinematics.collision import Printed, solids, sweep_gaps
from mdp.head import bodies, directions
from mdp.mesh import Floats
from mdp.pose import UP, Pose, rotation
from profiles.machine import Machine

ASIDE_MM = 1.0  # free at the ends of the axes
BESIDE_MM = 20.0  # from the outline of a finished print: what drips falls beside it, and a hand can reach it
PARTS = 4  # number of pieces in which a way is tried when it is not clear as a whole


@dataclass(frozen=True)
class Park:
    """Axis positions, mm: the tip goes up to lift_mm and from there to stand_mm; the same place twice where it stays."""

    lift_mm: tuple[float, float, float]
    stand_mm: tuple[float, float, float]


def find_park_position(
    machine: Machine, printed: Printed, at_mm: Floats, pose: Pose, stands: Sequence[tuple[float, float]] = ()
) -> Park | None:
    """Where to wait when the tip stands at at_mm (axis positions X Y Z); None when no way up is proved clear.

    stands: X, Y of the places that may be chosen besides the corners of the axes; the nearest is.
    """
    x, y, z = (float(value) for value in at_mm)
    most = machine.z.limits_mm[1]
    top = obstacle_top_mm(machine, printed, pose) + machine.lift_mm
    height = min(max(top, z + min(machine.lift_mm, most - z)), most)
    while not is_way_clear(machine, pose, np.array([x, y, z]), np.array([x, y, height]), parts=PARTS):
        height = z + (height - z) / 2.0
        if height - z < min(1.0, machine.clearance_mm):
            return None
    lift = (x, y, height)
    if height < min(top, most) - 1e-9:
        return Park(lift, lift)
    corners = product(*((low + ASIDE_MM, high - ASIDE_MM) for low, high in (machine.x.limits_mm, machine.y.limits_mm)))
    for point in sorted([*stands, *corners], key=lambda point: abs(point[0] - x) + abs(point[1] - y)):
        stand = (*point, height)
        if height >= top - 1e-9 or is_way_clear(machine, pose, np.array(lift), np.array(stand), printed, PARTS):
            return Park(lift, stand)
    return Park(lift, lift)


def beside(machine: Machine, printed: Printed, at_mm: Floats, pose: Pose) -> list[tuple[float, float]]:
    """X, Y beside a finished print, as far as the axes reach: straight out of its outline to each side, or where the tip is."""
    x, y = (float(value) for value in at_mm[:2])
    right, back, left, front = printed.reach(machine, pose, np.vstack([np.eye(3)[:2], -np.eye(3)[:2]]))
    outline = ((-left, right), (-front, back))
    if any(value <= low - BESIDE_MM or value >= high + BESIDE_MM for value, (low, high) in zip((x, y), outline, strict=True)):
        return [(x, y)]
    places = []
    for axis, (low, high) in zip((machine.x, machine.y), outline, strict=True):
        for value in (low - BESIDE_MM, high + BESIDE_MM):
            within = min(max(value, axis.limits_mm[0] + ASIDE_MM), axis.limits_mm[1] - ASIDE_MM)
            if not low <= within <= high:
                places.append((within, y) if axis is machine.x else (x, within))
    return places


def obstacle_top_mm(machine: Machine, printed: Printed | None, pose: Pose) -> float:
    """Greatest Z of table, cradle and print at a pose."""
    return max(float(reach_of(UP[None])[0]) for _, reach_of in solids(machine, pose, printed))


def over_print_mm(machine: Machine, printed: Printed, pose: Pose) -> float:
    """Z at which the tip clears all that is printed, wherever it goes at a pose."""
    return float(printed.reach(machine, pose, UP[None])[0]) + machine.clearance_mm


def is_way_clear(
    machine: Machine, pose: Pose, start: Floats, end: Floats, printed: Printed | None = None, parts: int = 1
) -> bool:
    """True when each body keeps what it must from table, cradle and print while the tip goes from start to end.

    The way is checked in `parts` pieces: a direction that separates body and solid is easier to find for a short piece.
    """
    tried = directions(rotation(machine, pose) @ UP)
    shares = np.linspace(0.0, 1.0, parts + 1)[:, None]
    places = start + shares * (end - start)
    for _, reach_of in solids(machine, pose, printed):
        reach = reach_of(tried)
        for body in bodies(machine):
            if float(sweep_gaps(body, places[:-1], places[1:], tried, reach).min()) < body.need_mm - 1e-6:
                return False
    return True
