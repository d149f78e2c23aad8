"""A table that tilts and turns under a head that moves along X Y Z: where a point of the workpiece is in the machine.

tip = tilt_point + R_tilt (turn_point + R_turn w - tilt_point), X Y Z = tip + tool: LinuxCNC's xyzac-trt-kins for any two axes.
"""

import numpy as np

from mdp.mesh import Floats
from mdp.pose import Pose, rotation, shift, unit
from profiles.axes import RotaryAxis
from profiles.machine import Machine


def machine_points(machine: Machine, pose: Pose, workpiece_mm: Floats) -> Floats:
    """(n, 3) X Y Z positions at which the tip touches the (n, 3) workpiece points, the table standing at a pose."""
    points: Floats = workpiece_mm @ rotation(machine, pose).T + shift(machine, pose)
    return points


def workpiece_points(machine: Machine, pose: Pose, machine_mm: Floats) -> Floats:
    """(n, 3) workpiece points under the tip when X Y Z are (n, 3) machine_mm and the table stands at a pose."""
    points: Floats = (machine_mm - shift(machine, pose)) @ rotation(machine, pose)
    return points


def part_shift(machine: Machine, pose: Pose, base_offset_mm: float) -> Floats:
    """(3,) what to add to part coordinates to get X Y Z: part and machine frame differ by this translation only."""
    moved: Floats = shift(machine, pose) + np.array([0.0, 0.0, base_offset_mm])
    return moved


def workpiece_path(machine: Machine, axes: Floats) -> Floats:
    """(n, 3) workpiece points under the tip for (n, 5) rows X Y Z tilt turn, the angles in degrees."""
    tilt_point, turn_point = np.array(machine.tilt.point_mm), np.array(machine.turn.point_mm)
    tip = axes[:, :3] - np.array(machine.tool_mm)
    tilted_back = turned_back(unit(machine.tilt.axis), angles_rad(machine.tilt, axes[:, 3]), tip - tilt_point) + tilt_point
    return turned_back(unit(machine.turn.axis), angles_rad(machine.turn, axes[:, 4]), tilted_back - turn_point)


def angles_rad(axis: RotaryAxis, values_deg: Floats) -> Floats:
    """(...) right-handed angles that undo what the axis does to the table at its values."""
    angles: Floats = np.radians(axis.sign * (values_deg - axis.zero_deg))
    return angles


def turned_back(unit_axis: Floats, angles: Floats, points: Floats) -> Floats:
    """(..., 3) points turned about (..., 3) unit axes by (...) angles in radians (Rodrigues), each by its own."""
    cosine, sine = np.cos(angles)[..., None], np.sin(angles)[..., None]
    along = (points * unit_axis).sum(axis=-1, keepdims=True)
    turned: Floats = points * cosine + np.cross(unit_axis, points) * sine + unit_axis * along * (1.0 - cosine)
    return turned
