"""Reason: why a hanging place could be given no support, one sentence each."""

from collections.abc import Iterator, Sequence

import numpy as np

from mdp.clearance import least_tip_height_mm
from slicer.geometry.polygons import Polygons, contours, islands, offset, union
from slicer.overhangs import seen_from_above
from slicer.paths import Unsupported
from slicer.sections import Sections
from slicer.support.blocker import above_base_planes, beside_standing, support_reach_mm
from slicer.support.reachable import EVEN_MM
from slicer.support.support import Supports

UNWANTED = "no support is wanted there"
MOST = 0.5  # share of a place that one reason has to hold for


def explain(supports: Supports) -> tuple[Unsupported, ...]:
    """Every place that got no support, the largest first; layers are counted from 0."""
    sections = supports.sections
    reasons = [Unsupported(mm2, layer, _reason(layer, area, sections)) for mm2, layer, area in _connected_areas(supports.missed)]
    reasons += [Unsupported(mm2, layer, UNWANTED) for mm2, layer, _ in _connected_areas(supports.unwanted)]
    return tuple(sorted(reasons, key=lambda area: (-area.mm2, area.layer)))


def _connected_areas(hanging: Sequence[Polygons]) -> Iterator[tuple[float, int, Polygons]]:
    """What hangs, seen from above as connected places: the area of each, the layer with most of it and what of it is there."""
    for island in islands(seen_from_above(hanging)):
        pieces = {k: piece ^ island for k, piece in enumerate(hanging) if not piece.is_empty()}
        mm2 = {k: piece.area() for k, piece in pieces.items()}
        worst = max(mm2, key=lambda k: mm2[k], default=-1)
        if worst >= 0 and mm2[worst] > 0.0:
            yield sum(mm2.values()), worst, pieces[worst]


def _reason(layer: int, hanging: Polygons, sections: Sections) -> str:
    """Why none of the ways to hold a place of a layer was open."""
    process, heights, least_mm2 = sections.support_process, sections.heights, MOST * hanging.area()
    drop = float(heights.bottom_mm[layer]) - process.support_gap_mm
    top = max(int(np.searchsorted(heights.tip_mm, drop + EVEN_MM, side="right")) - 1, 0)
    if sections.on_platform and (hanging - offset(sections.plate, -process.line_width_mm)).area() >= least_mm2:
        return "the plate ends before"
    under, far_mm = heights[top : top + 1], support_reach_mm(sections)
    for upper in sections.later:
        gap_mm, machine = process.support_distance_mm, sections.profile.machine
        above = above_base_planes(sections.part, [upper], under, gap_mm, far_mm, machine)[0]
        if (hanging ^ above).area() >= least_mm2:
            return f"support would stand where the head prints part {upper.index}"
    is_limb = sections.part.base.limbs_mm is not None and bool(sections.earlier)
    if is_limb and (hanging ^ beside_standing(sections, under, far_mm)[0]).area() >= least_mm2:
        return "support would stand where the head meets what is printed before"
    room_mm = process.support_gap_mm + process.support_bottom_gap_mm + process.layer_height_mm
    lowest = int(np.searchsorted(heights.tip_mm, drop - room_mm + EVEN_MM))
    if (hanging ^ union(list(sections.outlines[lowest : max(layer - 1, 0)]))).area() >= least_mm2:
        return "there is no room for support between it and the plastic below"
    aside_mm = process.support_distance_mm + process.line_width_mm
    if layer and (hanging ^ offset(sections.outlines[top], aside_mm)).area() >= least_mm2:
        return "there is no room for support beside the walls"
    met = _part_at_table(hanging, float(heights.bottom_mm[layer]), sections)
    if met is not None:
        return f"the head would meet the table if support were printed there with part {met}"
    return f"support would have to lean by more than {process.support_branch_angle_deg:g} deg to find ground"


def _part_at_table(hanging: Polygons, z_mm: float, sections: Sections) -> int | None:
    """The part with which support could be printed under a place if the table were not in the way of the head."""
    corners = np.concatenate(contours(hanging))
    middle = 0.5 * (corners.min(axis=0) + corners.max(axis=0))
    base_mm, machine = sections.part.base.offset_mm, sections.profile.machine
    below, under = (np.append(middle, base_mm + z) @ sections.part.rotation for z in (z_mm, 0.0))
    if not sections.on_platform and below[2] < least_tip_height_mm(machine, sections.part.pose):
        return sections.part.index
    earlier = [part for part in reversed(sections.earlier) if part.base.limbs_mm is None]
    lower = next((part for part in earlier if part.base.heights_mm(under[None])[0] > 0.0), None)
    if lower is None or lower.index == 1 or under[2] >= least_tip_height_mm(machine, lower.pose):
        return None
    return lower.index
