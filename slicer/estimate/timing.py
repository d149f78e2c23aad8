"""Timing: duration of straight moves with acceleration and look-ahead at corners, and of a layer's strokes.

The model is that of classic Marlin: constant acceleration along the move; at a corner every axis may change its speed instantly
by at most the junction speed; and corner speeds are the greatest from which the machine can still stop.
"""

from math import sqrt
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from mdp.kernels.arrays import floats, table
from mdp.kernels.kernel import kernel, no_nrt
from mdp.mesh import Floats, Indices
from mdp.overhang import Mask
from profiles.machine import Machine
from profiles.profile import Profile
from slicer.paths import Layer
from slicer.strokes.speed import stroke_accelerations, travel_mm_s2
from slicer.strokes.strokes import Strokes
from slicer.strokes.travels import STANDING_MM

TINY = 1e-9
SPEED, MOST_MM_S2, STANDS = 6, 7, 8  # columns of a table of moves, after the steps of six axes
# A wipe turns by 45 deg in its middle, as over the small rings that most wipes follow: mm along each axis per mm of its length.
TURNED = 0.5 / sqrt(2.0)


class Speeds(NamedTuple):
    """Upper limits for moves that do not extrude: vertical, horizontal and of the filament alone, mm/s; acceleration, mm/s2, inf
    if the axes decide; (3,) speeds of X, Y and Z, mm/s.
    """

    lift_mm_s: float
    travel_mm_s: float
    filament_mm_s: float
    acceleration_mm_s2: float
    axes_mm_s: Floats


class Blocks(NamedTuple):
    """Moves in the form that a planner takes, (m,) each: direction (m, 6) of X Y Z tilt turn E, length, cruise speed,
    acceleration, the measure used by F, and whether the machine stops before the move.
    """

    direction: Floats
    length: Floats
    cruise: Floats
    acceleration: Floats
    measure: NDArray[np.int8]
    halts: NDArray[np.bool_]


def speeds_of(profile: Profile) -> Speeds:
    """The process's speeds, limited by the axes and the extruder."""
    process, machine, material = profile.process, profile.machine, profile.material
    return Speeds(
        lift_mm_s=min(process.lift_speed_mm_s, machine.z.speed_mm_s),
        travel_mm_s=min(process.travel_speed_mm_s, machine.x.speed_mm_s, machine.y.speed_mm_s),
        filament_mm_s=min(material.retract_speed_mm_s, machine.extruder_speed_mm_s),
        acceleration_mm_s2=travel_mm_s2(profile),
        axes_mm_s=axis_speeds(machine)[:3],
    )


@no_nrt
def trapezoid_s(length_mm: float, speed_mm_s: float, acceleration_mm_s2: float, v0: float, v1: float) -> float:
    """Duration of a straight move between two speeds, s: a speed trapezoid, or a triangle if cruise speed is not reached."""
    peak = min(speed_mm_s, sqrt(0.5 * (v0 * v0 + v1 * v1) + acceleration_mm_s2 * length_mm))
    ramps_mm = (2.0 * peak * peak - v0 * v0 - v1 * v1) / (2.0 * acceleration_mm_s2)
    return float((2.0 * peak - v0 - v1) / acceleration_mm_s2 + max(0.0, length_mm - ramps_mm) / max(peak, TINY))


@kernel
def line_s(length_mm: float, speed_mm_s: float, acceleration_mm_s2: float) -> float:
    """Duration of a straight move from rest to rest, s."""
    return trapezoid_s(length_mm, speed_mm_s, acceleration_mm_s2, 0.0, 0.0)


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
    """Length measured by F for (n, 6) deltas of X Y Z tilt turn E, and its measure (0 X Y Z, 1 rotary, 2 filament, 3 none).

    The rule of NIST's RS274: the path of X Y Z; if they do not move, the rotary axes; if these do not move either, the filament.
    """
    x, y, z, tilt, turn, filament = deltas.T
    ways: list[Floats] = [np.sqrt(x**2 + y**2 + z**2), np.hypot(tilt, turn), np.abs(filament)]
    moves = [way > TINY for way in ways]
    return np.select(moves, ways), np.select(moves, [0, 1, 2], 3).astype(np.int8)


def move_times(
    deltas: Floats, speed: Floats, stop: NDArray[np.bool_], machine: Machine, most_mm_s2: Floats | None = None
) -> Floats:
    """(n,) seconds for (n, 6) deltas of X Y Z tilt turn E at (n,) speeds (mm/s or deg/s along what F measures).

    stop: (n,) whether the machine stops before the move. most_mm_s2: (n,) acceleration limit of X Y Z. A move is slowed down if
    an axis would exceed its speed.
    """
    blocks, moving = blocks_of(deltas, speed, stop, machine, most_mm_s2)
    times = np.zeros(len(deltas))
    if moving.any():
        times[moving] = _block_times(blocks, machine.junction_speed_mm_s)
    return times


