"""Forecast: what a sequence of planes would cost, summed over a solid's surface without cutting it.

A piece of the surface belongs to the first part whose plane it lies above, what lies above none to the part on the platform.
The faces that these cuts lay open are not in the sum, though later ones may turn them into overhangs. A rim runs over what the
planes before its own have left.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from math import sqrt
from typing import NamedTuple

import numpy as np

from mdp.cost.clipping import along, chord_mm, clip_below, flat_area_mm2, rim_per_mm
from mdp.cost.cost import CostTerms
from mdp.kernels.arrays import floats, table
from mdp.kernels.kernel import kernel, part
from mdp.mesh import Floats, Ints
from mdp.overhang import Mask, threshold
from mdp.plane import Plane
from mdp.support_need.patches import NEEDS_SUPPORT, UNSUPPORTABLE, Classes
from mdp.sweep.rims import ROUNDING_MM
from mdp.sweep.sweep import Remainder


class Faces(NamedTuple):
    """Faces of a solid: (m, 3, 3) corners, (m, 3) normals, (m,) areas, which are risky upright, the cosine of normal and
    direction below which a face is risky along that direction; (m,) mm2 that a mm of rim costs on each, (0,) where seams cost
    nothing, by how much more on a feather edge; of which faces of the model they are pieces, see integrals.Needs, how many
    times what is unsupportable counts, and (m,) how many times an area on each that needs support."""

    corners: Floats
    normals: Floats
    areas_mm2: Floats
    risky: Mask
    risky_below: float
    seam_mm: Floats
    feather: float
    sources: Ints
    weight: float
    counts: Floats


@dataclass(frozen=True, eq=False)
class Surface:
    """What remains of a model, its faces that count laid out."""

    remainder: Remainder
    faces: Faces
    cut_mm2: float

    @classmethod
    def of(cls, remainder: Remainder, terms: CostTerms) -> "Surface":
        """The surface of what remains. Where seams cost nothing, faces that no direction above the horizon finds risky are left
        out."""
        mesh, risky, least = remainder.mesh, remainder.risky, threshold(terms.angle_deg)
        counted = risky | (mesh.normals[:, 2] < sqrt(max(0.0, 1.0 - least * least)))
        seam_mm = np.zeros(0)
        if remainder.seam_weights is not None:
            counted = np.ones(len(risky), dtype=np.bool_)
            seam_mm = terms.seam_mm * remainder.seam_weights
        corners = mesh.vertices[mesh.faces[counted]]
        pieces = remainder.pieces
        sources = np.zeros(0, np.int32) if pieces is None else pieces.sources[counted]
        weight = 1.0 if pieces is None else pieces.need.weight
        areas, normals, counts = mesh.areas_mm2[counted], mesh.normals[counted], counts_of(remainder)[counted]
        faces = Faces(corners, normals, areas, risky[counted], least, seam_mm, terms.feather, sources, weight, counts)
        return cls(remainder, faces, terms.cut_mm2)

    def classes(self, planes: Sequence[Plane]) -> Classes:
        """(k, n) what the faces of the model need along the planes' normals."""
        pieces = self.remainder.pieces
        return np.zeros((len(planes), 0), np.uint8) if pieces is None else pieces.need.along(_normals(planes))

    def left_mm2(self, planes: Sequence[Plane], classes: Classes | None = None) -> float:
        """What cuts along the planes, in this order, would cost: the area left that needs support, the seams, and each cut.

        classes: those of planes that lean a little otherwise; absent: the planes' own.
        """
        offsets = np.array([plane.offset_mm for plane in planes], dtype=np.float64)
        needs = self.classes(planes) if classes is None else classes
        return _sum_left(self.faces, _normals(planes), offsets, needs) + self.cut_mm2 * len(planes)


def counts_of(remainder: Remainder) -> Floats:
    """(m,) how many times an area on each face counts that needs support."""
    pieces = remainder.pieces
    return np.ones(len(remainder.risky)) if pieces is None or pieces.counts is None else pieces.counts


def _normals(planes: Sequence[Plane]) -> Floats:
    return np.array([plane.normal for plane in planes], dtype=np.float64).reshape(-1, 3)


@kernel
def _sum_left(surface: Faces, directions: Floats, offsets: Floats, classes: Classes) -> float:
    """Risky area and seams of the planes (directions, offsets), cut in their order."""
    corners, normals, areas, risky = surface.corners, surface.normals, surface.areas_mm2, surface.risky
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
                if len(surface.seam_mm) > 0 and highest > ROUNDING_MM and lowest < -ROUNDING_MM:
                    cosine = along(normals, face, directions, cut)
                    total += surface.seam_mm[face] * chord_mm(polygon, heights, size) * rim_per_mm(cosine, surface.feather)
                size = clip_below(polygon, spare, heights, size)
                polygon, spare = spare, polygon
                below = flat_area_mm2(polygon, size, normals, face)
            if along(normals, face, directions, cut) < surface.risky_below:
                total += (area - below) * weight_along(surface, classes, cut, face) * surface.counts[face]
            area = below
            if lowest >= 0.0:
                break
        if risky[face]:
            total += area * surface.counts[face]
    return total


@part
def weight_along(surface: Faces, classes: Classes, cut: int, face: int) -> float:
    """How many times a face counts that is risky along the normal of a cut."""
    if len(surface.sources) == 0 or surface.sources[face] < 0:
        return 1.0
    of_face = classes[cut, surface.sources[face]]
    return surface.weight if of_face == UNSUPPORTABLE else 1.0 if of_face == NEEDS_SUPPORT else 0.0
