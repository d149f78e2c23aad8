"""Blocker: where support would be in the way of parts printed later, or the head in that of the table or of what stands beside a
limb, or a person wants none."""

from collections.abc import Sequence
from itertools import pairwise

import numpy as np

from mdp.clearance import Standing, highest_in_cells, least_tip_height_mm, subdivide
from mdp.decomposition import Part
from mdp.mesh import Floats
from mdp.overhang import Mask
from mdp.pose import UP
from profiles.machine import Machine
from slicer.geometry.polygons import Polygons, half_plane, offset, offset_round, union, unite_layers
from slicer.heights import Heights
from slicer.interface.base_plane import LEVEL, BasePlane, plane_in_frame_of, room_of
from slicer.interface.interface import in_frame_of
from slicer.sections import Sections
from slicer.support.reachable import EVEN_MM

AROUND_MM = 20.0  # support needs no more space around a part than its lean and this
CELL_MM, COARSER = 0.5, 1.5  # grid on which the height of the tip is computed, and the factor by which it is coarsened
MOST_PAIRS = 200_000_000  # of a grid cell and a point that stands
LOW_MM = 0.05  # up to this height above the base plane is the cut face itself


def support_reach_mm(sections: Sections) -> float:
    """A distance from the origin that no support of a part ever reaches."""
    low, high = sections.mesh.bounds_mm
    return float(np.hypot(*np.maximum(np.abs(low), np.abs(high))[:2]) + 2.0 * high[2]) + AROUND_MM


def blocked_areas(sections: Sections, count: int, gap_mm: float, far_mm: float) -> list[Polygons]:
    """For each of the lowest layers where support cannot be, or where a person wants none.

    gap_mm: what it keeps from later parts' base planes; far_mm: how far from the origin all ends.
    """
    heights = sections.heights[:count]
    blocked = above_base_planes(sections.part, sections.later, heights, gap_mm, far_mm, sections.profile.machine)
    if sections.standing:
        blocked = unite_layers(blocked, beside_standing(sections, slice(count), far_mm))
    if sections.no_support:
        blocked = unite_layers(blocked, unwanted_areas(sections)[:count])
    return blocked


def unwanted_areas(sections: Sections) -> list[Polygons]:
    """For each layer where a person wants no support: in the boxes, and over the faces as far as what would stand on them."""
    heights, gap_mm = sections.heights, sections.process.support_bottom_gap_mm
    near = np.searchsorted(heights.tip_mm, heights.bottom_mm - gap_mm + EVEN_MM, side="right")
    return [union(sections.no_support[max(lowest - 1, 0) : k + 1]) for k, lowest in enumerate(near.tolist())]


def above_base_planes(
    part: Part, later: Sequence[Part], heights: Heights, gap_mm: float, far_mm: float, machine: Machine
) -> list[Polygons]:
    """The area of each layer above the base plane of any later part, taken as lower by gap_mm.

    While a part is printed the head moves above its base plane, so nothing may stand there, near that part or not. A limb only
    forbids what the head could meet.
    """
    limbs = [upper for upper in later if upper.base.limbs_mm is not None]
    whole = [upper for upper in later if upper.base.limbs_mm is None]
    planes = [plane_in_frame_of(part, upper.base.normal, upper.base.offset_mm - gap_mm) for upper in whole]
    blocked = _above_planes(planes, heights, far_mm)
    for limb in limbs:
        for low_mm, places in head_room(limb, machine, gap_mm):
            plane = BasePlane.of(part, limb, heights, far_mm, places)
            blocked = unite_layers(blocked, [plane.band(layer, low_mm, np.inf) for layer in range(len(blocked))])
    return blocked


def beside_standing(sections: Sections, layers: slice, far_mm: float) -> list[Polygons]:
    """For some layers of a limb the area that is too near to earlier parts, out of the head's reach or too far from the limb."""
    part, process, machine = sections.part, sections.support_process, sections.profile.machine
    gap_mm = max(process.support_gap_mm, process.support_bottom_gap_mm)
    heights, stands = sections.heights[layers], sections.standing[layers]
    outside = Polygons.square((2.0 * far_mm, 2.0 * far_mm), True) - room_of(part)
    reaches = out_of_reach(part, sections.earlier, heights.tip_mm.tolist(), machine)
    low = np.searchsorted(heights.tip_mm, heights.bottom_mm - gap_mm)
    high = np.searchsorted(heights.bottom_mm, heights.tip_mm + gap_mm)
    near = [union(stands[a:b]) for a, b in zip(low.tolist(), high.tolist(), strict=True)]
    beside = [offset(area, process.support_distance_mm) if not area.is_empty() else area for area in near]
    return [union([outside, *areas]) for areas in zip(beside, reaches, strict=True)]


def near_table(sections: Sections, heights: Heights, far_mm: float) -> list[Polygons]:
    """The area of each layer so near to the table that the head would meet it."""
    least_mm = least_tip_height_mm(sections.profile.machine, sections.part.pose)
    return _above_planes([plane_in_frame_of(sections.part, -UP, -least_mm)], heights, far_mm)


def _above_planes(planes: Sequence[Floats], heights: Heights, far_mm: float) -> list[Polygons]:
    """The area of each layer above any plane: (4,) unit normal and offset."""
    layers: list[list[Polygons]] = [[] for _ in heights.tip_mm]
    everywhere = Polygons.square((2.0 * far_mm, 2.0 * far_mm), True)
    for x, y, z, offset_mm in planes:
        below_mm = offset_mm - np.maximum(z * heights.bottom_mm, z * heights.tip_mm)
        level = np.hypot(x, y) < LEVEL
        for layer, rest in zip(layers, below_mm.tolist(), strict=True):
            if rest < 0.0 or not level:
                layer.append(half_plane(everywhere, x, y, -rest))
    return [union(layer) for layer in layers]


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
        mesh = in_frame_of(limb, part)
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
