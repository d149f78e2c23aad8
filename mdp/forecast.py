"""Forecast: what a sequence of planes would leave risky, summed over a solid's surface without cutting it.

A piece of the surface belongs to the first part whose plane it lies above, what lies above none to the part on the platform.
The faces that these cuts lay open are not in the sum, though later ones may turn them into overhangs.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from math import sqrt

import numpy as np

from mdp.kernel import floats, kernel, part, table
from mdp.mesh import Floats, Mesh
from mdp.overhang import Mask, threshold
from mdp.plane import Plane


@dataclass(frozen=True, eq=False)
class Surface:
    """A solid's surface: (m, 3, 3) corners, (m, 3) normals, (m,) areas and which faces are risky upright."""

    corners: Floats
    normals: Floats
    areas_mm2: Floats
    risky: Mask
    threshold: float

    @classmethod
    def of(cls, mesh: Mesh, risky: Mask, self_supporting_angle_deg: float) -> "Surface":
        """The surface of a mesh with its faces that are risky upright; faces that no direction above the horizon finds risky
        are left out."""
        least = threshold(self_supporting_angle_deg)
        may = risky | (mesh.normals[:, 2] < sqrt(max(0.0, 1.0 - least * least)))
        return cls(mesh.vertices[mesh.faces[may]], mesh.normals[may], mesh.areas_mm2[may], risky[may], least)

    def left_mm2(self, planes: Sequence[Plane]) -> float:
        """Risky area that cuts along the planes, in this order, would leave."""
        normals = np.array([plane.normal for plane in planes], dtype=np.float64).reshape(-1, 3)
        offsets = np.array([plane.offset_mm for plane in planes], dtype=np.float64)
        return float(sum_left(self.corners, self.normals, self.areas_mm2, self.risky, normals, offsets, self.threshold))


@kernel
def sum_left(  # type: ignore[no-untyped-def]
    corners, normals, areas, risky, directions, offsets, threshold
):
    """Risky area left by the planes (directions, offsets), cut in their order."""
    polygon, spare = table(len(offsets) + 4, 3), table(len(offsets) + 4, 3)
    heights = floats(len(offsets) + 4, 0.0)
    total = 0.0
    for face in range(len(areas)):
        size, area = 3, areas[face]
        for corner in range(3):
            for axis in range(3):
                polygon[corner, axis] = corners[face, corner, axis]
        for cut in range(len(offsets)):
            lowest, highest = np.inf, -np.inf
            for i in range(size):
                heights[i] = along(polygon, i, directions, cut) - offsets[cut]
                lowest, highest = min(lowest, heights[i]), max(highest, heights[i])
            if highest <= 0.0:
                continue
            below = 0.0
            if lowest < 0.0:
                size = clip(polygon, spare, heights, size)
                polygon, spare = spare, polygon
                below = flat_area(polygon, size, normals, face)
            if along(normals, face, directions, cut) < threshold:
                total += area - below
            area = below
            if lowest >= 0.0:
                break
        if risky[face]:
            total += area
    return total


@part
def along(points, row, directions, other):  # type: ignore[no-untyped-def]
    """Product of a row with a row of another array."""
    product = points[row, 0] * directions[other, 0] + points[row, 1] * directions[other, 1]
    return product + points[row, 2] * directions[other, 2]


@part
def clip(polygon, kept, heights, size):  # type: ignore[no-untyped-def]
    """Put into `kept` what of a convex polygon lies below height 0; the number of its corners."""
    count = 0
    for i in range(size):
        j = i + 1 if i + 1 < size else 0
        if heights[i] <= 0.0:
            for axis in range(3):
                kept[count, axis] = polygon[i, axis]
            count += 1
        if heights[i] * heights[j] < 0.0:
            share = heights[i] / (heights[i] - heights[j])
            for axis in range(3):
                kept[count, axis] = polygon[i, axis] + share * (polygon[j, axis] - polygon[i, axis])
            count += 1
    return count


@part
def flat_area(polygon, size, normals, face):  # type: ignore[no-untyped-def]
    """Area of a flat convex polygon with a known unit normal."""
    twice = 0.0
    for i in range(1, size - 1):
        a0, a1, a2 = polygon[i, 0] - polygon[0, 0], polygon[i, 1] - polygon[0, 1], polygon[i, 2] - polygon[0, 2]
        b0, b1, b2 = polygon[i + 1, 0] - polygon[0, 0], polygon[i + 1, 1] - polygon[0, 1], polygon[i + 1, 2] - polygon[0, 2]
        across = normals[face, 0] * (a1 * b2 - a2 * b1) + normals[face, 1] * (a2 * b0 - a0 * b2)
        twice += across + normals[face, 2] * (a0 * b1 - a1 * b0)
    return 0.5 * twice
