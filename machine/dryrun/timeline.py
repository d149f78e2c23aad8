"""Timeline: how long every straight move takes, with acceleration and look-ahead at the corners.

The model of classic Marlin: constant acceleration along the move, at a corner every axis may change its speed at once by at
most the junction speed, and the speeds at the corners are the greatest from which the machine can still stop.
"""

import numpy as np
from numpy.typing import NDArray

from mdp.kernel import floats, kernel
from mdp.mesh import Floats
from profiles.machine import Machine

TINY = 1e-9


def axis_speeds(machine: Machine) -> Floats:
    """(6,) greatest speeds of X Y Z tilt turn E, mm/s and deg/s."""
    linear = [machine.x.speed_mm_s, machine.y.speed_mm_s, machine.z.speed_mm_s]
    return np.array([*linear, machine.tilt.speed_deg_s, machine.turn.speed_deg_s, machine.extruder_speed_mm_s])


def axis_accelerations(machine: Machine) -> Floats:
    """(6,) accelerations of X Y Z tilt turn E, mm/s2 and deg/s2."""
    linear = [machine.x.acceleration_mm_s2, machine.y.acceleration_mm_s2, machine.z.acceleration_mm_s2]
    rotary = [machine.tilt.acceleration_deg_s2, machine.turn.acceleration_deg_s2]
    return np.array([*linear, *rotary, machine.extruder_acceleration_mm_s2])


def lengths(deltas: Floats) -> tuple[Floats, NDArray[np.int8]]:
    """What F measures for (n, 6) deltas of X Y Z tilt turn E, and by which measure (0 X Y Z, 1 rotary, 2 filament, 3 none).

    The rule of NIST's RS274: the path of X Y Z; when they stand still the rotary axes; when they stand still too, filament.
    """
    travel = np.sqrt((deltas[:, :3] ** 2).sum(axis=1))
    turned = np.hypot(deltas[:, 3], deltas[:, 4])
    pushed = np.abs(deltas[:, 5])
    measure = np.select([travel > TINY, turned > TINY, pushed > TINY], [0, 1, 2], 3).astype(np.int8)
    length: Floats = np.choose(measure, [travel, turned, pushed, np.zeros_like(travel)])
    return length, measure


def move_times(
    deltas: Floats, speed: Floats, stop: NDArray[np.bool_], machine: Machine, most_mm_s2: Floats | None = None
) -> Floats:
    """(n,) seconds for (n, 6) deltas of X Y Z tilt turn E at (n,) speeds (mm/s or deg/s along what F measures).

    stop: (n,) True where the machine stands still before the move. most_mm_s2: (n,) acceleration told for X Y Z. Axes that
    would be too fast slow the move down.
    """
    length, measure = lengths(deltas)
    share = np.abs(deltas) / np.maximum(length, TINY)[:, None]
    with np.errstate(divide="ignore"):
        cruise = np.minimum(speed, (axis_speeds(machine) / share).min(axis=1))
        acceleration = (axis_accelerations(machine) / share).min(axis=1)
    if most_mm_s2 is not None:
        acceleration = np.where(measure == 0, np.minimum(acceleration, most_mm_s2), acceleration)
    moving = measure < 3
    times = np.zeros(len(deltas))
    if moving.any():
        halts = np.diff(np.cumsum(stop)[moving], prepend=0) > 0
        directions = deltas[moving] / length[moving][:, None]
        times[moving] = _planned(
            directions, length[moving], cruise[moving], acceleration[moving], measure[moving], halts, machine.junction_speed_mm_s
        )
    return times


@kernel
def _planned(directions, length, cruise, acceleration, measure, halts, jerk):  # type: ignore[no-untyped-def]
    """Seconds of each move: corner speeds, backward and forward pass, trapezoids."""
    n = len(length)
    corner, times = floats(n + 1, 0.0), floats(n, 0.0)
    for i in range(1, n):
        if halts[i] or measure[i] != measure[i - 1]:
            continue
        v = min(cruise[i - 1], cruise[i])
        for k in range(6):
            change = abs(directions[i, k] - directions[i - 1, k])
            if change * v > jerk:
                v = jerk / change
        corner[i] = v
    for i in range(n - 1, -1, -1):
        corner[i] = min(corner[i], np.sqrt(corner[i + 1] ** 2 + 2.0 * acceleration[i] * length[i]))
    for i in range(n):
        a, v0, distance = acceleration[i], corner[i], length[i]
        corner[i + 1] = min(corner[i + 1], np.sqrt(v0 * v0 + 2.0 * a * distance))
        v1 = corner[i + 1]
        peak = min(cruise[i], np.sqrt(0.5 * (v0 * v0 + v1 * v1) + a * distance))
        ramps = (2.0 * peak * peak - v0 * v0 - v1 * v1) / (2.0 * a)
        times[i] = (2.0 * peak - v0 - v1) / a + max(0.0, distance - ramps) / peak
    return times
