"""Forecast: what a sequence of planes would cost, summed over a solid's surface without cutting it.

A piece of the surface belongs to the first part whose plane it lies above, what lies above none to the part on the platform.
The faces that these cuts lay open are not in the sum, though later ones may turn them into overhangs. A rim runs over what the
planes before its own have left. Faces are convex polygons in space, clipped by one plane after the other; directions, normals and
corners are rows of (n, 3) arrays.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from math import sqrt
from typing import NamedTuple

import numpy as np

from mdp.cost.cost import CostTerms
from mdp.kernels.arrays import floats, table
from mdp.kernels.kernel import helper, kernel, no_nrt
from mdp.mesh import Floats, Ints
from mdp.overhang import Mask, threshold
from mdp.plane import Plane
from mdp.stairs import step_share
from mdp.support_need.patches import NEEDS_SUPPORT, UNSUPPORTABLE, Classes
from mdp.sweep.cylinders import crossings
from mdp.sweep.limbs import cylinders_cut, limb_reach
from mdp.sweep.rims import ROUNDING_MM, weigh_chord
from mdp.sweep.sweep import Remainder

LEAST_SINE = 0.01  # of the angle between face and plane; a chord along a face parallel to the plane has no length of its own


class Planes(NamedTuple):
    """Planes in the order of their cuts: (k, 3) normals, (k,) offsets, and (k, m) which faces each may cut, (0, 0): all."""

    directions: Floats
    offsets_mm: Floats
    reach: Mask


def planes_of(planes: Sequence[Plane], reach: Mask) -> Planes:
    """Planes for kernels."""
    directions = np.array([plane.normal for plane in planes], dtype=np.float64).reshape(-1, 3)
    return Planes(directions, np.array([plane.offset_mm for plane in planes], dtype=np.float64), reach)


def reach_of(remainder: Remainder, planes: Sequence[Plane], chosen: Mask) -> Mask:
    """(k, m) which of the chosen faces of a solid each plane may cut: those of its limbs and below them; (0, 0): all of them."""
    if all(plane.limbs_mm is None for plane in planes):
        return np.zeros((0, 0), np.bool_)
    return np.stack([limb_reach(remainder, plane)[chosen] for plane in planes])


class Faces(NamedTuple):
    """Faces of a solid: (m, 3, 3) corners, (m, 3) normals, (m,) areas, which are risky upright, the cosine of normal and
    direction below which a face is risky along that direction; (m,) how much a mm of rim counts on each, by how much more on a
    feather edge; of which faces of the model they are pieces, see integrals.Needs, how many times what is unsupportable counts,
    and (m,) how many times an area on each that needs support, and one whose steps are as high as a layer."""

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
    stair_weights: Floats


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
        stair_weights=(np.zeros(len(chosen)) if remainder.stair_weights is None else remainder.stair_weights)[chosen],
    )


@dataclass(frozen=True, eq=False)
class Surface:
    """What remains of a model, its faces that count laid out."""

    remainder: Remainder
    faces: Faces
    terms: CostTerms
    chosen: Mask

    @classmethod
    def of(cls, remainder: Remainder, terms: CostTerms) -> "Surface":
        """The surface of what remains. Where seams cost nothing, faces that no direction above the horizon finds risky are left
        out."""
        least, weights, count = threshold(terms.angle_deg), remainder.seam_weights, len(remainder.risky)
        chosen = remainder.risky | (remainder.mesh.normals[:, 2] < sqrt(max(0.0, 1.0 - least * least)))
        if weights is not None:
            chosen = np.ones(count, dtype=np.bool_)
        seam_mm2 = np.zeros(count) if weights is None else terms.seam_mm * weights
        return cls(remainder, faces_of(remainder, terms, seam_mm2, chosen), terms, chosen)

    def classes(self, planes: Sequence[Plane]) -> Classes:
        """(k, n) what the faces of the model need along the planes' normals."""
        return self.remainder.classes(np.array([plane.normal for plane in planes], dtype=np.float64).reshape(-1, 3))

    def reach(self, planes: Sequence[Plane]) -> Mask:
        """Which of the faces each plane may cut, see reach_of."""
        return reach_of(self.remainder, planes, self.chosen)

    def left_mm2(self, planes: Sequence[Plane], classes: Classes | None = None, reach: Mask | None = None) -> float:
        """What cuts along the planes, in this order, would cost: the area left that needs support, the seams, the
        stairs, and each cut.

        classes, reach: those of planes that lean a little otherwise; absent: the planes' own.
        """
        needs = self.classes(planes) if classes is None else classes
        cuts_mm2 = self.terms.cut_mm2 * len(planes) + self._crossed_mm2(planes)
        return _sum_left(self.faces, planes_of(planes, self.reach(planes) if reach is None else reach), needs) + cuts_mm2

    def _crossed_mm2(self, planes: Sequence[Plane]) -> float:
        """What it costs that bores are cut askew, each as long as something of it is left."""
        left, crossed = self.remainder.cylinders if self.terms.feature_mm2 > 0.0 else (), 0.0
        for plane in planes:
            cut = cylinders_cut(self.remainder, left, plane)
            crossed += float(crossings(cut, plane.normal[None], np.array([[plane.offset_mm]]))[0, 0])
            left = tuple(cylinder for cylinder in left if cylinder not in cut or cylinder.reaches_below(plane))
        return self.terms.feature_mm2 * crossed


