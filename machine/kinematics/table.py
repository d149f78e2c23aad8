"""Table that tilts and turns below a head with axes X Y Z: conversion between workpiece and machine coordinates.

tip = tilt_point + R_tilt (turn_point + R_turn w - tilt_point), X Y Z = tip + tool: LinuxCNC's xyzac-trt-kins for any two axes.
"""

from itertools import pairwise

import numpy as np

from machine.firmware import dialect_of
from mdp.kernels.arrays import table
from mdp.kernels.kernel import kernel, no_nrt
from mdp.mesh import Floats, Indices
from mdp.pose import Pose, level, rotation, shift, unit
from profiles.machine import Machine

Point = tuple[float, float, float]


def machine_points(machine: Machine, pose: Pose, workpiece_mm: Floats) -> Floats:
    """(n, 3) X Y Z positions at which the tip touches (n, 3) workpiece points, with the table in a pose."""
    points: Floats = workpiece_mm @ rotation(machine, pose).T + shift(machine, pose)
    return points


def workpiece_points(machine: Machine, pose: Pose, machine_mm: Floats) -> Floats:
    """(n, 3) workpiece points under the tip at X Y Z of (n, 3) machine_mm, with the table in a pose."""
    points: Floats = (machine_mm - shift(machine, pose)) @ rotation(machine, pose)
    return points


def part_shift(machine: Machine, pose: Pose, base_offset_mm: float) -> Floats:
    """(3,) translation from part coordinates to X Y Z, the only difference between the two frames."""
    moved: Floats = shift(machine, pose) + np.array([0.0, 0.0, base_offset_mm])
    return moved


def workpiece_path(machine: Machine, axes: Floats) -> Floats:
    """(n, 3) workpiece points under the tip for (n, 5) rows X Y Z tilt turn, the angles in degrees."""
    return _path(np.ascontiguousarray(axes), _chain(machine))


def workpiece_segments(machine: Machine, start: Floats, end: Floats, rows: Indices) -> Floats:
    """(m, 2, 3) points under the tip where (m,) of the moves begin and end; start, end: (n, 5) X Y Z tilt turn."""
    return _segments(start, end, rows, _chain(machine))


def _chain(machine: Machine) -> Floats:
    """(7, 3) tool; a point and the direction of the tilt axis, of the turn axis; sign and zero, deg, of both."""
    signs = [(axis.sign, axis.zero_deg, 0.0) for axis in (machine.tilt, machine.turn)]
    axes = [line for axis in (machine.tilt, machine.turn) for line in (axis.point_mm, unit(axis.axis))]
    return np.array([machine.tool_mm, *axes, *signs])


@kernel
def _path(axes: Floats, chain: Floats) -> Floats:
    out, angles = table(len(axes), 3), table(2, 3)
    for k in range(len(axes)):
        out[k, 0], out[k, 1], out[k, 2] = _place(axes, k, chain, angles, k == 0)
    return out


@kernel
def _segments(start: Floats, end: Floats, rows: Indices, chain: Floats) -> Floats:
    """Kernel of workpiece_segments; most moves begin at the end of the previous one."""
    out, angles = np.empty((len(rows), 2, 3)), table(2, 3)
    for k in range(len(rows)):
        row = rows[k]
        if k > 0 and row == rows[k - 1] + 1 and goes_on(start, end, row):
            for axis in range(3):
                out[k, 0, axis] = out[k - 1, 1, axis]
        else:
            out[k, 0, 0], out[k, 0, 1], out[k, 0, 2] = _place(start, row, chain, angles, k == 0)
        out[k, 1, 0], out[k, 1, 1], out[k, 1, 2] = _place(end, row, chain, angles, False)
    return out


@no_nrt
def goes_on(start: Floats, end: Floats, row: int) -> bool:
    """Whether a row begins at the end of the previous one, on all five axes."""
    same = row > 0
    for axis in range(5):
        same = same and start[row, axis] == end[row - 1, axis]
    return same


@no_nrt
def _place(rows: Floats, row: int, chain: Floats, angles: Floats, is_first: bool) -> Point:
    """The workpiece point of one of (n, 5) rows; angles: (2, 3) cached angle, deg, cosine and sine of both rotary axes."""
    axes = rows[row]  # sliced in here, where no references are counted
    for axis in range(2):
        if is_first or axes[3 + axis] != angles[axis, 0]:
            angle = np.radians(chain[5 + axis, 0] * (axes[3 + axis] - chain[5 + axis, 1]))
            angles[axis, 0], angles[axis, 1], angles[axis, 2] = axes[3 + axis], np.cos(angle), np.sin(angle)
    point = (axes[0] - chain[0, 0], axes[1] - chain[0, 1], axes[2] - chain[0, 2])
    x, y, z = _about(chain[1], chain[2], angles[0], point)
    return _about(chain[3], chain[4], angles[1], (x + chain[1, 0], y + chain[1, 1], z + chain[1, 2]))


@no_nrt
def _about(middle: Floats, axis: Floats, angle: Floats, point: Point) -> Point:
    """A point rotated about an axis through a centre, relative to that; angle: (3,) with its cosine and sine at the end."""
    cosine, sine = angle[1], angle[2]
    x, y, z = point[0] - middle[0], point[1] - middle[1], point[2] - middle[2]
    if sine == 0.0 and cosine == 1.0:
        return x, y, z
    along = x * axis[0] + y * axis[1] + z * axis[2]
    return (
        x * cosine + (axis[1] * z - axis[2] * y) * sine + axis[0] * along * (1.0 - cosine),
        y * cosine + (axis[2] * x - axis[0] * z) * sine + axis[1] * along * (1.0 - cosine),
        z * cosine + (axis[0] * y - axis[1] * x) * sine + axis[2] * along * (1.0 - cosine),
    )


def origin_mm(machine: Machine) -> Floats:
    """(3,) the workpiece origin in the coordinates of a following firmware.

    LinuxCNC and Marlin: X Y Z there with the table level, for their kinematics change nothing at tilt 0, turn 0. grblHAL: zero,
    the turn axis on the table.
    """
    if dialect_of(machine).follow_from_turn_axis:
        return np.zeros(3)
    return shift(machine, level(machine))


def followed_places(machine: Machine, pose: Pose, points_mm: Floats) -> Floats:
    """(n, 3) positions relative to the table for (n, 3) axis positions at a pose."""
    places: Floats = workpiece_points(machine, pose, points_mm) + origin_mm(machine)
    return places


def axis_positions(machine: Machine, rows: Floats) -> Floats:
    """(n, 3) axis positions for (n, 5) rows of a followed X Y Z and tilt, turn in degrees."""
    places = rows[:, :3] - origin_mm(machine)
    positions = np.empty_like(places)
    changes = np.flatnonzero((rows[1:, 3:5] != rows[:-1, 3:5]).any(axis=1)) + 1
    bounds = [0, *changes.tolist(), len(rows)]
    for first, last in pairwise(bounds):
        pose = Pose(float(rows[first, 3]), float(rows[first, 4])) if last > first else level(machine)
        positions[first:last] = machine_points(machine, pose, places[first:last])
    return positions
