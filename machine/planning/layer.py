"""Layer: a layer's strokes as moves, each as fast as axes, extruder and hot end can, and the ways of the tip between them.

Filament that makes up for what oozed while the table turned is pushed during a stroke inside, not at standstill. How much oozed
is not known. Pushed at the beginning of a wall, what did not ooze would be a drop on the seam; spread over the first stretch of
infill or support it makes that a little thicker, where nobody sees or feels it.
"""

from itertools import pairwise
from math import pi

import numpy as np

from machine.planning.limits import path_speeds, stroke_filament_mm_s
from machine.planning.moves import POINTS, RETRACT, SPEED, Moves, add_point, add_row
from machine.planning.travel import Laid, Tip, add_travel, height_to, trail_after
from mdp.kernels.arrays import floats, longs, table
from mdp.kernels.kernel import kernel
from mdp.mesh import Floats, Indices
from mdp.overhang import Mask
from profiles.profile import Profile
from slicer.estimate.timing import Speeds
from slicer.geometry.polyline import length_between
from slicer.paths import Kind, Layer, bead_area_mm2
from slicer.strokes.speed import stroke_accelerations
from slicer.strokes.travels import STANDING_MM

MOST_COASTED = 0.25  # a path coasts over this share of its length at most
RUN_MM = 20.0  # the filament of a turn is spread over so much of a stroke
MOST_FULL = 1.5  # of what the width and the height of a bead need: what did not ooze shall not fill the room twice
SEEN = (Kind.OUTER_WALL, Kind.OVERHANG, Kind.TOP_SKIN)


def print_layer(tip: Tip, layer: Layer, points: Floats, shift: Floats, *, on_plate: bool) -> None:
    """Print a layer whose points are at (n, 3) machine coordinates, its own moved by a shift.

    From one place where the filament is pulled back to the next the moves are written at once.
    """
    profile, starts = tip.profile, layer.starts
    strokes = _strokes(tip, layer, points, on_plate=on_plate)
    tip.run_in_mm -= run_in(strokes, layer, tip.run_in_mm, profile)
    laid = Laid(points, starts, layer.width_mm, layer.wiped, layer.approach + shift[:2], layer.approach_starts)
    firsts = points[starts[:-1]]
    apart = np.linalg.norm(firsts - np.vstack([tip.at_mm, points[starts[1:-1] - 1]]), axis=1) > STANDING_MM
    alone = apart if tip.limb is not None else apart & layer.retract  # a stroke may begin where the one before it ends
    ways = np.concatenate([[0], np.cumsum(strokes.rows[:, POINTS].astype(np.int64))])
    for a, b in pairwise([0, *(np.flatnonzero(alone[1:]) + 1).tolist(), len(layer)]):
        over = float(firsts[a, 2])
        if apart[a]:
            approach = laid.approach[laid.approach_starts[a] : laid.approach_starts[a + 1]]
            over = height_to(tip, firsts[a], approach, bool(layer.retract[a]), shift)
        begin = np.array([*tip.at_mm, over, tip.retracted_mm + tip.prime_extra_mm])
        piece = Moves(strokes.ways[ways[a] : ways[b]], strokes.rows[a:b])
        tip.add(_lay(piece, apart[a:b], laid.approach, laid.approach_starts[a : b + 1], begin, tip.speeds))
        tip.retracted_mm = tip.prime_extra_mm = 0.0
        tip.trail = trail_after(laid, a, b, tip.trail, profile.material.wipe_mm)


def _strokes(tip: Tip, layer: Layer, points: Floats, *, on_plate: bool) -> Moves:
    """The strokes of a layer whose points are at (n, 3) machine coordinates.

    Filament by volume (a stroke's flow holds the material's); the speed lowered to what axes, extruder and hot end can do.
    """
    profile, counts = tip.profile, np.diff(layer.starts)
    material = profile.material
    filament_mm2 = pi * material.diameter_mm**2 / 4.0
    area_mm2 = bead_area_mm2(layer.width_mm, layer.height_mm) * layer.flow
    with np.errstate(divide="ignore"):
        fastest = stroke_filament_mm_s(profile) * filament_mm2 / np.maximum(area_mm2, 0.0)
    speeds = path_speeds(points, layer.starts, np.minimum(layer.speed_mm_s, fastest), tip.speeds.axes_mm_s)
    accelerations = stroke_accelerations(profile, on_plate)[layer.kind]
    ways = _ways(points, layer.points, layer.starts, area_mm2, filament_mm2)
    rows = np.column_stack([layer.kind, counts, speeds, layer.width_mm, layer.own_fan, accelerations])
    if material.coast_mm > 0.0:
        return _coasted(Moves(ways, rows), layer.points, np.append(layer.retract[1:], False), material.coast_mm)
    return Moves(ways, rows)


def _ways(points_mm: Floats, flat_mm: Floats, starts: Indices, area_mm2: Floats, filament_mm2: float) -> Floats:
    """(n, 4) points of strokes with the filament of beads of (k,) areas; flat_mm (n, 2): the points before they were moved."""
    steps_mm = np.hypot(*np.diff(flat_mm, axis=0, prepend=flat_mm[:1]).T)
    steps_mm[starts[:-1]] = 0.0
    return np.column_stack([points_mm, steps_mm * np.repeat(area_mm2, np.diff(starts)) / filament_mm2])


