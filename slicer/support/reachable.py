"""Reachable areas: where support may stand in each layer and find ground below within the angle that it may lean.

Everything here is about the middle of a branch: a place is free when a disc of the branch's least radius around it keeps
all gaps, and reachable when a chain of such places, each within the lean of the one below, leads down to ground. (Cura's tree
support has the complement, avoidance areas, and its word for what one may stand on, placeable.)
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from math import radians, tan

import numpy as np

from mdp.mesh import Floats
from profiles.process import Process
from slicer.geometry.polygons import Polygons, offset, offset_round, union
from slicer.heights import Heights
from slicer.sections import Sections

COARSE_MM = 0.03  # sections are simplified by this before they are grown
MARGIN_MM = 0.08  # and grown by this more, which leaves space for simplified support
FINE_MM = 0.005  # reachable places are simplified by this
SPARE = 0.15  # share of the lean that reachable places keep in reserve, so that more than a point of the layer below is near
SMOOTH_MM = 0.05  # support is simplified by this: its edges come from single faces, and nobody needs them
SLIVER_MM = 0.02  # what is narrower than twice this and has no place has neighbours that do
EVEN_MM = 1e-6  # heights nearer than this are equal
SPECK_MM2 = 4.0 * SLIVER_MM**2  # no place that is no sliver is smaller
LEAST_MM2 = 1e-5  # places smaller than this are rounding
STEPS = (0.3, 0.6, 1.0)  # of the lean: how far support goes aside, no farther than needed, for it gets wider by as much
BEYOND = 0.75  # of the radius: how far from plastic the middle of a disc may stand; its inner beads then lie on the edge
WIDEST = 1.3  # times the distance: how far corners of widened places may reach; sharper ones than 100 degrees are cut off
SEGMENTS = 12  # of a full turn in round corners; corners lie on the circle, so the lean is never exceeded


@dataclass(frozen=True, eq=False)
class ReachableAreas:
    """Where support of a part may stand; per layer, of as many of its lowest ones as are of use: the lean from the layer below,
    mm, what is placeable, and what is reachable.

    placeable: places of the ground beneath that a branch may end on: what is solid, grown by BEYOND of the radius. shut: for a
    limb, where the head cannot print support.
    """

    sections: Sections
    lean_mm: Floats
    placeable: tuple[Polygons, ...]
    reachable: tuple[Polygons, ...]
    shut: Sequence[Polygons] = ()

    @property
    def process(self) -> Process:
        """The settings of support, with the width of its lines."""
        return self.sections.support_process

    @property
    def radius_mm(self) -> float:
        """How far the beads of a branch reach round each place."""
        return self.process.line_width_mm

    @property
    def heights(self) -> Heights:
        """Those of all layers of the part."""
        return self.sections.heights

    def carrying_layers(self, layer: int) -> range:
        """The layers, from the highest down, on which what hangs in a layer may rest.

        The distance across keeps support as much lower under a slope that is just too flat.
        """
        process, drop_mm = self.process, float(self.heights.bottom_mm[layer]) - self.process.support_gap_mm
        slack_mm = process.support_distance_mm / max(tan(radians(process.self_supporting_angle_deg)), 0.5)
        highest = int(np.searchsorted(self.heights.tip_mm, drop_mm + EVEN_MM, side="right")) - 1
        lowest = int(np.searchsorted(self.heights.tip_mm, drop_mm - slack_mm - EVEN_MM))
        return range(highest, min(lowest, highest) - 1, -1) if highest >= 0 else range(0)

    def next_above(self, layer: int) -> int:
        """The first layer over one that support in it keeps no gap to."""
        return int(np.searchsorted(self.heights.bottom_mm, self.heights.tip_mm[layer] + self.process.support_gap_mm - EVEN_MM))

    def next_below(self, layer: int) -> int:
        """How many layers lie so far under one that support in it may stand on them."""
        drop_mm = self.heights.bottom_mm[layer] - self.process.support_bottom_gap_mm
        return min(int(np.searchsorted(self.heights.tip_mm, drop_mm + EVEN_MM, side="right")), layer)


def dilate(area: Polygons, distance_mm: float) -> Polygons:
    """The area grown with round corners by at most a distance."""
    return offset_round(area, distance_mm, SEGMENTS) if distance_mm > 0.0 else area


def widen(area: Polygons, distance_mm: float) -> Polygons:
    """The area grown by at least a distance, with hardly more corners than it has.

    What is grown layer after layer must not get round corners: each of them would be two in the next layer.
    """
    return offset(area, distance_mm, WIDEST)


def drop_slivers(places: Polygons) -> Polygons:
    """Without slivers."""
    core = Polygons() if places.area() < SPECK_MM2 else offset(places, -SLIVER_MM)
    return core if core.is_empty() else offset(core, 1.5 * SLIVER_MM) ^ places


def carrying_area(places: Polygons, reachable: Polygons, placeable: Polygons, lean_mm: float) -> Polygons:
    """Reachable places of a layer that carry places of the layer above: straight below where that can be, aside where it
    must. What is placeable needs nothing.
    """
    straight = places ^ reachable
    rest = places - reachable
    if rest.area() >= LEAST_MM2:
        rest = rest - placeable
    if rest.area() >= LEAST_MM2:
        rest = rest - dilate(offset(straight, -SLIVER_MM), lean_mm)
    if rest.area() < LEAST_MM2:
        return straight
    for share in STEPS:
        aside = widen(rest, share * lean_mm) ^ reachable
        if share == STEPS[-1] or (rest - dilate(aside, lean_mm)).area() < LEAST_MM2:
            break
    return straight + aside


def reachable_areas(sections: Sections, blocked: Sequence[Polygons], handed: Polygons | None = None) -> ReachableAreas:
    """The areas of as many layers of a part as there are `blocked`; all of the plate is placeable on the platform.

    handed: places on the base plane that support of an earlier part can reach.
    """
    process, count = sections.support_process, len(blocked)
    radius, angle = process.line_width_mm, min(process.support_branch_angle_deg, process.self_supporting_angle_deg)
    lean_mm = sections.heights.height_mm[:count] * tan(radians(angle))
    areas = ReachableAreas(sections, lean_mm, (), ())
    highest = max(areas.next_above(count - 1), count)
    plain = [s if s.is_empty() else s.simplify(COARSE_MM) for s in sections.outlines[:highest]]
    wide = [s if s.is_empty() else offset(s, radius + MARGIN_MM) for s in plain]
    tall = [s if s.is_empty() else offset(s, radius + process.support_distance_mm + MARGIN_MM) for s in plain[:count]]
    root = int(np.searchsorted(np.maximum(areas.heights.bottom_mm, 0.0), process.support_bottom_gap_mm - EVEN_MM))
    placeable: list[Polygons] = []
    reachable: list[Polygons] = []
    for m in range(count):
        near = areas.next_below(m)
        shut = blocked[m] if blocked[m].is_empty() else offset(blocked[m], radius + MARGIN_MM)
        close = (tall[m], *wide[near:m], *wide[m + 1 : areas.next_above(m)], shut)
        obstacles = union([obstacle for obstacle in close if not obstacle.is_empty()])
        stands = [offset(plain[near - 1], BEYOND * radius)] if near > 0 and process.support_on_part else []
        if sections.plastic_below is not None and m == root:
            stands.append(offset(sections.plastic_below, BEYOND * radius))
        if handed is not None and m == 0:
            stands.append(handed)
        placeable.append(union(stands))
        if m == 0 and sections.on_platform:
            start = offset(sections.plate, -radius)
        else:
            start = placeable[m]
            if m and not reachable[-1].is_empty():
                start = dilate(reachable[-1], (1.0 - SPARE) * float(lean_mm[m])) + start
        reachable.append(start if start.is_empty() else (start - obstacles).simplify(FINE_MM))
    is_limb = sections.part.base.limbs_mm is not None
    return replace(areas, placeable=tuple(placeable), reachable=tuple(reachable), shut=blocked if is_limb else ())
