"""Edge index: the edges of polygons sorted into a grid of square cells, so that a query visits only the few edges near it.

It finds the crossings of a segment with edges, whether a point lies inside, the nearest edge, and the depth of points inside. All
queries treat a point on an edge in the same way (slicer.geometry.polyline): no crossing is counted twice or missed at a vertex.
"""

from math import inf, sqrt
from typing import NamedTuple

import numpy as np

from mdp.kernels.arrays import floats, longs
from mdp.kernels.kernel import helper, kernel, no_nrt
from mdp.kernels.sorting import sort_into_bins
from mdp.mesh import Floats, Indices
from mdp.overhang import Mask
from mdp.topology.cross_section import loop_edges
from slicer.geometry.polygons import Polygons, contours
from slicer.geometry.polyline import Segment, crossing, edge, level_crossing, nearest_share, squared_distance

MARGIN_MM = 1e-6  # by which an edge extends into neighbouring cells, so that rounding never hides it
FARTHEST_MM = 1e7  # limit of the search for the nearest edge


class Grid(NamedTuple):
    """Square cells of size_mm, row by row from the corner x, y."""

    x: float
    y: float
    size_mm: float
    columns: int
    rows: int


class EdgeIndex(NamedTuple):
    """Edges sorted into a grid. edges: (n, 4) x0 y0 x1 y1, loop by loop; loop: (n,) number of an edge's loop; begins: start of
    each loop, and n.

    Cell c of row r of the grid holds the edges items[first[r * columns + c] : first[r * columns + c + 1]].
    """

    edges: Floats
    loop: Indices
    begins: Indices
    grid: Grid
    first: Indices
    items: Indices


def index_edges(polygons: Polygons) -> EdgeIndex:
    """The edges of all contours, about one edge per cell."""
    loops = contours(polygons)
    begins = np.cumsum([0, *(len(loop) for loop in loops)]).astype(np.int64)
    return _index(loop_edges(loops), np.repeat(np.arange(len(loops), dtype=np.int64), np.diff(begins)), begins)


def index_segments(segments: Floats) -> EdgeIndex:
    """Index of segments (n, 4) without an inside, for nearest-edge queries."""
    return _index(segments, np.zeros(len(segments), np.int64), np.array([0, len(segments)]))


@kernel
def _index(edges: Floats, loop: Indices, begins: Indices) -> EdgeIndex:
    x0, y0, x1, y1 = 1e9, 1e9, -1e9, -1e9
    for e in range(len(edges)):
        x0, x1 = min(x0, edges[e, 0], edges[e, 2]), max(x1, edges[e, 0], edges[e, 2])
        y0, y1 = min(y0, edges[e, 1], edges[e, 3]), max(y1, edges[e, 1], edges[e, 3])
    x0, y0 = x0 - 1.0, y0 - 1.0
    wide, deep = max(x1 + 1.0 - x0, 1.0), max(y1 + 1.0 - y0, 1.0)
    size = max(sqrt(wide * deep / max(len(edges), 1)), max(wide, deep) / 1000.0)
    grid = Grid(x0, y0, size, int(wide / size) + 1, int(deep / size) + 1)
    first, items = _into_cells(edges, grid)
    return EdgeIndex(edges, loop, begins, grid, first, items)


@helper
def _cells(grid: Grid, r: int, segment: Segment) -> tuple[int, int]:
    """First and last cell that a segment touches in a row; the last is less than the first if there is none."""
    x0, y0, x1, y1 = segment
    low, high = grid.y + r * grid.size_mm - MARGIN_MM, grid.y + r * grid.size_mm + grid.size_mm + MARGIN_MM
    bottom, top = min(y0, y1), max(y0, y1)
    if bottom > high or top < low:
        return 1, 0
    left, right = min(x0, x1), max(x0, x1)
    if top > bottom:
        slope = (x1 - x0) / (y1 - y0)
        a, b = x0 + (max(low, bottom) - y0) * slope, x0 + (min(high, top) - y0) * slope
        left, right = max(left, min(a, b)), min(right, max(a, b))
    first, last = int((left - MARGIN_MM - grid.x) / grid.size_mm), int((right + MARGIN_MM - grid.x) / grid.size_mm)
    return r * grid.columns + max(first, 0), r * grid.columns + min(last, grid.columns - 1)


@helper
def _rows(grid: Grid, y0: float, y1: float) -> tuple[int, int]:
    """First and last row touched by an interval of heights."""
    first, last = int((min(y0, y1) - MARGIN_MM - grid.y) / grid.size_mm), int((max(y0, y1) + MARGIN_MM - grid.y) / grid.size_mm)
    return max(first, 0), min(last, grid.rows - 1)


@helper
def _into_cells(edges: Floats, grid: Grid) -> tuple[Indices, Indices]:
    """The `first` and `items` of an EdgeIndex. An edge is a run of cells in every row that it touches."""
    many = 0
    for e in range(len(edges)):
        low, high = _rows(grid, edges[e, 1], edges[e, 3])
        many += high - low + 1
    begin, end, owner = longs(many, 0), longs(many, 0), longs(many, 0)
    n = 0
    for e in range(len(edges)):
        low, high = _rows(grid, edges[e, 1], edges[e, 3])
        for r in range(low, high + 1):
            begin[n], end[n] = _cells(grid, r, edge(edges, e))
            owner[n] = e
            n += 1
    first, items = sort_into_bins(begin, end, grid.columns * grid.rows)
    for k in range(len(items)):
        items[k] = owner[items[k]]
    return first, items


