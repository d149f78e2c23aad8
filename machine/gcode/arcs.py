"""Arcs: geometry of G2 and G3, and recognition of arcs in polylines."""

from collections.abc import Mapping
from math import acos, atan2, ceil, cos, floor, hypot, pi, sin

import numpy as np
from numpy.typing import NDArray

from mdp.kernels.kernel import helper, kernel
from mdp.mesh import Floats

FEWEST_CHORDS = 3  # fewer straight moves are not worth an arc
LARGEST_MM, SMALLEST_MM = 500.0, 0.3  # radii beyond: visually straight, or smaller than a bead
WIDEST = 1.7 * pi  # sweep of one arc: a whole circle ends where it begins, and rounding could reduce it to nothing
UNEVEN = 0.01  # greatest relative variation of filament per mm along an arc
MOST_CHORDS = 20000
AXIS_DIRECTIONS = ((1.0, 0.0), (0.0, 1.0), (-1.0, 0.0), (0.0, -1.0))  # a quarter turn apart

Point = tuple[float, float]


def sweep_rad(start: Point, end: Point, centre: Point, clockwise: bool) -> float:
    """Angle from start to end about the centre, below 0 when clockwise; equal ends make a whole circle."""
    angle = atan2(end[1] - centre[1], end[0] - centre[0]) - atan2(start[1] - centre[1], start[0] - centre[0])
    if hypot(end[0] - start[0], end[1] - start[1]) < 1e-9:
        angle = 0.0
    angle %= 2.0 * pi
    if clockwise:
        return angle - 2.0 * pi
    return angle if angle > 0.0 else 2.0 * pi


def arc_centre(start: Point, end: Point, shape: Mapping[str, float], clockwise: bool) -> Point | None:
    """Centre of an arc by its words I J or R, mm; None without these, or if the ends are too far apart for R. An R below 0
    selects the longer arc."""
    if "R" not in shape:
        return (start[0] + shape.get("I", 0.0), start[1] + shape.get("J", 0.0)) if shape else None
    radius, dx, dy = shape["R"], end[0] - start[0], end[1] - start[1]
    half = 0.5 * hypot(dx, dy)
    if half == 0.0 or abs(radius) < half * (1.0 - 1e-6):
        return None
    aside = (max(radius * radius - half * half, 0.0)) ** 0.5 / (2.0 * half)
    if clockwise != (radius < 0.0):
        aside = -aside
    return 0.5 * (start[0] + end[0]) - aside * dy, 0.5 * (start[1] + end[1]) + aside * dx


def arc_box(start: Point, end: Point, centre: Point, clockwise: bool) -> tuple[Point, Point]:
    """Least and greatest x y of an arc."""
    first = atan2(start[1] - centre[1], start[0] - centre[0])
    low, high = sorted((first, first + sweep_rad(start, end, centre, clockwise)))
    radius = max(hypot(x - centre[0], y - centre[1]) for x, y in (start, end))
    passed = [AXIS_DIRECTIONS[k % 4] for k in range(ceil(low / (pi / 2.0)), floor(high / (pi / 2.0)) + 1)]
    xs, ys = zip(start, end, *((centre[0] + radius * x, centre[1] + radius * y) for x, y in passed), strict=True)
    return (min(xs), min(ys)), (max(xs), max(ys))


def chord_count(radius: float, sweep: float, tolerance_mm: float) -> int:
    """Number of equal chords that stay within the tolerance of an arc."""
    most = 2.0 * acos(max(1.0 - tolerance_mm / radius, -0.5)) if radius > tolerance_mm else 1.0
    return min(max(1, ceil(abs(sweep) / max(most, 1e-6))), MOST_CHORDS)


