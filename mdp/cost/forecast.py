"""Forecast: cost of a sequence of planes, and the size and area needing support of the resulting parts.

All are summed over a solid's surface without cutting it.

A piece of the surface belongs to the first part whose plane it lies above, or else to the part on the build plate. A rim runs
over what the earlier planes have left. Faces are convex polygons in space, clipped by one plane after the other; normals and
corners are columns of (3, n) arrays.

The cost leaves out faces created by the cuts, though later cuts may turn them into overhangs. The parts include them, as fans:
the chord of every face in a plane makes a triangle with one point of that plane, and the signed areas of these triangles add up
to the cut face. Later planes cut them like any other face, which gives volumes by the divergence theorem.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from math import acos, degrees, sqrt
from typing import NamedTuple

import numpy as np

from mdp.cost.cost import CostTerms
from mdp.kernels.arrays import floats, ints, table
from mdp.kernels.kernel import kernel, no_nrt
from mdp.mesh import Floats, Indices, Ints
from mdp.overhang import Mask, step_share, threshold
from mdp.plane import Plane, normals_and_offsets
from mdp.support_need.patches import Classes
from mdp.sweep.crossing import ROUNDING_MM, weigh_chord
from mdp.sweep.cylinders import crossed_by
from mdp.sweep.facets import Blemishes, FaceTable, times_along
from mdp.sweep.limbs import cylinders_cut, limb_reach
from mdp.sweep.sweep import Remainder

LEAST_SINE = 0.01  # sine of the angle between face and plane; a chord along a face parallel to the plane has no definite length
NEEDED, RIM, COSINE, VOLUME, COLUMNS = range(5)  # columns of the sums over a part; NEEDED in mm2, RIM in mm
LEAST_EDGE_MM = 1e-3  # length of the line in which two cuts meet; a shorter sum over fans is rounding
Vector = tuple[float, float, float]


@dataclass(frozen=True)
class PartForecast:
    """A forecast part: the area that needs support, the visible length of its rim, the smallest edge angle that the cut makes,
    and its volume.
    """

    support_mm2: float
    rim_mm: float
    edge_deg: float
    volume_mm3: float


@dataclass(frozen=True, eq=False)
class Forecast:
    """Forecast for the remainder of a model, (k,) the numbers of its faces that count, and their blemishes without directions."""

    remainder: Remainder
    terms: CostTerms
    chosen: Indices
    blemishes: Blemishes

    @classmethod
    def of(cls, remainder: Remainder, terms: CostTerms, rim_weights: Floats | None = None) -> "Forecast":
        """Forecast for the surface of a remainder. rim_weights: (m,) cost of a mm of rim on each face; None: the remainder's own
        seam weights. If seams cost nothing, faces that no direction above the horizon makes risky are left out.
        """
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
        blemishes = Blemishes(np.zeros((0, 3)), faces, least, no_classes, remainder.weight, terms.feather, none_lost)
        return cls(remainder, terms, chosen, blemishes)

    def classes(self, planes: Sequence[Plane]) -> Classes:
        """(k, n) support class of each of the model's faces along each plane's normal."""
        return self.remainder.classes(normals_and_offsets(planes)[0])

    def reach(self, planes: Sequence[Plane]) -> Mask:
        """(k, m) whether each plane may cut each face: those of its limbs and those below them; (0, 0): all planes cut all
        faces.
        """
        if all(plane.limbs_mm is None for plane in planes):
            return np.zeros((0, 0), np.bool_)
        return np.stack([limb_reach(self.remainder, plane)[self.chosen] for plane in planes])

    def left_mm2(self, planes: Sequence[Plane], classes: Classes | None = None, reach: Mask | None = None) -> float:
        """Cost of cuts along the planes in this order, mm2: the remaining area that needs support, the seams, the stair-stepping,
        and a charge per cut.

        classes, reach: those of slightly tilted planes, to reuse; None: computed for these planes.
        """
        cuts_mm2 = self.terms.cut_mm2 * len(planes) + self._crossed_mm2(planes)
        normals, offsets_mm = normals_and_offsets(planes)
        needs = self.classes(planes) if classes is None else classes
        blemishes = self.blemishes._replace(directions=normals, classes=needs)
        return _sum_left(blemishes, offsets_mm, self.reach(planes) if reach is None else reach) + cuts_mm2

    def parts(self, planes: Sequence[Plane]) -> tuple[tuple[PartForecast, ...], float]:
        """The parts that planes cut off a whole model, in the order of the cuts, and the area of the first part that needs
        support when it is printed straight up, mm2. All faces of the model count.
        """
        middle, (directions, offsets_mm) = self.remainder.mesh.bounds_mm.mean(axis=0), normals_and_offsets(planes)
        apexes = middle - (directions @ middle - offsets_mm)[:, None] * directions
        blemishes = self.blemishes._replace(directions=directions, classes=self.classes(planes))
        sums = _sum_parts(blemishes, offsets_mm, self.reach(planes), apexes)
        rows, before = np.nonzero(np.abs(sums[:-1, COLUMNS:]) > LEAST_EDGE_MM)
        np.maximum.at(sums[:, COSINE], rows, np.abs((directions[rows] * directions[before]).sum(axis=1)))
        parts = (PartForecast(s[NEEDED], s[RIM], degrees(acos(min(s[COSINE], 1.0))), s[VOLUME]) for s in sums[:-1].tolist())
        return tuple(parts), float(sums[-1, NEEDED])

    def _crossed_mm2(self, planes: Sequence[Plane]) -> float:
        """Cost of the bores that planes cut askew; a bore counts until nothing of it is left, mm2."""
        left, crossed = self.remainder.cylinders if self.terms.feature_mm2 > 0.0 else (), 0.0
        for plane in planes:
            cut = cylinders_cut(self.remainder, left, plane)
            crossed += crossed_by(cut, plane)
            left = tuple(cylinder for cylinder in left if cylinder not in cut or cylinder.reaches_below(plane))
        return self.terms.feature_mm2 * crossed


@kernel
def _sum_left(blemishes: Blemishes, offsets_mm: Floats, reach: Mask) -> float:
    """Risky area, seams and stair-stepping of cuts in order, along the directions of the blemishes, mm2. reach (k, m): whether
    each cut may touch each face, (0, 0): all.
    """
    faces, normals, directions, cuts = blemishes.faces, blemishes.faces.normals, blemishes.directions, len(offsets_mm)
    polygon, spare, heights, ends = table(3, cuts + 4), table(3, cuts + 4), floats(cuts + 4, 0.0), table(3, 2)
    total = 0.0
    for face in range(len(faces.areas_mm2)):
        size, area = 3, faces.areas_mm2[face]
        _put_face(faces, face, polygon)
        for cut in range(cuts):
            if len(reach) > 0 and not reach[cut, face]:
                continue
            lowest, highest = _find_heights(polygon, size, directions[cut], offsets_mm[cut], heights)
            if highest <= 0.0:
                continue
            cosine, below = _along(normals, face, directions[cut]), 0.0
            if lowest < 0.0:
                if faces.seam_weights[face] > 0.0 and highest > ROUNDING_MM and lowest < -ROUNDING_MM:
                    chord_mm = _find_chord(polygon, heights, size, ends)
                    sine = max(np.sqrt(max(1.0 - cosine * cosine, 0.0)), LEAST_SINE)
                    total += faces.seam_weights[face] * chord_mm * (weigh_chord(cosine, blemishes.feather) / sine)
                size = _clip_below(polygon, spare, heights, size)
                polygon, spare = spare, polygon
                below = _flat_area_mm2(polygon, size, (normals[0, face], normals[1, face], normals[2, face]))
            if cosine < blemishes.risky_below:
                total += (area - below) * times_along(blemishes, cut, face) * faces.counts[face]
            total += (area - below) * faces.stair_weights[face] * step_share(cosine)
            area = below
            if lowest >= 0.0:
                break
        if faces.risky[face]:
            total += area * faces.counts[face]
        total += area * faces.stair_weights[face] * step_share(normals[2, face])
    return total


@no_nrt
def _put_face(faces: FaceTable, face: int, polygon: Floats) -> None:
    """Write the corners of a face into the first columns of `polygon`."""
    for corner in range(3):
        for axis in range(3):
            polygon[axis, corner] = faces.points[axis, faces.corners[corner, face]]


@no_nrt
def _along(vectors: Floats, column: int, d: Floats) -> float:
    """Product of a column of (3, n) vectors with a direction."""
    product: float = vectors[0, column] * d[0] + vectors[1, column] * d[1] + vectors[2, column] * d[2]
    return product


@no_nrt
def _find_heights(polygon: Floats, size: int, d: Floats, offset_mm: float, heights: Floats) -> tuple[float, float]:
    """Write the heights of a polygon's corners above a plane into `heights`; returns the least and the greatest."""
    lowest, highest = np.inf, -np.inf
    for i in range(size):
        heights[i] = _along(polygon, i, d) - offset_mm
        lowest, highest = min(lowest, heights[i]), max(highest, heights[i])
    return lowest, highest


