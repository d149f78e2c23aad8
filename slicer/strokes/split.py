"""Split: strokes of a layer parted where they enter and leave an area, so that they are printed otherwise there."""

from dataclasses import replace
from typing import NamedTuple

import numpy as np

from mdp.kernels.arrays import flags, floats, longs, table
from mdp.kernels.kernel import helper, kernel
from mdp.mesh import Floats, Indices
from mdp.overhang import Mask
from slicer.geometry.edge_index import EdgeIndex, crossings, index_edges, within
from slicer.geometry.polygons import Polygons
from slicer.geometry.segments import Segment
from slicer.strokes.strokes import Strokes

SNAP = 1e-6  # of a step's length: a crossing so near its end is at its end


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
    index = index_edges(area)
    count, room = -1, 2 * len(strokes.points) + 64
    while count < 0:
        pieces = _Pieces(np.empty((room, 3)), np.empty(room, np.int64), np.empty(room, np.int64), np.empty(room, np.bool_))
        count = _split(strokes.points, strokes.starts, wanted, index, shortest_mm, pieces)
        room *= 4
    starts, source = pieces.starts[: count + 1].copy(), pieces.source[:count]
    out = strokes.refined(pieces.points[: starts[-1]].copy(), starts, source)
    is_whole = np.bincount(source, minlength=len(strokes))[source] == 1
    return replace(out, small=out.small & (is_whole | out.varies)), pieces.within[:count].copy()


@kernel
def _split(points: Floats, starts: Indices, wanted: Mask, area: EdgeIndex, shortest_mm: float, out: _Pieces) -> int:
    """Fills in the pieces and returns how many there are, -1 where there is no room for them."""
    room = len(out.points)
    cut, within = table(room, 3), flags(room)
    count = n = 0
    out.starts[0] = 0
    for k in range(len(starts) - 1):
        a, b = starts[k], starts[k + 1]
        size = 0
        if wanted[k]:
            size = _cut_into(points[a:b], area, cut, within)
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


def cut_line(points: Floats, area: Polygons) -> tuple[Floats, Mask]:
    """The polyline (n, 2) with the places added where it enters and leaves an area, and which steps lie within."""
    index, size, room = index_edges(area), -1, 2 * len(points) + 64
    while size < 0:
        out, marks = np.empty((room, 2)), np.empty(room, np.bool_)
        size = _cut(points, index, out, marks)
        room *= 4
    return out[:size], marks[: size - 1]


@kernel
def _cut(points: Floats, area: EdgeIndex, out: Floats, marks: Mask) -> int:
    return _cut_into(points, area, out, marks)


@helper
def _cut_into(points: Floats, area: EdgeIndex, out: Floats, marks: Mask) -> int:
    """Fills in the points and which steps lie within; returns how many points there are, -1 where there is no room for them.

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
