"""Reachable areas: where support may stand in each layer and find ground below within the angle that it may lean.

Everything here is about the middle of a branch: a place is free when a disc of the branch's least radius around it keeps
all gaps, and reachable when a chain of such places, each within the lean of the one below, leads down to ground. (Cura's tree
support has the complement, avoidance areas, and calls ground placeable.)
"""

from collections.abc import Sequence
from dataclasses import dataclass
from math import radians, tan

import numpy as np

from mdp.mesh import Floats
from profiles.process import Process
from slicer.geometry.polygons import Polygons, offset, offset_round, union
from slicer.heights import Heights

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
    """Per layer: ground to stand on, what is reachable, and the lean from the layer below, mm.

    bottom_mm and top_mm: of all layers of the part. ground: what is solid, grown by BEYOND of the radius.
    """

    radius_mm: float
    bottom_mm: Floats
    top_mm: Floats
    lean_mm: Floats
    ground: tuple[Polygons, ...]
    reachable: tuple[Polygons, ...]


def dilate(area: Polygons, distance_mm: float) -> Polygons:
    """The area grown with round corners by at most a distance."""
    return offset_round(area, distance_mm, SEGMENTS) if distance_mm > 0.0 else area


def widen(area: Polygons, distance_mm: float) -> Polygons:
    """The area grown by at least a distance, with hardly more corners than it has.

    What is grown layer after layer must not get round corners: each of them would be two in the next layer.
    """
    return offset(area, distance_mm, WIDEST)


def only_slivers(places: Polygons) -> bool:
    """Whether the places are nothing but slivers."""
    return bool(places.area() < SPECK_MM2 or offset(places, -SLIVER_MM).is_empty())


def drop_slivers(places: Polygons) -> Polygons:
    """Without slivers."""
    core = Polygons() if places.area() < SPECK_MM2 else offset(places, -SLIVER_MM)
    return core if core.is_empty() else offset(core, 1.5 * SLIVER_MM) ^ places


def carrying_area(places: Polygons, reachable: Polygons, ground: Polygons, lean_mm: float) -> Polygons:
    """Reachable places of a layer that carry places of the layer above: straight below where that can be, aside where it
    must. Places on ground need nothing.
    """
    straight = places ^ reachable
    rest = places - reachable
    if rest.area() >= LEAST_MM2:
        rest = rest - ground
    if rest.area() >= LEAST_MM2:
        rest = rest - dilate(offset(straight, -SLIVER_MM), lean_mm)
    if rest.area() < LEAST_MM2:
        return straight
    for share in STEPS:
        aside = widen(rest, share * lean_mm) ^ reachable
        if share == STEPS[-1] or (rest - dilate(aside, lean_mm)).area() < LEAST_MM2:
            break
    return straight + aside


def reachable_areas(
    outlines: Sequence[Polygons],
    heights: Heights,
    process: Process,
    below: Polygons | None,
    blocked: Sequence[Polygons],
    floor: Polygons,
    handed: Polygons | None = None,
) -> ReachableAreas:
    """The areas of as many layers as there are `blocked`, for the part with these outlines.

    below: plastic just under the base plane, None: the platform, all of whose floor is ground. handed: places on the base
    plane that support of an earlier part can reach.
    """
    count, radius = len(blocked), process.line_width_mm
    top, bottom = heights.tip_mm, heights.bottom_mm
    angle = min(process.support_branch_angle_deg, process.self_supporting_angle_deg)
    lean = heights.height_mm[:count] * tan(radians(angle))
    plain = [s if s.is_empty() else s.simplify(COARSE_MM) for s in outlines]
    wide = [s if s.is_empty() else offset(s, radius + MARGIN_MM) for s in plain]
    tall = [s if s.is_empty() else offset(s, radius + process.support_distance_mm + MARGIN_MM) for s in plain[:count]]
    root = int(np.searchsorted(np.maximum(bottom, 0.0), process.support_bottom_gap_mm - EVEN_MM))
    ground: list[Polygons] = []
    reachable: list[Polygons] = []
    for m in range(count):
        near = min(int(np.searchsorted(top, bottom[m] - process.support_bottom_gap_mm + EVEN_MM, side="right")), m)
        over = int(np.searchsorted(bottom, top[m] + process.support_gap_mm - EVEN_MM))
        shut = blocked[m] if blocked[m].is_empty() else offset(blocked[m], radius + MARGIN_MM)
        obstacles = union([o for o in (tall[m], *wide[near:m], *wide[m + 1 : over], shut) if not o.is_empty()])
        stands = [offset(plain[near - 1], BEYOND * radius)] if near > 0 and process.support_on_part else []
        if below is not None and m == root:
            stands.append(offset(below, BEYOND * radius))
        if handed is not None and m == 0:
            stands.append(handed)
        ground.append(union(stands))
        if m == 0 and below is None:
            start = offset(floor, -radius)
        else:
            start = ground[m]
            if m and not reachable[-1].is_empty():
                start = dilate(reachable[-1], (1.0 - SPARE) * float(lean[m])) + start
        reachable.append(start if start.is_empty() else (start - obstacles).simplify(FINE_MM))
    return ReachableAreas(radius, bottom, top, lean, tuple(ground), tuple(reachable))