def blocks_of(
    deltas: Floats, speed: Floats, stop: NDArray[np.bool_], machine: Machine, most_mm_s2: Floats | None = None
) -> tuple[Blocks, NDArray[np.bool_]]:
    """The blocks of all moves with a length, and (n,) a mask of these moves."""
    length, measure = lengths(deltas)
    limits = axis_speeds(machine), axis_accelerations(machine)
    cruise, acceleration = _allowed(np.ascontiguousarray(deltas), length, speed, *limits)
    if most_mm_s2 is not None:
        acceleration = np.where(measure == 0, np.minimum(acceleration, most_mm_s2), acceleration)
    moving = measure < 3
    which = slice(None) if moving.all() else moving  # usually all of them, which need not be copied
    halts = np.diff(np.cumsum(stop)[which], prepend=0) > 0
    direction = deltas[which] / length[which, None]
    return Blocks(direction, length[which], cruise[which], acceleration[which], measure[which], halts), moving


@kernel
def _allowed(
    deltas: Floats, length: Floats, speed: Floats, most_speed: Floats, most_acceleration: Floats
) -> tuple[Floats, Floats]:
    """(n,) speed and acceleration along each move at which no axis exceeds its limits."""
    cruise, acceleration = floats(len(deltas), 0.0), floats(len(deltas), np.inf)
    for k in range(len(deltas)):
        cruise[k] = speed[k]
        for axis in range(6):
            cruise[k] = min(cruise[k], along(most_speed[axis], deltas[k, axis], length[k]))
            acceleration[k] = min(acceleration[k], along(most_acceleration[axis], deltas[k, axis], length[k]))
    return cruise, acceleration


@no_nrt
def along(most: float, step: float, length: float) -> float:
    """Limit along a move of some length from the limit of one axis, whose part of the move is `step`."""
    share = abs(step) / max(length, TINY)
    return most / share if share > 0.0 else np.inf


@no_nrt
def corner_speed(blocks: Blocks, before: int, after: int, junction_speed: float) -> float:
    """Greatest speed at a corner: no axis changes its speed by more than the junction speed; 0 if the measure changes."""
    if blocks.measure[before] != blocks.measure[after]:
        return 0.0
    v = min(blocks.cruise[before], blocks.cruise[after])
    for k in range(6):
        change = abs(blocks.direction[after, k] - blocks.direction[before, k])
        if change * v > junction_speed:
            v = junction_speed / change
    return float(v)


@no_nrt
def block_time(blocks: Blocks, i: int, v0: float, v1: float) -> float:
    """Duration of a block between two speeds, s."""
    return trapezoid_s(blocks.length[i], blocks.cruise[i], blocks.acceleration[i], v0, v1)


@kernel
def _block_times(blocks: Blocks, junction_speed: float) -> Floats:
    """(m,) duration of each block, s: corner speeds, backward and forward pass, trapezoids."""
    n = len(blocks.length)
    corner, times = floats(n + 1, 0.0), floats(n, 0.0)
    for i in range(1, n):
        corner[i] = 0.0 if blocks.halts[i] else corner_speed(blocks, i - 1, i, junction_speed)
    for i in range(n - 1, -1, -1):
        corner[i] = min(corner[i], np.sqrt(corner[i + 1] ** 2 + 2.0 * blocks.acceleration[i] * blocks.length[i]))
    for i in range(n):
        fastest = np.sqrt(corner[i] * corner[i] + 2.0 * blocks.acceleration[i] * blocks.length[i])
        corner[i + 1] = min(corner[i + 1], fastest)
        times[i] = block_time(blocks, i, corner[i], corner[i + 1])
    return times