@no_nrt
def _clip_below(polygon: Floats, below: Floats, heights: Floats, size: int) -> int:
    """Clip a convex polygon at height 0 and write the lower piece into `below`; returns the number of its corners."""
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
def _flat_area_mm2(polygon: Floats, size: int, normal: Vector) -> float:
    """Area of a flat convex polygon with a known unit normal."""
    twice, (x, y, z) = 0.0, normal
    for i in range(1, size - 1):
        a0, a1, a2 = polygon[0, i] - polygon[0, 0], polygon[1, i] - polygon[1, 0], polygon[2, i] - polygon[2, 0]
        b0, b1, b2 = polygon[0, i + 1] - polygon[0, 0], polygon[1, i + 1] - polygon[1, 0], polygon[2, i + 1] - polygon[2, 0]
        twice += x * (a1 * b2 - a2 * b1) + y * (a2 * b0 - a0 * b2) + z * (a0 * b1 - a1 * b0)
    return 0.5 * twice


@no_nrt
def _find_chord(polygon: Floats, heights: Floats, size: int, ends: Floats) -> float:
    """Write the ends (3, 2) of a convex polygon's chord at height 0 into `ends`, first the end where its outline rises; returns
    the chord's length, mm. The polygon must reach to both sides.
    """
    for i in range(size):
        j = i + 1 if i + 1 < size else 0
        if (heights[i] > 0.0) != (heights[j] > 0.0):
            share = heights[i] / (heights[i] - heights[j])
            for axis in range(3):
                ends[axis, int(heights[i] > 0.0)] = polygon[axis, i] + share * (polygon[axis, j] - polygon[axis, i])
    return float(np.sqrt((ends[0, 1] - ends[0, 0]) ** 2 + (ends[1, 1] - ends[1, 0]) ** 2 + (ends[2, 1] - ends[2, 0]) ** 2))


