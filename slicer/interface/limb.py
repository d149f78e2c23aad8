"""Limb: a part beside which earlier parts stand above its base plane: where it and its support are, and where the head goes."""

from collections.abc import Sequence
from functools import lru_cache
from itertools import pairwise

import numpy as np

from mdp.clearance import Standing, highest_in_cells, subdivide
from mdp.cut import solid_of
from mdp.decomposition import Part
from mdp.overhang import Mask
from profiles.machine import Machine
from slicer.geometry.polygons import Polygons, offset_round, union

AROUND_MM = 5.0  # support of a limb stays within this distance of its shadow
COARSE_MM = 0.05  # tolerance to which a shadow is simplified
CELL_MM, COARSER = 0.5, 1.5  # grid on which the height of the tip is computed, and the factor by which it is coarsened
MOST_PAIRS = 200_000_000  # of a grid cell and a point that stands
LOW_MM = 0.05  # up to this height above the base plane is the cut face itself
PLACES_KEPT = 64


@lru_cache(PLACES_KEPT)
def shadow_of(limb: Part) -> Polygons:
    """The outline of a limb seen along its direction, in its frame."""
    return solid_of(limb.in_part_frame()).project().simplify(COARSE_MM)


@lru_cache(PLACES_KEPT)
def room_of(limb: Part) -> Polygons:
    """The area of a limb's base plane over which it and its support are printed."""
    return offset_round(shadow_of(limb), AROUND_MM)


def head_room(limb: Part, machine: Machine, gap_mm: float) -> list[tuple[float, Polygons]]:
    """Heights above a limb's base plane, each with the area in which nothing may stand higher while the limb is printed.

    The tip is assumed to reach down to the base plane everywhere in the limb's room. Nothing below -gap_mm is forbidden.
    """
    room, clearance_mm, profile = room_of(limb), machine.clearance_mm, machine.head.silhouette_mm
    rings = [(-gap_mm, profile[0][0])]
    rings += [(height - clearance_mm, wider) for (_, height), (wider, _) in pairwise(profile)]
    levels = [(max(low_mm, -gap_mm), offset_round(room, radius + clearance_mm)) for low_mm, radius in rings]
    x0, y0, x1, y1 = room.bounds()
    for box in machine.head.boxes:
        low, high = (np.array(corner[:2]) for corner in (box.min_mm, box.max_mm))
        x, y = np.array([x0, y0]) + low - clearance_mm
        right, back = np.array([x1, y1]) + high + clearance_mm
        levels.append((max(box.min_mm[2] - clearance_mm, -gap_mm), Polygons.square((right - x, back - y)).translate((x, y))))
    return levels


def out_of_reach(limb: Part, earlier: Sequence[Part], tips_mm: Sequence[float], machine: Machine) -> list[Polygons]:
    """For each height of the tip the area of a limb's room, in its frame, where the head would meet what stands."""
    x0, y0, x1, y1 = room_of(limb).bounds()
    cell_mm = CELL_MM
    stands = standing_beside(limb, earlier, machine, cell_mm)
    while len(stands.points_mm) * (x1 - x0) * (y1 - y0) > MOST_PAIRS * cell_mm**2:
        cell_mm *= COARSER
        stands = standing_beside(limb, earlier, machine, cell_mm)
    sizes = np.ceil([(x1 - x0) / cell_mm, (y1 - y0) / cell_mm]).astype(np.int64)
    columns, rows = (corner + cell_mm * (np.arange(size) + 0.5) for corner, size in zip((x0, y0), sizes, strict=True))
    places = np.stack(np.meshgrid(columns, rows), axis=-1)
    least_mm = stands.least_tip_mm(places.reshape(-1, 2), min(tips_mm, default=0.0)).reshape(places.shape[:2])
    covered: dict[int, Polygons] = {}  # by the count of cells: those of a higher tip are among those of a lower one
    reaches = []
    for tip_mm in tips_mm:
        met = least_mm > tip_mm
        count = int(met.sum())
        if count not in covered:
            rectangles = [_rectangles(met[row], x0, float(rows[row]), cell_mm) for row in np.flatnonzero(met.any(axis=1))]
            covered[count] = union([rectangle for of_row in rectangles for rectangle in of_row])
        reaches.append(covered[count])
    return reaches


def standing_beside(limb: Part, earlier: Sequence[Part], machine: Machine, cell_mm: float) -> Standing:
    """What of earlier parts' models stands above a limb's base plane; cell_mm: the grid on which it will be asked."""
    points = [np.zeros((0, 3))]
    for part in earlier:
        mesh = part.mesh.transform(limb.rotation, (0.0, 0.0, -limb.base.offset_mm))
        corners = mesh.vertices[mesh.faces]
        corners = subdivide(np.ascontiguousarray(corners[corners[:, :, 2].max(axis=1) > 0.0]), 2.0 * cell_mm)
        points.append(corners.reshape(-1, 3))
    tops = np.concatenate(points)
    tops = highest_in_cells(tops[tops[:, 2] > LOW_MM], cell_mm)
    # Half the diagonal of either cell, and the distance from the middle of such a triangle to its corners.
    return Standing.of(tops, 2.6 * cell_mm, machine)


def _rectangles(met: Mask, x0: float, middle_mm: float, cell_mm: float) -> list[Polygons]:
    """Rectangles over the marked cells of a row."""
    steps = np.diff(np.concatenate([[0], met.astype(np.int8), [0]]))
    pairs = zip(np.flatnonzero(steps > 0).tolist(), np.flatnonzero(steps < 0).tolist(), strict=True)
    low = middle_mm - 0.5 * cell_mm
    return [Polygons.square(((end - begin) * cell_mm, cell_mm)).translate((x0 + begin * cell_mm, low)) for begin, end in pairs]
