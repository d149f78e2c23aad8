"""Dashes: one straight bead through a small compact place of a section, where no centreline would fit well."""

from math import pi
from typing import NamedTuple

import numpy as np

from mdp.kernels.arrays import table
from mdp.kernels.kernel import kernel, part
from mdp.mesh import Floats
from slicer.geometry.polygons import Polygons, edges
from slicer.geometry.segments import inside, squared_distance_to_any

CELLS = 40  # along the longer side of the grid of distances to the borders
EVERY = 3  # cells between the places through which a bead is tried
TURNS = 18  # directions tried over half a turn
THINNER = 0.93  # from one width tried to the next


def dash(island: Polygons, borders: Floats, least_mm: float, most_mm: float, spare_mm: float) -> tuple[Floats, float] | None:
    """Ends (2, 2) mm and width of the straight bead that covers most of an island; None where not even the least fits.

    borders: (m, 4) edges of the section near the island, over which the bead reaches by spare_mm at most.
    """
    limits = _Limits(least_mm, most_mm, spare_mm)
    ends, width = _best(edges(island), borders, np.array(island.bounds()), limits)
    return (ends, float(width)) if width > 0.0 else None


class _Limits(NamedTuple):
    """Widths of the bead, and by how much it may reach over the borders, mm."""

    least: float
    most: float
    spare: float


@part
def _clearances(sides: Floats, borders: Floats, box: Floats, cell: float) -> Floats:
    """(rows, columns) distances to the borders of a grid's points, -1 outside the island."""
    columns, rows = int((box[2] - box[0]) / cell) + 1, int((box[3] - box[1]) / cell) + 1
    clear: Floats = table(rows, columns)
    for i in range(rows):
        for j in range(columns):
            x, y = box[0] + (j + 0.5) * cell, box[1] + (i + 0.5) * cell
            clear[i, j] = np.sqrt(squared_distance_to_any(borders, x, y)) if inside(sides, x, y) else -1.0
    return clear


@part
def _run(clear: Floats, i: int, j: int, step: tuple[float, float], least: float) -> int:
    """Steps of one cell (rows, columns) that a line through the grid goes before it comes nearer to a border than the least."""
    steps = 0
    while True:
        row, column = int(np.floor(i + (steps + 1) * step[0] + 0.5)), int(np.floor(j + (steps + 1) * step[1] + 0.5))
        if row < 0 or column < 0 or row >= clear.shape[0] or column >= clear.shape[1] or clear[row, column] < least:
            return steps
        steps += 1


@kernel
def _best(sides: Floats, borders: Floats, box: Floats, limits: _Limits) -> tuple[Floats, float]:
    """Ends (2, 2) and width of the bead whose strip and round ends are largest; width 0 where none fits."""
    cell = max(box[2] - box[0], box[3] - box[1]) / CELLS
    clear = _clearances(sides, borders, box, cell)
    ends, best, width = table(2, 2), 0.0, 0.0
    for i in range(EVERY // 2, clear.shape[0], EVERY):
        for j in range(EVERY // 2, clear.shape[1], EVERY):
            radius = min(clear[i, j] + limits.spare, 0.5 * limits.most)
            while radius >= 0.5 * limits.least:
                for turn in range(TURNS):
                    c, s = np.cos(turn * pi / TURNS), np.sin(turn * pi / TURNS)
                    a = _run(clear, i, j, (-s, -c), radius - limits.spare)
                    b = _run(clear, i, j, (s, c), radius - limits.spare)
                    covered = 2.0 * radius * (a + b) * cell + pi * radius * radius
                    if a + b > 0 and covered > best:
                        best, width = covered, 2.0 * radius
                        x, y = box[0] + (j + 0.5) * cell, box[1] + (i + 0.5) * cell
                        ends[0, 0], ends[0, 1] = x - a * cell * c, y - a * cell * s
                        ends[1, 0], ends[1, 1] = x + b * cell * c, y + b * cell * s
                radius *= THINNER
    return ends, width