@kernel
def _sum_left(surface: Faces, planes: Planes, classes: Classes) -> float:
    """Risky area, seams and stairs of the planes, cut in their order."""
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
            if len(planes.reach) > 0 and not planes.reach[cut, face]:
                continue
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
            total += (area - below) * surface.stair_weights[face] * step_share(cosine)
            area = below
            if lowest >= 0.0:
                break
        if risky[face]:
            total += area * surface.counts[face]
        total += area * surface.stair_weights[face] * step_share(normals[face, 2])
    return total


@no_nrt
def weight_along(surface: Faces, classes: Classes, cut: int, face: int) -> float:
    """How many times a face counts that is risky along the normal of a cut."""
    source = surface.sources[face]
    if source < 0:
        return 1.0
    return surface.weight if classes[cut, source] == UNSUPPORTABLE else 1.0 if classes[cut, source] == NEEDS_SUPPORT else 0.0


@no_nrt
def along(points: Floats, row: int, directions: Floats, second_row: int) -> float:
    """Product of a row with a row of another array."""
    product: float = points[row, 0] * directions[second_row, 0] + points[row, 1] * directions[second_row, 1]
    product += points[row, 2] * directions[second_row, 2]
    return product


@helper
def find_heights(polygon: Floats, size: int, planes: Planes, cut: int, heights: Floats) -> tuple[float, float]:
    """Put the heights of a polygon's corners above one of some planes into `heights`; the least and the greatest."""
    lowest, highest = np.inf, -np.inf
    for i in range(size):
        heights[i] = along(polygon, i, planes.directions, cut) - planes.offsets_mm[cut]
        lowest, highest = min(lowest, heights[i]), max(highest, heights[i])
    return lowest, highest


@no_nrt
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


@no_nrt
def flat_area_mm2(polygon: Floats, size: int, normals: Floats, face: int) -> float:
    """Area of a flat convex polygon with a known unit normal."""
    twice = 0.0
    for i in range(1, size - 1):
        a0, a1, a2 = polygon[i, 0] - polygon[0, 0], polygon[i, 1] - polygon[0, 1], polygon[i, 2] - polygon[0, 2]
        b0, b1, b2 = polygon[i + 1, 0] - polygon[0, 0], polygon[i + 1, 1] - polygon[0, 1], polygon[i + 1, 2] - polygon[0, 2]
        across = normals[face, 0] * (a1 * b2 - a2 * b1) + normals[face, 1] * (a2 * b0 - a0 * b2)
        twice += across + normals[face, 2] * (a0 * b1 - a1 * b0)
    return 0.5 * twice


@helper
def rim_per_mm(cosine: float, feather: float) -> float:
    """How much a mm of rim counts where a face's normal has that cosine with the plane's."""
    sine = np.sqrt(max(1.0 - cosine * cosine, 0.0))
    return float(weigh_chord(cosine, feather) / max(sine, LEAST_SINE))


@no_nrt
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
