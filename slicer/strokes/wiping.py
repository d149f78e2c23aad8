"""Wiping: the way of the tip while filament is pulled back, over what it has just printed, so that the drop stays there."""

import numpy as np

from mdp.mesh import Floats
from mdp.overhang import Mask
from slicer.geometry.cells import cells_of
from slicer.geometry.polygons import Polygons
from slicer.geometry.polyline import length_mm
from slicer.strokes.strokes import Strokes
from slicer.strokes.travels import crosses, lie_within

STANDING_MM = 1e-6
RING = 4.0  # a path whose ends lie nearer than its width, and that is longer than so many widths, runs round


def may_wipe_over(strokes: Strokes, skin: Polygons, wipe_mm: float) -> Mask:
    """(k,) whether a wipe may go over each stroke: not where it ends beside the skin and such a wipe would lead onto it."""
    may = np.ones(len(strokes), np.bool_)
    if skin.is_empty() or not len(strokes):
        return may
    border = cells_of(skin)
    off = ~lie_within(border, strokes.last_points)
    for k in np.flatnonzero(off).tolist():
        points = strokes.points[strokes.starts[k] : strokes.starts[k + 1], :2]
        way = first_length(wipe_trail(points, float(strokes.width_mm[k])), wipe_mm)
        may[k] = len(way) < 2 or not crosses(border, way[:-1], way[1:]).any()
    return may


def runs_round(points: Floats, width_mm: float) -> bool:
    """Whether a path ends where it begins, or nearly."""
    return float(np.linalg.norm(points[-1] - points[0])) <= width_mm and length_mm(points) > RING * width_mm


def wipe_trail(points: Floats, width_mm: float) -> Floats:
    """The way of a wipe after a stroke (n, 2 or 3): on along a ring, over its seam; back along a line."""
    if not runs_round(points, width_mm):
        return points[::-1]
    stands = float(np.linalg.norm(points[-1] - points[0])) <= STANDING_MM
    return points if stands else np.vstack([points[-1:], points])


def first_length(way: Floats, length: float) -> Floats:
    """The first `length` mm of a polyline (n, 2 or 3), or all of it; without points that repeat."""
    if len(way) < 2 or length <= 0.0:
        return way[:0]
    steps = np.linalg.norm(np.diff(way, axis=0), axis=1)
    way, steps = way[np.concatenate([[True], steps > STANDING_MM])], steps[steps > STANDING_MM]
    done = np.cumsum(steps)
    last = int(np.searchsorted(done, length))
    if last >= len(steps):
        return way
    share = 1.0 - (done[last] - length) / steps[last]
    return np.vstack([way[: last + 1], way[last] + share * (way[last + 1] - way[last])])
