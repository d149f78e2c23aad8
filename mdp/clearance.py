"""Clearance: how high above the table the tip must be for the head's bodies to miss it at a pose.

By construction nothing printed stands above the base plane of the part being printed, so the head can only meet the table.
A body point at b from the tip is n . b + z above the table, n the table's normal in the machine frame and z the tip's height
above the table; with the table unbounded, z >= max over the bodies of -n . b keeps all of them clear. For one body reaching y
across the tilt axis on the rising side at height h this is z >= y sin t - h cos t.
"""

from itertools import product
from math import hypot

import numpy as np

from mdp.mesh import Floats
from mdp.pose import UP, Pose, poses, rotation, shift
from profiles.machine import Machine


def least_tip_height_mm(machine: Machine, pose: Pose) -> float:
    """Least height of the tip above the table's plane at a pose, the profile's clearance included; 0 at a level table."""
    normal = rotation(machine, pose) @ UP
    across, along = hypot(normal[0], normal[1]), float(normal[2])
    if across < 1e-9:
        return 0.0
    needed = [radius * across - height * along for radius, height in machine.head.silhouette_mm]
    for box in machine.head.boxes:
        corners = np.array(list(product(*zip(box.min_mm, box.max_mm, strict=True))))
        needed.append(float(-(corners @ normal).min()))
    return max(0.0, max(needed) + machine.clearance_mm)


def least_height_mm(machine: Machine, direction: Floats) -> float:
    """Least height of what is printed along a direction, over the poses that reach it; infinite when none does."""
    return min((least_tip_height_mm(machine, pose) for pose in poses(machine, direction)), default=np.inf)


def allowed_poses(machine: Machine, direction: Floats, points_mm: Floats, near_turn_deg: float | None = None) -> list[Pose]:
    """Poses at which a part with these (n, 3) workpiece points can be printed: clear of the table, inside X Y Z limits."""
    lowest = float(points_mm[:, 2].min())
    found = []
    for pose in poses(machine, direction, near_turn_deg):
        reached = points_mm @ rotation(machine, pose).T + shift(machine, pose)
        limits = np.array([axis.limits_mm for axis in (machine.x, machine.y, machine.z)])
        inside = (reached.min(axis=0) >= limits[:, 0]).all() and (reached.max(axis=0) <= limits[:, 1]).all()
        if inside and lowest >= least_tip_height_mm(machine, pose):
            found.append(pose)
    return found
