"""Triangulation: the constrained Delaunay triangulation of polygons: any triangles, their inner sides flipped (Lawson 1977)."""

from collections.abc import Sequence
from typing import NamedTuple

import manifold3d
import numpy as np
from numpy.typing import NDArray

from mdp.kernels.arrays import flags, longs
from mdp.kernels.kernel import borrower, kernel
from mdp.mesh import Floats, Ints
from mdp.topology.linked_faces import opposites
from slicer.geometry.segments import Segment, orientation

Indices = NDArray[np.int64]
ROUNDING = 1e-14  # of the terms that are added up: ten times their error
MOST_FLIPS = 200  # for every side; real polygons need fewer than ten, rounding must not make it endless


class Triangulation(NamedTuple):
    """points: (n, 2) mm. Half-edge 3 t + k runs from the point tails[3 t + k] of triangle t to its next one.

    tails: (3 m,) counter-clockwise in every triangle; across: (3 m,) the half-edge on the other side, -1 on the boundary.
    """

    points: Floats
    tails: Ints
    across: Ints


def triangulate(loops: Sequence[Floats]) -> Triangulation | None:
    """The Delaunay triangulation of polygons given by their contours (k, 2); None where they have no area."""
    if not loops:
        return None
    triangles = np.asarray(manifold3d.triangulate(list(loops)), dtype=np.int32).reshape(-1, 3)
    if not len(triangles):
        return None
    triangulation = Triangulation(np.concatenate(loops), triangles.ravel().copy(), opposites(triangles))
    _flip(triangulation)
    return triangulation


@borrower
def doubled_area(points: Floats, a: int, b: int, c: int) -> float:
    """Twice the signed area of a triangle of three of the points."""
    return orientation(Segment(points[a, 0], points[a, 1], points[b, 0], points[b, 1]), points[c, 0], points[c, 1])


@borrower
def _inside_circle(points: Floats, a: int, b: int, c: int, p: int) -> bool:
    """Whether p lies clearly inside the circle through a, b, c (counter-clockwise)."""
    x, y = points[p, 0], points[p, 1]
    ax, ay, bx, by = points[a, 0] - x, points[a, 1] - y, points[b, 0] - x, points[b, 1] - y
    cx, cy = points[c, 0] - x, points[c, 1] - y
    a2, b2, c2 = ax * ax + ay * ay, bx * bx + by * by, cx * cx + cy * cy
    bc, ca, ab = bx * cy - by * cx, cx * ay - cy * ax, ax * by - ay * bx
    size = (
        a2 * (abs(bx * cy) + abs(by * cx)) + b2 * (abs(cx * ay) + abs(cy * ax)) + c2 * (abs(ax * by) + abs(ay * bx))
    )  # what rounding goes by (Shewchuk 1997, section 4.4): of four points on one circle no side must flip for ever
    return bool(a2 * bc + b2 * ca + c2 * ab > ROUNDING * size)


@kernel
def _flip(triangulation: Triangulation) -> int:
    """Flips inner sides in place until every one is locally Delaunay; returns how many times."""
    points, tails, across = triangulation
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
        a_prev, b_prev = a - a % 3 + (a + 2) % 3, b - b % 3 + (b + 2) % 3
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