@helper
def _near(index: EdgeIndex, r: int, segment: Segment) -> tuple[int, int]:
    """The range of items in the cells that a segment touches in a row: start and end."""
    a, b = _cells(index.grid, r, segment)
    return (index.first[a], index.first[b + 1]) if a <= b else (0, 0)


@helper
def crossings(index: EdgeIndex, segment: Segment, shares: Floats, crossed: Indices) -> int:
    """Fill in the positions (0..1, ascending) and edges at which a segment crosses edges; returns their number, -1 if the arrays
    are too small.
    """
    low, high = _rows(index.grid, segment.y0, segment.y1)
    n = 0
    for r in range(low, high + 1):
        begin, end = _near(index, r, segment)
        for k in range(begin, end):
            e = index.items[k]
            share = crossing(segment, edge(index.edges, e))
            known = share < 0.0
            for i in range(n):
                known = known or crossed[i] == e
            if known:
                continue
            if n == len(shares):
                return -1
            i = n
            while i > 0 and (shares[i - 1] > share or (shares[i - 1] == share and crossed[i - 1] > e)):
                shares[i], crossed[i] = shares[i - 1], crossed[i - 1]
                i -= 1
            shares[i], crossed[i] = share, e
            n += 1
    return n


@helper
def free(index: EdgeIndex, segment: Segment) -> bool:
    """Whether a segment crosses no edge."""
    low, high = _rows(index.grid, segment.y0, segment.y1)
    for r in range(low, high + 1):
        begin, end = _near(index, r, segment)
        for k in range(begin, end):
            if crossing(segment, edge(index.edges, index.items[k])) >= 0.0:
                return False
    return True


@no_nrt
def within(index: EdgeIndex, x: float, y: float) -> bool:
    """Whether a point lies in the polygons, by the edges that a ray to the right crosses, each counted in one cell."""
    grid = index.grid
    row, column = int((y - grid.y) / grid.size_mm), max(int((x - grid.x) / grid.size_mm), 0)
    if y < grid.y or row >= grid.rows:
        return False
    odd = False
    for c in range(column, grid.columns):
        cell = row * grid.columns + c
        for k in range(index.first[cell], index.first[cell + 1]):
            cut = level_crossing(edge(index.edges, index.items[k]), y)
            if cut > x and int((cut - grid.x) / grid.size_mm) == c:
                odd = not odd
    return odd


@helper
def nearest(index: EdgeIndex, x: float, y: float, reach: float) -> tuple[float, float, int]:
    """The nearest point of any edge within reach, and its edge; edge -1 if there is none."""
    grid = index.grid
    best, which, nx, ny = reach, -1, x, y
    low, high = _rows(grid, y - reach, y + reach)
    left = max(int((x - reach - grid.x) / grid.size_mm), 0)
    right = min(int((x + reach - grid.x) / grid.size_mm), grid.columns - 1)
    for r in range(low, high + 1):
        for c in range(r * grid.columns + left, r * grid.columns + right + 1):
            for k in range(index.first[c], index.first[c + 1]):
                side = edge(index.edges, index.items[k])
                share = nearest_share(side, x, y)
                px, py = side.x0 + share * (side.x1 - side.x0), side.y0 + share * (side.y1 - side.y0)
                distance = np.hypot(px - x, py - y)
                if distance < best:
                    best, which, nx, ny = distance, index.items[k], px, py
    return nx, ny, which


@kernel
def crosses(index: EdgeIndex, since: Floats, to: Floats) -> Mask:
    """(n,) whether the segments between (n, 2) points cross any edge."""
    out = np.empty(len(to), np.bool_)
    for k in range(len(to)):
        out[k] = not free(index, Segment(since[k, 0], since[k, 1], to[k, 0], to[k, 1]))
    return out


@kernel
def lie_within(index: EdgeIndex, points: Floats) -> Mask:
    """(n,) whether (n, 2) points lie in the polygons."""
    out = np.empty(len(points), np.bool_)
    for k in range(len(points)):
        out[k] = within(index, points[k, 0], points[k, 1])
    return out


@kernel
def depths(points: Floats, index: EdgeIndex) -> Floats:
    """(n,) distance from points (n, 2) to the nearest edge, mm, negative outside the polygons; -inf without edges."""
    out: Floats = floats(len(points), -inf)
    for k in range(len(points) if len(index.edges) else 0):
        x, y = points[k, 0], points[k, 1]
        reach, which = index.grid.size_mm, -1
        while which < 0 and reach < FARTHEST_MM:
            _, _, which = nearest(index, x, y, reach)
            reach *= 2.0
        distance = sqrt(squared_distance(edge(index.edges, which), x, y)) if which >= 0 else inf
        out[k] = distance if within(index, x, y) else -distance
    return out
