"""Loop: a closed polyline in space and the triangles that fill it."""

import numpy as np
from numpy.typing import NDArray

from mdp.mesh import Floats


def fan_is_sound(points: Floats) -> bool:
    """Whether the fan about the first of the (n, 3) corners turns the same way everywhere, as that of a convex polygon does."""
    spokes = points[1:] - points[0]
    crosses = np.cross(spokes[:-1], spokes[1:])
    return bool((crosses @ crosses.sum(axis=0) >= 0).all())


def filled(points: Floats) -> NDArray[np.int64]:
    """(n - 2, 3) triangles of least total area over the (n, 3) corners, wound like the loop.

    Dynamic programming over the loop's chords: G. T. Klincsek, Minimal triangulations of polygonal domains (1980); O(n^3).
    """
    n = len(points)
    if n > LONGEST:
        raise ValueError(f"a loop of {n} corners")
    cost = np.zeros((n, n))
    split = np.zeros((n, n), dtype=np.int64)
    for span in range(2, n):
        first = np.arange(n - span)
        last = first + span
        middle = first[:, None] + np.arange(1, span)[None, :]
        a, b, c = points[first][:, None], points[middle], points[last][:, None]
        area = 0.5 * np.linalg.norm(np.cross(b - a, c - a), axis=2)
        total = cost[first[:, None], middle] + cost[middle, last[:, None]] + area
        best = total.argmin(axis=1)
        split[first, last] = middle[first, best]
        cost[first, last] = total[first, best]
    triangles, pending = [], [(0, n - 1)]
    while pending:
        first_corner, last_corner = pending.pop()
        if last_corner - first_corner >= 2:
            between = int(split[first_corner, last_corner])
            triangles.append((first_corner, between, last_corner))
            pending += [(between, last_corner), (first_corner, between)]
    return np.array(triangles, dtype=np.int64)


LONGEST = 400  # corners; the table of chords grows with the square and the work with the cube of it
