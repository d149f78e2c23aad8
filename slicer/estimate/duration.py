"""Duration: how long the strokes of a layer and the travels to them take."""

from math import sqrt
from typing import NamedTuple

import numpy as np

from mdp.kernels.arrays import flags, floats, longs, table
from mdp.kernels.kernel import kernel, no_nrt
from mdp.mesh import Floats, Indices
from mdp.overhang import Mask
from profiles.profile import Profile
from slicer.estimate.timing import TINY, Speeds, line_s, move_times, speeds_of
from slicer.strokes.speed import stroke_accelerations
from slicer.strokes.strokes import Strokes
from slicer.strokes.travels import STANDING_MM

# A wipe turns in its middle by 45 deg, as over the small rings after which most are: mm along each axis for a mm of all of it.
TURNED = 0.5 / sqrt(2.0)


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
    machine, process, material, speeds = profile.machine, profile.process, profile.material, speeds_of(profile)
    places = strokes.points, strokes.starts, strokes.approach, strokes.approach_starts
    bounds = speeds_mm_s, stroke_accelerations(profile, first_layer)[strokes.kind]
    wipe_mm = material.wipe_mm if material.retract_mm > 0.0 else 0.0
    moves = _moves(places, tip, bounds, strokes.retract, speeds, (process.lift_mm, wipe_mm, material.retract_mm))
    n = int(moves.size[0])
    moving_s = move_times(moves.step[:n], moves.speed[:n], moves.stands[:n], machine, moves.most_mm_s2[:n]).sum()
    rise_s = line_s(process.layer_height_mm, speeds.lift_mm_s, machine.z.acceleration_mm_s2)
    return float(moving_s + rise_s + int(strokes.retract.sum()) * _standing_s(profile, speeds.filament_mm_s))


def _standing_s(profile: Profile, filament_mm_s: float) -> float:
    """Seconds that the filament moves alone for one retraction."""
    material, ramp = profile.material, profile.machine.extruder_acceleration_mm_s2
    if material.retract_mm <= 0.0:
        return 0.0
    primed_s = line_s(material.retract_mm + material.retract_prime_extra_mm, filament_mm_s, ramp)
    return primed_s if material.wipe_mm > 0.0 else primed_s + line_s(material.retract_mm, filament_mm_s, ramp)


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
    places: tuple[Floats, Indices, Floats, Indices],
    tip: Floats,
    bounds: tuple[Floats, Floats],
    retract: Mask,
    paces: Speeds,
    far_mm: tuple[float, float, float],
) -> StraightMoves:
    """Strokes one after the other with the travels to them; one that retracts wipes and lifts, and ends at a stand, where the
    filament is primed. far_mm: of a lift, a wipe and the filament pulled back meanwhile."""
    points, starts, approach, approach_starts = places
    speeds, most = bounds
    lift_mm, wipe_mm, pulled_mm = far_mm
    wipe_mm_s = min(paces.travel_mm_s, wipe_mm * paces.filament_mm_s / max(pulled_mm, TINY))
    room = len(points) + len(approach) + 4 * len(speeds) + 1
    moves = StraightMoves(table(room, 6), floats(room, 0.0), floats(room, 0.0), flags(room), longs(1, 0))
    x, y = tip[0], tip[1]
    for k in range(len(speeds)):
        first, n = starts[k], moves.size[0]
        stands = retract[k] and wipe_mm <= 0.0
        if retract[k]:
            if n > 0:
                begun = starts[k - 1]
                apart = sqrt((x - points[begun, 0]) ** 2 + (y - points[begun, 1]) ** 2)
                wipe = wipe_mm if apart <= points[begun, 2] else -wipe_mm  # on along a ring, back along a line
                ux, uy, uz = moves.step[n - 1, 0], moves.step[n - 1, 1], moves.step[n - 1, 2]
                length = sqrt(ux**2 + uy**2 + uz**2)
                ux, uy, aside = ux / length, uy / length, TURNED * wipe
                _add(moves, (0.5 * wipe * ux, 0.5 * wipe * uy, 0.0), wipe_mm_s, np.inf, False)
                _add(moves, (aside * (ux - uy), aside * (ux + uy), 0.0), wipe_mm_s, np.inf, False)
            _add(moves, (0.0, 0.0, lift_mm), paces.lift_mm_s, np.inf, stands)
        for i in range(approach_starts[k], approach_starts[k + 1] + 1):
            if i < approach_starts[k + 1]:
                x1, y1 = approach[i, 0], approach[i, 1]
            else:
                x1, y1 = points[first, 0], points[first, 1]
            stands = stands and i == approach_starts[k] and lift_mm <= STANDING_MM
            _add(moves, (x1 - x, y1 - y, 0.0), paces.travel_mm_s, paces.acceleration_mm_s2, stands)
            x, y = x1, y1
        if retract[k]:
            _add(moves, (0.0, 0.0, -lift_mm), paces.lift_mm_s, np.inf, False)
        for i in range(first + 1, starts[k + 1]):
            step = (points[i, 0] - points[i - 1, 0], points[i, 1] - points[i - 1, 1], 0.0)
            _add(moves, step, speeds[k], most[k], retract[k] and i == first + 1)
        x, y = points[starts[k + 1] - 1, 0], points[starts[k + 1] - 1, 1]
    return moves
