"""Support from earlier parts: support that finds no ground above its part's base plane stands on support printed with earlier
parts.

Every point over the build plate lies above the base plane of some part and below those of all later ones (that of a limb counts
only beside the limb): there is exactly one part with which support can be printed there. So support that a part misses is planned
in three passes: upward, where support of each part may stand if that of the parts before it may; downward, from the last part to
the first, the support itself, whose feet on a base plane become patches for the parts before (EarlierSupport); and upward again,
to keep only the support that stands on printed support.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from math import hypot, radians, tan

import numpy as np

from mdp.mesh import Floats
from mdp.pose import shift
from slicer.geometry.polygons import Polygons, bounding_box, closing, offset, rectangle, union, unite_layers
from slicer.interface.interface import BasePlane, frame_change, sections_of
from slicer.overhangs import LEAST_MM2
from slicer.sectioning import Sections, marked_areas, no_seam_segments
from slicer.support.reachable import ReachableAreas, blocked_areas, near_table, reachable_areas, support_reach_mm
from slicer.support.sturdy import hollow_places
from slicer.support.support import Supports, find_missed, grow, seen_from_above, stand, widen_foot

AROUND_MM = 3.0  # further margin of support from earlier parts, besides its lean
SHALLOW_MM = 1.2  # depth below a plane at which the centres of support that can reach it lie
DEEP_MM = 1.0  # depth below a plane within which support begins: enough to keep a wall along a steep plane upright
# support that ends closer to a plane carries support on it: allows for a step of a slope and the gap beside a disc
NEAR_MM = 0.35
STEP_MM = 0.15  # steps of a slope are joined across this


@dataclass(frozen=True, eq=False)
class Patch:
    """An area on a base plane, in its part's frame, under which support must end gap_mm below the plane."""

    places: Polygons
    gap_mm: float

    def under(self, plane: BasePlane, layer: int, deep_mm: float) -> Polygons:
        """The area of a layer under the patch, from its gap to deep_mm below the plane."""
        return plane.shadow(self.places, layer) ^ plane.band(layer, -deep_mm, -self.gap_mm)

    def begins(self, plane: BasePlane, count: int) -> dict[int, Polygons]:
        """The areas in which support of the patch must begin, by layer, among the lowest `count` layers."""
        deep_mm = self.gap_mm + DEEP_MM
        layers = plane.layers_near(self.places, deep_mm)
        begins = {layer: self.under(plane, layer, deep_mm) for layer in layers if layer < count}
        return {layer: area for layer, area in begins.items() if not area.is_empty()}


def keep_off(bodies: Sequence[Polygons], patches: Sequence[Patch], plane: BasePlane, gap_mm: float) -> list[Polygons]:
    """Support of the earlier part's layers that keeps gap_mm from the plane, or the patches' own gap under patches."""
    wide = [Patch(offset(patch.places, gap_mm), patch.gap_mm) for patch in patches]
    clear = []
    for layer, body in enumerate(bodies):
        if not body.is_empty():
            near = plane.band(layer, -gap_mm, plane.far_mm) ^ bounding_box(body, 1.0)
            for patch in wide if not near.is_empty() else ():
                near = near - patch.under(plane, layer, gap_mm)
            body = body if near.is_empty() else body - near
        clear.append(body)
    return clear


def upper_side(areas: Sequence[Polygons], plane: BasePlane, window: Polygons, deep_mm: float) -> Polygons:
    """The areas of an earlier part's layers that end less than deep_mm below the plane, projected onto a window of it."""
    layers = [layer for layer in plane.layers_near(window, deep_mm) if layer < len(areas) and not areas[layer].is_empty()]
    near = [(areas[layer] ^ plane.band(layer, -deep_mm, 0.0), layer) for layer in layers]
    pieces = [plane.project(area, layer) for area, layer in near if not area.is_empty()]
    return closing(offset(union(pieces), 0.5 * STEP_MM), STEP_MM) ^ window


@dataclass(frozen=True, eq=False)
class EarlierSupport:
    """Support that is printed with a part for later parts.

    sections: up to the highest layer that such support needs; window: area of the base plane available to it within the axes'
    reach; areas: the reachable areas inside its box; blocked: blocked area of the first layer; far_mm: greatest distance of
    support from the frame's origin. bodies, contacts: one area per layer, all grown support and its beginnings; patches: its feet
    that need support below the base plane. All three are empty until support has grown.
    """

    sections: Sections
    window: Polygons
    areas: ReachableAreas
    blocked: Polygons
    far_mm: float
    bodies: Sequence[Polygons] = ()
    contacts: Sequence[Polygons] = ()
    patches: Sequence[Patch] = ()

    def plane_of(self, later: Sections) -> BasePlane:
        """The base plane of a later part in the frame of this part."""
        return BasePlane.of(self.sections.part, later.part, self.sections.heights, self.far_mm)


