"""Clearance: how high above the table the tip must be for the head's bodies to miss it at a pose.

By construction nothing printed stands above the base plane of the part being printed, so the head can only meet the table.
A body point at b from the tip is n . b + z above the table, n the table's normal in the machine frame and z the tip's height
above the table; with the table unbounded, z >= max over the bodies of -n . b keeps all of them clear. For one body reaching y
across the tilt axis on the rising side at height h this is z >= y sin t - h cos t. What of the cradle stands higher than the
table is not under that plane: it is tried against the head wherever the tip goes.
"""

from math import hypot
from typing import NamedTuple

import numpy as np

from mdp.head import bodies, corners, directions
from mdp.mesh import Floats
from mdp.pose import UP, Pose, poses, rotation, shift
from profiles.frozen import Vector
from profiles.machine import Machine


class LowestBody(NamedTuple):
    """The body of the head that asks for the greatest height of the tip above the table, clearance included, and its point that
    comes nearest to the table, from the tip in the machine frame, mm."""

    needed_mm: float
    name: str
    point_mm: Vector


def least_tip_height_mm(machine: Machine, pose: Pose) -> float:
    """Least height of the tip above the table's plane at a pose; 0 at a level table."""
    return lowest_body(machine, pose).needed_mm


def lowest_body(machine: Machine, pose: Pose) -> LowestBody:
    """The body that asks for that height."""
    normal = rotation(machine, pose) @ UP
    across, along = hypot(normal[0], normal[1]), float(normal[2])
    if across < 1e-9:
        return LowestBody(0.0, "nozzle tip", (0.0, 0.0, 0.0))
    aside = -normal[:2] / across
    needed: list[LowestBody] = []
    for radius, height in machine.head.silhouette_mm:
        point = float(radius * aside[0]), float(radius * aside[1]), float(height)
        needed.append(LowestBody(radius * across - height * along, "hot end", point))
    for box in machine.head.boxes:
        points = corners(box.min_mm, box.max_mm)
        heights = points @ normal
        x, y, z = (float(value) for value in points[int(np.argmin(heights))])
        needed.append(LowestBody(float(-heights.min()), box.name, (x, y, z)))
    lowest = max(needed)
    return lowest._replace(needed_mm=max(0.0, lowest.needed_mm + machine.clearance_mm))


def least_height_mm(machine: Machine, direction: Floats) -> float:
    """Least height of what is printed along a direction, over the poses that reach it; infinite when none does."""
    return min((least_tip_height_mm(machine, pose) for pose in poses(machine, direction)), default=np.inf)


def allowed_poses(machine: Machine, direction: Floats, points_mm: Floats, near_turn_deg: float | None = None) -> list[Pose]:
    """Poses at which a part with these (n, 3) workpiece points can be printed: clear of the table, inside X Y Z limits."""
    return [pose for pose in poses(machine, direction, near_turn_deg) if find_obstacle(machine, pose, points_mm) is None]


def find_obstacle(machine: Machine, pose: Pose, points_mm: Floats) -> str | None:
    """Why a part with these (n, 3) workpiece points cannot be printed at a pose; None: it can."""
    reached = points_mm @ rotation(machine, pose).T + shift(machine, pose)
    low, high = reached.min(axis=0), reached.max(axis=0)
    for axis, letter in enumerate("XYZ"):
        least, most = (machine.x, machine.y, machine.z)[axis].limits_mm
        if low[axis] < least or high[axis] > most:
            return f"{letter} would go from {low[axis]:.1f} to {high[axis]:.1f} mm, {least:g} to {most:g} is allowed"
    lowest, (needed, body, _) = float(points_mm[:, 2].min()), lowest_body(machine, pose)
    if lowest < needed:
        return f"the head's {body} would meet the table: the part begins {lowest:.1f} mm above it, {needed:.1f} mm are needed"
    met = _find_in_cradle(machine, pose, reached)
    return None if met is None else f"the head's {met[0]} would meet the cradle's {met[1]}"


def _find_in_cradle(machine: Machine, pose: Pose, tips_mm: Floats) -> tuple[str, str] | None:
    """The body of the head and that of the cradle, of those that stand higher than the table, that could meet, the tip anywhere
    in the hull of (n, 3) machine points: one direction must part each body there from each box."""
    higher = [box for box in machine.cradle if box.max_mm[2] > 0.0]
    if not higher:
        return None
    tried = directions(rotation(machine, pose) @ UP)
    least = (tried @ tips_mm.T).min(axis=1)
    tilted = Pose(pose.tilt_deg, machine.turn.zero_deg)  # the cradle does not turn with the table
    for box in higher:
        reached = corners(box.min_mm, box.max_mm) @ rotation(machine, tilted).T + shift(machine, tilted)
        reach = (tried @ reached.T).max(axis=1)
        for body in bodies(machine):
            if float((least + body.least(tried) - reach).max()) < body.need_mm:
                return body.name, box.name
    return None
