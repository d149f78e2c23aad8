"""Lattice: the sides of polygons sorted into square cells, so that a short travel meets only the few sides near it."""

from math import sqrt
from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from mdp.mesh import Floats
from slicer.polygons import Polygons, contours

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
    sides = np.concatenate([np.zeros((0, 4)), *(np.hstack([loop, np.roll(loop, -1, axis=0)]) for loop in loops)])
    loop = np.repeat(np.arange(len(loops), dtype=np.int64), np.diff(begins))
    low = sides.reshape(-1, 2).min(axis=0, initial=1e9) - 1.0
    wide, deep = np.maximum(sides.reshape(-1, 2).max(axis=0, initial=-1e9) + 1.0 - low, 1.0)
    size = max(sqrt(wide * deep / max(len(sides), 1)), max(wide, deep) / 1000.0)
    columns, rows = int(wide / size) + 1, int(deep / size) + 1
    first, listed = _sorted_in(sides, float(low[0]), float(low[1]), float(size), columns, rows)
    return Lattice(sides, loop, begins, float(low[0]), float(low[1]), float(size), columns, rows, first, listed)


@njit(cache=True)
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


@njit(cache=True)
def _rows(y0: float, y1: float, y: float, size: float, rows: int) -> tuple[int, int]:
    return max(int((min(y0, y1) - MARGIN_MM - y) / size), 0), min(int((max(y0, y1) + MARGIN_MM - y) / size), rows - 1)


@njit(cache=True)
def _sorted_in(
    sides: Floats, x: float, y: float, size: float, columns: int, rows: int
) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    first = np.zeros(columns * rows + 1, np.int64)
    listed = np.zeros(0, np.int64)
    place = first
    for filling in range(2):
        for s in range(len(sides)):
            x0, y0, x1, y1 = sides[s]
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
            first = np.cumsum(first)
            place = first.copy()
            listed = np.empty(first[-1], np.int64)
    return first, listed


@njit(cache=True)
def _meets(sides: Floats, s: int, x0: float, y0: float, x1: float, y1: float) -> float:
    """Where (0..1) the segment crosses side s; -1 when it does not. An end on the segment's line counts as its right side."""
    ax, ay, bx, by = sides[s]
    a = (x1 - x0) * (ay - y0) - (y1 - y0) * (ax - x0)
    b = (x1 - x0) * (by - y0) - (y1 - y0) * (bx - x0)
    if (a > 0) == (b > 0):
        return -1.0
    start = (bx - ax) * (y0 - ay) - (by - ay) * (x0 - ax)
    end = (bx - ax) * (y1 - ay) - (by - ay) * (x1 - ax)
    if (start > 0) == (end > 0):
        return -1.0
    return float(start / (start - end))


@njit(cache=True)
def crossings(lattice: Lattice, x0: float, y0: float, x1: float, y1: float, most: int) -> tuple[Floats, NDArray[np.int64]]:
    """Where (0..1, rising) and which sides the segment crosses; the search ends at `most` crossings."""
    low, high = _rows(y0, y1, lattice.y, lattice.size, lattice.rows)
    at, which = np.empty(16), np.empty(16, np.int64)
    n = 0
    for r in range(low, high + 1):
        bottom = lattice.y + r * lattice.size
        top = bottom + lattice.size + MARGIN_MM
        a, b = _columns(x0, y0, x1, y1, bottom - MARGIN_MM, top, lattice.x, lattice.size, lattice.columns)
        for c in range(r * lattice.columns + a, r * lattice.columns + b + 1):
            for k in range(lattice.first[c], lattice.first[c + 1]):
                s = lattice.listed[k]
                share = _meets(lattice.sides, s, x0, y0, x1, y1)
                known = share < 0.0
                for i in range(n):
                    known = known or which[i] == s
                if known:
                    continue
                if n == len(at):
                    at, which = np.concatenate((at, at)), np.concatenate((which, which))
                at[n], which[n] = share, s
                n += 1
                if n == most:
                    return at[:n], which[:n]
    order = np.argsort(at[:n])
    return at[:n][order], which[:n][order]


@njit(cache=True)
def free(lattice: Lattice, x0: float, y0: float, x1: float, y1: float) -> bool:
    """Whether the segment crosses no side."""
    return len(crossings(lattice, x0, y0, x1, y1, 1)[0]) == 0


@njit(cache=True)
def within(lattice: Lattice, x: float, y: float) -> bool:
    """Whether a point lies in the polygons: the sides that a ray to the right crosses, each counted in one cell."""
    row, column = int((y - lattice.y) / lattice.size), max(int((x - lattice.x) / lattice.size), 0)
    if y < lattice.y or row >= lattice.rows:
        return False
    odd = False
    for c in range(column, lattice.columns):
        cell = row * lattice.columns + c
        for k in range(lattice.first[cell], lattice.first[cell + 1]):
            ax, ay, bx, by = lattice.sides[lattice.listed[k]]
            if (ay > y) != (by > y):
                cut = ax + (y - ay) / (by - ay) * (bx - ax)
                if cut > x and int((cut - lattice.x) / lattice.size) == c:
                    odd = not odd
    return odd


@njit(cache=True)
def nearest(lattice: Lattice, x: float, y: float, reach: float) -> tuple[float, float, int]:
    """The nearest point of any side within reach, and its side; side -1: none."""
    best, side, nx, ny = reach, -1, x, y
    low, high = _rows(y - reach, y + reach, lattice.y, lattice.size, lattice.rows)
    left = max(int((x - reach - lattice.x) / lattice.size), 0)
    right = min(int((x + reach - lattice.x) / lattice.size), lattice.columns - 1)
    for r in range(low, high + 1):
        for c in range(r * lattice.columns + left, r * lattice.columns + right + 1):
            for k in range(lattice.first[c], lattice.first[c + 1]):
                ax, ay, bx, by = lattice.sides[lattice.listed[k]]
                dx, dy = bx - ax, by - ay
                along = dx * dx + dy * dy
                share = min(max(((x - ax) * dx + (y - ay) * dy) / along, 0.0), 1.0) if along > 0.0 else 0.0
                px, py = ax + share * dx, ay + share * dy
                distance = np.hypot(px - x, py - y)
                if distance < best:
                    best, side, nx, ny = distance, lattice.listed[k], px, py
    return nx, ny, side
