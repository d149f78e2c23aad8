"""Columns: a lattice over X and Y, the plastic that beads lay into each of its columns, how high they reach there, and which
columns lie inside loops. It shares no code with what gave each bead its volume."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from mdp.kernels.arrays import table
from mdp.kernels.kernel import helper, kernel, no_nrt
from mdp.mesh import Floats

NOTHING = -1e9
ROUNDING_MM = 1e-6
MOST_COLUMNS = 4_000_000

Mask = NDArray[np.bool_]


class Lattice(NamedTuple):
    """shape: (2,) columns along X and Y, squares of side cell; origin: (2,) mm, the least corner."""

    origin: Floats
    cell: float
    shape: NDArray[np.int64]

    @property
    def column_mm2(self) -> float:
        """Area of a column."""
        return self.cell * self.cell


class Bars(NamedTuple):
    """Straight pieces of plastic: (m, 3) middles of the ends of their tops, (m, 3) up, (m,) half widths and heights."""

    begin: Floats
    end: Floats
    up: Floats
    half: Floats
    height: Floats


def lattice_over(points: Floats, cell_mm: float, margin_mm: float = 1.5) -> Lattice:
    """A lattice over (n, 2) points and a margin; its columns grow where there would be too many."""
    low, high = points.min(axis=0) - margin_mm, points.max(axis=0) + margin_mm
    cell = max(cell_mm, float(np.sqrt((high - low).prod() / MOST_COLUMNS)))
    return Lattice(low, cell, np.ceil((high - low) / cell).astype(np.int64))


@kernel
def laid(bars: Bars, mm3: Floats, lattice: Lattice) -> Floats:
    """Plastic, mm3, in each column: that of every level bar spread evenly over the columns whose middles it covers.

    A bar that covers none gives all it has to the column at its middle, so that nothing over the lattice is lost.
    """
    plastic = table(lattice.shape[0], lattice.shape[1])
    for k in range(len(mm3)):
        a, b = bars.begin[k], bars.end[k]
        count = _spread(a, b, bars.half[k], 0.0, lattice, plastic)
        if count:
            _spread(a, b, bars.half[k], mm3[k] / count, lattice, plastic)
        else:
            i = int((0.5 * (a[0] + b[0]) - lattice.origin[0]) / lattice.cell)
            j = int((0.5 * (a[1] + b[1]) - lattice.origin[1]) / lattice.cell)
            if 0 <= i < lattice.shape[0] and 0 <= j < lattice.shape[1]:
                plastic[i, j] += mm3[k]
    return plastic


@helper
def _spread(a: Floats, b: Floats, half: float, mm3: float, lattice: Lattice, plastic: Floats) -> int:
    """Add mm3 to every column whose middle lies within half of the line from a to b; returns their number."""
    dx, dy, count = b[0] - a[0], b[1] - a[1], 0
    length = np.sqrt(dx * dx + dy * dy)
    if length <= 0.0:
        return 0
    dx, dy = dx / length, dy / length
    i0, i1 = _columns(0.5 * (a[0] + b[0]), 0.5 * length * abs(dx) + half * abs(dy), 0, lattice)
    j0, j1 = _columns(0.5 * (a[1] + b[1]), 0.5 * length * abs(dy) + half * abs(dx), 1, lattice)
    for i in range(i0, i1 + 1):
        x = lattice.origin[0] + (i + 0.5) * lattice.cell - a[0]
        for j in range(j0, j1 + 1):
            y = lattice.origin[1] + (j + 0.5) * lattice.cell - a[1]
            along, aside = x * dx + y * dy, x * dy - y * dx
            if 0.0 <= along < length and -half <= aside < half:
                count += 1
                plastic[i, j] += mm3
    return count


@helper
def _columns(middle: float, reach: float, axis: int, lattice: Lattice) -> tuple[int, int]:
    """The first and the last column whose middle lies within reach of a place along an axis."""
    first = int(np.ceil((middle - reach - lattice.origin[axis]) / lattice.cell - 0.5))
    last = int(np.floor((middle + reach - lattice.origin[axis]) / lattice.cell - 0.5))
    return max(first, 0), min(last, lattice.shape[axis] - 1)


@kernel
def tops(bars: Bars, lattice: Lattice, least: float) -> Floats:
    """Height at which each column leaves the uppermost of some bars, which may lie at any slant and end round, as beads turn at
    corners; NOTHING where there is none. A height below `least` may be returned as any lower one, or as NOTHING.
    """
    top = table(lattice.shape[0], lattice.shape[1])
    for i in range(lattice.shape[0]):
        for j in range(lattice.shape[1]):
            top[i, j] = NOTHING
    for k in range(len(bars.half) - 1, -1, -1):  # from the last one down: what lies under those before it is not looked at
        a, b, up, half, height = bars.begin[k], bars.end[k], bars.up[k], bars.half[k], bars.height[k]
        length = np.sqrt((b[0] - a[0]) ** 2 + (b[1] - a[1]) ** 2 + (b[2] - a[2]) ** 2)
        if length <= 0.0:
            continue
        d = ((b[0] - a[0]) / length, (b[1] - a[1]) / length, (b[2] - a[2]) / length)
        s = (up[1] * d[2] - up[2] * d[1], up[2] * d[0] - up[0] * d[2], up[0] * d[1] - up[1] * d[0])
        slabs = ((d[0], d[1], d[2], 0.0, length), (s[0], s[1], s[2], -half, half), (up[0], up[1], up[2], -height, 0.0))
        sines = [np.sqrt(max(0.0, 1.0 - up[n] * up[n])) for n in range(3)]
        reach = [0.5 * (length * abs(d[n]) + height * abs(up[n])) + half * sines[n] for n in range(2)]
        ceiling = max(a[2], b[2]) + half * sines[2] + height * max(0.0, -up[2]) + ROUNDING_MM
        if abs(d[0] * up[0] + d[1] * up[1] + d[2] * up[2]) > ROUNDING_MM:
            ceiling = -NOTHING  # its sides are no rectangle
        if ceiling < least:
            continue
        i0, i1 = _columns(0.5 * (a[0] + b[0] - height * up[0]), reach[0], 0, lattice)
        j0, j1 = _columns(0.5 * (a[1] + b[1] - height * up[1]), reach[1], 1, lattice)
        for i in range(i0, i1 + 1):
            x = lattice.origin[0] + (i + 0.5) * lattice.cell - a[0]
            for j in range(j0, j1 + 1):
                if top[i, j] >= ceiling:
                    continue
                y = lattice.origin[1] + (j + 0.5) * lattice.cell - a[1]
                highest = max(
                    a[2] + _leaves(x, y, slabs),
                    a[2] + _leaves_end(x, y, up, half, height),
                    b[2] + _leaves_end(x + a[0] - b[0], y + a[1] - b[1], up, half, height),
                )
                if highest > max(top[i, j], 0.5 * NOTHING):
                    top[i, j] = highest
    return top


@no_nrt
def _leaves_end(x: float, y: float, up: Floats, half: float, height: float) -> float:
    """Height at which an upright line leaves the round end of a bar: a cylinder below the end of its top, seen from there.

    Of the places p = (x, y, z) on it those with |p|^2 - (p . up)^2 <= half^2, a quadratic in z, and -height <= p . up <= 0.
    """
    along, free = x * up[0] + y * up[1], 1.0 - up[2] * up[2]
    rest = x * x + y * y - along * along - half * half
    low, high = NOTHING, -NOTHING
    if free > 1e-12:
        root = along * along * up[2] * up[2] - free * rest
        if root < 0.0:
            return NOTHING
        low, high = (along * up[2] - np.sqrt(root)) / free, (along * up[2] + np.sqrt(root)) / free
    elif rest > 0.0:
        return NOTHING
    if abs(up[2]) > 1e-9:
        low = max(low, min(-along / up[2], (-height - along) / up[2]))
        high = min(high, max(-along / up[2], (-height - along) / up[2]))
    elif along > 0.0 or along < -height:
        return NOTHING
    return high if low <= high else NOTHING


@helper
def _leaves(x: float, y: float, slabs: tuple[tuple[float, float, float, float, float], ...]) -> float:
    """Height at which an upright line leaves the intersection of slabs, each the places p with least <= n . p <= most."""
    low, high = NOTHING, -NOTHING
    for nx, ny, nz, least, most in slabs:
        across = x * nx + y * ny
        if abs(nz) > 1e-9:
            low = max(low, min((least - across) / nz, (most - across) / nz))
            high = min(high, max((least - across) / nz, (most - across) / nz))
        elif across < least or across > most:
            return NOTHING
    return high if low <= high else NOTHING


def inside_loops(sides: Floats, lattice: Lattice) -> Mask:
    """Columns whose middle an odd number of loops enclose; sides: (n, 4) x y of the begin and end of each side."""
    count = _crossings(sides, lattice)
    np.cumsum(count[:, ::-1], axis=1, out=count[:, ::-1])
    within: Mask = np.mod(count, 2.0, out=count) > 0.5
    return within


@kernel
def _crossings(sides: Floats, lattice: Lattice) -> Floats:
    """How many sides pass above each column's middle and not above that of the next one."""
    crossings = table(lattice.shape[0], lattice.shape[1])
    for k in range(len(sides)):
        x0, y0, x1, y1 = sides[k, 0], sides[k, 1], sides[k, 2], sides[k, 3]
        first, last = _columns(0.5 * (x0 + x1), 0.5 * abs(x1 - x0) + 1e-9, 0, lattice)
        for i in range(first, last + 1):
            x = lattice.origin[0] + (i + 0.5) * lattice.cell
            if min(x0, x1) <= x < max(x0, x1):
                y = y0 + (x - x0) / (x1 - x0) * (y1 - y0)
                j = int(np.ceil((y - lattice.origin[1]) / lattice.cell - 0.5)) - 1
                if j >= 0:
                    crossings[i, min(j, lattice.shape[1] - 1)] += 1.0
    return crossings
