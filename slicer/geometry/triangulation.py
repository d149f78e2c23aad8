"""Constrained Delaunay triangulation of polygons: arbitrary triangles whose inner sides are flipped (Lawson 1977)."""

from collections.abc import Sequence
from typing import NamedTuple

import manifold3d
import numpy as np

from mdp.kernels.arrays import flags, ints, longs
from mdp.kernels.kernel import kernel, no_nrt
from mdp.mesh import Floats, Indices, Ints
from mdp.topology.edges import opposites
from slicer.geometry.polyline import Segment, orientation

ROUNDING = 1e-14  # share of the summed terms: ten times their error
MOST_FLIPS = 2000  # per side; a straight strip of 2 m needs 500, most polygons one; rounding must not make it endless


class Triangulation(NamedTuple):
    """Triangulation. points: (n, 2) mm. Half-edge 3 t + k runs from the point tails[3 t + k] of triangle t to its next one.

    tails: (3 m,) counter-clockwise in every triangle; across: (3 m,) the opposite half-edge, -1 on the boundary. piece: (n,) the
    piece of each point.
    """

    points: Floats
    tails: Ints
    across: Ints
    piece: Indices


@no_nrt
def after(h: int) -> int:
    """The next half-edge of the same triangle."""
    return h - 2 if h % 3 == 2 else h + 1


@no_nrt
def before(h: int) -> int:
    """The previous half-edge of the same triangle."""
    return h + 2 if h % 3 == 0 else h - 1


def triangulate(pieces: Sequence[Sequence[Floats]], step_mm: float = np.inf) -> Triangulation | None:
    """The Delaunay triangulation of several polygons, each given by its contours (k, 2) and triangulated separately; None if none
    has an area. step_mm: greatest length of a side; points are added to longer sides after the triangulation, which takes a
    fraction of the time.
    """
    loops = [loop for piece in pieces for loop in piece]
    sizes = [sum(map(len, piece)) for piece in pieces]
    rows = zip(pieces, np.cumsum([0, *sizes]), strict=False)
    apart = [np.asarray(manifold3d.triangulate(list(piece))) + begin for piece, begin in rows if piece]
    triangles = np.concatenate([np.zeros((0, 3)), *apart]).astype(np.int32)
    if not len(triangles):
        return None
    points, first, between = resample(np.concatenate(loops), np.cumsum([0, *map(len, loops)]), step_mm)
    tails, across = _with_samples(triangles.ravel(), opposites(triangles), first, between)
    triangulation = Triangulation(points, tails, across, np.repeat(np.repeat(np.arange(len(pieces)), sizes), between + 1))
    _flip(triangulation)
    return triangulation


def resample(points: Floats, starts: Indices, step_mm: float) -> tuple[Floats, Indices, Indices]:
    """The points of consecutive loops with samples added so that no side is longer than the step.

    points: (n, 2); starts: (k + 1,). Returns all points (m, 2), the index of each original point among them, and the number of
    samples after each.
    """
    following = np.arange(1, len(points) + 1)
    following[starts[1:] - 1] = starts[:-1]
    sides = points[following] - points
    between = np.maximum(np.ceil(np.hypot(*sides.T) / step_mm).astype(np.int64), 1) - 1
    first = np.cumsum(between + 1) - between - 1
    at = np.repeat(np.arange(len(points)), between + 1)
    share = (np.arange(len(at)) - first[at]) / (between[at] + 1)
    return points[at] + share[:, None] * sides[at], first, between


