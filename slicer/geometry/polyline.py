"""Polylines: length and simplification, singly or in tables, and the predicates of segments for kernels: orientation, crossing,
nearest point.

A point on a line counts as on its right side, and a point at the height of an edge's end as below it, for all edges that meet
there: so no crossing is counted twice or missed at a vertex.
"""

from math import inf
from typing import Any, NamedTuple

import numpy as np

from mdp.kernels.arrays import flags, floats
from mdp.kernels.kernel import kernel, no_nrt
from mdp.mesh import Floats, Indices
from mdp.overhang import Mask

SHORT_MM = 0.25  # corners of a path that are closer together slow a printer down


class Segment(NamedTuple):
    """A straight line from x0, y0 to x1, y1."""

    x0: float
    y0: float
    x1: float
    y1: float


@no_nrt
def edge(edges: Floats, e: int) -> Segment:
    """One of (n, 4) edges x0 y0 x1 y1."""
    return Segment(edges[e, 0], edges[e, 1], edges[e, 2], edges[e, 3])


@no_nrt
def orientation(line: Segment, x: float, y: float) -> float:
    """Twice the signed area of the triangle of a line's two points and a third point: positive if that lies to the left."""
    return float((line.x1 - line.x0) * (y - line.y0) - (line.y1 - line.y0) * (x - line.x0))


@no_nrt
def crossing(segment: Segment, crossed: Segment) -> float:
    """Position (0..1) at which a segment crosses another one; -1 if it does not."""
    if (orientation(segment, crossed.x0, crossed.y0) > 0.0) == (orientation(segment, crossed.x1, crossed.y1) > 0.0):
        return -1.0
    start, end = orientation(crossed, segment.x0, segment.y0), orientation(crossed, segment.x1, segment.y1)
    if (start > 0.0) == (end > 0.0):
        return -1.0
    return float(start / (start - end))


@no_nrt
def clamp_projection(along: float, square: float) -> float:
    """Position (0..1) on a segment of its point nearest to another point.

    along: product of the vectors from the segment's start to the point and to its end; square: squared length of the segment.
    """
    return min(max(along / square, 0.0), 1.0) if square > 0.0 else 0.0


@no_nrt
def nearest_share(segment: Segment, x: float, y: float) -> float:
    """Position (0..1) on a segment of its point nearest to x, y."""
    dx, dy = segment.x1 - segment.x0, segment.y1 - segment.y0
    return clamp_projection((x - segment.x0) * dx + (y - segment.y0) * dy, dx * dx + dy * dy)


@no_nrt
def squared_distance(segment: Segment, x: float, y: float) -> float:
    """Squared distance between a point and a segment."""
    share = nearest_share(segment, x, y)
    px, py = x - segment.x0, y - segment.y0
    return float((px - share * (segment.x1 - segment.x0)) ** 2 + (py - share * (segment.y1 - segment.y0)) ** 2)


@no_nrt
def squared_distance_in_space(p: Any, a: Any, b: Any) -> float:
    """Squared distance in space between a point and the segment from a to b, each with three coordinates."""
    dx, dy, dz = b[0] - a[0], b[1] - a[1], b[2] - a[2]
    x, y, z = p[0] - a[0], p[1] - a[1], p[2] - a[2]
    share = clamp_projection(x * dx + y * dy + z * dz, dx * dx + dy * dy + dz * dz)
    x, y, z = x - share * dx, y - share * dy, z - share * dz
    return float(x * x + y * y + z * z)


@no_nrt
def level_crossing(segment: Segment, y: float) -> float:
    """The x at which a segment crosses the height y, for even-odd tests; -inf if it does not."""
    if (segment.y0 > y) == (segment.y1 > y):
        return -inf
    return float(segment.x0 + (y - segment.y0) / (segment.y1 - segment.y0) * (segment.x1 - segment.x0))


def near_height(segments: Floats, z_mm: float, reach_mm: float) -> Floats:
    """The (n, 6) segments in space that come within a distance of a height."""
    off = segments[:, [2, 5]] - z_mm
    near: Floats = segments[(off.min(axis=1) < reach_mm) & (off.max(axis=1) > -reach_mm)]
    return near


@kernel
def length_mm(points: Floats) -> float:
    """Length of a polyline (n, 2 or more) projected to the plane, mm."""
    return length_between(points, 0, len(points))


def along_mm(points: Floats) -> Floats:
    """(n,) distance along a polyline (n, 2 or more), projected to the plane, to each of its points, mm."""
    return np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(points[:, :2], axis=0).T))])


@kernel
def lengths_mm(points: Floats, starts: Indices) -> Floats:
    """(k,) lengths of consecutive polylines projected to the plane, mm. points: (n, 2 or more); starts: (k + 1,)."""
    out: Floats = floats(len(starts) - 1, 0.0)
    for k in range(len(out)):
        out[k] = length_between(points, starts[k], starts[k + 1])
    return out


@no_nrt
def length_between(points: Floats, first: int, end: int) -> float:
    """Length of the polyline of a range of points, projected to the plane."""
    total = 0.0
    for i in range(first + 1, end):
        total += np.hypot(points[i, 0] - points[i - 1, 0], points[i, 1] - points[i - 1, 1])
    return total


