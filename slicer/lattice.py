"""Lattice: the sides of polygons sorted into square cells, so that a short travel meets only the few sides near it."""

from math import sqrt
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from mdp.kernel import kernel, longs, part
from mdp.mesh import Floats
from slicer.polygons import Polygons, contours, edges_of

MARGIN_MM = 1e-6  # by which a side reaches into neighbouring cells, so that rounding never hides it


class Lattice(NamedTuple):
    """sides: (n, 4) x0 y0 x1 y1, loop after loop; loop: (n,) number of a side's loop; begins: where each loop begins, and n.

    Cell c of row r holds the sides listed[first[r * columns + c] : first[r * columns + c + 1]].
    """

    sides: Floats
    loop: NDArray[np.int64]
    begins: NDArray[np.int64]
    x: float
    y: float
    size: float
    columns: int
    rows: int
    first: NDArray[np.int64]
    listed: NDArray[np.int64]


def lattice(polygons: Polygons) -> Lattice:
    """The sides of all contours in cells, about one side a cell."""
    loops = contours(polygons)
    begins = np.cumsum([0, *(len(loop) for loop in loops)]).astype(np.int64)
    sides = edges_of(loops)
    loop = np.repeat(np.arange(len(loops), dtype=np.int64), np.diff(begins))
    low = sides.reshape(-1, 2).min(axis=0, initial=1e9) - 1.0
    wide, deep = np.maximum(sides.reshape(-1, 2).max(axis=0, initial=-1e9) + 1.0 - low, 1.0)
    size = max(sqrt(wide * deep / max(len(sides), 1)), max(wide, deep) / 1000.0)
    columns, rows = int(wide / size) + 1, int(deep / size) + 1
    first, listed = _sorted_in(sides, float(low[0]), float(low[1]), float(size), columns, rows)
    return Lattice(sides, loop, begins, float(low[0]), float(low[1]), float(size), columns, rows, first, listed)


@part
def _side(sides: Floats, s: int) -> tuple[float, float, float, float]:
    return sides[s, 0], sides[s, 1], sides[s, 2], sides[s, 3]


@part
def _columns(
    x0: float, y0: float, x1: float, y1: float, low: float, high: float, x: float, size: float, columns: int
) -> tuple[int, int]:
    """First and last column that a segment touches in a row between the heights low and high; the last below the first: none."""
    bottom, top = min(y0, y1), max(y0, y1)
    if bottom > high or top < low:
        return 1, 0
    left, right = min(x0, x1), max(x0, x1)
    if top > bottom:
        slope = (x1 - x0) / (y1 - y0)
        a, b = x0 + (max(low, bottom) - y0) * slope, x0 + (min(high, top) - y0) * slope
        left, right = max(left, min(a, b)), min(right, max(a, b))
    return max(int((left - MARGIN_MM - x) / size), 0), min(int((right + MARGIN_MM - x) / size), columns - 1)


@part
def _rows(y0: float, y1: float, y: float, size: float, rows: int) -> tuple[int, int]:
    return max(int((min(y0, y1) - MARGIN_MM - y) / size), 0), min(int((max(y0, y1) + MARGIN_MM - y) / size), rows - 1)


@kernel
def _sorted_in(
    sides: Floats, x: float, y: float, size: float, columns: int, rows: int
) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    cells = columns * rows
    first, place, listed = longs(cells + 1, 0), longs(cells + 1, 0), longs(0, 0)
    for filling in range(2):
        for s in range(len(sides)):
            x0, y0, x1, y1 = _side(sides, s)
            low, high = _rows(y0, y1, y, size, rows)
            for r in range(low, high + 1):
                bottom = y + r * size
                a, b = _columns(x0, y0, x1, y1, bottom - MARGIN_MM, bottom + size + MARGIN_MM, x, size, columns)
                for c in range(r * columns + a, r * columns + b + 1):
                    if filling:
                        listed[place[c]] = s
                        place[c] += 1
                    else:
                        first[c + 1] += 1
        if not filling:
            for c in range(cells):
                first[c + 1] += first[c]
                place[c + 1] = first[c + 1]
            listed = longs(first[cells], 0)
    return first, listed


