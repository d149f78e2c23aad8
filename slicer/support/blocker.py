"""Blocker: where support would be in the way of parts printed later, or the head in that of the table, or a person wants none."""

from collections.abc import Sequence

import numpy as np

from mdp.clearance import least_tip_height_mm
from mdp.decomposition import Part
from mdp.mesh import Floats
from mdp.pose import UP
from profiles.machine import Machine
from slicer.geometry.polygons import Polygons, half_plane, offset, union
from slicer.heights import Heights
from slicer.interface.base_plane import BasePlane
from slicer.interface.interface import frame_change, plane_in_frame_of, sections_of
from slicer.interface.limb import head_room, out_of_reach, room_of
from slicer.sections import Sections
from slicer.support.reachable import EVEN_MM
from slicer.zones import no_support_areas

AROUND_MM = 20.0  # support needs no more space around a part than its lean and this
LEVEL = 1e-9  # a plane whose normal is nearer to upright than this forbids all of a layer or nothing


def support_reach_mm(sections: Sections) -> float:
    """A distance from the origin that no support of a part ever reaches."""
    low, high = sections.mesh.bounds_mm
    return float(np.hypot(*np.maximum(np.abs(low), np.abs(high))[:2]) + 2.0 * high[2]) + AROUND_MM


def blocked_areas(sections: Sections, heights: Heights, gap_mm: float, far_mm: float) -> list[Polygons]:
    """For each layer where support cannot be, or where a person wants none.

    heights: of the lowest layers; gap_mm: what it keeps from later parts' base planes; far_mm: how far from the origin all ends.
    """
    blocked = above_base_planes(sections.part, sections.later, heights, gap_mm, far_mm, sections.profile.machine)
    if sections.part.base.limbs_mm is not None and sections.earlier:
        blocked = _united(blocked, beside_standing(sections, heights, far_mm))
    if not sections.part.no_support.anywhere:
        return blocked
    return _united(blocked, shut_areas(sections, heights))


def _united(some: Sequence[Polygons], others: Sequence[Polygons]) -> list[Polygons]:
    return [union(areas) for areas in zip(some, others, strict=True)]


def shut_areas(sections: Sections, heights: Heights) -> list[Polygons]:
    """For each layer where a person wants no support: in the boxes, and over the faces as far as what would stand on them."""
    unwanted = no_support_areas(sections.part, sections.mesh, heights.cut_mm)
    gap_mm = sections.process.support_bottom_gap_mm
    near = np.searchsorted(heights.tip_mm, heights.bottom_mm - gap_mm + EVEN_MM, side="right")
    return [union(unwanted[max(lowest - 1, 0) : k + 1]) for k, lowest in enumerate(near.tolist())]


def above_base_planes(
    part: Part, later: Sequence[Part], heights: Heights, gap_mm: float, far_mm: float, machine: Machine
) -> list[Polygons]:
    """For each layer what lies above the base plane of any later part, taken as lower by gap_mm.

    While a part is printed the head moves above its base plane, so nothing may stand there, near that part or not. A limb only
    forbids what the head could meet.
    """
    limbs = [upper for upper in later if upper.base.limbs_mm is not None]
    whole = [upper for upper in later if upper.base.limbs_mm is None]
    planes = [plane_in_frame_of(part, upper.base.normal, upper.base.offset_mm - gap_mm) for upper in whole]
    blocked = _above_planes(planes, heights, far_mm)
    for limb in limbs:
        to_limb = frame_change(part, limb)
        for low_mm, places in head_room(limb, machine, gap_mm):
            plane = BasePlane(*to_limb, heights, far_mm, places)
            blocked = _united(blocked, [plane.band(layer, low_mm, np.inf) for layer in range(len(blocked))])
    return blocked


def beside_standing(sections: Sections, heights: Heights, far_mm: float) -> list[Polygons]:
    """For each layer of a limb the area that is too near to earlier parts, out of the head's reach or too far from the limb."""
    part, process, machine = sections.part, sections.support_process, sections.profile.machine
    gap_mm = max(process.support_gap_mm, process.support_bottom_gap_mm)
    stands = sections_of(sections.earlier, part, heights.cut_mm)
    outside = Polygons.square((2.0 * far_mm, 2.0 * far_mm), True) - room_of(part)
    reaches = out_of_reach(part, sections.earlier, heights.tip_mm.tolist(), machine)
    low = np.searchsorted(heights.tip_mm, heights.bottom_mm - gap_mm)
    high = np.searchsorted(heights.bottom_mm, heights.tip_mm + gap_mm)
    near = [union(stands[a:b]) for a, b in zip(low.tolist(), high.tolist(), strict=True)]
    beside = [offset(area, process.support_distance_mm) if not area.is_empty() else area for area in near]
    return [union([outside, *areas]) for areas in zip(beside, reaches, strict=True)]


def near_table(sections: Sections, heights: Heights, far_mm: float) -> list[Polygons]:
    """For each layer what lies so near to the table that the head would meet it."""
    least_mm = least_tip_height_mm(sections.profile.machine, sections.part.pose)
    return _above_planes([plane_in_frame_of(sections.part, -UP, -least_mm)], heights, far_mm)


def _above_planes(planes: Sequence[Floats], heights: Heights, far_mm: float) -> list[Polygons]:
    """For each layer what of it lies above any plane: (4,) unit normal and offset."""
    layers: list[list[Polygons]] = [[] for _ in heights.tip_mm]
    everywhere = Polygons.square((2.0 * far_mm, 2.0 * far_mm), True)
    for x, y, z, offset_mm in planes:
        below_mm = offset_mm - np.maximum(z * heights.bottom_mm, z * heights.tip_mm)
        level = np.hypot(x, y) < LEVEL
        for layer, rest in zip(layers, below_mm.tolist(), strict=True):
            if rest < 0.0 or not level:
                layer.append(half_plane(everywhere, x, y, -rest))
    return [union(layer) for layer in layers]
