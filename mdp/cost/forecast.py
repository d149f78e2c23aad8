"""Forecast: what a sequence of planes would cost, summed over a solid's surface without cutting it.

A piece of the surface belongs to the first part whose plane it lies above, what lies above none to the part on the platform.
The faces that these cuts lay open are not in the sum, though later ones may turn them into overhangs. A rim runs over what the
planes before its own have left. Faces are convex polygons in space, clipped by one plane after the other; directions, normals and
corners are columns of (3, n) arrays.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from math import sqrt
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from mdp.cost.cost import CostTerms
from mdp.kernels.arrays import floats, table
from mdp.kernels.kernel import helper, kernel, no_nrt
from mdp.mesh import Floats
from mdp.overhang import Mask, threshold
from mdp.plane import Plane
from mdp.stairs import step_share
from mdp.support_need.patches import Classes
from mdp.sweep.cylinders import crossings
from mdp.sweep.facets import FaceTable, Scars, times_along
from mdp.sweep.limbs import cylinders_cut, limb_reach
from mdp.sweep.rims import ROUNDING_MM, weigh_chord
from mdp.sweep.sweep import Remainder

LEAST_SINE = 0.01  # of the angle between face and plane; a chord along a face parallel to the plane has no length of its own


class Planes(NamedTuple):
    """Planes in the order of their cuts: (3, k) normals, (k,) offsets, (k, m) which faces each may cut, (0, 0): all, and (3, k) a
    point in each, needed for parts only."""

    directions: Floats
    offsets_mm: Floats
    reach: Mask
    apexes: Floats


def planes_of(planes: Sequence[Plane], reach: Mask) -> Planes:
    """Planes for kernels, without points."""
    normals = np.array([plane.normal for plane in planes], dtype=np.float64).reshape(-1, 3)
    offsets_mm = np.array([plane.offset_mm for plane in planes], dtype=np.float64)
    return Planes(np.ascontiguousarray(normals.T), offsets_mm, reach, np.zeros((3, 0)))


@dataclass(frozen=True, eq=False)
class Surface:
    """What remains of a model, (k,) the numbers of its faces that count, and what blemishes them along no direction yet."""

    remainder: Remainder
    terms: CostTerms
    chosen: NDArray[np.int64]
    scars: Scars

    @classmethod
    def of(cls, remainder: Remainder, terms: CostTerms, rim_weights: Floats | None = None) -> "Surface":
        """The surface of what remains. rim_weights: (m,) how much a mm of rim counts on each face; None: what seams of the
        remainder cost. Where they cost nothing, faces that no direction above the horizon finds risky are left out."""
        faces, least, count = remainder.faces, threshold(terms.angle_deg), len(remainder.risky)
        if rim_weights is None and remainder.seam_weights is not None:
            rim_weights = terms.seam_mm * remainder.seam_weights
        chosen = np.arange(count)
        if rim_weights is None:
            chosen = np.flatnonzero(faces.risky | (faces.normals[2] < sqrt(max(0.0, 1.0 - least * least))))
            rim_weights = np.zeros(count)
        stairs = np.zeros(count) if remainder.stair_weights is None else remainder.stair_weights
        faces = faces._replace(seam_weights=rim_weights, stair_weights=stairs).of_faces(chosen)
        no_classes, none_lost = np.zeros((0, 0), np.uint8), np.zeros(0, np.bool_)
        scars = Scars(np.zeros((0, 3)), faces, least, no_classes, remainder.weight, terms.feather, none_lost)
        return cls(remainder, terms, chosen, scars)

    def classes(self, planes: Sequence[Plane]) -> Classes:
        """(k, n) what the faces of the model need along the planes' normals."""
        return self.remainder.classes(np.array([plane.normal for plane in planes], dtype=np.float64).reshape(-1, 3))

    def reach(self, planes: Sequence[Plane]) -> Mask:
        """(k, m) which of the faces each plane may cut: those of its limbs and below them; (0, 0): all of them."""
        if all(plane.limbs_mm is None for plane in planes):
            return np.zeros((0, 0), np.bool_)
        return np.stack([limb_reach(self.remainder, plane)[self.chosen] for plane in planes])

    def left_mm2(self, planes: Sequence[Plane], classes: Classes | None = None, reach: Mask | None = None) -> float:
        """What cuts along the planes, in this order, would cost: the area left that needs support, the seams, the
        stairs, and each cut.

        classes, reach: those of planes that lean a little otherwise; absent: the planes' own.
        """
        needs = self.classes(planes) if classes is None else classes
        cuts_mm2 = self.terms.cut_mm2 * len(planes) + self._crossed_mm2(planes)
        cuts = planes_of(planes, self.reach(planes) if reach is None else reach)
        return _sum_left(self.scars._replace(classes=needs), cuts) + cuts_mm2

    def _crossed_mm2(self, planes: Sequence[Plane]) -> float:
        """What it costs that bores are cut askew, each as long as something of it is left."""
        left, crossed = self.remainder.cylinders if self.terms.feature_mm2 > 0.0 else (), 0.0
        for plane in planes:
            cut = cylinders_cut(self.remainder, left, plane)
            crossed += float(crossings(cut, plane.normal[None], np.array([[plane.offset_mm]]))[0, 0])
            left = tuple(cylinder for cylinder in left if cylinder not in cut or cylinder.reaches_below(plane))
        return self.terms.feature_mm2 * crossed