def plan_supports(own: Sequence[Supports]) -> list[Supports]:
    """The support of every part. own: support of each part planned alone, in print order."""
    planned = list(own)
    if all(supports.unsupported_mm2 == 0.0 for supports in own[1:]):
        return planned
    earlier_support: dict[int, EarlierSupport] = {}  # by position of the part in print order
    for k, (box, top_mm) in _extents(own).items():
        earlier_support[k] = _room(up_to(own[k].sections, top_mm), box, top_mm, list(earlier_support.values()))
    for k in sorted(earlier_support, reverse=True):
        earlier_support[k] = _plan_from_above(
            earlier_support[k], own[k].missed, [earlier_support[m] for m in sorted(earlier_support) if m > k]
        )
    for k in sorted(earlier_support):
        planned[k] = _stand(earlier_support[k], own[k], planned[:k])
    return planned


def _extents(own: Sequence[Supports]) -> dict[int, tuple[Polygons, float]]:
    """For each part that may print support for later parts, the box of its base plane for this and the height of that support,
    mm.
    """
    lean = tan(radians(max(supports.sections.process.support_branch_angle_deg for supports in own)))
    boxes = [np.array([np.inf, np.inf, -np.inf, -np.inf]) for _ in own]
    tops = [0.0] * len(own)

    def take(k: int, low: Floats, high: Floats, top_mm: float) -> None:
        aside = max(top_mm, 0.0) * lean + AROUND_MM
        boxes[k] = np.concatenate([np.minimum(boxes[k][:2], low - aside), np.maximum(boxes[k][2:], high + aside)])
        tops[k] = max(tops[k], top_mm)

    for k in range(len(own) - 1, 0, -1):
        for layer, area in enumerate(own[k].missed):
            if not area.is_empty():
                bounds = np.array(area.bounds())
                take(k, bounds[:2], bounds[2:], float(own[k].sections.heights.tip_mm[layer]))
        x0, y0, x1, y1 = boxes[k]
        for m in range(k if x0 < x1 else 0):
            turn, moved = frame_change(own[m].sections.part, own[k].sections.part)
            corners = (np.array([[x0, y0, 0.0], [x1, y0, 0.0], [x1, y1, 0.0], [x0, y1, 0.0]]) - moved) @ turn
            part = own[m].sections.part
            highest_mm = max(float((other.sections.part.mesh.vertices @ part.direction).max()) for other in own[m:])
            top_mm = min(float(corners[:, 2].max()), highest_mm - part.base.offset_mm)
            if top_mm > 0.0:
                take(m, corners[:, :2].min(axis=0), corners[:, :2].max(axis=0), top_mm)
    some = [k for k, (x0, _, x1, _) in enumerate(boxes) if x0 < x1 and own[k].sections.process.support != "none"]
    return {k: (rectangle(*boxes[k]), tops[k]) for k in some}


def up_to(sections: Sections, top_mm: float) -> Sections:
    """The sections extended by empty layers up to a height."""
    below = len(sections.heights.tip_mm)
    heights = sections.heights.up_to(top_mm, sections.process.layer_height_mm)
    count = len(heights.tip_mm) - below
    if count <= 0:
        return sections
    empty = [Polygons()] * count
    part, known, end = sections.part, len(sections.above), len(sections.beside) + count
    higher = [*sections.beside, *sections.above, *empty]  # the added layers are at the heights of `above`
    return replace(
        sections,
        heights=heights,
        outlines=[*sections.outlines, *empty],
        own=[*sections.own, *empty],
        ungrooved=[*sections.ungrooved, *empty],
        beside=higher[:end],
        above=higher[end : end + known],
        standing=[*sections.standing, *sections_of(sections.earlier, part, heights.cut_mm[below:])] if sections.standing else (),
        no_seam=no_seam_segments(part, sections.mesh, heights.cut_mm),
        no_support=marked_areas(part.no_support, part, sections.mesh, heights.cut_mm),
        enforced=marked_areas(part.support, part, sections.mesh, heights.cut_mm),
        places=[replace(place, areas=[*place.areas, *empty]) for place in sections.places],
    )


def _room(sections: Sections, box: Polygons, top_mm: float, earlier: Sequence[EarlierSupport]) -> EarlierSupport:
    """Possible areas for support of a part, given those of earlier parts."""
    machine, (moved_x, moved_y, _) = sections.profile.machine, shift(sections.profile.machine, sections.part.pose)
    (left, right), (front, back) = machine.x.limits_mm, machine.y.limits_mm
    window = box ^ rectangle(left - moved_x, front - moved_y, right - moved_x, back - moved_y)  # as far as the axes reach
    count = max(min(int(np.searchsorted(sections.heights.bottom_mm, top_mm)), len(sections.outlines)), 1)
    x0, y0, x1, y1 = box.bounds()
    far_mm = max(support_reach_mm(sections), 2.0 * hypot(max(abs(x0), abs(x1)), max(abs(y0), abs(y1))) + AROUND_MM)
    blocked = blocked_areas(sections, count, 0.0, far_mm)
    if not sections.on_plate:
        blocked = unite_layers(blocked, near_table(sections, sections.heights[:count], far_mm))
    outside = offset(box, AROUND_MM) - window
    blocked = [union([layer, outside]) for layer in blocked] if outside.area() > 4.0 * AROUND_MM**2 else blocked
    near = replace(
        sections,
        outlines=[outline ^ box for outline in sections.outlines],
        plastic_below=None if sections.plastic_below is None else sections.plastic_below ^ box,
        plate=sections.plate ^ window,
    )
    reached = [upper_side(room.areas.reachable, room.plane_of(sections), window, SHALLOW_MM) for room in earlier]
    return EarlierSupport(sections, window, reachable_areas(near, blocked, union(reached)), blocked[0], far_mm)


