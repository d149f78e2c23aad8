"""Reason: why a hanging place could be given no support, one sentence each."""

from collections.abc import Iterator, Sequence

import numpy as np

from mdp.clearance import least_tip_height_mm
from slicer.geometry.polygons import Polygons, contours, islands, offset, union
from slicer.overhangs import seen_from_above
from slicer.paths import Unsupported
from slicer.sections import Sections
from slicer.support.blocker import above_base_planes, support_reach_mm
from slicer.support.reachable import EVEN_MM
from slicer.support.support import Supports

UNWANTED = "no support is wanted there"
MOST = 0.5  # share of a place that one reason has to hold for


def explain(supports: Supports) -> tuple[Unsupported, ...]:
    """Every place that got no support, the largest first; layers are counted from 0."""
    sections = supports.sections
    reasons = [Unsupported(mm2, layer, _reason(layer, place, sections)) for mm2, layer, place in _places(supports.missed)]
    reasons += [Unsupported(mm2, layer, UNWANTED) for mm2, layer, _ in _places(supports.unwanted)]
    return tuple(sorted(reasons, key=lambda place: (-place.mm2, place.layer)))


def _places(hanging: Sequence[Polygons]) -> Iterator[tuple[float, int, Polygons]]:
    """What hangs, seen from above as connected places: the area of each, the layer with most of it and what of it is there."""
    for island in islands(seen_from_above(hanging)):
        places = {k: place ^ island for k, place in enumerate(hanging) if not place.is_empty()}
        areas = {k: place.area() for k, place in places.items()}
        worst = max(areas, key=lambda k: areas[k], default=-1)
        if worst >= 0 and areas[worst] > 0.0:
            yield sum(areas.values()), worst, places[worst]


def _reason(layer: int, place: Polygons, sections: Sections) -> str:
    """Why none of the ways to hold a place of a layer was open."""
    process, heights, least_mm2 = sections.support_process, sections.heights, MOST * place.area()
    drop = float(heights.bottom_mm[layer]) - process.support_gap_mm
    top = max(int(np.searchsorted(heights.tip_mm, drop + EVEN_MM, side="right")) - 1, 0)
    if sections.on_platform and (place - offset(sections.plate, -process.line_width_mm)).area() >= least_mm2:
        return "the plate ends before"
    under, far_mm = heights[top : top + 1], support_reach_mm(sections)
    for other in sections.later:
        above = above_base_planes(sections.part, [other], under, process.support_distance_mm, far_mm)[0]
        if (place ^ above).area() >= least_mm2:
            return f"support would stand where the head prints part {other.index}"
    room_mm = process.support_gap_mm + process.support_bottom_gap_mm + process.layer_height_mm
    lowest = int(np.searchsorted(heights.tip_mm, drop - room_mm + EVEN_MM))
    if (place ^ union(list(sections.outlines[lowest : max(layer - 1, 0)]))).area() >= least_mm2:
        return "there is no room for support between it and the plastic below"
    aside_mm = process.support_distance_mm + process.line_width_mm
    if layer and (place ^ offset(sections.outlines[top], aside_mm)).area() >= least_mm2:
        return "there is no room for support beside the walls"
    met = _part_at_table(place, float(heights.bottom_mm[layer]), sections)
    if met is not None:
        return f"the head would meet the table if support were printed there with part {met}"
    return f"support would have to lean by more than {process.support_branch_angle_deg:g} deg to find ground"


def _part_at_table(place: Polygons, z_mm: float, sections: Sections) -> int | None:
    """The part with which support could be printed under a place if the table were not in the way of the head."""
    corners = np.concatenate(contours(place))
    middle = 0.5 * (corners.min(axis=0) + corners.max(axis=0))
    base_mm, machine = sections.part.base.offset_mm, sections.profile.machine
    below, under = (np.append(middle, base_mm + z) @ sections.part.rotation for z in (z_mm, 0.0))
    if not sections.on_platform and below[2] < least_tip_height_mm(machine, sections.part.pose):
        return sections.part.index
    other = next((part for part in reversed(sections.earlier) if part.base.heights_mm(under[None])[0] > 0.0), None)
    if other is None or other.index == 1 or under[2] >= least_tip_height_mm(machine, other.pose):
        return None
    return other.index
