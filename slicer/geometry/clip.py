"""Clipping: open lines clipped to polygons, each piece with the border edges on which it ends, and lines split where they enter
and leave.
"""

from itertools import pairwise
from math import cos, radians, sin
from typing import NamedTuple

import numpy as np

from mdp.kernels.arrays import floats, longs
from mdp.kernels.kernel import kernel
from mdp.mesh import Floats, Indices
from mdp.overhang import Mask
from slicer.geometry.edge_index import EdgeIndex, crossings, index_edges, within
from slicer.geometry.polygons import Polygons
from slicer.geometry.polyline import Segment

SNAP = 1e-6  # share of a step's length: a crossing this close to the step's end is at its end


class Pieces(NamedTuple):
    """Pieces of lines. points: (n, 2) mm; starts: (k + 1,) first point of each piece, and n; ends: (k, 2) edges on which the two
    ends lie.
    """

    points: Floats
    starts: Indices
    ends: Indices


NO_PIECES = Pieces(np.zeros((0, 2)), np.zeros(1, np.int64), np.zeros((0, 2), np.int64))


def rotation_2d(angle_deg: float) -> Floats:
    """(2, 2) rotation of row vectors by -angle."""
    c, s = cos(radians(angle_deg)), sin(radians(angle_deg))
    return np.array([[c, -s], [s, c]])


def clip_lines(points: Floats, starts: Indices, border: EdgeIndex) -> Pieces:
    """The pieces of open lines (n, 2) inside the polygons of a border, by the even-odd rule.

    Every line must begin and end outside.
    """
    if not len(border.edges) or not len(starts):
        return NO_PIECES
    bounds = np.append(starts, len(points))
    n, room = -1, 4 * len(points) + 2 * len(border.edges) + 64
    while n < 0:
        out = Pieces(np.empty((room, 2)), np.empty(room + 1, np.int64), np.empty((room, 2), np.int64))
        n, pieces = _clip(points, bounds, border, out)
        room *= 4
    return Pieces(out.points[:n].copy(), out.starts[: pieces + 1].copy(), out.ends[:pieces].copy())


@kernel
def _clip(points: Floats, bounds: Indices, border: EdgeIndex, out: Pieces) -> tuple[int, int]:
    """Fill in the pieces; returns the number of points and of pieces, -1 if the arrays are too small."""
    shares, crossed = floats(len(border.edges), 0.0), longs(len(border.edges), 0)
    n = count = 0
    for line in range(len(bounds) - 1):
        within = False
        for k in range(bounds[line], bounds[line + 1] - 1):
            ax, ay, bx, by = points[k, 0], points[k, 1], points[k + 1, 0], points[k + 1, 1]
            many = crossings(border, Segment(ax, ay, bx, by), shares, crossed)
            if n + many + 1 > len(out.points):
                return -1, 0
            for i in range(many):
                within = not within
                if within:
                    out.starts[count], out.ends[count, 0] = n, crossed[i]
                else:
                    out.ends[count, 1] = crossed[i]
                    count += 1
                out.points[n, 0], out.points[n, 1] = ax + shares[i] * (bx - ax), ay + shares[i] * (by - ay)
                n += 1
            if within:
                out.points[n, 0], out.points[n, 1] = bx, by
                n += 1
        if within:
            n = out.starts[count]
    out.starts[count] = n
    return n, count


def merge_pieces(several: list[Pieces]) -> Pieces:
    """The pieces of several bundles of lines as one bundle."""
    points, starts, ends = zip(NO_PIECES, *several, strict=True)
    sizes = np.concatenate([np.diff(of_bundle) for of_bundle in starts])
    return Pieces(np.concatenate(points), np.cumsum([0, *sizes]), np.concatenate(ends))


def cut_line(points: Floats, area: Polygons) -> tuple[Floats, Mask]:
    """The polyline (n, 2) with points added where it enters and leaves an area, and a mask of the steps inside."""
    index, size, room = index_edges(area), -1, 2 * len(points) + 64
    while size < 0:
        out, marks = np.empty((room, 2)), np.empty(room, np.bool_)
        size = cut_into(points, index, out, marks)
        room *= 4
    return out[:size], marks[: size - 1]


def runs_within(points: Floats, area: Polygons) -> list[Floats]:
    """The parts of a polyline (n, 2) inside an area; in a closed one, the part across its first point is one piece."""
    if area.is_empty():
        return []
    points, within = cut_line(points, area)
    if within.all():
        return [points]
    bounds = [0, *(np.flatnonzero(np.diff(within)) + 1).tolist(), len(within)]
    runs = [points[a : b + 1] for a, b in pairwise(bounds) if within[a]]
    closed = bool((points[0] == points[-1]).all())
    if closed and len(runs) > 1 and within[0] and within[-1]:
        runs = [*runs[1:-1], np.concatenate([runs[-1], runs[0][1:]])]
    return runs


@kernel
def cut_into(points: Floats, area: EdgeIndex, out: Floats, marks: Mask) -> int:
    """Fill in the points and the mask of steps inside; returns the number of points, -1 if the arrays are too small.

    points, out: (n, 2 or more), further columns are interpolated.
    """
    shares, crossed = floats(len(area.edges) + 1, 0.0), longs(len(area.edges), 0)
    columns, n = points.shape[1], 1
    for axis in range(columns):
        out[0, axis] = points[0, axis]
    for k in range(len(points) - 1):
        step = Segment(points[k, 0], points[k, 1], points[k + 1, 0], points[k + 1, 1])
        many = crossings(area, step, shares[:-1], crossed)
        if n + many + 1 > len(out):
            return -1
        shares[many] = 1.0
        since = 0.0
        for s in range(many + 1):
            if s < many and not SNAP < shares[s] < 1.0 - SNAP:
                continue
            # Tested for every piece: where a line leaves the area exactly at one of its points, no step crosses an edge.
            middle = 0.5 * (since + shares[s])
            is_within = within(area, step.x0 + middle * (step.x1 - step.x0), step.y0 + middle * (step.y1 - step.y0))
            for axis in range(columns):
                end = points[k + 1, axis]
                out[n, axis] = end if s == many else points[k, axis] + shares[s] * (end - points[k, axis])
            marks[n - 1], since = is_within, shares[s]
            n += 1
    return n
