"""Arrange: places on the plate for several models of one size, in rows and columns, near the middle."""

from itertools import product
from math import ceil, hypot

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
    inside = [(x, y) for x in columns for y in rows if _fits((x, y), size_mm, machine)]
    return sorted(inside, key=lambda place: (round(hypot(*place), 6), place[1], place[0]))


def _fits(place: Place, size_mm: Place, machine: Machine) -> bool:
    """Whether a box lies on the plate."""
    far = [abs(middle) + 0.5 * side + EDGE_MM for middle, side in zip(place, size_mm, strict=True)]
    if machine.table.size_mm is None:
        return hypot(*far) <= machine.table.radius_mm
    return all(reach <= 0.5 * side for reach, side in zip(far, machine.table.size_mm, strict=True))
