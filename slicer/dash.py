"""Dashes: one straight bead through a small compact place of a section, where no line along its middle would fit well."""

from math import pi

import numpy as np

from mdp.kernel import kernel, part, table
from mdp.mesh import Floats
from slicer.polygons import Polygons, edges
from slicer.scanline import inside

CELLS = 40  # along the longer side of the grid on which the ways to the borders are known
EVERY = 3  # cells between the places through which a bead is tried
TURNS = 18  # directions tried over half a turn
THINNER = 0.93  # from one width tried to the next


def dash(island: Polygons, borders: Floats, least_mm: float, most_mm: float, spare_mm: float) -> tuple[Floats, float] | None:
    """Ends (2, 2) mm and width of the straight bead that covers most of an island; None where not even the least fits.

    borders: (m, 4) edges of the section near the island, over which the bead reaches by spare_mm at most.
    """
    x0, y0, x1, y1 = island.bounds()
    found, width = _best(edges(island), borders, np.array([x0, y0, x1, y1]), least_mm, most_mm, spare_mm)
    return (found, float(width)) if width > 0.0 else None


@part
def _clearance(borders: Floats, x: float, y: float) -> float:
    """Distance of a point to (m, 4) edges."""
    least = np.inf
    for e in range(len(borders)):
        dx, dy = borders[e, 2] - borders[e, 0], borders[e, 3] - borders[e, 1]
        px, py = x - borders[e, 0], y - borders[e, 1]
        share = min(max((px * dx + py * dy) / max(dx * dx + dy * dy, 1e-18), 0.0), 1.0)
        least = min(least, (px - share * dx) ** 2 + (py - share * dy) ** 2)
    return float(np.sqrt(least))


@part
def _clearances(sides: Floats, borders: Floats, box: Floats, cell: float) -> Floats:
    """(rows, columns) distances to the borders of a grid's points, -1 outside the island."""
    columns, rows = int((box[2] - box[0]) / cell) + 1, int((box[3] - box[1]) / cell) + 1
    clear: Floats = table(rows, columns)
    for i in range(rows):
        for j in range(columns):
            x, y = box[0] + (j + 0.5) * cell, box[1] + (i + 0.5) * cell
            clear[i, j] = _clearance(borders, x, y) if inside(sides, x, y) else -1.0
    return clear


@part
def _run(clear: Floats, i: int, j: int, di: float, dj: float, least: float) -> int:
    """Steps of one cell that a way through the grid goes before it comes nearer to a border than the least."""
    steps = 0
    while True:
        row, column = int(np.floor(i + (steps + 1) * di + 0.5)), int(np.floor(j + (steps + 1) * dj + 0.5))
        if row < 0 or column < 0 or row >= clear.shape[0] or column >= clear.shape[1] or clear[row, column] < least:
            return steps
        steps += 1


@kernel
def _best(  # type: ignore[no-untyped-def]
    sides, borders, box, least_mm, most_mm, spare_mm
):
    """Ends (2, 2) and width of the bead whose strip and round ends are largest; width 0 where none fits."""
    cell = max(box[2] - box[0], box[3] - box[1]) / CELLS
    clear = _clearances(sides, borders, box, cell)
    found, best, width = table(2, 2), 0.0, 0.0
    for i in range(EVERY // 2, clear.shape[0], EVERY):
        for j in range(EVERY // 2, clear.shape[1], EVERY):
            radius = min(clear[i, j] + spare_mm, 0.5 * most_mm)
            while radius >= 0.5 * least_mm:
                for turn in range(TURNS):
                    c, s = np.cos(turn * pi / TURNS), np.sin(turn * pi / TURNS)
                    a = _run(clear, i, j, -s, -c, radius - spare_mm)
                    b = _run(clear, i, j, s, c, radius - spare_mm)
                    covered = 2.0 * radius * (a + b) * cell + pi * radius * radius
                    if a + b > 0 and covered > best:
                        best, width = covered, 2.0 * radius
                        x, y = box[0] + (j + 0.5) * cell, box[1] + (i + 0.5) * cell
                        found[0, 0], found[0, 1] = x - a * cell * c, y - a * cell * s
                        found[1, 0], found[1, 1] = x + b * cell * c, y + b * cell * s
                radius *= THINNER
    return found, width
