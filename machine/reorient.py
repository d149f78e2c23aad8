"""Reorient: a safe place for the head while the table turns, and the moves there and back down.

Safe means: through the whole turn nothing of the table's plate and nothing printed reaches higher than lift_mm below the tip; no
body of the head hangs lower than the tip. Where the Z axis is too short for that, the head stands aside of what turns.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import pairwise
from math import ceil, hypot, radians

import numpy as np

from machine.collide import Printed, bodies, directions, sweep_gaps, table_reach
from mdp.mesh import Floats
from mdp.pose import UP, Pose, rotation
from profiles.errors import MoveError
from profiles.machine import Machine

STEP_DEG = 1.0
MOST_STEPS = 1500
PARKING_PLACES = 7


@dataclass(frozen=True)
class SafePose:
    """The tip stands at over_mm (X, Y) and z_mm while the table turns; over_mm None: where it is, straight up."""

    z_mm: float
    over_mm: tuple[float, float] | None


def poses_between(start: Pose, end: Pose, step_deg: float = STEP_DEG) -> list[Pose]:
    """Poses from start to end, both included, both axes in proportion, step_deg apart (farther when they would be too many)."""
    tilt, turn = end.tilt_deg - start.tilt_deg, end.turn_deg - start.turn_deg
    count = min(max(1, ceil(hypot(tilt, turn) / step_deg)), MOST_STEPS)
    return [Pose(start.tilt_deg + tilt * k / count, start.turn_deg + turn * k / count) for k in range(count + 1)]


def highest_z(machine: Machine, printed: Printed, turning: list[Pose]) -> float:
    """Greatest machine Z that the plate's rim or anything printed reaches during a turn, between its poses included.

    Between two poses that differ by a (radians, both axes together) a point at radius r rises above its places at the two
    by at most r a^2 / 4: its second derivative along the turn is at most 2 r a^2.
    """
    up = UP[None]
    top = max(max(float(table_reach(machine, p, up)[0]), float(printed.reach(machine, p, up)[0])) for p in turning)
    reach = max(
        machine.table.radius_mm + machine.table.thickness_mm, float(np.linalg.norm(printed.points_mm, axis=1).max(initial=0.0))
    )
    radius = reach + float(np.linalg.norm(np.array(machine.tilt.point_mm) - np.array(machine.turn.point_mm)))
    step = max((hypot(b.tilt_deg - a.tilt_deg, b.turn_deg - a.turn_deg) for a, b in pairwise(turning)), default=0.0)
    return top + radius * radians(step) ** 2 / 4.0


def safe_pose(machine: Machine, printed: Printed, at_mm: Floats, start: Pose, end: Pose, part: int) -> SafePose:
    """Where to hold the tip, now at at_mm (machine X Y Z), while the table turns from start to end for a part.

    Raises MoveError when neither above nor aside is inside the axis limits.
    """
    turning = poses_between(start, end)
    need = highest_z(machine, printed, turning) + max(machine.lift_mm, machine.clearance_mm)
    allowed = machine.z.limits_mm[1]
    if need <= allowed:
        return SafePose(max(need, float(at_mm[2])), None)
    for over in _aside(machine, at_mm):
        if _clear_aside(machine, printed, np.array([*over, allowed]), at_mm, turning):
            return SafePose(allowed, over)
    raise MoveError(
        f"part {part}: turning the table to {machine.tilt.letter}{end.tilt_deg:.3f} {machine.turn.letter}{end.turn_deg:.3f} "
        f"needs the tip at Z {need:.1f} mm, {machine.name} allows at most {allowed:g} mm, and no place aside is clear"
    )


def _aside(machine: Machine, at_mm: Floats) -> Iterator[tuple[float, float]]:
    """Places to stand: where the tip is, then a lattice over X and Y, the farthest from the turn axis first."""
    yield float(at_mm[0]), float(at_mm[1])
    xs, ys = (np.linspace(*axis.limits_mm, PARKING_PLACES) for axis in (machine.x, machine.y))
    lattice = [(float(x), float(y)) for x in xs for y in ys]
    centre = machine.turn.point_mm
    yield from sorted(lattice, key=lambda p: (-hypot(p[0] - centre[0], p[1] - centre[1]), p))


def _clear_aside(machine: Machine, printed: Printed, stand: Floats, at_mm: Floats, turning: list[Pose]) -> bool:
    """True when the way from above at_mm to `stand`, and standing there through all poses, is clear of table and print."""
    above = np.array([at_mm[0], at_mm[1], stand[2]])
    if not _clear(machine, printed, turning[-1], stand, stand, machine.clearance_mm):
        return False
    if not _clear(machine, printed, turning[0], above, stand, 0.0):
        return False
    return all(_clear(machine, printed, pose, stand, stand, machine.clearance_mm) for pose in turning)


def _clear(machine: Machine, printed: Printed, pose: Pose, start: Floats, end: Floats, keep_mm: float) -> bool:
    """True when each body keeps keep_mm, and what it must keep anyway, while the tip goes from start to end."""
    tried = directions(rotation(machine, pose) @ UP)
    reaches = [table_reach(machine, pose, tried), printed.reach(machine, pose, tried)]
    return all(
        float(sweep_gaps(body, start[None], end[None], tried, reach)[0]) >= max(body.need_mm, keep_mm)
        for body in bodies(machine)
        for reach in reaches
    )


def approach_z(machine: Machine, printed: Printed, pose: Pose, safe: SafePose, target_mm: Floats, part: int) -> float:
    """Machine Z at which the tip may cross to above target_mm at a pose: safe.z_mm unless the head stood aside.

    Raises MoveError when the way in from aside is not clear.
    """
    if safe.over_mm is None:
        return safe.z_mm
    stand = np.array([*safe.over_mm, safe.z_mm])
    above = np.array([target_mm[0], target_mm[1], safe.z_mm])
    if not _clear(machine, printed, pose, stand, above, 0.0):
        raise MoveError(
            f"part {part}: the way from aside (X {stand[0]:.1f} Y {stand[1]:.1f}) to its first point at "
            f"{machine.tilt.letter}{pose.tilt_deg:.3f} is not clear at Z {safe.z_mm:g} mm, the greatest on {machine.name}"
        )
    return safe.z_mm
