"""Duration: how long the strokes of a layer and the travels to them take, on a machine like classic Marlin: no axis changes its
speed at once by more than the junction speed, and none accelerates faster than it may.
"""

from math import sqrt
from typing import NamedTuple

import numpy as np

from mdp.kernels.arrays import floats, longs, table
from mdp.kernels.kernel import helper, kernel, no_nrt
from mdp.mesh import Floats, Indices
from mdp.overhang import Mask
from profiles.profile import Profile
from slicer.paths import KINDS
from slicer.strokes.speed import axes_mm_s2, stroke_accelerations, travel_mm_s2
from slicer.strokes.strokes import Strokes
from slicer.strokes.travels import STANDING_MM

# A wipe turns in its middle by 45 deg, as over the small rings after which most are: mm along each axis for a mm of all of it.
TURNED = 0.5 / sqrt(2.0)
TINY = 1e-9  # mm, mm/s or a cosine, instead of a division by 0


class Pace(NamedTuple):
    """What bounds the moves of a layer: accelerations of X and Y and of Z, speed change at corners; speed and acceleration of
    travels, speed of lifts, how far one lifts, speed and length of a wipe."""

    axes_mm_s2: float
    z_mm_s2: float
    junction_mm_s: float
    travel_mm_s: float
    travel_mm_s2: float
    lift_mm_s: float
    lift_mm: float
    wipe_mm_s: float
    wipe_mm: float


class StraightMoves(NamedTuple):
    """Buffers for moves in order, the first size[0] of them set: direction (n, 3), length, cruise speed, acceleration, and the
    greatest speed at which each begins."""

    direction: Floats
    length: Floats
    cruise: Floats
    ramp: Floats
    begin: Floats
    size: Indices


@no_nrt
def trapezoid_s(length_mm: float, speed_mm_s: float, acceleration_mm_s2: float, v0: float, v1: float) -> float:
    """Seconds of a straight move from one speed to another: a trapezoid of speeds, or a triangle where it gets no faster."""
    peak = min(speed_mm_s, sqrt(0.5 * (v0 * v0 + v1 * v1) + acceleration_mm_s2 * length_mm))
    ramps_mm = (2.0 * peak * peak - v0 * v0 - v1 * v1) / (2.0 * acceleration_mm_s2)
    return float((2.0 * peak - v0 - v1) / acceleration_mm_s2 + max(0.0, length_mm - ramps_mm) / max(peak, TINY))


@kernel
def line_s(length_mm: float, speed_mm_s: float, acceleration_mm_s2: float) -> float:
    """Seconds of a straight line from a stand to a stand."""
    return trapezoid_s(length_mm, speed_mm_s, acceleration_mm_s2, 0.0, 0.0)


def strokes_s(strokes: Strokes, speeds_mm_s: Floats, tip: Floats, profile: Profile, first_layer: bool) -> float:
    """Seconds of a layer's strokes at their (k,) speeds, with the rise to it, the travels to them and their retractions.

    tip: (2,) where the layer below ends.
    """
    by_kind = stroke_accelerations(profile, first_layer)
    most = np.full(len(KINDS), np.inf) if by_kind is None else np.array([by_kind[kind] for kind in KINDS])
    pace = _pace(profile)
    places = strokes.points, strokes.starts, strokes.approach, strokes.approach_starts
    moving_s = _way_s(places, tip, (speeds_mm_s, most[strokes.kind]), strokes.retract, pace)
    rise_s = line_s(profile.process.layer_height_mm, pace.lift_mm_s, pace.z_mm_s2)
    return float(moving_s + rise_s + int(strokes.retract.sum()) * _standing_s(profile))


def _pace(profile: Profile) -> Pace:
    process, material, machine = profile.process, profile.material, profile.machine
    travel_mm_s = min(process.travel_speed_mm_s, machine.x.speed_mm_s, machine.y.speed_mm_s)
    wipe_mm = material.wipe_mm if material.retract_mm > 0.0 else 0.0
    return Pace(
        axes_mm_s2=axes_mm_s2(profile),
        z_mm_s2=machine.z.acceleration_mm_s2,
        junction_mm_s=machine.junction_speed_mm_s,
        travel_mm_s=travel_mm_s,
        travel_mm_s2=travel_mm_s2(profile) or np.inf,
        lift_mm_s=min(process.lift_speed_mm_s, machine.z.speed_mm_s),
        lift_mm=process.lift_mm,
        wipe_mm_s=min(travel_mm_s, wipe_mm * _filament_mm_s(profile) / max(material.retract_mm, TINY)),
        wipe_mm=wipe_mm,
    )


def _filament_mm_s(profile: Profile) -> float:
    return min(profile.material.retract_speed_mm_s, profile.machine.extruder_speed_mm_s)