@part
def _meets(sides: Floats, s: int, x0: float, y0: float, x1: float, y1: float) -> float:
    """Where (0..1) the segment crosses side s; -1 when it does not. An end on the segment's line counts as its right side."""
    ax, ay, bx, by = _side(sides, s)
    a = (x1 - x0) * (ay - y0) - (y1 - y0) * (ax - x0)
    b = (x1 - x0) * (by - y0) - (y1 - y0) * (bx - x0)
    if (a > 0) == (b > 0):
        return -1.0
    start = (bx - ax) * (y0 - ay) - (by - ay) * (x0 - ax)
    end = (bx - ax) * (y1 - ay) - (by - ay) * (x1 - ax)
    if (start > 0) == (end > 0):
        return -1.0
    return float(start / (start - end))


@part
def _near(lattice: Lattice, r: int, x0: float, y0: float, x1: float, y1: float) -> tuple[int, int]:
    """Which of the listed sides lie in the cells that a segment touches in a row: from and to."""
    bottom = lattice.y + r * lattice.size
    top = bottom + lattice.size + MARGIN_MM
    a, b = _columns(x0, y0, x1, y1, bottom - MARGIN_MM, top, lattice.x, lattice.size, lattice.columns)
    return (lattice.first[r * lattice.columns + a], lattice.first[r * lattice.columns + b + 1]) if a <= b else (0, 0)


@part
def crossings(lattice: Lattice, x0: float, y0: float, x1: float, y1: float, at: Floats, which: NDArray[np.int64]) -> int:
    """Fills in where (0..1, rising) and which sides the segment crosses; returns how many, -1 where there is no room for them."""
    low, high = _rows(y0, y1, lattice.y, lattice.size, lattice.rows)
    n = 0
    for r in range(low, high + 1):
        begin, end = _near(lattice, r, x0, y0, x1, y1)
        for k in range(begin, end):
            s = lattice.listed[k]
            share = _meets(lattice.sides, s, x0, y0, x1, y1)
            known = share < 0.0
            for i in range(n):
                known = known or which[i] == s
            if known:
                continue
            if n == len(at):
                return -1
            i = n
            while i > 0 and at[i - 1] > share:
                at[i], which[i] = at[i - 1], which[i - 1]
                i -= 1
            at[i], which[i] = share, s
            n += 1
    return n


@part
def free(lattice: Lattice, x0: float, y0: float, x1: float, y1: float) -> bool:
    """Whether the segment crosses no side."""
    low, high = _rows(y0, y1, lattice.y, lattice.size, lattice.rows)
    for r in range(low, high + 1):
        begin, end = _near(lattice, r, x0, y0, x1, y1)
        for k in range(begin, end):
            if _meets(lattice.sides, lattice.listed[k], x0, y0, x1, y1) >= 0.0:
                return False
    return True


@part
def within(lattice: Lattice, x: float, y: float) -> bool:
    """Whether a point lies in the polygons: the sides that a ray to the right crosses, each counted in one cell."""
    row, column = int((y - lattice.y) / lattice.size), max(int((x - lattice.x) / lattice.size), 0)
    if y < lattice.y or row >= lattice.rows:
        return False
    odd = False
    for c in range(column, lattice.columns):
        cell = row * lattice.columns + c
        for k in range(lattice.first[cell], lattice.first[cell + 1]):
            ax, ay, bx, by = _side(lattice.sides, lattice.listed[k])
            if (ay > y) != (by > y):
                cut = ax + (y - ay) / (by - ay) * (bx - ax)
                if cut > x and int((cut - lattice.x) / lattice.size) == c:
                    odd = not odd
    return odd


@part
def nearest(lattice: Lattice, x: float, y: float, reach: float) -> tuple[float, float, int]:
    """The nearest point of any side within reach, and its side; side -1: none."""
    best, side, nx, ny = reach, -1, x, y
    low, high = _rows(y - reach, y + reach, lattice.y, lattice.size, lattice.rows)
    left = max(int((x - reach - lattice.x) / lattice.size), 0)
    right = min(int((x + reach - lattice.x) / lattice.size), lattice.columns - 1)
    for r in range(low, high + 1):
        for c in range(r * lattice.columns + left, r * lattice.columns + right + 1):
            for k in range(lattice.first[c], lattice.first[c + 1]):
                ax, ay, bx, by = _side(lattice.sides, lattice.listed[k])
                dx, dy = bx - ax, by - ay
                along = dx * dx + dy * dy
                share = min(max(((x - ax) * dx + (y - ay) * dy) / along, 0.0), 1.0) if along > 0.0 else 0.0
                px, py = ax + share * dx, ay + share * dy
                distance = np.hypot(px - x, py - y)
                if distance < best:
                    best, side, nx, ny = distance, lattice.listed[k], px, py
    return nx, ny, side