def strokes_s(strokes: Strokes | Layer, speeds_mm_s: Floats, tip: Floats, profile: Profile, first_layer: bool) -> float:
    """Duration of a layer's strokes at their (k,) speeds, s, including the rise to the layer, travels and retractions.

    tip: (2,) end of the layer below, mm.
    """
    machine, process, material, speeds = profile.machine, profile.process, profile.material, speeds_of(profile)
    places = strokes.points, strokes.starts, strokes.width_mm, strokes.approach, strokes.approach_starts
    bounds = speeds_mm_s, stroke_accelerations(profile, first_layer)[strokes.kind]
    pulls = material.retract_mm > 0.0
    wipe_mm = material.wipe_mm if pulls else 0.0
    moves = _moves(places, tip, bounds, strokes.retract, speeds, (process.lift_mm, wipe_mm, material.retract_mm))
    speed_mm_s, most_mm_s2, stands = np.ascontiguousarray(moves[:, SPEED:].T)
    moving_s = move_times(moves[:, :6], speed_mm_s, stands > 0.0, machine, most_mm_s2).sum()
    rise_s = line_s(process.layer_height_mm, speeds.lift_mm_s, machine.z.acceleration_mm_s2)
    # The filament moves alone at the end of a retraction, and at its beginning if there is no wipe.
    alone_mm = [material.retract_mm + material.retract_prime_extra_mm, *([] if wipe_mm > 0.0 else [material.retract_mm])]
    ramp = machine.extruder_acceleration_mm_s2
    standing_s = sum(line_s(length_mm, speeds.filament_mm_s, ramp) for length_mm in alone_mm) if pulls else 0.0
    return float(moving_s + rise_s + int(strokes.retract.sum()) * standing_s)


@kernel
def _moves(
    places: tuple[Floats, Indices, Floats, Floats, Indices],
    tip: Floats,
    bounds: tuple[Floats, Floats],
    retract: Mask,
    paces: Speeds,
    far_mm: tuple[float, float, float],
) -> Floats:
    """(n, 9) straight moves of consecutive strokes with their travels: steps of X Y Z tilt turn E, speed, greatest acceleration,
    and 1 if the machine stops before. A travel with retraction wipes and lifts, and ends at rest, where the filament is primed.
    far_mm: lengths of lift, wipe and filament pulled back during the wipe.
    """
    points, starts, width_mm, approach, approach_starts = places
    speeds, most = bounds
    lift_mm, wipe_mm, pulled_mm = far_mm
    wipe_mm_s = min(paces.travel_mm_s, wipe_mm * paces.filament_mm_s / max(pulled_mm, TINY))
    moves, n = table(len(points) + len(approach) + 4 * len(speeds) + 1, 9), 0
    x, y = tip[0], tip[1]
    for k in range(len(speeds)):
        first, stands = starts[k], retract[k] and wipe_mm <= 0.0
        if retract[k]:
            if n > 0:
                begun = starts[k - 1]
                apart = sqrt((x - points[begun, 0]) ** 2 + (y - points[begun, 1]) ** 2)
                wipe = wipe_mm if apart <= width_mm[k - 1] else -wipe_mm  # forward along a ring, back along a line
                ux, uy, uz = moves[n - 1, 0], moves[n - 1, 1], moves[n - 1, 2]
                length = sqrt(ux**2 + uy**2 + uz**2)
                ux, uy, aside = ux / length, uy / length, TURNED * wipe
                n = _add(moves, n, (0.5 * wipe * ux, 0.5 * wipe * uy, 0.0), wipe_mm_s, np.inf, False)
                n = _add(moves, n, (aside * (ux - uy), aside * (ux + uy), 0.0), wipe_mm_s, np.inf, False)
            n = _add(moves, n, (0.0, 0.0, lift_mm), paces.lift_mm_s, np.inf, stands)
        for i in range(approach_starts[k], approach_starts[k + 1] + 1):
            if i < approach_starts[k + 1]:
                x1, y1 = approach[i, 0], approach[i, 1]
            else:
                x1, y1 = points[first, 0], points[first, 1]
            stands = stands and i == approach_starts[k] and lift_mm <= STANDING_MM
            n = _add(moves, n, (x1 - x, y1 - y, 0.0), paces.travel_mm_s, paces.acceleration_mm_s2, stands)
            x, y = x1, y1
        if retract[k]:
            n = _add(moves, n, (0.0, 0.0, -lift_mm), paces.lift_mm_s, np.inf, False)
        for i in range(first + 1, starts[k + 1]):
            step = (points[i, 0] - points[i - 1, 0], points[i, 1] - points[i - 1, 1], 0.0)
            n = _add(moves, n, step, speeds[k], most[k], retract[k] and i == first + 1)
        x, y = points[starts[k + 1] - 1, 0], points[starts[k + 1] - 1, 1]
    return moves[:n]


@no_nrt
def _add(moves: Floats, n: int, step: tuple[float, float, float], speed: float, most_mm_s2: float, stands: bool) -> int:
    """Append a move as row n; returns the new n."""
    if sqrt(step[0] ** 2 + step[1] ** 2 + step[2] ** 2) <= STANDING_MM:
        return n
    moves[n, 0], moves[n, 1], moves[n, 2] = step
    moves[n, SPEED], moves[n, MOST_MM_S2], moves[n, STANDS] = speed, most_mm_s2, stands
    return n + 1
