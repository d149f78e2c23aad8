"""Polylines: their length and their simplification, one by one or a table of them at once."""

import numpy as np

from mdp.kernels.arrays import flags, floats
from mdp.kernels.kernel import kernel, no_nrt
from mdp.mesh import Floats, Indices
from mdp.overhang import Mask
from slicer.geometry.segments import Segment, squared_distance

PATH_RESOLUTION_MM = 0.0125  # of paths as they are printed, the same as PrusaSlicer's resolution of G-code


def length_mm(points: Floats) -> float:
    """Length of a polyline (n, 2 or more) seen from above."""
    return float(_length(points))


@kernel
def _length(points: Floats) -> float:
    return length_between(points, 0, len(points))


@kernel
def lengths_mm(points: Floats, starts: Indices) -> Floats:
    """(k,) lengths, seen from above, of polylines one after the other; points: (n, 2 or more); starts: (k + 1,)."""
    out: Floats = floats(len(starts) - 1, 0.0)
    for k in range(len(out)):
        out[k] = length_between(points, starts[k], starts[k + 1])
    return out


@no_nrt
def length_between(points: Floats, first: int, end: int) -> float:
    """Length of the polyline of some of the points, seen from above."""
    total = 0.0
    for i in range(first + 1, end):
        total += np.hypot(points[i, 0] - points[i - 1, 0], points[i, 1] - points[i - 1, 1])
    return total


def simplify(points: Floats) -> Floats:
    """A polyline (n, 2) without points that lie within PATH_RESOLUTION_MM of the line between those that stay; its ends stay."""
    if len(points) < 3:
        return points
    corners = mark_corners(points, np.array([0, len(points)]), PATH_RESOLUTION_MM)
    return points if corners.all() else points[corners]


@kernel
def mark_corners(points: Floats, starts: Indices, tolerance_mm: float) -> Mask:
    """(n,) points that simplified polylines keep (Douglas and Peucker 1973); the chord of a loop is its first point.

    points: (n, 2 or more), one polyline after the other; starts: (k + 1,).
    """
    corner: Mask = flags(len(points))
    for k in range(len(starts) - 1):
        corner[starts[k]], corner[starts[k + 1] - 1] = True, True
        stack = [(starts[k], starts[k + 1] - 1)]
        while len(stack):
            a, b = stack.pop()
            chord = Segment(points[a, 0], points[a, 1], points[b, 0], points[b, 1])
            farthest, at = tolerance_mm * tolerance_mm, -1
            for i in range(a + 1, b):
                away = squared_distance(chord, points[i, 0], points[i, 1])
                if away > farthest:
                    farthest, at = away, i
            if at >= 0:
                corner[at] = True
                stack.append((a, at))
                stack.append((at, b))
    return corner
