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

from mdp.cost.clipping import Planes, along, clip_below, find_chord, find_heights, flat_area_mm2, planes_of, rim_per_mm
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
    direction below which a face is risky along that direction; (m,) how much a mm of rim counts on each, by how much more on a
    feather edge; of which faces of the model they are pieces, see integrals.Needs, how many times what is unsupportable counts,
    and (m,) how many times an area on each that needs support."""

    corners: Floats
    normals: Floats
    areas_mm2: Floats
    risky: Mask
    risky_below: float
    rim_weights: Floats
    feather: float
    sources: Ints
    weight: float
    counts: Floats


def faces_of(remainder: Remainder, terms: CostTerms, rim_weights: Floats, chosen: Mask) -> Faces:
    """The chosen faces of what remains of a model. rim_weights: (m,) how much a mm of rim counts on each."""
    mesh = remainder.mesh
    return Faces(
        corners=mesh.vertices[mesh.faces[chosen]],
        normals=mesh.normals[chosen],
        areas_mm2=mesh.areas_mm2[chosen],
        risky=remainder.risky[chosen],
        risky_below=threshold(terms.angle_deg),
        rim_weights=rim_weights[chosen],
        feather=terms.feather,
        sources=remainder.sources[chosen],
        weight=remainder.weight,
        counts=remainder.counts[chosen],
    )


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
        least, weights, count = threshold(terms.angle_deg), remainder.seam_weights, len(remainder.risky)
        chosen = remainder.risky | (remainder.mesh.normals[:, 2] < sqrt(max(0.0, 1.0 - least * least)))
        if weights is not None:
            chosen = np.ones(count, dtype=np.bool_)
        seam_mm2 = np.zeros(count) if weights is None else terms.seam_mm * weights
        return cls(remainder, faces_of(remainder, terms, seam_mm2, chosen), terms.cut_mm2)

    def classes(self, planes: Sequence[Plane]) -> Classes:
        """(k, n) what the faces of the model need along the planes' normals."""
        return self.remainder.classes(planes_of(planes).directions)

    def left_mm2(self, planes: Sequence[Plane], classes: Classes | None = None) -> float:
        """What cuts along the planes, in this order, would cost: the area left that needs support, the seams, and each cut.

        classes: those of planes that lean a little otherwise; absent: the planes' own.
        """
        needs = self.classes(planes) if classes is None else classes
        return _sum_left(self.faces, planes_of(planes), needs) + self.cut_mm2 * len(planes)


@kernel
def _sum_left(surface: Faces, planes: Planes, classes: Classes) -> float:
    """Risky area and seams of the planes, cut in their order."""
    corners, normals, areas, risky = surface.corners, surface.normals, surface.areas_mm2, surface.risky
    directions, most = planes.directions, len(planes.directions) + 4
    polygon, spare, heights, ends = table(most, 3), table(most, 3), floats(most, 0.0), table(2, 3)
    total = 0.0
    for face in range(len(areas)):
        size, area = 3, areas[face]
        for corner in range(3):
            for axis in range(3):
                polygon[corner, axis] = corners[face, corner, axis]
        for cut in range(len(directions)):
            lowest, highest = find_heights(polygon, size, planes, cut, heights)
            if highest <= 0.0:
                continue
            cosine, below = along(normals, face, directions, cut), 0.0
            if lowest < 0.0:
                if surface.rim_weights[face] > 0.0 and highest > ROUNDING_MM and lowest < -ROUNDING_MM:
                    chord_mm = find_chord(polygon, heights, size, ends)
                    total += surface.rim_weights[face] * chord_mm * rim_per_mm(cosine, surface.feather)
                size = clip_below(polygon, spare, heights, size)
                polygon, spare = spare, polygon
                below = flat_area_mm2(polygon, size, normals, face)
            if cosine < surface.risky_below:
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
    source = surface.sources[face]
    if source < 0:
        return 1.0
    return surface.weight if classes[cut, source] == UNSUPPORTABLE else 1.0 if classes[cut, source] == NEEDS_SUPPORT else 0.0
