"""A table that tilts and turns under a head that moves along X Y Z: where a point of the workpiece is in the machine.

tip = tilt_point + R_tilt (turn_point + R_turn w - tilt_point), X Y Z = tip + tool: LinuxCNC's xyzac-trt-kins for any two axes.
"""

import numpy as np

from mdp.kernels.arrays import table
from mdp.kernels.kernel import kernel
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
    tilted_back = _turned_back(unit(machine.tilt.axis), angles_rad(machine.tilt, axes[:, 3]), tip - tilt_point) + tilt_point
    return _turned_back(unit(machine.turn.axis), angles_rad(machine.turn, axes[:, 4]), tilted_back - turn_point)


@kernel
def _turned_back(unit_axis: Floats, angles: Floats, points: Floats) -> Floats:
    """(n, 3) points turned about one unit axis by (n,) angles in radians, most of which are that of the point before."""
    out: Floats = table(len(points), 3)
    cosine, sine = 1.0, 0.0
    for k in range(len(points)):
        if k == 0 or angles[k] != angles[k - 1]:
            cosine, sine = np.cos(angles[k]), np.sin(angles[k])
        along = points[k, 0] * unit_axis[0] + points[k, 1] * unit_axis[1] + points[k, 2] * unit_axis[2]
        for i in range(3):
            a, b = (i + 1) % 3, (i + 2) % 3
            across = unit_axis[a] * points[k, b] - unit_axis[b] * points[k, a]
            out[k, i] = points[k, i] * cosine + across * sine + unit_axis[i] * along * (1.0 - cosine)
    return out


def angles_rad(axis: RotaryAxis, values_deg: Floats) -> Floats:
    """(...) right-handed angles that undo what the axis does to the table at its values."""
    angles: Floats = np.radians(axis.sign * (values_deg - axis.zero_deg))
    return angles
