"""Scanlines: parallel lines clipped to polygons by the even-odd rule, and their joining into zigzags."""

import numpy as np
from numpy.typing import NDArray

from mdp.kernel import flags, floats, kernel, longs, part, rank, sort, table
from mdp.mesh import Floats


@kernel
def clipped(edges: Floats, heights: Floats) -> Floats:
    """Horizontal lines at rising `heights` clipped to polygons given by their (n, 4) edges.

    Returns (m, 4) rows: left x, right x, y, number of the line; lines in order, each from left to right.
    """
    offsets, place = longs(len(heights) + 1, 0), longs(len(heights) + 1, 0)
    first, last = longs(len(edges), 0), longs(len(edges), 0)
    for e in range(len(edges)):
        first[e] = rank(heights, min(edges[e, 1], edges[e, 3]), False)
        last[e] = rank(heights, max(edges[e, 1], edges[e, 3]), False)
        for k in range(first[e], last[e]):
            offsets[k + 1] += 1
    rows = 0
    for k in range(len(heights)):
        rows += offsets[k + 1] // 2
        offsets[k + 1] += offsets[k]
        place[k + 1] = offsets[k + 1]
    out: Floats = table(rows, 4)
    crossing = floats(offsets[len(heights)], 0.0)
    for e in range(len(edges)):
        slope = (edges[e, 2] - edges[e, 0]) / (edges[e, 3] - edges[e, 1]) if edges[e, 3] != edges[e, 1] else 0.0
        for k in range(first[e], last[e]):
            crossing[place[k]] = edges[e, 0] + slope * (heights[k] - edges[e, 1])
            place[k] += 1
    n = 0
    for k in range(len(heights)):
        sort(crossing, offsets[k], offsets[k + 1])
        for i in range(offsets[k], offsets[k + 1] - 1, 2):
            out[n, 0], out[n, 1], out[n, 2], out[n, 3] = crossing[i], crossing[i + 1], heights[k], float(k)
            n += 1
    return out


@part
def crossed(edges: Floats, x0: float, y0: float, x1: float, y1: float) -> bool:
    """Whether the segment crosses any of the (n, 4) edges."""
    left, right, low, high = min(x0, x1), max(x0, x1), min(y0, y1), max(y0, y1)
    for e in range(len(edges)):
        ax, ay, bx, by = edges[e, 0], edges[e, 1], edges[e, 2], edges[e, 3]
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


@part
def inside(edges: Floats, x: float, y: float) -> bool:
    """Whether a point lies in the polygons of (n, 4) edges."""
    odd = False
    for e in range(len(edges)):
        if (edges[e, 1] > y) != (edges[e, 3] > y):
            share = (y - edges[e, 1]) / (edges[e, 3] - edges[e, 1])
            if edges[e, 0] + share * (edges[e, 2] - edges[e, 0]) > x:
                odd = not odd
    return odd


@kernel
def joined(rows: Floats, fence: Floats, reach_mm: float) -> tuple[Floats, NDArray[np.int64]]:
    """Clipped lines joined end to end where a neighbouring line begins within reach and no fence edge lies between.

    rows: as of clipped(); fence: (n, 4) edges. Returns points (n, 2) and the start of each polyline in them.
    """
    lines = int(rows[len(rows) - 1, 3]) + 2 if len(rows) else 0
    begin = longs(lines + 1, 0)
    for r in range(len(rows)):
        begin[int(rows[r, 3]) + 1] += 1
    for line in range(lines):
        begin[line + 1] += begin[line]
    points, starts, used = table(2 * len(rows), 2), longs(len(rows), 0), flags(len(rows))
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
            points[n, 0], points[n, 1] = rows[at, 1 - side], y
            points[n + 1, 0], points[n + 1, 1] = rows[at, side], y
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