class Division(NamedTuple):
    """State of dividing the faces of a model among parts: the cuts' offsets (k,), the faces that each may cut (k, m) or (0, 0)
    for all, and a point in each cut (k, 3); the sums of _sum_parts; pending triangles: (3, 3 n) corners, (n,) the cut whose fan
    each belongs to, -1 for a face of the model, and the next plane; two polygons, their heights above a plane, and the ends of a
    chord.
    """

    offsets_mm: Floats
    reach: Mask
    apexes: Floats
    sums: Floats
    corners: Floats
    fans: Ints
    cuts: Ints
    polygon: Floats
    spare: Floats
    heights: Floats
    ends: Floats


@kernel
def _sum_parts(blemishes: Blemishes, offsets_mm: Floats, reach: Mask, apexes: Floats) -> Floats:
    """(k + 1, COLUMNS + k) sums over the parts in the order of the cuts, the remainder last; the last k columns hold the signed
    length of the line in which the plane of a row meets an earlier cut (column).
    """
    count = len(offsets_mm)
    sums, most = table(count + 1, COLUMNS + count), (count + 1) * (count + 2) // 2
    corners, fans, cuts = table(3, 3 * most), ints(most, 0), ints(most, 0)
    polygon, spare, heights, ends = table(3, count + 4), table(3, count + 4), floats(count + 4, 0.0), table(3, 2)
    division = Division(offsets_mm, reach, apexes, sums, corners, fans, cuts, polygon, spare, heights, ends)
    for face in range(len(blemishes.faces.areas_mm2)):
        fans[0], cuts[0], waiting = -1, 0, 1
        _put_face(blemishes.faces, face, corners)
        while waiting > 0:
            waiting = _divide(blemishes, division, face, waiting - 1)
    return sums


