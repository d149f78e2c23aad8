"""Pose: the tilt and turn of the table that bring a direction of the workpiece upright, and the poses of a whole print.

The table's rotation is R = R_tilt R_turn with each factor a right-handed rotation about its axis by -sign * (value - zero_deg),
the rule of LinuxCNC's xyzac-trt-kins written for any two axes. Poses are here because the search needs them too;
machine.kinematics has the positions of workpiece points at a pose. A rotation of a whole model is also given as turns about x,
then y, then z, as in process.rotate_deg.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import lru_cache
from itertools import pairwise
from math import asin, atan2, ceil, cos, degrees, floor, hypot, radians, sin, sqrt

import numpy as np

from mdp.mesh import Floats
from mdp.plane import UP as UP
from profiles.axes import RotaryAxis
from profiles.machine import Machine

SINGULAR = 1e-7  # sine of an angle below any table's resolution; the turn is undefined nearer to the singular pose
KNOWN = 256  # cached rotations
DECIMALS = 9  # digits of an angle as a file or a user states it: accurate to a tenth of a micrometre over a metre
LEVEL = 1.0 - 1e-12  # sine of the turn about y above which the turns about x and z are about the same axis
Three = list[float]  # a vector; numpy's operations on a single one take longer than the rest of a pose


@dataclass(frozen=True)
class Pose:
    """Positions of the tilt and the turn axis as the firmware counts them, degrees."""

    tilt_deg: float
    turn_deg: float


def level(machine: Machine) -> Pose:
    """The pose with a level, unturned table."""
    return Pose(machine.tilt.zero_deg, machine.turn.zero_deg)


def about(axis: Floats, angle_rad: float) -> Floats:
    """(3, 3) right-handed rotation about a unit axis (Rodrigues' formula)."""
    (x, y, z), s, t = axis.tolist(), sin(angle_rad), 1.0 - cos(angle_rad)
    rows = [
        [1.0 - t * (y * y + z * z), t * x * y - s * z, t * x * z + s * y],
        [t * x * y + s * z, 1.0 - t * (x * x + z * z), t * y * z - s * x],
        [t * x * z - s * y, t * y * z + s * x, 1.0 - t * (x * x + y * y)],
    ]
    return np.array(rows)


def unit(vector: object) -> Floats:
    """The vector scaled to length 1."""
    array = np.asarray(vector, dtype=np.float64)
    return array / sqrt(array @ array)


def turned_by(angles_deg: tuple[float, float, float]) -> Floats:
    """(3, 3) rotation composed of turns about x, then y, then z, degrees."""
    whole = np.eye(3)
    for axis, angle in zip(np.eye(3), np.radians(angles_deg), strict=True):
        whole = about(axis, float(angle)) @ whole
    return whole


def turns_of(rotation: Floats) -> tuple[float, float, float]:
    """The turns about x, then y, then z, degrees, that compose a (3, 3) rotation.

    >>> turns_of(turned_by((0.0, 0.0, 90.0)))
    (0.0, 0.0, 90.0)
    """
    sine = min(max(-float(rotation[2, 0]), -1.0), 1.0)
    if abs(sine) > LEVEL:
        return 0.0, degrees(asin(sine)), degrees(atan2(-rotation[0, 1], rotation[1, 1])) + 0.0
    x, z = atan2(rotation[2, 1], rotation[2, 2]), atan2(rotation[1, 0], rotation[0, 0])
    return degrees(x) + 0.0, degrees(asin(sine)) + 0.0, degrees(z) + 0.0


def turned_further(rotate_deg: tuple[float, float, float], rotation: Floats) -> tuple[float, float, float]:
    """The value of process.rotate_deg that combines an earlier rotate_deg with a further (3, 3) rotation, degrees.

    >>> turned_further((30.0, 0.0, 0.0), turned_by((60.0, 0.0, 0.0)))
    (90.0, 0.0, 0.0)
    """
    x, y, z = (round(angle, DECIMALS) + 0.0 for angle in turns_of(rotation @ turned_by(rotate_deg)))
    return x, y, z


def axis_rotation(axis: RotaryAxis, value_deg: float) -> Floats:
    """(3, 3) rotation of the table by one axis at a value."""
    return _about(tuple(axis.axis), radians(-axis.sign * (value_deg - axis.zero_deg)))


@lru_cache(maxsize=KNOWN)
def _about(axis: tuple[float, ...], angle_rad: float) -> Floats:
    """(3, 3) rotation about an axis of any length, radians; cached, since it is needed at one pose after the other."""
    turned = about(unit(axis), angle_rad)
    turned.flags.writeable = False
    return turned


def rotation(machine: Machine, pose: Pose) -> Floats:
    """(3, 3) rotation from the workpiece frame to the orientation of the machine frame at a pose."""
    return axis_rotation(machine.tilt, pose.tilt_deg) @ axis_rotation(machine.turn, pose.turn_deg)


def shift(machine: Machine, pose: Pose) -> Floats:
    """(3,) X Y Z of the workpiece origin at a pose: a workpiece point w is reached at rotation @ w + shift."""
    tilt_point, turn_point = np.array(machine.tilt.point_mm), np.array(machine.turn.point_mm)
    turn_from_tilt: Floats = axis_rotation(machine.tilt, pose.tilt_deg) @ (turn_point - tilt_point)
    origin: Floats = turn_from_tilt + tilt_point + np.array(machine.tool_mm)
    return origin


def poses(machine: Machine, direction: Floats, near_turn_deg: float | None = None) -> list[Pose]:
    """Poses within the axis limits that bring `direction` (unit, workpiece frame) to the machine's +z.

    Both branches, each with the equivalent turn nearest to `near_turn_deg` (default: the turn's zero) inside the limits. At a
    level table any turn works, and the nearest to `near_turn_deg` is returned. Empty if the direction is out of reach.

    >>> from profiles.profile import load
    >>> [(round(pose.tilt_deg), round(pose.turn_deg)) for pose in poses(load().machine, unit([0.0, 1.0, 1.0]))]
    [(45, 0), (-45, 180)]
    """
    near = machine.turn.zero_deg if near_turn_deg is None else near_turn_deg
    reachable = []
    axes = unit(machine.tilt.axis).tolist(), unit(machine.turn.axis).tolist()
    for tilt_rad, turn_rad in _angles(*axes, direction.tolist()):
        tilt = machine.tilt.zero_deg - machine.tilt.sign * degrees(tilt_rad)
        turn = near if turn_rad is None else machine.turn.zero_deg - machine.turn.sign * degrees(turn_rad)
        tilt_inside = nearest_turn(tilt, machine.tilt.reach_deg, machine.tilt.zero_deg)
        turn_inside = nearest_turn(turn, machine.turn.reach_deg, near)
        if tilt_inside is not None and turn_inside is not None:
            reachable.append(Pose(tilt_inside, turn_inside))
    return reachable


def nearest_turn(value_deg: float, limits_deg: tuple[float, float], near_deg: float) -> float | None:
    """The equivalent angle (plus whole turns) inside the limits that is nearest to near_deg; None if there is none."""
    least, most = limits_deg[0] - 1e-9, limits_deg[1] + 1e-9
    low, high = ceil((least - value_deg) / 360.0), floor((most - value_deg) / 360.0)
    if low > high:
        return None
    turns = min(max(round((near_deg - value_deg) / 360.0), low), high)
    return value_deg + 360.0 * turns


def least_rotation(
    machine: Machine, options: Sequence[Sequence[Pose]], fits: Callable[[int, Pose], bool] | None = None
) -> list[Pose]:
    """One pose for every part so that tilt and turn together move least over the whole print, inside limits and cables.

    options: for every part the poses that reach its direction, at least one each; equivalent turns are added here, except for the
    first part, where the print begins. A part printed on the level table may keep any turn of the part before it, if
    fits(position in options, pose) is true (None: always). Shortest path through the parts, so the result is optimal; unwinding
    of the cables is part of the path.
    """
    states = [list(options[0])]
    for position, poses in enumerate(options[1:], start=1):
        here = _equivalents(machine, poses, len(options))
        here += [pose for pose in _keep_turn(machine, poses, states[-1], here) if fits is None or fits(position, pose)]
        states.append(here)
    cost = [0.0] * len(states[0])
    came_from: list[list[int]] = []
    for before, here in pairwise(states):
        steps = [min((cost[k] + rotation_deg(p, q), k) for k, p in enumerate(before)) for q in here]
        cost = [total for total, _ in steps]
        came_from.append([k for _, k in steps])
    state = min(range(len(cost)), key=cost.__getitem__)
    chosen = [states[-1][state]]
    for back, before in zip(reversed(came_from), reversed(states[:-1]), strict=True):
        state = back[state]
        chosen.append(before[state])
    return chosen[::-1]


def rotation_deg(a: Pose, b: Pose) -> float:
    """Total rotation of tilt and turn between two poses, degrees."""
    return abs(a.tilt_deg - b.tilt_deg) + abs(a.turn_deg - b.turn_deg)


def _equivalents(machine: Machine, poses: Sequence[Pose], reach: int) -> list[Pose]:
    """The poses with whole turns added, inside the turn's limits and cables, at most `reach` turns from the given values."""
    least, most = machine.turn.reach_deg
    equivalents = []
    for pose in poses:
        low = max(ceil((least - pose.turn_deg) / 360.0 - 1e-9), -reach)
        high = min(floor((most - pose.turn_deg) / 360.0 + 1e-9), reach)
        equivalents += [Pose(pose.tilt_deg, pose.turn_deg + 360.0 * turns) for turns in range(low, high + 1)]
    return equivalents


def _keep_turn(machine: Machine, poses: Sequence[Pose], before: Sequence[Pose], known: Sequence[Pose]) -> list[Pose]:
    """The poses in which any turn works, with each turn of the previous poses."""
    free = dict.fromkeys(pose.tilt_deg for pose in poses if _any_turn_serves(machine, pose))
    unturned = dict.fromkeys(Pose(tilt, pose.turn_deg) for tilt in free for pose in before)
    return [pose for pose in unturned if pose not in known]


def _any_turn_serves(machine: Machine, pose: Pose) -> bool:
    """Whether the turn axis is vertical: turning then does not change the upward direction of the workpiece."""
    x, y, _ = axis_rotation(machine.tilt, pose.tilt_deg) @ unit(machine.turn.axis)
    return hypot(x, y) < SINGULAR


def _angles(tilt_axis: Three, turn_axis: Three, direction: Three) -> list[tuple[float, float | None]]:
    """Rotations (tilt, turn), radians, with R_tilt R_turn direction = up: subproblem 2 of Paden and Kahan.

    The turned direction c has the same turn_axis component as `direction` and the same tilt_axis component as up. Its third
    component is the height of the corner c of a spherical triangle whose sides are angles; computed from their sines it keeps its
    digits where c comes near to the plane of the axes (L'Huilier's form of the triple product).
    """
    up = UP.tolist()
    k, p, q = _dot(tilt_axis, turn_axis), _dot(turn_axis, direction), tilt_axis[2]
    determinant = 1.0 - k * k
    along_turn, along_tilt = (p - k * q) / determinant, (q - k * p) / determinant
    a, b, c = _angle(turn_axis, direction), _angle(tilt_axis, up), _angle(tilt_axis, turn_axis)
    s = 0.5 * (a + b + c)
    triple2 = 4.0 * sin(s) * sin(s - a) * sin(s - b) * sin(s - c)
    if triple2 < -SINGULAR * SINGULAR:
        return []
    normal = _cross(turn_axis, tilt_axis)
    length = max(triple2, 0.0) ** 0.5 / determinant
    solutions: list[tuple[float, float | None]] = []
    for side in (1.0, -1.0):
        parts = zip(turn_axis, tilt_axis, normal, strict=True)
        turned = [along_turn * x + along_tilt * y + side * length * z for x, y, z in parts]
        tilt = _turn_between(tilt_axis, turned, up)
        free = hypot(*_cross(turn_axis, direction)) < SINGULAR
        solutions.append((tilt, None if free else _turn_between(turn_axis, direction, turned)))
        if length < SINGULAR:
            break
    return solutions


def _angle(a: Three, b: Three) -> float:
    """Angle between two unit vectors, radians; exact for small angles too."""
    return atan2(hypot(*_cross(a, b)), _dot(a, b))


def _turn_between(axis: Three, a: Three, b: Three) -> float:
    """Angle about `axis` from the projection of a across it to that of b, radians in (-pi, pi]."""
    across_a, across_b = ([x - n * _dot(axis, vector) for x, n in zip(vector, axis, strict=True)] for vector in (a, b))
    return atan2(_dot(axis, _cross(across_a, across_b)), _dot(across_a, across_b))


def _dot(a: Three, b: Three) -> float:
    """Dot product of two vectors."""
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


def _cross(a: Three, b: Three) -> Three:
    """Cross product of two vectors."""
    (ax, ay, az), (bx, by, bz) = a, b
    return [ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx]
