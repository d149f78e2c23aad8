"""Plate: its outline, how well part 1 holds on it, and the first layer without the elephant's foot."""

from math import inf

import numpy as np

from mdp.mesh import Floats
from profiles.machine import Table
from slicer.geometry.polygons import Polygons, contours, offset

PUSH_N = 1.0  # sideways push of the nozzle at the top of a print: light contact with a curled edge
ADHESION_N_MM2 = 0.2  # of plastic to a clean warm plate, a few times less than published peel tests of PLA and PETG give
TURNS = 36  # directions in which it may tip


def plate_outline(table: Table) -> Polygons:
    """The plate's outline in the frame of a part that is printed with the table level, part 1's."""
    if table.size_mm is not None:
        return Polygons.square(table.size_mm, True)
    return Polygons.circle(table.radius_mm, 180)


def tips_over(base: Polygons, height_mm: float) -> bool:
    """Whether a push at that height would tear the base off the plate.

    The plate holds the base like glue an upright beam: the greatest tension is push times height over the least section
    modulus of the base.
    """
    modulus = section_modulus_mm3(base)
    return modulus <= 0.0 or PUSH_N * height_mm / modulus > ADHESION_N_MM2


def section_modulus_mm3(base: Polygons) -> float:
    """Least section modulus of an area over all axes through its centroid: second moment over the farthest point."""
    loops = contours(base)
    if not loops:
        return 0.0
    area, first, second = 0.0, np.zeros(2), np.zeros((2, 2))
    for a in loops:
        b = np.roll(a, -1, axis=0)
        cross = a[:, 0] * b[:, 1] - b[:, 0] * a[:, 1]
        area += 0.5 * float(cross.sum())
        first += (cross[:, None] * (a + b)).sum(axis=0) / 6.0
        pairs = 2.0 * (_outer(a, a) + _outer(b, b)) + _outer(a, b) + _outer(b, a)
        second += (cross[:, None, None] * pairs).sum(axis=0) / 24.0
    if area <= 0.0:
        return 0.0
    middle = first / area
    second -= area * np.outer(middle, middle)
    points, least = np.concatenate(loops) - middle, inf
    for turn in np.pi * np.arange(TURNS) / TURNS:
        across = np.array([np.cos(turn), np.sin(turn)])
        least = min(least, float(across @ second @ across) / float(np.abs(points @ across).max()))
    return least


def _outer(a: Floats, b: Floats) -> Floats:
    """(n, 2, 2) products of rows."""
    products: Floats = a[:, :, None] * b[:, None, :]
    return products


def compensate_elephant_foot(outline: Polygons, elephant_foot_mm: float, width_mm: float) -> Polygons:
    """The outline less what the first layer is squeezed out by; places that would shrink below a line keep their width."""
    if elephant_foot_mm <= 0.0:
        return outline
    deep = elephant_foot_mm + 0.5 * width_mm
    narrow = outline - offset(offset(outline, -deep), deep + 0.01)
    return offset(outline, -elephant_foot_mm) + narrow
