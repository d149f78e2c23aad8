"""Courses: the way and the widths of a bead, smoothed, and without points that say nothing."""

import numpy as np
from numpy.typing import NDArray

from mdp.kernels.arrays import flags, floats, longs
from mdp.kernels.kernel import kernel
from mdp.mesh import Floats
from slicer.geometry.segments import Segment, nearest_share, squared_distance


@kernel
def smoothed(points: Floats, values: Floats, reach_mm: float, closed: bool) -> Floats:
    """(n,) means of values over all of a polyline (n, 2) within the reach on both sides; closed: it goes on from its end."""
    n = len(points)
    out = floats(n, 0.0)
    low, high = values[0], values[0]
    for k in range(n):
        low, high = min(low, values[k]), max(high, values[k])
    if high - low < 1e-6:
        for k in range(n):
            out[k] = values[k]
        return out
    steps = floats(n, 0.0)  # from each point to the next
    for k in range(n):
        after = (k + 1) % n
        steps[k] = np.hypot(points[after, 0] - points[k, 0], points[after, 1] - points[k, 1])
    for k in range(n):
        total, weight = 0.0, 0.0
        for sense in (-1, 1):
            left, i = reach_mm, k
            for _ in range(n):
                j = i + sense
                if j < 0 or j >= n:
                    if not closed:
                        break
                    j = (j + n) % n
                step = steps[i] if sense > 0 else steps[j]
                part = min(step, left)
                share = part / step if step > 0.0 else 0.0
                total += part * (values[i] + 0.5 * share * (values[j] - values[i]))
                weight += part
                left -= part
                i = j
                if left <= 0.0:
                    break
        out[k] = total / weight if weight > 0.0 else values[k]
    return out


@kernel
def corners(points: Floats, widths: Floats, tolerance_mm: float, width_tolerance_mm: float) -> NDArray[np.bool_]:
    """(n,) points that a polyline keeps when it is simplified (Douglas and Peucker 1973), in place and in width."""
    keep = flags(len(points))
    keep[0], keep[len(points) - 1] = True, True
    stack = longs(2 * len(points), 0)
    stack[1], waiting = len(points) - 1, 2
    while waiting > 0:
        waiting -= 2
        a, b = stack[waiting], stack[waiting + 1]
        chord = Segment(points[a, 0], points[a, 1], points[b, 0], points[b, 1])
        worst, at = 1.0, -1
        for k in range(a + 1, b):
            share = nearest_share(chord, points[k, 0], points[k, 1])
            wider = (widths[a] + share * (widths[b] - widths[a]) - widths[k]) / width_tolerance_mm
            away = squared_distance(chord, points[k, 0], points[k, 1]) / (tolerance_mm * tolerance_mm)
            if max(away, wider * wider) > worst:
                worst, at = max(away, wider * wider), k
        if at >= 0:
            keep[at] = True
            stack[waiting], stack[waiting + 1], stack[waiting + 2], stack[waiting + 3] = a, at, at, b
            waiting += 4
    return keep
