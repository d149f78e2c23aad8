"""Clipping: convex polygons in space cut by planes, and the rims that this leaves (parts of kernels).

Directions, normals and corners are rows of (n, 3) arrays.
"""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from mdp.kernels.kernel import part
from mdp.mesh import Floats
from mdp.plane import Plane
from mdp.sweep.rims import weigh_chord

LEAST_SINE = 0.01  # of the angle between face and plane; a chord along a face parallel to the plane has no length of its own


class Planes(NamedTuple):
    """Planes in the order of their cuts: (k, 3) normals and (k,) offsets."""

    directions: Floats
    offsets_mm: Floats


def planes_of(planes: Sequence[Plane]) -> Planes:
    """Planes for kernels."""
    directions = np.array([plane.normal for plane in planes], dtype=np.float64).reshape(-1, 3)
    return Planes(directions, np.array([plane.offset_mm for plane in planes], dtype=np.float64))


@part
def along(points: Floats, row: int, directions: Floats, second_row: int) -> float:
    """Product of a row with a row of another array."""
    product: float = points[row, 0] * directions[second_row, 0] + points[row, 1] * directions[second_row, 1]
    product += points[row, 2] * directions[second_row, 2]
    return product


@part
def find_heights(polygon: Floats, size: int, planes: Planes, cut: int, heights: Floats) -> tuple[float, float]:
    """Put the heights of a polygon's corners above one of some planes into `heights`; the least and the greatest."""
    lowest, highest = np.inf, -np.inf
    for i in range(size):
        heights[i] = along(polygon, i, planes.directions, cut) - planes.offsets_mm[cut]
        lowest, highest = min(lowest, heights[i]), max(highest, heights[i])
    return lowest, highest


@part
def clip_below(polygon: Floats, below: Floats, heights: Floats, size: int) -> int:
    """Put into `below` what of a convex polygon lies below height 0; the number of its corners."""
    count = 0
    for i in range(size):
        j = i + 1 if i + 1 < size else 0
        if heights[i] <= 0.0:
            for axis in range(3):
                below[count, axis] = polygon[i, axis]
            count += 1
        if heights[i] * heights[j] < 0.0:
            share = heights[i] / (heights[i] - heights[j])
            for axis in range(3):
                below[count, axis] = polygon[i, axis] + share * (polygon[j, axis] - polygon[i, axis])
            count += 1
    return count


@part
def flat_area_mm2(polygon: Floats, size: int, normals: Floats, face: int) -> float:
    """Area of a flat convex polygon with a known unit normal."""
    twice = 0.0
    for i in range(1, size - 1):
        a0, a1, a2 = polygon[i, 0] - polygon[0, 0], polygon[i, 1] - polygon[0, 1], polygon[i, 2] - polygon[0, 2]
        b0, b1, b2 = polygon[i + 1, 0] - polygon[0, 0], polygon[i + 1, 1] - polygon[0, 1], polygon[i + 1, 2] - polygon[0, 2]
        across = normals[face, 0] * (a1 * b2 - a2 * b1) + normals[face, 1] * (a2 * b0 - a0 * b2)
        twice += across + normals[face, 2] * (a0 * b1 - a1 * b0)
    return 0.5 * twice


@part
def rim_per_mm(cosine: float, feather: float) -> float:
    """How much a mm of rim counts where a face's normal has that cosine with the plane's."""
    sine = np.sqrt(max(1.0 - cosine * cosine, 0.0))
    return float(weigh_chord(cosine, feather) / max(sine, LEAST_SINE))


@part
def find_chord(polygon: Floats, heights: Floats, size: int, ends: Floats) -> float:
    """Put the ends (2, 3) of a convex polygon's chord at height 0 into `ends`, first where its outline rises through it; its
    length, mm. The polygon reaches to both sides."""
    for i in range(size):
        j = i + 1 if i + 1 < size else 0
        if (heights[i] > 0.0) != (heights[j] > 0.0):
            share = heights[i] / (heights[i] - heights[j])
            for axis in range(3):
                ends[int(heights[i] > 0.0), axis] = polygon[i, axis] + share * (polygon[j, axis] - polygon[i, axis])
    return float(np.sqrt((ends[1, 0] - ends[0, 0]) ** 2 + (ends[1, 1] - ends[0, 1]) ** 2 + (ends[1, 2] - ends[0, 2]) ** 2))
