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

from mdp.cost.cost import CostTerms
from mdp.cost.forecast import (
    Faces,
    Planes,
    along,
    clip_below,
    faces_of,
    find_chord,
    find_heights,
    flat_area_mm2,
    planes_of,
    reach_of,
    weight_along,
)
from mdp.kernels.arrays import floats, ints, table
from mdp.kernels.kernel import kernel, no_nrt
from mdp.mesh import Floats, Ints
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
        faces = faces_of(remainder, terms, weights, np.ones(len(weights), dtype=np.bool_))
        return cls(remainder, faces, remainder.mesh.bounds_mm.mean(axis=0))

    def parts(self, planes: Sequence[Plane]) -> tuple[tuple[PartForecast, ...], float]:
        """The parts that planes cut off, in the order of the cuts, and the area of what remains that needs support printed
        straight up, mm2."""
        every = np.ones(len(self.faces.areas_mm2), np.bool_)
        cuts = planes_of(planes, reach_of(self.remainder, planes, every))
        directions = cuts.directions
        apexes = self.middle - (directions @ self.middle - cuts.offsets_mm)[:, None] * directions
        meeting = np.zeros((len(planes), len(planes)))
        sums = _sum_parts(self.faces, Cuts(cuts, apexes, self.remainder.classes(directions)), meeting)
        rows, before = np.nonzero(np.abs(meeting) > LEAST_EDGE_MM)
        np.maximum.at(sums[:, COSINE], rows, np.abs((directions[rows] * directions[before]).sum(axis=1)))
        return tuple(_part(row) for row in sums[:-1]), float(sums[-1, NEEDED])


def _part(row: Floats) -> PartForecast:
    values = [float(value) for value in row]
    return PartForecast(values[NEEDED], values[RIM], degrees(acos(min(values[COSINE], 1.0))), values[VOLUME])


class Cuts(NamedTuple):
    """Base planes in the order of their cuts, (k, 3) points in them, and (k, n) what the faces of the model need along each."""

    planes: Planes
    apexes: Floats
    classes: Classes


class Sums(NamedTuple):
    """What is summed: (k + 1, COLUMNS) over the parts in the order of the cuts, the last one what remains; meeting (k, k), the
    signed length of the line in which a plane (row) meets the cut of one before (column)."""

    parts: Floats
    meeting: Floats


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
def _sum_parts(surface: Faces, cuts: Cuts, meeting: Floats) -> Floats:
    """The sums over the parts; the other ones are put into meeting."""
    count = len(cuts.apexes)
    sums, most = Sums(table(count + 1, COLUMNS), meeting), (count + 1) * (count + 2) // 2
    polygon, spare, heights = table(count + 4, 3), table(count + 4, 3), floats(count + 4, 0.0)
    room = Room(table(3 * most, 3), ints(most, 0), ints(most, 0), polygon, spare, heights, table(2, 3))
    for face in range(len(surface.areas_mm2)):
        room.fans[0], room.cuts[0], waiting = -1, 0, 1
        for corner in range(3):
            for axis in range(3):
                room.corners[corner, axis] = surface.corners[face, corner, axis]
        while waiting > 0:
            waiting = _divide(surface, cuts, room, face, waiting - 1, sums)
    return sums.parts


@no_nrt
def _divide(surface: Faces, cuts: Cuts, room: Room, face: int, waiting: int, sums: Sums) -> int:
    """Divide the last triangle that waits among the parts; how many wait afterwards."""
    fan, cut, directions, size = room.fans[waiting], room.cuts[waiting], cuts.planes.directions, 3
    polygon, spare, heights, ends, parts = room.polygon, room.spare, room.heights, room.ends, sums.parts
    normals, row = (surface.normals, face) if fan < 0 else (directions, int(fan))
    for corner in range(3):
        for axis in range(3):
            polygon[corner, axis] = room.corners[3 * waiting + corner, axis]
    area = flat_area_mm2(polygon, size, normals, row)
    while cut < len(directions) and size > 0:
        if len(cuts.planes.reach) > 0 and not cuts.planes.reach[cut, face]:
            cut += 1
            continue
        lowest, highest = find_heights(polygon, size, cuts.planes, cut, heights)
        if highest > 0.0:
            cosine, left = along(normals, row, directions, cut), 0.0
            height = along(polygon, 0, normals, row) - along(cuts.apexes, cut, normals, row)
            if lowest < 0.0:
                length = find_chord(polygon, heights, size, ends)
                if fan >= 0:
                    sums.meeting[cut, fan] += _signed(ends, directions, fan, cut)
                elif highest > ROUNDING_MM and lowest < -ROUNDING_MM:
                    parts[cut, COSINE] = max(parts[cut, COSINE], abs(cosine))
                    parts[cut, RIM] += length if surface.rim_weights[face] > 0.0 else 0.0
                _add_fan(room, waiting, cuts.apexes[cut], cut)
                waiting += 1
                size = clip_below(polygon, spare, heights, size)
                polygon, spare = spare, polygon
                left = flat_area_mm2(polygon, size, normals, row)
            else:
                size = 0
            parts[cut, VOLUME] += (area - left) * height / 3.0
            if cosine < surface.risky_below:
                needing = fan >= 0 or weight_along(surface, cuts.classes, cut, face) > 0.0
                parts[cut, NEEDED] += area - left if needing else 0.0
            area = left
        cut += 1
    if size > 0 and (surface.risky[face] if fan < 0 else directions[fan, 2] < surface.risky_below):
        parts[len(directions), NEEDED] += area
    return waiting


@no_nrt
def _add_fan(room: Room, waiting: int, apex: Floats, cut: int) -> None:
    """Have the triangle of a chord and a point of its plane wait: it closes what remains below the plane."""
    room.fans[waiting], room.cuts[waiting] = cut, cut + 1
    for axis in range(3):
        room.corners[3 * waiting, axis] = apex[axis]
        room.corners[3 * waiting + 1, axis] = room.ends[1, axis]
        room.corners[3 * waiting + 2, axis] = room.ends[0, axis]


@no_nrt
def _signed(ends: Floats, directions: Floats, first: int, second: int) -> float:
    """Length of a chord along the line in which two planes meet, with the sign of its sense."""
    total = 0.0
    for axis in range(3):
        j, k = (axis + 1) % 3, (axis + 2) % 3
        across = directions[first, j] * directions[second, k] - directions[first, k] * directions[second, j]
        total += (ends[1, axis] - ends[0, axis]) * across
    return total
