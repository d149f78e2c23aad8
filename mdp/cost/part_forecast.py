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

from mdp.cost.forecast import Planes, Surface, along, clip_below, find_chord, find_heights, flat_area_mm2, planes_of, put_face
from mdp.kernels.arrays import floats, ints, table
from mdp.kernels.kernel import kernel, no_nrt
from mdp.mesh import Floats, Ints
from mdp.plane import Plane
from mdp.sweep.facets import Scars, times_along
from mdp.sweep.rims import ROUNDING_MM

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


def forecast_parts(surface: Surface, planes: Sequence[Plane]) -> tuple[tuple[PartForecast, ...], float]:
    """The parts that planes cut off a whole model, all of whose faces count, in the order of the cuts, and what of the rest needs
    support printed straight up, mm2."""
    remainder, cuts = surface.remainder, planes_of(planes, surface.reach(planes))
    middle, directions = remainder.mesh.bounds_mm.mean(axis=0), np.ascontiguousarray(cuts.directions.T)
    apexes = middle - (directions @ middle - cuts.offsets_mm)[:, None] * directions
    scars, cuts = surface.scars._replace(classes=surface.classes(planes)), cuts._replace(apexes=np.ascontiguousarray(apexes.T))
    sums = _sum_parts(scars, cuts)
    rows, before = np.nonzero(np.abs(sums[:-1, COLUMNS:]) > LEAST_EDGE_MM)
    np.maximum.at(sums[:, COSINE], rows, np.abs((directions[rows] * directions[before]).sum(axis=1)))
    return tuple(_part(row) for row in sums[:-1]), float(sums[-1, NEEDED])


def _part(row: Floats) -> PartForecast:
    values = [float(value) for value in row]
    return PartForecast(values[NEEDED], values[RIM], degrees(acos(min(values[COSINE], 1.0))), values[VOLUME])


class Room(NamedTuple):
    """Triangles that wait to be cut: (3, 3 n) corners, (n,) the cut whose fan each belongs to, below 0: it is a face of the
    model, and the plane that is next; two polygons, their heights above a plane, and the ends of a chord."""

    corners: Floats
    fans: Ints
    cuts: Ints
    polygon: Floats
    spare: Floats
    heights: Floats
    ends: Floats


@kernel
def _sum_parts(scars: Scars, cuts: Planes) -> Floats:
    """(k + 1, COLUMNS + k) the sums over the parts in the order of the cuts, the last one what remains; behind them the signed
    length of the line in which a plane (row) meets the cut of one before (column)."""
    count = len(cuts.offsets_mm)
    sums, most = table(count + 1, COLUMNS + count), (count + 1) * (count + 2) // 2
    polygon, spare, heights = table(3, count + 4), table(3, count + 4), floats(count + 4, 0.0)
    room = Room(table(3, 3 * most), ints(most, 0), ints(most, 0), polygon, spare, heights, table(3, 2))
    for face in range(len(scars.faces.areas_mm2)):
        room.fans[0], room.cuts[0], waiting = -1, 0, 1
        put_face(scars.faces, face, room.corners)
        while waiting > 0:
            waiting = _divide(scars, cuts, room, face, waiting - 1, sums)
    return sums


@no_nrt
def _divide(scars: Scars, cuts: Planes, room: Room, face: int, waiting: int, sums: Floats) -> int:
    """Divide the last triangle that waits among the parts; how many wait afterwards."""
    fan, cut, directions, size, count = room.fans[waiting], room.cuts[waiting], cuts.directions, 3, len(cuts.offsets_mm)
    polygon, spare, heights, ends = room.polygon, room.spare, room.heights, room.ends
    normals, column = (scars.faces.normals, face) if fan < 0 else (directions, int(fan))
    for corner in range(3):
        for axis in range(3):
            polygon[axis, corner] = room.corners[axis, 3 * waiting + corner]
    area = flat_area_mm2(polygon, size, normals, column)
    while cut < count and size > 0:
        if len(cuts.reach) > 0 and not cuts.reach[cut, face]:
            cut += 1
            continue
        lowest, highest = find_heights(polygon, size, cuts, cut, heights)
        if highest > 0.0:
            cosine, left = along(normals, column, directions, cut), 0.0
            height = along(polygon, 0, normals, column) - along(cuts.apexes, cut, normals, column)
            if lowest < 0.0:
                length = find_chord(polygon, heights, size, ends)
                if fan >= 0:
                    sums[cut, COLUMNS + fan] += _signed(ends, directions, fan, cut)
                elif highest > ROUNDING_MM and lowest < -ROUNDING_MM:
                    sums[cut, COSINE] = max(sums[cut, COSINE], abs(cosine))
                    sums[cut, RIM] += length if scars.faces.seam_weights[face] > 0.0 else 0.0
                _add_fan(room, waiting, cuts.apexes, cut)
                waiting += 1
                size = clip_below(polygon, spare, heights, size)
                polygon, spare = spare, polygon
                left = flat_area_mm2(polygon, size, normals, column)
            else:
                size = 0
            sums[cut, VOLUME] += (area - left) * height / 3.0
            if cosine < scars.risky_below:
                needing = fan >= 0 or times_along(scars, cut, face) > 0.0
                sums[cut, NEEDED] += area - left if needing else 0.0
            area = left
        cut += 1
    if size > 0 and (scars.faces.risky[face] if fan < 0 else directions[2, fan] < scars.risky_below):
        sums[count, NEEDED] += area
    return waiting


@no_nrt
def _add_fan(room: Room, waiting: int, apexes: Floats, cut: int) -> None:
    """Have the triangle of a chord and a point of its plane wait: it closes what remains below the plane."""
    room.fans[waiting], room.cuts[waiting] = cut, cut + 1
    for axis in range(3):
        room.corners[axis, 3 * waiting] = apexes[axis, cut]
        room.corners[axis, 3 * waiting + 1] = room.ends[axis, 1]
        room.corners[axis, 3 * waiting + 2] = room.ends[axis, 0]


@no_nrt
def _signed(ends: Floats, directions: Floats, first: int, second: int) -> float:
    """Length of a chord along the line in which two planes meet, with the sign of its sense."""
    total = 0.0
    for axis in range(3):
        j, k = (axis + 1) % 3, (axis + 2) % 3
        across = directions[j, first] * directions[k, second] - directions[k, first] * directions[j, second]
        total += (ends[axis, 1] - ends[axis, 0]) * across
    return total
