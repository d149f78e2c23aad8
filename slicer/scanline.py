"""Scanlines: parallel lines clipped to polygons by the even-odd rule, and their joining into zigzags."""

import numpy as np
from numba import njit
from numpy.typing import NDArray

from mdp.mesh import Floats


@njit(cache=True)
def clipped(edges: Floats, heights: Floats) -> Floats:
    """Horizontal lines at rising `heights` clipped to polygons given by their (n, 4) edges.

    Returns (m, 4) rows: left x, right x, y, number of the line; lines in order, each from left to right.
    """
    offsets = np.zeros(len(heights) + 1, np.int64)
    first, last = np.empty(len(edges), np.int64), np.empty(len(edges), np.int64)
    for e in range(len(edges)):
        first[e] = np.searchsorted(heights, min(edges[e, 1], edges[e, 3]))
        last[e] = np.searchsorted(heights, max(edges[e, 1], edges[e, 3]))
        for k in range(first[e], last[e]):
            offsets[k + 1] += 1
    offsets = np.cumsum(offsets)
    crossing = np.empty(offsets[-1])
    place = offsets.copy()
    for e in range(len(edges)):
        slope = (edges[e, 2] - edges[e, 0]) / (edges[e, 3] - edges[e, 1]) if edges[e, 3] != edges[e, 1] else 0.0
        for k in range(first[e], last[e]):
            crossing[place[k]] = edges[e, 0] + slope * (heights[k] - edges[e, 1])
            place[k] += 1
    rows = np.empty((offsets[-1] // 2, 4))
    n = 0
    for k in range(len(heights)):
        across = np.sort(crossing[offsets[k] : offsets[k + 1]])
        for i in range(0, len(across) - 1, 2):
            rows[n] = np.array([across[i], across[i + 1], heights[k], float(k)])
            n += 1
    return rows[:n]


@njit(cache=True)
def crossed(edges: Floats, x0: float, y0: float, x1: float, y1: float) -> bool:
    """Whether the segment crosses any of the (n, 4) edges."""
    left, right, low, high = min(x0, x1), max(x0, x1), min(y0, y1), max(y0, y1)
    for e in range(len(edges)):
        ax, ay, bx, by = edges[e]
        if max(ax, bx) < left or min(ax, bx) > right or max(ay, by) < low or min(ay, by) > high:
            continue
        side_a = (x1 - x0) * (ay - y0) - (y1 - y0) * (ax - x0)
        side_b = (x1 - x0) * (by - y0) - (y1 - y0) * (bx - x0)
        if (side_a > 0) == (side_b > 0):
            continue
        side_0 = (bx - ax) * (y0 - ay) - (by - ay) * (x0 - ax)
        side_1 = (bx - ax) * (y1 - ay) - (by - ay) * (x1 - ax)
        if (side_0 > 0) != (side_1 > 0):
            return True
    return False


@njit(cache=True)
def inside(edges: Floats, x: float, y: float) -> bool:
    """Whether a point lies in the polygons of (n, 4) edges."""
    odd = False
    for e in range(len(edges)):
        if (edges[e, 1] > y) != (edges[e, 3] > y):
            share = (y - edges[e, 1]) / (edges[e, 3] - edges[e, 1])
            if edges[e, 0] + share * (edges[e, 2] - edges[e, 0]) > x:
                odd = not odd
    return odd


@njit(cache=True)
def all_inside(edges: Floats, points: Floats) -> bool:
    """Whether every point (n, 2) lies in the polygons of (n, 4) edges."""
    k = 0
    while k < len(points) and inside(edges, points[k, 0], points[k, 1]):
        k += 1
    return k == len(points)


@njit(cache=True)
def joined(rows: Floats, fence: Floats, reach_mm: float) -> tuple[Floats, NDArray[np.int64]]:
    """Clipped lines joined end to end where a neighbouring line begins within reach and no fence edge lies between.

    rows: as of clipped(); fence: (n, 4) edges. Returns points (n, 2) and the start of each polyline in them.
    """
    lines = int(rows[-1, 3]) + 2 if len(rows) else 0
    begin = np.zeros(lines + 1, np.int64)
    for r in range(len(rows)):
        begin[int(rows[r, 3]) + 1] += 1
    begin = np.cumsum(begin)
    points = np.empty((2 * len(rows), 2))
    starts = np.empty(len(rows), np.int64)
    used = np.zeros(len(rows), np.bool_)
    n = count = 0
    for seed in range(len(rows)):
        if used[seed]:
            continue
        starts[count] = n
        count += 1
        at, side = seed, 1
        while at >= 0:
            used[at] = True
            y = rows[at, 2]
            points[n] = rows[at, 1 - side], y
            points[n + 1] = rows[at, side], y
            n += 2
            x, line = rows[at, side], int(rows[at, 3]) + 1
            best, best_side, nearest = -1, 0, reach_mm
            for other in range(begin[line], begin[line + 1]):
                if used[other]:
                    continue
                for end in range(2):
                    distance = np.hypot(rows[other, end] - x, rows[other, 2] - y)
                    if distance < nearest and not crossed(fence, x, y, rows[other, end], rows[other, 2]):
                        best, best_side, nearest = other, 1 - end, distance
            at, side = best, best_side
    return points[:n], starts[:count]