def _standing_s(profile: Profile) -> float:
    """Seconds that the filament moves alone for one retraction."""
    material, ramp = profile.material, profile.machine.extruder_acceleration_mm_s2
    if material.retract_mm <= 0.0:
        return 0.0
    primed_s = line_s(material.retract_mm + material.retract_prime_extra_mm, _filament_mm_s(profile), ramp)
    return primed_s if material.wipe_mm > 0.0 else primed_s + line_s(material.retract_mm, _filament_mm_s(profile), ramp)


@no_nrt
def _add(
    moves: StraightMoves, step: tuple[float, float, float], cruise: float, acceleration: float, stands: bool, pace: Pace
) -> None:
    """Append a straight move; stands: the machine stands still before it."""
    length = sqrt(step[0] ** 2 + step[1] ** 2 + step[2] ** 2)
    n = moves.size[0]
    if length <= STANDING_MM:
        return
    ux, uy, uz = step[0] / length, step[1] / length, step[2] / length
    moves.length[n], moves.cruise[n] = length, cruise
    moves.ramp[n] = min(acceleration, pace.axes_mm_s2 / max(abs(ux), abs(uy), TINY), pace.z_mm_s2 / max(abs(uz), TINY))
    if stands or n == 0:
        moves.begin[n] = 0.0
    else:
        x, y, z = moves.direction[n - 1]
        change = max(abs(ux - x), abs(uy - y), abs(uz - z), TINY)
        moves.begin[n] = min(cruise, moves.cruise[n - 1], pace.junction_mm_s / change)
    moves.direction[n, 0], moves.direction[n, 1], moves.direction[n, 2] = ux, uy, uz
    moves.size[0] += 1


@kernel
def _way_s(
    places: tuple[Floats, Indices, Floats, Indices], tip: Floats, bounds: tuple[Floats, Floats], retract: Mask, pace: Pace
) -> float:
    """Seconds of strokes one after the other, from a stand to a stand; a travel that retracts wipes and lifts, and ends at a
    stand, where the filament is primed."""
    points, starts, approach, approach_starts = places
    speeds, most = bounds
    room = len(points) + len(approach) + 4 * len(speeds) + 1
    moves = StraightMoves(table(room, 3), floats(room, 0.0), floats(room, 0.0), floats(room, 0.0), floats(room, 0.0), longs(1, 0))
    x, y = tip[0], tip[1]
    for k in range(len(speeds)):
        first, n = starts[k], moves.size[0]
        stands = retract[k] and pace.wipe_mm <= 0.0
        if retract[k]:
            if n > 0:
                begun = starts[k - 1]
                apart = sqrt((x - points[begun, 0]) ** 2 + (y - points[begun, 1]) ** 2)
                wipe = pace.wipe_mm if apart <= points[begun, 2] else -pace.wipe_mm  # on along a ring, back along a line
                ux, uy = moves.direction[n - 1, 0], moves.direction[n - 1, 1]
                aside = TURNED * wipe
                _add(moves, (0.5 * wipe * ux, 0.5 * wipe * uy, 0.0), pace.wipe_mm_s, np.inf, False, pace)
                _add(moves, (aside * (ux - uy), aside * (ux + uy), 0.0), pace.wipe_mm_s, np.inf, False, pace)
            _add(moves, (0.0, 0.0, pace.lift_mm), pace.lift_mm_s, np.inf, stands, pace)
        for i in range(approach_starts[k], approach_starts[k + 1] + 1):
            if i < approach_starts[k + 1]:
                x1, y1 = approach[i, 0], approach[i, 1]
            else:
                x1, y1 = points[first, 0], points[first, 1]
            stands = stands and i == approach_starts[k] and pace.lift_mm <= STANDING_MM
            _add(moves, (x1 - x, y1 - y, 0.0), pace.travel_mm_s, pace.travel_mm_s2, stands, pace)
            x, y = x1, y1
        if retract[k]:
            _add(moves, (0.0, 0.0, -pace.lift_mm), pace.lift_mm_s, np.inf, False, pace)
        for i in range(first + 1, starts[k + 1]):
            step = (points[i, 0] - points[i - 1, 0], points[i, 1] - points[i - 1, 1], 0.0)
            _add(moves, step, speeds[k], most[k], retract[k] and i == first + 1, pace)
        x, y = points[starts[k + 1] - 1, 0], points[starts[k + 1] - 1, 1]
    return _moves_s(moves)


@helper
def _moves_s(moves: StraightMoves) -> float:
    """Seconds of moves that end at a stand; changes where they begin."""
    n, begin = moves.size[0], moves.begin
    begin[n] = 0.0
    for i in range(n - 1, -1, -1):
        begin[i] = min(begin[i], sqrt(begin[i + 1] ** 2 + 2.0 * moves.ramp[i] * moves.length[i]))
    seconds = 0.0
    for i in range(n):
        begin[i + 1] = min(begin[i + 1], sqrt(begin[i] ** 2 + 2.0 * moves.ramp[i] * moves.length[i]))
        seconds += trapezoid_s(moves.length[i], moves.cruise[i], moves.ramp[i], begin[i], begin[i + 1])
    return float(seconds)
