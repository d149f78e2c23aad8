"""Duration: how long the strokes of a layer and the travels to them take, on a machine like classic Marlin: no axis changes its
speed at once by more than the junction speed, and none accelerates faster than it may.
"""

from math import sqrt
from typing import NamedTuple

import numpy as np

from mdp.kernels.arrays import floats
from mdp.kernels.kernel import borrower, kernel
from mdp.mesh import Floats, Indices
from mdp.overhang import Mask
from profiles.profile import Profile
from slicer.paths import KINDS
from slicer.strokes.speed import axes_mm_s2, stroke_accelerations, travel_mm_s2
from slicer.strokes.strokes import Strokes
from slicer.strokes.wiping import STANDING_MM

TINY = 1e-9  # mm, mm/s or a cosine, instead of a division by 0


class Pace(NamedTuple):
    """What bounds the moves of a layer: speed and acceleration of travels, acceleration of each axis, speed change at corners."""

    travel_mm_s: float
    travel_mm_s2: float
    axes_mm_s2: float
    junction_mm_s: float


@borrower
def trapezoid_s(length_mm: float, speed_mm_s: float, acceleration_mm_s2: float, v0: float, v1: float) -> float:
    """Seconds of a straight move from one speed to another: a trapezoid of speeds, or a triangle where it gets no faster."""
    peak = min(speed_mm_s, sqrt(0.5 * (v0 * v0 + v1 * v1) + acceleration_mm_s2 * length_mm))
    ramps_mm = (2.0 * peak * peak - v0 * v0 - v1 * v1) / (2.0 * acceleration_mm_s2)
    return float((2.0 * peak - v0 - v1) / acceleration_mm_s2 + max(0.0, length_mm - ramps_mm) / max(peak, TINY))


@kernel
def line_s(length_mm: float, speed_mm_s: float, acceleration_mm_s2: float) -> float:
    """Seconds of a straight line from a stand to a stand."""
    return trapezoid_s(length_mm, speed_mm_s, acceleration_mm_s2, 0.0, 0.0)


def retraction_s(profile: Profile) -> float:
    """Seconds that pulling back with its wipe, lifting, lowering and priming add to a travel."""
    process, material, machine = profile.process, profile.material, profile.machine
    filament_mm_s, filament_mm_s2 = min(material.retract_speed_mm_s, machine.extruder_speed_mm_s), machine.extruder_acceleration_mm_s2
    pulled_mm, primed_mm = material.retract_mm, material.retract_mm + material.retract_prime_extra_mm
    if pulled_mm <= 0.0:
        back_s = 0.0
    elif material.wipe_mm > 0.0:
        back_s = line_s(material.wipe_mm, min(process.travel_speed_mm_s, material.wipe_mm * filament_mm_s / pulled_mm), axes_mm_s2(profile))
    else:
        back_s = line_s(pulled_mm, filament_mm_s, filament_mm_s2)
    lift_s = line_s(process.lift_mm, min(process.lift_speed_mm_s, machine.z.speed_mm_s), machine.z.acceleration_mm_s2)
    return back_s + 2.0 * lift_s + (line_s(primed_mm, filament_mm_s, filament_mm_s2) if primed_mm > 0.0 else 0.0)


def strokes_s(strokes: Strokes, speeds_mm_s: Floats, profile: Profile, first_layer: bool) -> float:
    """Seconds of a layer's strokes at their (k,) speeds, with the travels between them and their retractions."""
    machine, told = profile.machine, stroke_accelerations(profile, first_layer)
    most = np.full(len(KINDS), np.inf) if told is None else np.array([told[kind] for kind in KINDS])
    pace = Pace(
        min(profile.process.travel_speed_mm_s, machine.x.speed_mm_s, machine.y.speed_mm_s),
        travel_mm_s2(profile) or np.inf,
        axes_mm_s2(profile),
        machine.junction_speed_mm_s,
    )
    places = Way(strokes.points, strokes.starts, strokes.approach, strokes.approach_starts)
    moving_s = _way_s(places, speeds_mm_s, most[strokes.kind], strokes.retract, pace)
    return moving_s + int(strokes.retract[1:].sum()) * retraction_s(profile)


class Way(NamedTuple):
    """Points (n, 3) of strokes, where each begins, points (m, 2) that the travels to them pass, and where those of each begin."""

    points: Floats
    starts: Indices
    approach: Floats
    approach_starts: Indices


@kernel
def _way_s(way: Way, speeds: Floats, most: Floats, retract: Mask, pace: Pace) -> float:
    """Seconds of strokes one after the other, from a stand to a stand; where a travel retracts it stands before and after."""
    room = len(way.points) + len(way.approach) + 1
    length, cruise, ramp, corner = floats(room, 0.0), floats(room, 0.0), floats(room, 0.0), floats(room + 1, 0.0)
    n = 0
    x, y, ux, uy = way.points[0, 0], way.points[0, 1], 0.0, 0.0
    for k in range(len(speeds)):
        a, b = way.approach_starts[k], way.approach_starts[k + 1]
        before = b - a
        for step in range(before + way.starts[k + 1] - way.starts[k]):
            travels = step <= before
            if step < before:
                nx, ny = way.approach[a + step, 0], way.approach[a + step, 1]
            else:
                nx, ny = way.points[way.starts[k] + step - before, 0], way.points[way.starts[k] + step - before, 1]
            dx, dy = nx - x, ny - y
            long = sqrt(dx * dx + dy * dy)
            if long <= STANDING_MM:
                continue
            dx, dy = dx / long, dy / long
            length[n], cruise[n] = long, pace.travel_mm_s if travels else speeds[k]
            told = pace.travel_mm_s2 if travels else most[k]
            ramp[n] = min(pace.axes_mm_s2 / max(abs(dx), abs(dy), TINY), told)
            stands = n == 0 or (retract[k] and (step == 0 or step == before + 1))
            if not stands:
                change = max(abs(dx - ux), abs(dy - uy), TINY)
                corner[n] = min(cruise[n], cruise[n - 1], pace.junction_mm_s / change)
            x, y, ux, uy = nx, ny, dx, dy
            n += 1
    for i in range(n - 1, -1, -1):
        corner[i] = min(corner[i], sqrt(corner[i + 1] ** 2 + 2.0 * ramp[i] * length[i]))
    seconds = 0.0
    for i in range(n):
        corner[i + 1] = min(corner[i + 1], sqrt(corner[i] ** 2 + 2.0 * ramp[i] * length[i]))
        seconds += trapezoid_s(length[i], cruise[i], ramp[i], corner[i], corner[i + 1])
    return float(seconds)