@no_nrt
def _divide(blemishes: Blemishes, division: Division, face: int, waiting: int) -> int:
    """Divide the last pending triangle among the parts; returns the number of triangles still pending."""
    fan, cut, directions, count = division.fans[waiting], division.cuts[waiting], blemishes.directions, len(division.offsets_mm)
    polygon, spare, heights, ends, sums = division.polygon, division.spare, division.heights, division.ends, division.sums
    x, y, z = blemishes.faces.normals[0, face], blemishes.faces.normals[1, face], blemishes.faces.normals[2, face]
    if fan >= 0:
        x, y, z = directions[fan, 0], directions[fan, 1], directions[fan, 2]
    for corner in range(3):
        for axis in range(3):
            polygon[axis, corner] = division.corners[axis, 3 * waiting + corner]
    size, area = 3, _flat_area_mm2(polygon, 3, (x, y, z))
    while cut < count and size > 0:
        if len(division.reach) > 0 and not division.reach[cut, face]:
            cut += 1
            continue
        d, apex = directions[cut], division.apexes[cut]
        lowest, highest = _find_heights(polygon, size, d, division.offsets_mm[cut], heights)
        if highest > 0.0:
            cosine, left = x * d[0] + y * d[1] + z * d[2], 0.0
            height = polygon[0, 0] * x + polygon[1, 0] * y + polygon[2, 0] * z - (apex[0] * x + apex[1] * y + apex[2] * z)
            if lowest < 0.0:
                length = _find_chord(polygon, heights, size, ends)
                if fan >= 0:
                    sums[cut, COLUMNS + fan] += _signed(ends, directions[fan], d)
                elif highest > ROUNDING_MM and lowest < -ROUNDING_MM:
                    sums[cut, COSINE] = max(sums[cut, COSINE], abs(cosine))
                    sums[cut, RIM] += length if blemishes.faces.seam_weights[face] > 0.0 else 0.0
                _add_fan(division, waiting, cut)
                waiting += 1
                size = _clip_below(polygon, spare, heights, size)
                polygon, spare = spare, polygon
                left = _flat_area_mm2(polygon, size, (x, y, z))
            else:
                size = 0
            sums[cut, VOLUME] += (area - left) * height / 3.0
            if cosine < blemishes.risky_below:
                needing = fan >= 0 or times_along(blemishes, cut, face) > 0.0
                sums[cut, NEEDED] += area - left if needing else 0.0
            area = left
        cut += 1
    if size > 0 and (blemishes.faces.risky[face] if fan < 0 else z < blemishes.risky_below):
        sums[count, NEEDED] += area
    return waiting


@no_nrt
def _add_fan(division: Division, waiting: int, cut: int) -> None:
    """Add the triangle of a chord and a point of its plane to the pending ones: it closes the remainder below the plane."""
    division.fans[waiting], division.cuts[waiting] = cut, cut + 1
    for axis in range(3):
        division.corners[axis, 3 * waiting] = division.apexes[cut, axis]
        division.corners[axis, 3 * waiting + 1] = division.ends[axis, 1]
        division.corners[axis, 3 * waiting + 2] = division.ends[axis, 0]


@no_nrt
def _signed(ends: Floats, first: Floats, second: Floats) -> float:
    """Length of a chord along the line in which two planes with these normals meet, signed by its direction."""
    total = 0.0
    for axis in range(3):
        j, k = (axis + 1) % 3, (axis + 2) % 3
        total += (ends[axis, 1] - ends[axis, 0]) * (first[j] * second[k] - first[k] * second[j])
    return total
