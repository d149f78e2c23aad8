"""Order: in which sequence the beads of a layer are printed, and which travels between them retract.

Skirt and support come first. Islands of the section follow each other by the nearest next start; inside an island the
ranks rise (inner walls from the inside out, outer wall, gaps, skin, infill) and within a rank the nearest bead is next.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numba import njit
from numpy.typing import NDArray

from mdp.mesh import Floats, Ints
from slicer.bead import Bead
from slicer.paths import Kind
from slicer.polygons import Polygons, area_mm2, contours, edges, grown
from slicer.scanline import crossed, inside

OUTSIDE = -1000  # ranks up to this belong to no island: skirt, brim, support
INSET = 0.4  # line widths inside the section within which travels ooze unseen; centrelines of outer walls lie at 0.5


@dataclass(frozen=True, eq=False)
class Placed:
    """A bead in its place: points as printed, and whether the travel to them retracts."""

    bead: Bead
    points: Floats
    retract: bool


def ordered(
    beads: Sequence[Bead], section: Polygons, width_mm: float, tip: Floats | None, retract_travel_mm: float
) -> list[Placed]:
    """The beads of one layer in printing order; tip: (2,) where the nozzle stands before, None at the part's start."""
    if not beads:
        return []
    starts = np.array([bead.points[0] for bead in beads])
    ends = np.array([bead.points[-1] for bead in beads])
    ranks = np.array([bead.rank for bead in beads], dtype=np.int32)
    fixed = np.array([bead.closed for bead in beads])
    first = starts[0] if tip is None else tip
    order, flips = _sequence(_islands(starts, ranks, section), ranks, starts, ends, fixed, first[0], first[1])
    placed = [beads[k].points[::-1] if flip else beads[k].points for k, flip in zip(order, flips, strict=True)]
    to = np.array([points[0] for points in placed])
    since = np.array([first, *(points[-1] for points in placed[:-1])])
    props = np.array([beads[k].kind is Kind.SUPPORT for k in order])
    among = np.concatenate([[False], props[1:] & props[:-1]])
    retracts = _retracts(edges(grown(section, -INSET * width_mm)), since, to, among, retract_travel_mm)
    if tip is None:
        retracts[0] = True
    return [Placed(beads[k], points, bool(pull)) for k, points, pull in zip(order, placed, retracts, strict=True)]


def _islands(starts: Floats, ranks: Ints, section: Polygons) -> Ints:
    """The island of each bead: the smallest outer contour around its start; -1 for beads outside (skirt, support)."""
    outer = sorted((loop for loop in contours(section) if area_mm2(loop) > 0), key=lambda loop: abs(area_mm2(loop)))
    if len(outer) < 2:
        return np.where(ranks <= OUTSIDE, -1, 0).astype(np.int32)
    sides = [np.hstack([loop, np.roll(loop, -1, axis=0)]) for loop in outer]
    offsets = np.cumsum([0, *(len(side) for side in sides)])
    boxes = np.array([[*loop.min(axis=0), *loop.max(axis=0)] for loop in outer])
    found = _containing(np.concatenate(sides), offsets, boxes, starts)
    return np.where(ranks <= OUTSIDE, -1, found).astype(np.int32)


@njit(cache=True)
def _containing(sides: Floats, offsets: NDArray[np.int64], boxes: Floats, points: Floats) -> Ints:
    found = np.full(len(points), len(boxes), np.int32)
    for p in range(len(points)):
        x, y = points[p]
        for k in range(len(boxes)):
            near = boxes[k, 0] <= x <= boxes[k, 2] and boxes[k, 1] <= y <= boxes[k, 3]
            if near and inside(sides[offsets[k] : offsets[k + 1]], x, y):
                found[p] = k
                break
    return found


@njit(cache=True)
def _sequence(
    islands: Ints, ranks: Ints, starts: Floats, ends: Floats, fixed: NDArray[np.bool_], x: float, y: float
) -> tuple[NDArray[np.int64], NDArray[np.bool_]]:
    """Greedy nearest neighbour: lowest open rank of the island at hand, or of every island when it is finished."""
    n = len(islands)
    order, flips, done = np.empty(n, np.int64), np.zeros(n, np.bool_), np.zeros(n, np.bool_)
    lowest = np.empty(islands.max() + 2, np.int32)
    island = -1
    for place in range(n):
        lowest[:] = 2**30
        for k in range(n):
            if not done[k]:
                lowest[islands[k] + 1] = min(lowest[islands[k] + 1], ranks[k])
        if lowest[0] < 2**30:
            island = -1
        stay = lowest[island + 1] < 2**30
        best, flip, nearest = -1, False, np.inf
        for k in range(n):
            if done[k] or ranks[k] != lowest[islands[k] + 1] or (stay and islands[k] != island):
                continue
            distance = (starts[k, 0] - x) ** 2 + (starts[k, 1] - y) ** 2
            if distance < nearest:
                best, flip, nearest = k, False, distance
            distance = (ends[k, 0] - x) ** 2 + (ends[k, 1] - y) ** 2
            if not fixed[k] and distance < nearest:
                best, flip, nearest = k, True, distance
        order[place], flips[place], done[best], island = best, flip, True, islands[best]
        x, y = (starts[best, 0], starts[best, 1]) if flip else (ends[best, 0], ends[best, 1])
    return order, flips


@njit(cache=True)
def _retracts(sides: Floats, since: Floats, to: Floats, among: NDArray[np.bool_], least_mm: float) -> NDArray[np.bool_]:
    """A travel retracts when it is long and does not stay inside the section or, among supports, outside of it."""
    out = np.zeros(len(to), np.bool_)
    for k in range(len(to)):
        x0, y0, x1, y1 = since[k, 0], since[k, 1], to[k, 0], to[k, 1]
        if np.hypot(x1 - x0, y1 - y0) >= least_mm:
            out[k] = crossed(sides, x0, y0, x1, y1) or not (among[k] or inside(sides, x0, y0))
    return out