@kernel
def _coasted(strokes: Moves, flat_mm: Floats, coasts: Mask, coast_mm: float) -> Moves:
    """The strokes, some of which push nothing over their last coast_mm; a step is cut where that begins. flat_mm: as in _ways."""
    out, done = Moves(table(len(strokes.ways) + len(coasts), 4), strokes.rows), longs(2, 0)
    first = 0
    for k in range(len(coasts)):
        end = first + int(strokes.rows[k, POINTS])
        total, run, pushes = length_between(flat_mm, first, end), 0.0, True
        until = total - coast_mm if coasts[k] and coast_mm < MOST_COASTED * total else np.inf
        for i in range(first, end):
            here, pushed = strokes.ways[i], strokes.ways[i, 3]
            step = length_between(flat_mm, i - 1, i + 1) if i > first else 0.0
            run += step
            if i > first and pushes and run >= until:
                before, share = strokes.ways[i - 1], 1.0 - (run - until) / step if step > 0.0 else 1.0
                x, y = before[0] + share * (here[0] - before[0]), before[1] + share * (here[1] - before[1])
                add_point(out, done, x, y, before[2] + share * (here[2] - before[2]), share * pushed)
                out.rows[k, POINTS] += 1
                pushes = False
            add_point(out, done, here[0], here[1], here[2], pushed if pushes else 0.0)
        first = end
    return Moves(out.ways[: done[0]], out.rows)


def run_in(strokes: Moves, layer: Layer, more_mm: float, profile: Profile) -> float:
    """Add filament that is still to be pushed after a turn to the strokes of a layer; how much they take, mm.

    A stroke takes half more than its width and height need, the next one some of the rest; one that is seen takes it only in a
    layer that has no other.
    """
    if more_mm <= 0.0:
        return 0.0
    seen, taken_mm = layer.is_of(*SEEN), 0.0
    filament_mm2 = 0.25 * pi * profile.material.diameter_mm**2
    fastest = stroke_filament_mm_s(profile)
    needed_mm = bead_area_mm2(layer.width_mm, layer.height_mm) * profile.material.flow / filament_mm2  # for a millimetre
    ends = np.cumsum(strokes.rows[:, POINTS].astype(np.int64))
    for k in np.flatnonzero(~seen | seen.all()).tolist():
        if taken_mm >= more_mm:
            break
        way = strokes.ways[ends[k] - int(strokes.rows[k, POINTS]) : ends[k]]
        length, pushed = np.linalg.norm(np.diff(way[:, :3], axis=0), axis=1), way[1:, 3]
        run = np.where(np.cumsum(length) - length < RUN_MM, length, 0.0)
        more = min(more_mm - taken_mm, float((MOST_FULL * needed_mm[k] * length - pushed)[run > 0.0].sum()))
        if more > 0.0:
            taken_mm += more
            pushed += more * run / run.sum()
            densest = float((pushed[length > 0.0] / length[length > 0.0]).max())
            strokes.rows[k, SPEED] = min(strokes.rows[k, SPEED], fastest / densest)
    return taken_mm


@kernel
def _lay(strokes: Moves, apart: Mask, approach: Floats, approach_starts: Indices, begin: Floats, speeds: Speeds) -> Moves:
    """Strokes with the travels to those that begin apart from where the one before them ends, along the approach.

    begin: (5,) X Y Z of the tip, Z over which it crosses to the first stroke, and what is to be pushed before that.
    """
    most = len(strokes.ways) + approach_starts[-1] - approach_starts[0] + 7 * len(apart) + 1  # three travels and a push
    out, done, goal = Moves(table(most, 4), table(5 * len(apart), 6)), longs(2, 0), floats(3, 0.0)
    add_point(out, done, begin[0], begin[1], begin[2], 0.0)
    first = 0
    for k in range(len(strokes.rows)):
        start, points = strokes.ways[first], int(strokes.rows[k, POINTS])
        if apart[k]:
            over = begin[3] if k == 0 else start[2]
            at = out.ways[done[0] - 1]
            if abs(over - at[2]) > STANDING_MM:
                goal[0], goal[1], goal[2] = at[0], at[1], over
                add_travel(out, done, approach[:0], goal, speeds)
            goal[0], goal[1], goal[2] = start[0], start[1], over
            add_travel(out, done, approach[approach_starts[k] : approach_starts[k + 1]], goal, speeds)
            goal[2] = start[2]
            add_travel(out, done, approach[:0], goal, speeds)
        if k == 0 and begin[4] > 0.0:
            add_point(out, done, start[0], start[1], start[2], begin[4])
            add_row(out, done, RETRACT, 1, speeds.filament_mm_s, np.inf)
        for i in range(first, first + points):
            add_point(out, done, strokes.ways[i, 0], strokes.ways[i, 1], strokes.ways[i, 2], strokes.ways[i, 3])
        for column in range(6):
            out.rows[done[1], column] = strokes.rows[k, column]
        done[1] += 1
        first += points
    return Moves(out.ways[1 : done[0]], out.rows[: done[1]])
