"""Blocker: where support would be in the way of parts printed later, or the head in that of the table, or a person wants none."""

from collections.abc import Sequence

import numpy as np

from mdp.clearance import least_tip_height_mm
from mdp.decomposition import Part
from mdp.mesh import Floats
from mdp.pose import UP
from slicer.geometry.polygons import Polygons, half_plane, union
from slicer.heights import Heights
from slicer.interface.interface import plane_in_frame_of
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
    blocked = above_base_planes(sections.part, sections.later, heights, gap_mm, far_mm)
    if not sections.part.no_support.anywhere:
        return blocked
    return [union(areas) for areas in zip(blocked, shut_areas(sections, heights), strict=True)]


def shut_areas(sections: Sections, heights: Heights) -> list[Polygons]:
    """For each layer where a person wants no support: in the boxes, and over the faces as far as what would stand on them."""
    unwanted = no_support_areas(sections.part, sections.mesh, heights.cut_mm)
    gap_mm = sections.process.support_bottom_gap_mm
    near = np.searchsorted(heights.tip_mm, heights.bottom_mm - gap_mm + EVEN_MM, side="right")
    return [union(unwanted[max(lowest - 1, 0) : k + 1]) for k, lowest in enumerate(near.tolist())]


def above_base_planes(part: Part, later: Sequence[Part], heights: Heights, gap_mm: float, far_mm: float) -> list[Polygons]:
    """For each layer what lies above the base plane of any later part, taken as lower by gap_mm.

    While a part is printed the head moves above its base plane, so nothing may stand there, be it near that part or not.
    """
    planes = [plane_in_frame_of(part, upper.base.normal, upper.base.offset_mm - gap_mm) for upper in later]
    return _above_planes(planes, heights, far_mm)


def near_table(sections: Sections, heights: Heights, far_mm: float) -> list[Polygons]:
    """For each layer what lies so near to the table that the head would meet it."""
    least_mm = least_tip_height_mm(sections.profile.machine, sections.part.pose)
    return _above_planes([plane_in_frame_of(sections.part, -UP, -least_mm)], heights, far_mm)


def _above_planes(planes: Sequence[Floats], heights: Heights, far_mm: float) -> list[Polygons]:
    """For each layer what of it lies above any plane: (4,) unit normal and offset."""
    layers: list[list[Polygons]] = [[] for _ in heights.tip_mm]
    everywhere = Polygons.square((2.0 * far_mm, 2.0 * far_mm), True)
    for x, y, z, offset in planes:
        below_mm = offset - np.maximum(z * heights.bottom_mm, z * heights.tip_mm)
        level = np.hypot(x, y) < LEVEL
        for layer, rest in zip(layers, below_mm.tolist(), strict=True):
            if rest < 0.0 or not level:
                layer.append(half_plane(everywhere, x, y, -rest))
    return [union(layer) for layer in layers]
