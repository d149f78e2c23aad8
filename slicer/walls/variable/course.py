"""Courses: the way and the widths of a bead, smoothed, and without points that say nothing."""

import numpy as np
from numpy.typing import NDArray

from mdp.kernels.arrays import flags, floats, longs
from mdp.kernels.kernel import kernel
from mdp.mesh import Floats
from slicer.geometry.polyline import PATH_RESOLUTION_MM
from slicer.geometry.segments import Segment, nearest_share

TRANSITION = 0.7  # nominal spacings to both sides over which widths are smoothed
SEEN_RESOLUTION_MM = 0.004  # of outer walls, whose points are close where ribs are
WIDTH_STEP_MM = 0.004  # a point whose width is that near to the one between its neighbours says nothing


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
def corners(course: Floats, level: int) -> NDArray[np.bool_]:
    """(n,) points of a course (n, 3) that the wall of a level keeps when it is simplified (Douglas and Peucker 1973), in place
    and in width."""
    tolerance_mm = PATH_RESOLUTION_MM if level else SEEN_RESOLUTION_MM
    keep = flags(len(course))
    keep[0], keep[len(course) - 1] = True, True
    stack = longs(2 * len(course), 0)
    stack[1], waiting = len(course) - 1, 2
    while waiting > 0:
        waiting -= 2
        a, b = stack[waiting], stack[waiting + 1]
        chord = Segment(course[a, 0], course[a, 1], course[b, 0], course[b, 1])
        worst, at = 1.0, -1
        for k in range(a + 1, b):
            x, y = course[k, 0], course[k, 1]
            share = nearest_share(chord, x, y)
            dx, dy = x - chord.x0 - share * (chord.x1 - chord.x0), y - chord.y0 - share * (chord.y1 - chord.y0)
            wider = (course[a, 2] + share * (course[b, 2] - course[a, 2]) - course[k, 2]) / WIDTH_STEP_MM
            far = max((dx * dx + dy * dy) / (tolerance_mm * tolerance_mm), wider * wider)
            if far > worst:
                worst, at = far, k
        if at >= 0:
            keep[at] = True
            stack[waiting], stack[waiting + 1], stack[waiting + 2], stack[waiting + 3] = a, at, at, b
            waiting += 4
    return keep