@kernel
def mark_corners(points: Floats, starts: Indices, tolerance_mm: float) -> Mask:
    """(n,) mask of the points that simplified polylines keep (Douglas and Peucker 1973); the chord of a loop is its first point.

    Two points closer than SHORT_MM are replaced by a single point where that suffices. points: (n, 2 or more), one polyline after
    the other; starts: (k + 1,).
    """
    corner: Mask = flags(len(points))
    for k in range(len(starts) - 1):
        corner[starts[k]], corner[starts[k + 1] - 1] = True, True
        stack = [(starts[k], starts[k + 1] - 1)]
        while len(stack):
            a, b = stack.pop()
            at = _farthest(points, a, b, tolerance_mm)
            if at >= 0:
                corner[at] = True
                stack.append((a, at))
                stack.append((at, b))
        _join_near_corners(points, corner, starts[k], starts[k + 1] - 1, tolerance_mm)
    return corner


@no_nrt
def _farthest(points: Floats, a: int, b: int, tolerance_mm: float) -> int:
    """The point between two others farthest from their chord; -1 if none is beyond the tolerance."""
    chord = Segment(points[a, 0], points[a, 1], points[b, 0], points[b, 1])
    farthest, at = tolerance_mm * tolerance_mm, -1
    for i in range(a + 1, b):
        away = squared_distance(chord, points[i, 0], points[i, 1])
        if away > farthest:
            farthest, at = away, i
    return at


@no_nrt
def _join_near_corners(points: Floats, corner: Mask, first: int, last: int, tolerance_mm: float) -> None:
    """Replace close pairs of corners of a polyline first .. last by one point, where that suffices."""
    before, p = first, _next_corner(corner, first) if last > first else last
    while p < last:
        q = _next_corner(corner, p)
        if q == last:
            break
        joined = -1
        if np.hypot(points[q, 0] - points[p, 0], points[q, 1] - points[p, 1]) < SHORT_MM:
            after = _next_corner(corner, q)
            for m in range(p, q + 1):
                if _farthest(points, before, m, tolerance_mm) < 0 and _farthest(points, m, after, tolerance_mm) < 0:
                    joined = m
                    break
        if joined < 0:
            before, p = p, q
            continue
        corner[p], corner[q] = False, False
        corner[joined] = True
        p = joined


@no_nrt
def _next_corner(corner: Mask, at: int) -> int:
    """The next point that is kept; the last point of a polyline is always kept."""
    at += 1
    while not corner[at]:
        at += 1
    return at


@kernel
def lengthen_steps(points: Floats, starts: Indices, shortest_mm: Floats, most_mm: Floats) -> tuple[Floats, Mask]:
    """Polylines without steps shorter than shortest_mm, unless a point would move by more than most_mm; and (n,) mask of
    remaining points.

    One end of a short step moves back along the adjacent step, or is dropped with it, whichever moves the line less. First and
    last points stay. points: (n, 2 or more), consecutive polylines; shortest_mm, most_mm: (k,); shortest_mm 0 leaves a polyline
    unchanged.
    """
    out, left, fixed = points.copy(), flags(len(points)), flags(len(points))
    for k in range(len(starts) - 1):
        a, b, last = -1, starts[k], starts[k + 1] - 1
        left[b] = fixed[b] = fixed[last] = True
        while b < last:
            c = b + 1
            left[c] = True
            if shortest_mm[k] <= 0.0 or np.hypot(out[c, 0] - out[b, 0], out[c, 1] - out[b, 1]) >= shortest_mm[k]:
                a, b = b, c
                continue
            back = _drawn_back(out, (a, b, c), fixed, shortest_mm[k]) if a >= 0 else (np.inf, 0.0)
            on = _drawn_back(out, (c + 1, c, b), fixed, shortest_mm[k]) if c < last else (np.inf, 0.0)
            if min(back[0], on[0]) > most_mm[k]:
                a, b = b, c
                continue
            moved, towards, share = (b, a, back[1]) if back[0] <= on[0] else (c, c + 1, on[1])
            if share < 1.0:
                fixed[moved] = True
                out[moved, 0] += share * (out[towards, 0] - out[moved, 0])
                out[moved, 1] += share * (out[towards, 1] - out[moved, 1])
                a, b = b, c
                continue
            left[moved] = False
            fixed[b if moved == c else c] = fixed[towards] = True
            if moved == c:
                left[towards] = True
                a, b = b, towards
            else:
                b = c
    return out, left


@no_nrt
def _drawn_back(points: Floats, ends: tuple[int, int, int], fixed: Mask, shortest_mm: float) -> tuple[float, float]:
    """Deviation of the line a, b, c if b moves towards a until the step to c is long enough, and the share of the way.

    Share 1 drops b. The deviation is infinite if a step would become shorter or a fixed point would move.
    """
    a, b, c = ends
    ux, uy = points[a, 0] - points[b, 0], points[a, 1] - points[b, 1]
    vx, vy = points[b, 0] - points[c, 0], points[b, 1] - points[c, 1]
    square, along = ux * ux + uy * uy, ux * vx + uy * vy
    short = vx * vx + vy * vy - shortest_mm * shortest_mm
    if fixed[b] or square <= 0.0:
        return np.inf, 0.0
    share = (np.sqrt(max(along * along - square * short, 0.0)) - along) / square
    if (1.0 - share) * np.sqrt(square) < shortest_mm:
        if np.hypot(points[a, 0] - points[c, 0], points[a, 1] - points[c, 1]) < shortest_mm:
            return np.inf, 0.0
        share = 1.0
    to = Segment(points[b, 0] + share * ux, points[b, 1] + share * uy, points[c, 0], points[c, 1])
    return np.sqrt(squared_distance(to, points[b, 0], points[b, 1])), share
