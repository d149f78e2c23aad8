"""Part forecast: how large every part of a sequence of planes is and what of it needs support, summed over a model's surface
without cutting it.

As in mdp.cost.forecast a piece of the surface belongs to the first part whose plane it lies above. The faces that cuts lay open
are counted as fans: the chord of every face in a plane makes a triangle with one point of that plane, and the areas of these
triangles, with their signs, add up to the cut. They are cut by the planes that follow like any other face, which gives volumes
by the divergence theorem.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from math import acos, degrees
from typing import NamedTuple

import numpy as np

from mdp.cost.clipping import along, clip_below, find_chord, flat_area_mm2
from mdp.cost.cost import CostTerms
from mdp.cost.forecast import Faces, counts_of, weight_along
from mdp.kernels.arrays import floats, ints, table
from mdp.kernels.kernel import inlined, kernel, part
from mdp.mesh import Floats, Ints
from mdp.overhang import threshold
from mdp.plane import Plane
from mdp.support_need.patches import Classes
from mdp.sweep.rims import ROUNDING_MM
from mdp.sweep.sweep import Remainder

NEEDED, RIM, COSINE, VOLUME, COLUMNS = range(5)  # of the sums over a part; the others are mm2 and mm
LEAST_EDGE_MM = 1e-3  # of the line in which two cuts meet; fans leave less than nothing


@dataclass(frozen=True)
class PartForecast:
    """A part cut off: what of it needs support, the length of its rim where it is seen, the smallest angle of an edge that the
    cut makes, and its volume."""

    support_mm2: float
    rim_mm: float
    edge_deg: float
    volume_mm3: float


@dataclass(frozen=True, eq=False)
class ModelForecast:
    """A whole model laid out for forecasts of its parts. middle: a point in it."""

    remainder: Remainder
    faces: Faces
    middle: Floats

    @classmethod
    def of(cls, remainder: Remainder, weights: Floats, terms: CostTerms) -> "ModelForecast":
        """The forecasts of an uncut model; weights (m,): how much a mm of rim counts on each face."""
        mesh, pieces = remainder.mesh, remainder.pieces
        sources = np.zeros(0, np.int32) if pieces is None else pieces.sources
        weight = 1.0 if pieces is None else pieces.need.weight
        corners, risky_below = mesh.vertices[mesh.faces], threshold(terms.angle_deg)
        areas, normals = mesh.areas_mm2, mesh.normals
        faces = Faces(
            corners, normals, areas, remainder.risky, risky_below, weights, terms.feather, sources, weight, counts_of(remainder)
        )
        return cls(remainder, faces, mesh.bounds_mm.mean(axis=0))

    def parts(self, planes: Sequence[Plane]) -> tuple[tuple[PartForecast, ...], float]:
        """The parts that planes cut off, in the order of the cuts, and the area of what remains that needs support printed
        straight up, mm2."""
        directions = np.array([plane.normal for plane in planes], dtype=np.float64).reshape(-1, 3)
        offsets = np.array([plane.offset_mm for plane in planes], dtype=np.float64)
        apexes = self.middle - (directions @ self.middle - offsets)[:, None] * directions
        pieces = self.remainder.pieces
        classes = np.zeros((len(planes), 0), np.uint8) if pieces is None else pieces.need.along(directions)
        meeting = np.zeros((len(planes), len(planes)))
        sums = _sum_parts(self.faces, Planes(directions, offsets, apexes), classes, meeting)
        rows, before = np.nonzero(np.abs(meeting) > LEAST_EDGE_MM)
        np.maximum.at(sums[:, COSINE], rows, np.abs((directions[rows] * directions[before]).sum(axis=1)))
        return tuple(_part(row) for row in sums[:-1]), float(sums[-1, NEEDED])


def _part(row: Floats) -> PartForecast:
    values = [float(value) for value in row]
    return PartForecast(values[NEEDED], values[RIM], degrees(acos(min(values[COSINE], 1.0))), values[VOLUME])


class Planes(NamedTuple):
    """Base planes in the order of their cuts: (k, 3) normals, (k,) offsets and (k, 3) points in them."""

    directions: Floats
    offsets_mm: Floats
    apexes: Floats


class Room(NamedTuple):
    """Triangles that wait to be cut: (3 n, 3) corners, (n,) the cut whose fan each belongs to, below 0: it is a face of the
    model, and the plane that is next; two polygons, their heights above a plane, and the ends of a chord."""

    corners: Floats
    fans: Ints
    cuts: Ints
    polygon: Floats
    spare: Floats
    heights: Floats
    ends: Floats


@kernel
def _sum_parts(surface: Faces, planes: Planes, classes: Classes, meeting: Floats) -> Floats:
    """(k + 1, COLUMNS) sums over the parts in the order of the cuts, the last one what remains; meeting (k, k) is given the
    signed length of the line in which a plane (row) meets the cut of one before (column)."""
    count = len(planes.offsets_mm)
    sums, most = table(count + 1, COLUMNS), (count + 1) * (count + 2) // 2
    polygon, spare, heights = table(count + 4, 3), table(count + 4, 3), floats(count + 4, 0.0)
    room = Room(table(3 * most, 3), ints(most, 0), ints(most, 0), polygon, spare, heights, table(2, 3))
    for face in range(len(surface.areas_mm2)):
        room.fans[0], room.cuts[0], waiting = -1, 0, 1
        for corner in range(3):
            for axis in range(3):
                room.corners[corner, axis] = surface.corners[face, corner, axis]
        while waiting > 0:
            waiting = _divide(surface, planes, classes, room, face, waiting - 1, sums, meeting)
    return sums


@inlined
def _divide(
    surface: Faces, planes: Planes, classes: Classes, room: Room, face: int, waiting: int, sums: Floats, meeting: Floats
) -> int:
    """Divide the last triangle that waits among the parts; how many wait afterwards."""
    fan, cut, count, size = room.fans[waiting], room.cuts[waiting], len(planes.offsets_mm), 3
    polygon, spare, heights, ends = room.polygon, room.spare, room.heights, room.ends
    normals, row = (surface.normals, face) if fan < 0 else (planes.directions, int(fan))
    for corner in range(3):
        for axis in range(3):
            polygon[corner, axis] = room.corners[3 * waiting + corner, axis]
    area = flat_area_mm2(polygon, size, normals, row)
    while cut < count and size > 0:
        lowest, highest = np.inf, -np.inf
        for i in range(size):
            heights[i] = along(polygon, i, planes.directions, cut) - planes.offsets_mm[cut]
            lowest, highest = min(lowest, heights[i]), max(highest, heights[i])
        if highest > 0.0:
            height, left = along(polygon, 0, normals, row) - along(planes.apexes, cut, normals, row), 0.0
            if lowest < 0.0:
                length = find_chord(polygon, heights, size, ends)
                if fan >= 0:
                    meeting[cut, fan] += _signed(ends, planes.directions, fan, cut)
                elif highest > ROUNDING_MM and lowest < -ROUNDING_MM:
                    _add_rim(surface, face, along(normals, row, planes.directions, cut), length, sums[cut])
                _add_fan(room, waiting, planes.apexes[cut], cut)
                waiting += 1
                size = clip_below(polygon, spare, heights, size)
                polygon, spare = spare, polygon
                left = flat_area_mm2(polygon, size, normals, row)
            else:
                size = 0
            sums[cut, VOLUME] += (area - left) * height / 3.0
            if along(normals, row, planes.directions, cut) < surface.risky_below:
                needing = fan >= 0 or weight_along(surface, classes, cut, face) > 0.0
                sums[cut, NEEDED] += area - left if needing else 0.0
            area = left
        cut += 1
    if size > 0 and (surface.risky[face] if fan < 0 else planes.directions[fan, 2] < surface.risky_below):
        sums[count, NEEDED] += area
    return waiting


@part
def _add_fan(room: Room, waiting: int, apex: Floats, cut: int) -> None:
    """Have the triangle of a chord and a point of its plane wait: it closes what remains below the plane."""
    room.fans[waiting], room.cuts[waiting] = cut, cut + 1
    for axis in range(3):
        room.corners[3 * waiting, axis] = apex[axis]
        room.corners[3 * waiting + 1, axis] = room.ends[1, axis]
        room.corners[3 * waiting + 2, axis] = room.ends[0, axis]


@part
def _add_rim(surface: Faces, face: int, cosine: float, length: float, sums: Floats) -> None:
    """Add the chord of a face of the model to the sums of a part."""
    sums[COSINE] = max(sums[COSINE], abs(cosine))
    sums[RIM] += length if surface.seam_mm[face] > 0.0 else 0.0


@part
def _signed(ends: Floats, directions: Floats, one: int, other: int) -> float:
    """Length of a chord along the line in which two planes meet, with the sign of its sense."""
    total = 0.0
    for axis in range(3):
        j, k = (axis + 1) % 3, (axis + 2) % 3
        across = directions[one, j] * directions[other, k] - directions[one, k] * directions[other, j]
        total += (ends[1, axis] - ends[0, axis]) * across
    return total
