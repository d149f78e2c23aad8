"""Arrange: places on the plate for several models of one size, in rows and columns, near the middle."""

from itertools import product
from math import ceil, hypot

import numpy as np

from machine.planning.fit import over_edge_mm
from profiles.machine import Machine

EDGE_MM = 2.0  # kept to the plate's edge

Place = tuple[float, float]


def places_on_plate(size_mm: Place, gap_mm: float, count: int, machine: Machine) -> list[Place]:
    """Up to `count` middles (workpiece x, y, mm) of boxes of that size, gap_mm apart, the nearest to the plate's middle first.

    Rows and columns may have a box or a gap in the middle: what holds most is taken, among equals what stays nearer.
    """
    best: list[Place] = []
    for shift in product((0.0, 0.5), (0.0, 0.5)):
        lattice = _lattice(size_mm, gap_mm, shift, machine)[:count]
        if (len(lattice), -_reach(lattice)) > (len(best), -_reach(best)):
            best = lattice
    return best


def _reach(places: list[Place]) -> float:
    return max((hypot(*place) for place in places), default=0.0)


def _lattice(size_mm: Place, gap_mm: float, shift: Place, machine: Machine) -> list[Place]:
    steps = [side + gap_mm for side in size_mm]
    counts = [ceil(2.0 * machine.table.radius_mm / step) + 1 for step in steps]
    columns, rows = ([(k + part) * step for k in range(-n, n + 1)] for n, part, step in zip(counts, shift, steps, strict=True))
    middles = np.array(list(product(columns, rows)))
    over_mm, _ = over_edge_mm(np.abs(middles) + 0.5 * np.array(size_mm) + EDGE_MM, machine.table)
    inside = [(x, y) for x, y in middles[over_mm <= 0.0].tolist()]
    return sorted(inside, key=lambda middle: (round(hypot(*middle), 6), middle[1], middle[0]))