def _plan_from_above(room: EarlierSupport, missed: Sequence[Polygons], later: Sequence[EarlierSupport]) -> EarlierSupport:
    """The support that a part's own support misses, and that later parts need."""
    sections, areas = room.sections, room.areas
    planes = [room.plane_of(upper.sections) for upper in later]
    begins: dict[int, list[Polygons]] = {}
    for plane, upper in zip(planes, later, strict=True):
        for patch in upper.patches:
            for layer, area in patch.begins(plane, len(areas.reachable)).items():
                begins.setdefault(layer, []).append(area)
    wanted = [Polygons()] * len(missed) if sections.on_plate else missed
    begin = {layer: union(places) for layer, places in begins.items()}
    bodies, contacts = grow(wanted, begin, areas, union([seen_from_above(wanted), *begin.values()]))
    for plane, upper in zip(planes, later, strict=True):
        bodies = keep_off(bodies, upper.patches, plane, sections.process.support_distance_mm)
    patches = [Patch(area, gap_mm) for _, area, gap_mm in _hanging_low(areas, wanted)]
    if bodies and not sections.on_plate:
        patches.append(Patch(bodies[0] - _own_placeable(room), 0.0))
    large = [patch for patch in patches if patch.places.area() >= LEAST_MM2]
    return replace(room, bodies=bodies, contacts=contacts, patches=large)


def _hanging_low(areas: ReachableAreas, wanted: Sequence[Polygons]) -> list[tuple[int, Polygons, float]]:
    """Overhangs too low for support above the base plane: layer, area, and distance below the plane at which support ends."""
    gap_mm, bottom_mm = areas.process.support_gap_mm, areas.heights.bottom_mm
    low = enumerate(wanted[: int(np.searchsorted(bottom_mm, gap_mm + 1.0))])
    hanging = [(k, area) for k, area in low if not area.is_empty() and not len(areas.carrying_layers(k))]
    return [(k, area, max(gap_mm - max(float(bottom_mm[k]), 0.0), 0.0)) for k, area in hanging]


def _own_placeable(room: EarlierSupport) -> Polygons:
    """Area in which support stands on plastic without a gap."""
    process, below = room.areas.process, room.sections.plastic_below
    return Polygons() if below is None or process.support_bottom_gap_mm > 0.0 else offset(below, process.line_width_mm)


def _stand(room: EarlierSupport, own: Supports, earlier: Sequence[Supports]) -> Supports:
    """A part's support united with the standing support for later parts. earlier: support of the parts printed before it."""
    sections, areas, process = room.sections, room.areas, room.areas.process
    whole = replace(areas, sections=sections)
    if not sections.on_plate:
        held = offset(_held(room, earlier, 0.0), 0.5 * areas.radius_mm)
        areas = replace(areas, placeable=(union([held, _own_placeable(room)]), *areas.placeable[1:]))
    count = len(sections.outlines)
    printed, dense = (_padded(places, count) for places in stand(room.bodies, room.contacts, areas))
    wanted, missed, unwanted = (_padded(places, count) for places in (own.wanted, own.missed, own.unwanted))
    both = unite_layers(printed, _padded(own.areas, count))
    if sections.on_plate and not sections.on_raft:
        both[0] = union([both[0], widen_foot(printed, whole, (room.window ^ sections.plate) - room.blocked)])
    if not sections.on_plate:
        low = _hanging_low(areas, missed)
        missed = find_missed(missed, both, whole)
        for layer, _, gap_mm in low:
            missed[layer] = missed[layer] - offset(_held(room, earlier, gap_mm), 0.5 * process.line_width_mm)
    dense = unite_layers(dense, _padded(own.dense, count))
    return Supports(sections, both, dense, hollow_places(both, dense, process), wanted, missed, unwanted)


def _padded(places: Sequence[Polygons], count: int) -> list[Polygons]:
    """The areas of the lowest layers, extended by empty ones to `count` layers."""
    return [*places, *[Polygons()] * (count - len(places))]


def _held(room: EarlierSupport, earlier: Sequence[Supports], gap_mm: float) -> Polygons:
    """The area on a part's base plane that is held by support of earlier parts gap_mm below it."""
    held = []
    for supports in earlier:
        plane = BasePlane.of(supports.sections.part, room.sections.part, supports.sections.heights, room.far_mm)
        held.append(upper_side(supports.areas, plane, room.window, gap_mm + NEAR_MM))
    return union(held)
