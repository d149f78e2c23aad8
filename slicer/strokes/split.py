"""Split: strokes of a layer parted where they enter and leave an area, so that they are printed otherwise there."""

from dataclasses import replace
from typing import NamedTuple

import numpy as np

from mdp.kernels.arrays import flags, floats, table
from mdp.kernels.kernel import helper, kernel
from mdp.kernels.sorting import rank, sort
from mdp.mesh import Floats, Indices
from mdp.overhang import Mask
from slicer.geometry.polygons import Polygons, edges
from slicer.geometry.segments import Segment, inside, orientation
from slicer.strokes.strokes import Strokes

SNAP = 1e-6  # of a step's length: a crossing so near its end is at its end


class Sides(NamedTuple):
    """Sides (k, 4) of an area by rising least y; lows: (k,) that y; tallest: how far a side reaches along y at most."""

    edges: Floats
    lows: Floats
    tallest: float

    @classmethod
    def of(cls, edges: Floats) -> "Sides":
        """Those of (k, 4) edges in any order."""
        lows = np.minimum(edges[:, 1], edges[:, 3])
        order = np.argsort(lows, kind="stable")
        return cls(edges[order], lows[order], float(np.abs(edges[:, 3] - edges[:, 1]).max(initial=0.0)))


class _Pieces(NamedTuple):
    """Buffers for pieces of strokes: points (n, 3); starts: (k + 1,); source: (k,) the stroke of each; within: (k,)."""

    points: Floats
    starts: Indices
    source: Indices
    within: Mask


def split(strokes: Strokes, area: Polygons, wanted: Mask, shortest_mm: float) -> tuple[Strokes, Mask]:
    """The strokes in the same order, those that are wanted (k,) in pieces; and (j,) which of all lie within the area.

    No piece is shorter than shortest_mm.
    """
    sides = Sides.of(edges(area))
    count, room = -1, 2 * len(strokes.points) + 64
    while count < 0:
        pieces = _Pieces(np.empty((room, 3)), np.empty(room, np.int64), np.empty(room, np.int64), np.empty(room, np.bool_))
        count = _split(strokes.points, strokes.starts, wanted, sides, shortest_mm, pieces)
        room *= 4
    starts, source = pieces.starts[: count + 1].copy(), pieces.source[:count]
    out = strokes.refined(pieces.points[: starts[-1]].copy(), starts, source)
    is_whole = np.bincount(source, minlength=len(strokes))[source] == 1
    return replace(out, small=out.small & (is_whole | out.varies)), pieces.within[:count].copy()


@kernel
def _split(points: Floats, starts: Indices, wanted: Mask, sides: Sides, shortest_mm: float, out: _Pieces) -> int:
    """Fills in the pieces and returns how many there are, -1 where there is no room for them."""
    room = len(out.points)
    cut, within = table(room, 3), flags(room)
    count = n = 0
    out.starts[0] = 0
    for k in range(len(starts) - 1):
        a, b = starts[k], starts[k + 1]
        size = 0
        if wanted[k]:
            size = _cut_into(points[a:b], sides.edges, sides.lows, sides.tallest, cut, within)
            if size < 0:
                return -1
            _steady(cut, within, size, shortest_mm)
        whole = True
        for i in range(1, size - 1):
            whole = whole and within[i] == within[0]
        if n + (b - a if whole else 2 * size) > room or count + max(size, 1) >= room:
            return -1
        if whole:
            for i in range(a, b):
                for axis in range(3):
                    out.points[n, axis] = points[i, axis]
                n += 1
            out.source[count], out.within[count], out.starts[count + 1] = k, size > 1 and within[0], n
            count += 1
            continue
        begin = 0
        for i in range(size - 1):
            if i + 2 < size and within[i + 1] == within[begin]:
                continue
            for at in range(begin, i + 2):
                for axis in range(3):
                    out.points[n, axis] = cut[at, axis]
                n += 1
            out.source[count], out.within[count], out.starts[count + 1] = k, within[begin], n
            count, begin = count + 1, i + 1
    return count


@helper
def _steady(points: Floats, within: Mask, size: int, shortest_mm: float) -> None:
    """Runs of steps shorter than that take after their neighbours, those within last so that none is overlooked for a gap.

    points: of which `size` count; within: of as many steps less one. A line that is a single run has no neighbours.
    """
    for inner in range(2):
        a = 0
        while a < size - 1:
            b, length_mm = a, 0.0
            while b < size - 1 and within[b] == within[a]:
                length_mm += np.hypot(points[b + 1, 0] - points[b, 0], points[b + 1, 1] - points[b, 1])
                b += 1
            if a == 0 and b == size - 1:
                return
            if within[a] == (inner > 0) and length_mm < shortest_mm:
                for step in range(a, b):
                    within[step] = inner == 0
            a = b


def cut_line(points: Floats, sides: Sides) -> tuple[Floats, Mask]:
    """The polyline (n, 2) with the places added where it crosses sides, and which steps lie within."""
    size, room = -1, 2 * len(points) + 64
    while size < 0:
        out, within = np.empty((room, 2)), np.empty(room, np.bool_)
        size = _cut(points, sides, out, within)
        room *= 4
    return out[:size], within[: size - 1]


@kernel
def _cut(points: Floats, sides: Sides, out: Floats, marks: Mask) -> int:
    return _cut_into(points, sides.edges, sides.lows, sides.tallest, out, marks)


@helper
def _cut_into(points: Floats, sides: Floats, lows: Floats, tallest: float, out: Floats, marks: Mask) -> int:
    """Fills in the points and which steps lie within; returns how many points there are, -1 where there is no room for them.

    points, out: (n, 2 or more), further columns are interpolated.
    """
    shares, within = floats(len(sides) + 2, 0.0), False
    columns = points.shape[1]
    for axis in range(columns):
        out[0, axis] = points[0, axis]
    n = 1
    for k in range(len(points) - 1):
        step = Segment(points[k, 0], points[k, 1], points[k + 1, 0], points[k + 1, 1])
        x0, y0, dx, dy = step.x0, step.y0, step.x1 - step.x0, step.y1 - step.y0
        low, high = min(y0, y0 + dy), max(y0, y0 + dy)
        many = 1  # the first share stays 0
        touched = k == 0
        for e in range(rank(lows, low - tallest, False), rank(lows, high, True)):
            ax, ay, bx, by = sides[e, 0], sides[e, 1], sides[e, 2], sides[e, 3]
            side_a, side_b = orientation(step, ax, ay), orientation(step, bx, by)
            if (side_a > 0) != (side_b > 0):
                along = side_a / (side_a - side_b)
                share = ((ax + along * (bx - ax) - x0) * dx + (ay + along * (by - ay) - y0) * dy) / (dx * dx + dy * dy)
                touched = touched or -SNAP <= share <= 1.0 + SNAP
                if SNAP < share < 1.0 - SNAP:
                    shares[many] = share
                    many += 1
        if n + many > len(out):
            return -1
        sort(shares, 1, many)
        shares[many] = 1.0
        for s in range(many):
            if touched:
                middle = 0.5 * (shares[s] + shares[s + 1])
                within = inside(sides, x0 + middle * dx, y0 + middle * dy)
            for axis in range(columns):
                out[n, axis] = points[k, axis] + shares[s + 1] * (points[k + 1, axis] - points[k, axis])
            marks[n - 1] = within
            n += 1
        for axis in range(columns):
            out[n - 1, axis] = points[k + 1, axis]
    return n
