"""Duration: how long the strokes of a layer and the travels to them take."""

from math import sqrt
from typing import NamedTuple

import numpy as np

from mdp.kernels.arrays import flags, floats, longs, table
from mdp.kernels.kernel import kernel, no_nrt
from mdp.mesh import Floats, Indices
from mdp.overhang import Mask
from profiles.profile import Profile
from slicer.estimate.timing import TINY, line_s, move_times
from slicer.paths import KINDS
from slicer.strokes.speed import stroke_accelerations, travel_mm_s2
from slicer.strokes.strokes import Strokes
from slicer.strokes.travels import STANDING_MM

# A wipe turns in its middle by 45 deg, as over the small rings after which most are: mm along each axis for a mm of all of it.
TURNED = 0.5 / sqrt(2.0)


class Pace(NamedTuple):
    """What bounds the moves of a layer: speed and acceleration of travels, speed of lifts, how far one lifts, speed and length
    of a wipe."""

    travel_mm_s: float
    travel_mm_s2: float
    lift_mm_s: float
    lift_mm: float
    wipe_mm_s: float
    wipe_mm: float


class StraightMoves(NamedTuple):
    """Buffers for moves in order, the first size[0] of them set: steps (n, 6) of X Y Z tilt turn E, speed, greatest acceleration,
    and whether the machine stands still before it."""

    step: Floats
    speed: Floats
    most_mm_s2: Floats
    stands: Mask
    size: Indices


def strokes_s(strokes: Strokes, speeds_mm_s: Floats, tip: Floats, profile: Profile, first_layer: bool) -> float:
    """Seconds of a layer's strokes at their (k,) speeds, with the rise to it, the travels to them and their retractions.

    tip: (2,) where the layer below ends.
    """
    machine = profile.machine
    by_kind = stroke_accelerations(profile, first_layer)
    most = np.full(len(KINDS), np.inf) if by_kind is None else np.array([by_kind[kind] for kind in KINDS])
    pace = _pace(profile)
    places = strokes.points, strokes.starts, strokes.approach, strokes.approach_starts
    steps, speed, most_mm_s2, stands, size = _moves(places, tip, (speeds_mm_s, most[strokes.kind]), strokes.retract, pace)
    n = int(size[0])
    moving_s = move_times(steps[:n], speed[:n], stands[:n], machine, most_mm_s2[:n]).sum()
    rise_s = line_s(profile.process.layer_height_mm, pace.lift_mm_s, machine.z.acceleration_mm_s2)
    return float(moving_s + rise_s + int(strokes.retract.sum()) * _standing_s(profile))


def _pace(profile: Profile) -> Pace:
    process, material, machine = profile.process, profile.material, profile.machine
    travel_mm_s = min(process.travel_speed_mm_s, machine.x.speed_mm_s, machine.y.speed_mm_s)
    wipe_mm = material.wipe_mm if material.retract_mm > 0.0 else 0.0
    return Pace(
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
def _add(moves: StraightMoves, step: tuple[float, float, float], speed: float, most_mm_s2: float, stands: bool) -> None:
    """Append a straight move; stands: the machine stands still before it."""
    n = moves.size[0]
    if sqrt(step[0] ** 2 + step[1] ** 2 + step[2] ** 2) <= STANDING_MM:
        return
    moves.step[n, 0], moves.step[n, 1], moves.step[n, 2] = step
    moves.speed[n], moves.most_mm_s2[n], moves.stands[n] = speed, most_mm_s2, stands
    moves.size[0] += 1


@kernel
def _moves(
    places: tuple[Floats, Indices, Floats, Indices], tip: Floats, bounds: tuple[Floats, Floats], retract: Mask, pace: Pace
) -> StraightMoves:
    """Strokes one after the other with the travels to them; one that retracts wipes and lifts, and ends at a stand, where the
    filament is primed."""
    points, starts, approach, approach_starts = places
    speeds, most = bounds
    room = len(points) + len(approach) + 4 * len(speeds) + 1
    moves = StraightMoves(table(room, 6), floats(room, 0.0), floats(room, 0.0), flags(room), longs(1, 0))
    x, y = tip[0], tip[1]
    for k in range(len(speeds)):
        first, n = starts[k], moves.size[0]
        stands = retract[k] and pace.wipe_mm <= 0.0
        if retract[k]:
            if n > 0:
                begun = starts[k - 1]
                apart = sqrt((x - points[begun, 0]) ** 2 + (y - points[begun, 1]) ** 2)
                wipe = pace.wipe_mm if apart <= points[begun, 2] else -pace.wipe_mm  # on along a ring, back along a line
                ux, uy, uz = moves.step[n - 1, 0], moves.step[n - 1, 1], moves.step[n - 1, 2]
                length = sqrt(ux**2 + uy**2 + uz**2)
                ux, uy, aside = ux / length, uy / length, TURNED * wipe
                _add(moves, (0.5 * wipe * ux, 0.5 * wipe * uy, 0.0), pace.wipe_mm_s, np.inf, False)
                _add(moves, (aside * (ux - uy), aside * (ux + uy), 0.0), pace.wipe_mm_s, np.inf, False)
            _add(moves, (0.0, 0.0, pace.lift_mm), pace.lift_mm_s, np.inf, stands)
        for i in range(approach_starts[k], approach_starts[k + 1] + 1):
            if i < approach_starts[k + 1]:
                x1, y1 = approach[i, 0], approach[i, 1]
            else:
                x1, y1 = points[first, 0], points[first, 1]
            stands = stands and i == approach_starts[k] and pace.lift_mm <= STANDING_MM
            _add(moves, (x1 - x, y1 - y, 0.0), pace.travel_mm_s, pace.travel_mm_s2, stands)
            x, y = x1, y1
        if retract[k]:
            _add(moves, (0.0, 0.0, -pace.lift_mm), pace.lift_mm_s, np.inf, False)
        for i in range(first + 1, starts[k + 1]):
            step = (points[i, 0] - points[i - 1, 0], points[i, 1] - points[i - 1, 1], 0.0)
            _add(moves, step, speeds[k], most[k], retract[k] and i == first + 1)
        x, y = points[starts[k + 1] - 1, 0], points[starts[k + 1] - 1, 1]
    return moves