@kernel
def _with_samples(corners: Ints, across: Ints, first: Indices, between: Indices) -> tuple[Ints, Ints]:
    """Tails and opposites of triangles whose sides on the boundary are split at samples.

    corners, across: (3 m,) of the triangles of the original points; first: index of each of these among all points; between:
    number of samples after it. A sample splits the triangle on its side in two, towards the opposite corner.
    """
    size = len(corners)
    tails, twins = ints(size + 3 * int(between.sum()), -1), ints(size + 3 * int(between.sum()), -1)
    on_side = longs(len(first), -1)  # the boundary half-edge that begins at each original point
    for h in range(size):
        tails[h], twins[h] = first[corners[h]], across[h]
        if across[h] < 0:
            on_side[corners[h]] = h
    own = longs(len(tails), -1)  # the original point at which a boundary half-edge begins
    for point in range(len(first)):
        if on_side[point] >= 0:
            own[on_side[point]] = point
    for point in range(len(first)):
        h = on_side[point]
        for k in range(between[point] if h >= 0 else 0):
            onward, back = after(h), before(h)
            tails[size], tails[size + 1], tails[size + 2] = first[point] + 1 + k, tails[onward], tails[back]
            twins[size + 1], twins[size + 2] = twins[onward], onward
            if twins[onward] >= 0:
                twins[twins[onward]] = size + 1
            elif own[onward] >= 0:
                own[size + 1] = own[onward]
                on_side[own[onward]] = size + 1
                own[onward] = -1
            tails[onward], twins[onward] = first[point] + 1 + k, size + 2
            h = size
            size += 3
    return tails, twins


@no_nrt
def doubled_area(points: Floats, a: int, b: int, c: int) -> float:
    """Twice the signed area of a triangle of three points."""
    return orientation(Segment(points[a, 0], points[a, 1], points[b, 0], points[b, 1]), points[c, 0], points[c, 1])


@no_nrt
def _inside_circle(points: Floats, a: int, b: int, c: int, p: int) -> bool:
    """Whether p lies clearly inside the circle through a, b, c (counter-clockwise)."""
    x, y = points[p, 0], points[p, 1]
    ax, ay, bx, by = points[a, 0] - x, points[a, 1] - y, points[b, 0] - x, points[b, 1] - y
    cx, cy = points[c, 0] - x, points[c, 1] - y
    a2, b2, c2 = ax * ax + ay * ay, bx * bx + by * by, cx * cx + cy * cy
    bc, ca, ab = bx * cy - by * cx, cx * ay - cy * ax, ax * by - ay * bx
    # error bound (Shewchuk 1997, section 4.4): with four points on one circle no side may flip forever
    size = a2 * (abs(bx * cy) + abs(by * cx)) + b2 * (abs(cx * ay) + abs(cy * ax)) + c2 * (abs(ax * by) + abs(ay * bx))
    return bool(a2 * bc + b2 * ca + c2 * ab > ROUNDING * size)


@kernel
def _flip(triangulation: Triangulation) -> int:
    """Flip inner sides in place until every one is locally Delaunay; returns the number of flips."""
    points, tails, across, _ = triangulation
    waiting, stack, queued = len(tails), longs(len(tails), 0), flags(len(tails))
    for k in range(len(tails)):
        stack[k], queued[k] = len(tails) - 1 - k, True
    flips = 0
    while waiting > 0 and flips < MOST_FLIPS * len(tails):
        waiting -= 1
        a = stack[waiting]
        queued[a] = False
        b = across[a]
        if b < 0:
            continue
        a_prev, b_prev = before(a), before(b)
        p, q, r, s = tails[a], tails[b], tails[a_prev], tails[b_prev]
        if not _inside_circle(points, p, q, r, s):
            continue
        if doubled_area(points, s, q, r) <= 0.0 or doubled_area(points, r, p, s) <= 0.0:
            continue
        outer_a, outer_b = across[a_prev], across[b_prev]
        tails[a], tails[b] = s, r
        across[a], across[b] = outer_b, outer_a
        if outer_b >= 0:
            across[outer_b] = a
        if outer_a >= 0:
            across[outer_a] = b
        across[a_prev], across[b_prev] = b_prev, a_prev
        flips += 1
        for t in (a - a % 3, b - b % 3):
            for h in range(t, t + 3):
                if not queued[h]:
                    queued[h], stack[waiting] = True, h
                    waiting += 1
    return flips