def chords(start: Point, end: Point, centre: Point, sweep: float, count: int) -> list[Point]:
    """Ends of `count` chords of equal angle, the last one exactly the end; different radii at the ends are interpolated."""
    first = atan2(start[1] - centre[1], start[0] - centre[0])
    r0, r1 = hypot(start[0] - centre[0], start[1] - centre[1]), hypot(end[0] - centre[0], end[1] - centre[1])
    points = []
    for k in range(1, count):
        angle, radius = first + sweep * k / count, r0 + (r1 - r0) * k / count
        points.append((centre[0] + radius * cos(angle), centre[1] + radius * sin(angle)))
    return [*points, end]


def fit_arcs(points: Floats, pushed: Floats, tolerance_mm: float) -> tuple[NDArray[np.int64], Floats]:
    """Runs of a polyline (n, 2) that an arc replaces within the tolerance both ways; pushed: (n - 1,) filament of each step.

    Returns (m, 2) the first and last point of each run, in order, and (m, 3) its centre x, y and 1 (clockwise) or 0.
    """
    steps = np.hypot(*np.diff(points, axis=0).T)
    runs, arcs = np.empty((len(points), 2), np.int64), np.empty((len(points), 3))
    count = _fit_arcs(np.ascontiguousarray(points), pushed / np.maximum(steps, 1e-9), tolerance_mm, runs, arcs)
    return runs[:count], arcs[:count]


@kernel
def _fit_arcs(points: Floats, density: Floats, tolerance: float, runs: NDArray[np.int64], arcs: Floats) -> int:
    """Fill in the runs and their arcs; returns their number."""
    n = len(points)
    count, i = 0, 0
    while i + FEWEST_CHORDS < n:
        best, x, y, turn = -1, 0.0, 0.0, 0.0
        j = i + FEWEST_CHORDS
        while j < n:
            fits, cx, cy, sense = _circle(points, density, i, j, tolerance)
            if not fits:
                break
            best, x, y, turn = j, cx, cy, sense
            j += 1
        if best < 0:
            i += 1
            continue
        runs[count, 0], runs[count, 1] = i, best
        arcs[count, 0], arcs[count, 1], arcs[count, 2] = x, y, turn
        count += 1
        i = best
    return count


@helper
def _circle(points: Floats, density: Floats, i: int, j: int, tolerance: float) -> tuple[bool, float, float, float]:
    """The circle through the first, middle and last of points i..j, and whether all chords follow it in one direction."""
    ax, ay = points[i, 0], points[i, 1]
    bx, by = points[(i + j) // 2, 0] - ax, points[(i + j) // 2, 1] - ay
    cx, cy = points[j, 0] - ax, points[j, 1] - ay
    doubled = 2.0 * (bx * cy - by * cx)
    if doubled == 0.0:
        return False, 0.0, 0.0, 0.0
    b2, c2 = bx * bx + by * by, cx * cx + cy * cy
    x, y = ax + (cy * b2 - by * c2) / doubled, ay + (bx * c2 - cx * b2) / doubled
    radius = np.hypot(ax - x, ay - y)
    if radius > LARGEST_MM or radius < SMALLEST_MM:
        return False, x, y, 0.0
    turned = 0.0
    for k in range(i, j):
        px, py, qx, qy = points[k, 0] - x, points[k, 1] - y, points[k + 1, 0] - x, points[k + 1, 1] - y
        across, along = px * qy - py * qx, px * qx + py * qy
        step = np.arctan2(across, along)
        dx, dy = qx - px, qy - py
        foot = min(max(-(px * dx + py * dy) / max(dx * dx + dy * dy, 1e-18), 0.0), 1.0)  # nearest to the centre
        inner = np.hypot(px + foot * dx, py + foot * dy)
        close = abs(np.hypot(qx, qy) - radius) <= tolerance and abs(inner - radius) <= tolerance
        even = abs(density[k] - density[i]) <= UNEVEN * density[i]
        if not close or not even or along <= 0.0 or step == 0.0 or (turned != 0.0 and (step > 0.0) != (turned > 0.0)):
            return False, x, y, 0.0
        turned += step
    return abs(turned) <= WIDEST, x, y, 1.0 if turned < 0.0 else 0.0
