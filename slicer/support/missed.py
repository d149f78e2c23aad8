"""Missed: the hanging places that support does not hold, and why none could be given, one sentence each."""

from collections.abc import Iterator, Sequence

import numpy as np

from mdp.clearance import least_tip_height_mm
from slicer.geometry.polygons import Polygons, bounding_box, closing, contours, islands, offset, union
from slicer.overhangs import LEAST_MM2, RIM_MM, drop_small, seen_from_above
from slicer.paths import Unsupported
from slicer.sections import Sections
from slicer.support.blocker import above_base_planes, beside_standing, support_reach_mm
from slicer.support.reachable import EVEN_MM, ReachableAreas

LEDGE = 2.0  # line widths: a ledge no wider carries itself, the search's definition (mdp.support_need.patches)
UNWANTED = "no support is wanted there"
MOST = 0.5  # share of a place that one reason has to hold for


def find_missed(wanted: Sequence[Polygons], printed: Sequence[Polygons], areas: ReachableAreas) -> list[Polygons]:
    """The hanging places that support does not hold, layer by layer.

    A place is held over printed support and half a bead beyond its edge, where it spans from there to the part, where the part or
    the platform is a layer's height below where support would end, and on a mere ledge.
    """
    missed = []
    for k, hanging in enumerate(wanted):
        bare = hanging if hanging.is_empty() else _bare(k, hanging, printed, areas)
        missed.append(bare if bare.is_empty() or not k else _without_near(k, bare, areas))
    return _drop_ledges(missed, printed, areas)


def _drop_ledges(missed: Sequence[Polygons], printed: Sequence[Polygons], areas: ReachableAreas) -> list[Polygons]:
    """The missed places without those that, seen from above, have nothing of a size beyond a ledge's reach from what is held."""
    above, outlines, process = seen_from_above(missed), areas.sections.outlines, areas.process
    reach, beyond = LEDGE * process.line_width_mm, []
    for k, bare in enumerate(missed):
        if k and not bare.is_empty():
            carrying = (outlines[k - 1] ^ bounding_box(bare, 2.0 * reach)) - above
            bare = bare - offset(carrying + _held(k, printed, areas), reach)
        beyond.append(bare)
    large = [area for area in drop_small(beyond, process.support_least_mm2) if not area.is_empty()]
    if not large:
        return [Polygons()] * len(missed)
    seen = offset(union(large), RIM_MM)
    wide = union([island for island in islands(above) if not (island ^ seen).is_empty()])
    return [area if area.is_empty() else area ^ wide for area in missed]


def _held(k: int, printed: Sequence[Polygons], areas: ReachableAreas) -> Polygons:
    """The places of a layer that lie over printed support."""
    held = union([printed[m] for m in areas.carrying_layers(k) if m < len(printed)])
    return held if held.is_empty() else offset(held, 0.5 * areas.process.line_width_mm)


def _bare(k: int, hanging: Polygons, printed: Sequence[Polygons], areas: ReachableAreas) -> Polygons:
    """The part of a hanging place that lies over no support and does not span from there to the part."""
    held, distance_mm = _held(k, printed, areas), areas.process.support_distance_mm
    bare = hanging - held
    if k and not held.is_empty() and bare.area() >= LEAST_MM2:
        around = (held + areas.sections.outlines[k - 1]) ^ bounding_box(bare, 2.0 * distance_mm + 1.0)
        bare = bare - closing(around, 0.5 * distance_mm + RIM_MM)
    return bare if bare.area() >= LEAST_MM2 else Polygons()


def _without_near(k: int, bare: Polygons, areas: ReachableAreas) -> Polygons:
    """An unsupported place less what has plastic or the platform so near below that no layer of support fits between."""
    process = areas.process
    lowest = float(areas.heights.bottom_mm[k]) - process.support_gap_mm - process.layer_height_mm
    if lowest <= EVEN_MM and areas.sections.on_platform:
        return Polygons()
    near = list(areas.sections.outlines[int(np.searchsorted(areas.heights.tip_mm, lowest - EVEN_MM)) : k - 1])
    rest = bare - union(near) if near else bare
    return rest if rest.area() >= LEAST_MM2 else Polygons()


def explain(sections: Sections, missed: Sequence[Polygons], unwanted: Sequence[Polygons]) -> tuple[Unsupported, ...]:
    """Every place that got no support, the largest first; layers are counted from 0.

    missed: what of each layer no support could hold; unwanted: what a person wants none for.
    """
    reasons = [Unsupported(mm2, layer, _reason(layer, area, sections)) for mm2, layer, area in _connected_areas(missed)]
    reasons += [Unsupported(mm2, layer, UNWANTED) for mm2, layer, _ in _connected_areas(unwanted)]
    return tuple(sorted(reasons, key=lambda area: (-area.mm2, area.layer)))


def _connected_areas(hanging: Sequence[Polygons]) -> Iterator[tuple[float, int, Polygons]]:
    """Connected hanging places seen from above: the area of each, the layer with most of it, and its share there."""
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
    if sections.standing and (hanging ^ beside_standing(sections, slice(top, top + 1), far_mm)[0]).area() >= least_mm2:
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
