"""Scanlines: parallel lines clipped to polygons by the even-odd rule, and their joining into zigzags."""

import numpy as np
from numpy.typing import NDArray

from mdp.kernels.arrays import flags, floats, longs, table
from mdp.kernels.kernel import kernel
from mdp.kernels.sorting import rank, sort, sort_into_bins
from mdp.mesh import Floats
from slicer.geometry.segments import Segment, crosses_any


@kernel
def scan_lines(edges: Floats, heights: Floats) -> Floats:
    """Horizontal lines at rising `heights` clipped to polygons given by their (n, 4) edges.

    Returns (m, 4) rows: left x, right x, y, number of the line; lines in order, each from left to right.
    """
    first, last, slopes = longs(len(edges), 0), longs(len(edges), 0), floats(len(edges), 0.0)
    for e in range(len(edges)):
        first[e] = rank(heights, min(edges[e, 1], edges[e, 3]), False)
        last[e] = rank(heights, max(edges[e, 1], edges[e, 3]), False) - 1
        slopes[e] = (edges[e, 2] - edges[e, 0]) / (edges[e, 3] - edges[e, 1]) if edges[e, 3] != edges[e, 1] else 0.0
    offsets, crossed = sort_into_bins(first, last, len(heights))
    crossings, rows = floats(len(crossed), 0.0), 0
    for k in range(len(heights)):
        rows += (offsets[k + 1] - offsets[k]) // 2
        for at in range(offsets[k], offsets[k + 1]):
            e = crossed[at]
            crossings[at] = edges[e, 0] + slopes[e] * (heights[k] - edges[e, 1])
    out: Floats = table(rows, 4)
    n = 0
    for k in range(len(heights)):
        sort(crossings, offsets[k], offsets[k + 1])
        for i in range(offsets[k], offsets[k + 1] - 1, 2):
            out[n, 0], out[n, 1], out[n, 2], out[n, 3] = crossings[i], crossings[i + 1], heights[k], float(k)
            n += 1
    return out


@kernel
def join_lines(rows: Floats, fence: Floats, reach_mm: float) -> tuple[Floats, NDArray[np.int64]]:
    """Clipped lines joined end to end where a neighbouring line begins within reach and no fence edge lies between.

    rows: as of scan_lines(); fence: (n, 4) edges. Returns points (n, 2) and the start of each polyline in them.
    """
    lines = int(rows[len(rows) - 1, 3]) + 2 if len(rows) else 0
    begin = longs(lines + 1, 0)
    for line in range(lines + 1):
        begin[line] = rank(rows[:, 3], line, False)
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
            for row in range(begin[line], begin[line + 1]):
                if used[row]:
                    continue
                for end in range(2):
                    distance = np.hypot(rows[row, end] - x, rows[row, 2] - y)
                    if distance < nearest and not crosses_any(Segment(x, y, rows[row, end], rows[row, 2]), fence):
                        best, best_side, nearest = row, 1 - end, distance
            at, side = best, best_side
    return points[:n], starts[:count]
