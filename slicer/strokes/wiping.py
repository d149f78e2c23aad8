"""Wiping: the way of the tip while filament is pulled back, over what it has just printed, so that the drop stays there."""

import numpy as np

from mdp.kernels.arrays import table
from mdp.kernels.kernel import helper, kernel, no_nrt
from mdp.mesh import Floats
from mdp.overhang import Mask
from slicer.geometry.edge_index import crosses, index_edges, lie_within
from slicer.geometry.polygons import Polygons
from slicer.geometry.polyline import length_between
from slicer.strokes.strokes import Strokes

STANDING_MM = 1e-6
RING = 4.0  # a path whose ends lie nearer than its width, and that is longer than so many widths, runs round


def may_wipe_over(strokes: Strokes, skin: Polygons, wipe_mm: float) -> Mask:
    """(k,) whether a wipe may go over each stroke: not where it ends beside the skin and such a wipe would lead onto it."""
    may = np.ones(len(strokes), np.bool_)
    if skin.is_empty() or not len(strokes):
        return may
    border = index_edges(skin)
    off = ~lie_within(border, strokes.last_points)
    for k in np.flatnonzero(off).tolist():
        points = np.ascontiguousarray(strokes.points[strokes.starts[k] : strokes.starts[k + 1], :2])
        way = way_of_wipe(points, float(strokes.width_mm[k]), wipe_mm)
        may[k] = len(way) < 2 or not crosses(border, way[:-1], way[1:]).any()
    return may


@kernel
def way_of_wipe(points: Floats, width_mm: float, wipe_mm: float) -> Floats:
    """The way (n, 2 or 3) of a wipe of wipe_mm after a stroke, over nothing but that."""
    return first_length(wipe_trail(points, width_mm), wipe_mm)


@no_nrt
def runs_round(points: Floats, width_mm: float) -> bool:
    """Whether a path ends where it begins, or nearly."""
    return bool(distance(points, 0, len(points) - 1) <= width_mm and length_between(points, 0, len(points)) > RING * width_mm)


@no_nrt
def distance(points: Floats, i: int, k: int) -> float:
    """Between two of the points (n, 2 or 3)."""
    squared = 0.0
    for axis in range(points.shape[1]):
        squared += (points[k, axis] - points[i, axis]) ** 2
    return float(np.sqrt(squared))


@helper
def wipe_trail(points: Floats, width_mm: float) -> Floats:
    """The way of a wipe after a stroke (n, 2 or 3): on along a ring, over its seam; back along a line."""
    count, onward = len(points), runs_round(points, width_mm)
    across = 1 if onward and distance(points, 0, count - 1) > STANDING_MM else 0
    trail: Floats = table(count + across, points.shape[1])
    for i in range(len(trail)):
        k = (i - across) % count if onward else count - 1 - i
        for axis in range(points.shape[1]):
            trail[i, axis] = points[k, axis]
    return trail


@helper
def first_length(way: Floats, length: float) -> Floats:
    """The first `length` mm of a polyline (n, 2 or 3), or all of it; without points that repeat."""
    first: Floats = table(len(way), way.shape[1])
    count, run = 0, 0.0
    for i in range(len(way) if len(way) > 1 and length > 0.0 else 0):
        step = distance(way, i - 1, i) if i else 0.0
        if i and step <= STANDING_MM:
            continue
        run += step
        for axis in range(way.shape[1]):
            first[count, axis] = way[i, axis]
            if run >= length:
                first[count, axis] = first[count - 1, axis] + (1.0 - (run - length) / step) * (
                    way[i, axis] - first[count - 1, axis]
                )
        count += 1
        if run >= length:
            break
    return first[:count]