@kernel
def _sum_left(scars: Scars, planes: Planes) -> float:
    """Risky area, seams and stairs of the planes, cut in their order."""
    faces, normals, directions, cuts = scars.faces, scars.faces.normals, planes.directions, len(planes.offsets_mm)
    polygon, spare, heights, ends = table(3, cuts + 4), table(3, cuts + 4), floats(cuts + 4, 0.0), table(3, 2)
    total = 0.0
    for face in range(len(faces.areas_mm2)):
        size, area = 3, faces.areas_mm2[face]
        put_face(faces, face, polygon)
        for cut in range(cuts):
            if len(planes.reach) > 0 and not planes.reach[cut, face]:
                continue
            lowest, highest = find_heights(polygon, size, planes, cut, heights)
            if highest <= 0.0:
                continue
            cosine, below = along(normals, face, directions, cut), 0.0
            if lowest < 0.0:
                if faces.seam_weights[face] > 0.0 and highest > ROUNDING_MM and lowest < -ROUNDING_MM:
                    chord_mm = find_chord(polygon, heights, size, ends)
                    total += faces.seam_weights[face] * chord_mm * rim_per_mm(cosine, scars.feather)
                size = clip_below(polygon, spare, heights, size)
                polygon, spare = spare, polygon
                below = flat_area_mm2(polygon, size, normals, face)
            if cosine < scars.risky_below:
                total += (area - below) * times_along(scars, cut, face) * faces.counts[face]
            total += (area - below) * faces.stair_weights[face] * step_share(cosine)
            area = below
            if lowest >= 0.0:
                break
        if faces.risky[face]:
            total += area * faces.counts[face]
        total += area * faces.stair_weights[face] * step_share(normals[2, face])
    return total


@no_nrt
def put_face(faces: FaceTable, face: int, polygon: Floats) -> None:
    """Put the corners of a face into the first columns of `polygon`."""
    for corner in range(3):
        for axis in range(3):
            polygon[axis, corner] = faces.points[axis, faces.corners[corner, face]]


@no_nrt
def along(vectors: Floats, column: int, directions: Floats, second_column: int) -> float:
    """Product of a column of (3, n) vectors with a column of others."""
    product: float = vectors[0, column] * directions[0, second_column] + vectors[1, column] * directions[1, second_column]
    product += vectors[2, column] * directions[2, second_column]
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
                below[axis, count] = polygon[axis, i]
            count += 1
        if heights[i] * heights[j] < 0.0:
            share = heights[i] / (heights[i] - heights[j])
            for axis in range(3):
                below[axis, count] = polygon[axis, i] + share * (polygon[axis, j] - polygon[axis, i])
            count += 1
    return count


@no_nrt
def flat_area_mm2(polygon: Floats, size: int, normals: Floats, face: int) -> float:
    """Area of a flat convex polygon with a known unit normal."""
    twice = 0.0
    for i in range(1, size - 1):
        a0, a1, a2 = polygon[0, i] - polygon[0, 0], polygon[1, i] - polygon[1, 0], polygon[2, i] - polygon[2, 0]
        b0, b1, b2 = polygon[0, i + 1] - polygon[0, 0], polygon[1, i + 1] - polygon[1, 0], polygon[2, i + 1] - polygon[2, 0]
        across = normals[0, face] * (a1 * b2 - a2 * b1) + normals[1, face] * (a2 * b0 - a0 * b2)
        twice += across + normals[2, face] * (a0 * b1 - a1 * b0)
    return 0.5 * twice


@helper
def rim_per_mm(cosine: float, feather: float) -> float:
    """How much a mm of rim counts where a face's normal has that cosine with the plane's."""
    sine = np.sqrt(max(1.0 - cosine * cosine, 0.0))
    return float(weigh_chord(cosine, feather) / max(sine, LEAST_SINE))


@no_nrt
def find_chord(polygon: Floats, heights: Floats, size: int, ends: Floats) -> float:
    """Put the ends (3, 2) of a convex polygon's chord at height 0 into `ends`, first where its outline rises through it; its
    length, mm. The polygon reaches to both sides."""
    for i in range(size):
        j = i + 1 if i + 1 < size else 0
        if (heights[i] > 0.0) != (heights[j] > 0.0):
            share = heights[i] / (heights[i] - heights[j])
            for axis in range(3):
                ends[axis, int(heights[i] > 0.0)] = polygon[axis, i] + share * (polygon[axis, j] - polygon[axis, i])
    return float(np.sqrt((ends[0, 1] - ends[0, 0]) ** 2 + (ends[1, 1] - ends[1, 0]) ** 2 + (ends[2, 1] - ends[2, 0]) ** 2))
