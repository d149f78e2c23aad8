"""Bead: a piece of plastic to lay down, before its place in the order, its speed and its travel are known."""

from dataclasses import dataclass, replace
from functools import cached_property
from math import pi

import numpy as np
from numpy.typing import NDArray

from mdp.kernel import kernel
from mdp.mesh import Floats
from slicer.paths import Kind, bead_area_mm2

WALLS = (Kind.OUTER_WALL, Kind.INNER_WALL, Kind.OVERHANG)
ROUND_SIDES = 1.0 - pi / 4.0
HIDDEN_RESOLUTION_MM = 0.0125  # of what the outer wall hides: PrusaSlicer's resolution of G-code


@dataclass(frozen=True, eq=False)
class Bead:
    """points: (n, 2) mm, a closed bead repeats its first point.

    rank: beads of an island are printed by rising rank; those of rank 0 and below are its walls and stay together around
    each outer wall. over_infill: a bridge over the sparse infill of the layer below, which has a speed and a fan of its own.
    follows: printed right after the bead before it in the list.
    """

    kind: Kind
    points: Floats
    width_mm: float
    rank: int
    flow: float = 1.0
    over_infill: bool = False
    follows: bool = False

    @property
    def closed(self) -> bool:
        """Whether the bead ends where it begins."""
        return len(self.points) > 3 and bool((self.points[0] == self.points[-1]).all())

    @property
    def one_way(self) -> bool:
        """Whether the bead must begin where it does: walls have their seam there."""
        return self.closed or self.kind in WALLS

    @cached_property
    def length_mm(self) -> float:
        """Length of the bead."""
        return length_mm(self.points)


def length_mm(points: Floats) -> float:
    """Length of a polyline."""
    return float(_length(points))


@kernel
def _length(points: Floats) -> float:
    total = 0.0
    for i in range(1, len(points)):
        total += np.hypot(points[i, 0] - points[i - 1, 0], points[i, 1] - points[i - 1, 1])
    return total


def thinned(bead: Bead) -> Bead:
    """The bead without points that lie within HIDDEN_RESOLUTION_MM of the line between their neighbours; a loop's start stays."""
    if len(bead.points) < 3:
        return bead
    kept = _corners(bead.points, HIDDEN_RESOLUTION_MM)
    return bead if kept.all() else replace(bead, points=bead.points[kept])


@kernel
def _corners(points: Floats, tolerance_mm: float) -> NDArray[np.bool_]:
    """(n,) points that a polyline keeps (Douglas and Peucker 1973); the chord of a loop is the way from its start."""
    kept = np.zeros(len(points), np.bool_)
    kept[0], kept[len(points) - 1] = True, True
    stack = [(0, len(points) - 1)]
    while len(stack):
        a, b = stack.pop()
        dx, dy = points[b, 0] - points[a, 0], points[b, 1] - points[a, 1]
        square = max(dx * dx + dy * dy, 1e-18)
        farthest, at = tolerance_mm * tolerance_mm, -1
        for k in range(a + 1, b):
            x, y = points[k, 0] - points[a, 0], points[k, 1] - points[a, 1]
            share = min(max((x * dx + y * dy) / square, 0.0), 1.0)
            away = (x - share * dx) ** 2 + (y - share * dy) ** 2
            if away > farthest:
                farthest, at = away, k
        if at >= 0:
            kept[at] = True
            stack.append((a, at))
            stack.append((at, b))
    return kept


def spacing_mm(width_mm: float, height_mm: float) -> float:
    """Distance of neighbouring beads whose rounded sides leave no plastic over: cross-section / height."""
    return width_mm - height_mm * ROUND_SIDES


def width_for_mm(spacing: float, height_mm: float) -> float:
    """Width of the bead that fills a strip of that width between two others: the inverse of spacing_mm."""
    return spacing + height_mm * ROUND_SIDES


def bulged(width_mm: float, height_mm: float, free_sides: int, most_mm: float) -> float:
    """Flow of a bead that fills the rectangle of its width on its free sides, where nothing covers its round ones.

    The bead bulges by most_mm at most: half of height times (1 - pi/4) would fill the rectangle.
    """
    bulge = min(0.5 * height_mm * ROUND_SIDES, most_mm)
    return 1.0 + free_sides * bulge * height_mm / bead_area_mm2(width_mm, height_mm)
