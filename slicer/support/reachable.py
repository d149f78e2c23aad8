"""Reachable areas: area of each layer where support may stand and find ground below within its greatest lean.

All areas refer to the centre of a branch: a point is free if a disc of the branch's least radius around it keeps all gaps, and
reachable if a chain of such points, each within the lean of the one below, leads down to ground. (Cura's tree support has the
complement, avoidance areas, and its term "placeable" for standing on the part.) Blocked are areas where support would be in the
way of later parts, where the head would collide with the table or with parts beside a limb, or where the user wants none.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from math import radians, tan

import numpy as np

from mdp.clearance import StandingColumns, highest_in_cells, least_tip_height_mm, subdivide
from mdp.decomposition import Part
from mdp.mesh import Floats
from mdp.overhang import Mask
from mdp.pose import UP
from profiles.machine import Machine
from profiles.process import Process
from slicer.geometry.polygons import Polygons, half_plane, offset, offset_round, rectangle, union, unite_layers
from slicer.heights import SAME_MM, Heights
from slicer.interface.interface import BasePlane, frame_change, plane_in_frame_of, room_of
from slicer.sectioning import Sections

COARSE_MM = 0.03  # tolerance for simplifying sections before they are grown
MARGIN_MM = 0.08  # additional growth, which leaves space for simplified support
FINE_MM = 0.005  # tolerance for simplifying reachable areas
SPARE = 0.15  # share of the lean that reachable areas keep in reserve, so that more than a point of the layer below is near
SMOOTH_MM = 0.05  # tolerance for simplifying support, whose edges come from single faces
SLIVER_MM = 0.02  # an area narrower than twice this may be left out, since its neighbours hold it
SPECK_MM2 = 4.0 * SLIVER_MM**2  # smallest area that is not a sliver
LEAST_MM2 = 1e-5  # smaller areas are rounding
# share of the radius: distance from plastic at which the centre of a disc may stand; its inner beads then lie on the edge
BEYOND = 0.75
SEGMENTS = 12  # segments of a full circle in round corners; corners lie on the circle, so the lean is never exceeded
AROUND_MM = 20.0  # support needs no more space around a part than its lean and this
CELL_MM, COARSER = 0.5, 1.5  # grid for the height of the tip, and the factor by which it is coarsened
MOST_PAIRS = 200_000_000  # pairs of a grid cell and a standing point
STEEPEST = 0.5  # horizontal mm per mm of height of a slope: support at its distance cannot hold steeper ones
LOW_MM = 0.05  # up to this height above the base plane is the cut face itself


@dataclass(frozen=True, eq=False)
class ReachableAreas:
    """Possible areas for support of a part, for each of the lowest layers that may need it.

    lean_mm: greatest lean of a layer of support beyond the layer below, mm. placeable: ground below the layer on which a branch
    may end, which is solid area grown by BEYOND of the radius. reachable: area for centres of branches. blocked: for a limb, area
    in which the head cannot print support.
    """

    sections: Sections
    lean_mm: Floats
    placeable: tuple[Polygons, ...]
    reachable: tuple[Polygons, ...]
    blocked: Sequence[Polygons] = ()

    @property
    def process(self) -> Process:
        """The settings of support, with its line width."""
        return self.sections.support_process

    @property
    def radius_mm(self) -> float:
        """Extent of a branch's beads around its centres, mm."""
        return self.process.line_width_mm

    @property
    def heights(self) -> Heights:
        """The heights of all layers of the part."""
        return self.sections.heights

    def carrying_layers(self, layer: int) -> range:
        """The layers, from the highest down, on which the overhangs of a layer may rest.

        The horizontal distance keeps support lower under a slope: one that is just too flat, or any slope that the user may want
        supported.
        """
        process, drop_mm = self.process, float(self.heights.bottom_mm[layer]) - self.process.support_gap_mm
        steepest = 0.0 if self.sections.enforced else tan(radians(process.self_supporting_angle_deg))
        slack_mm = process.support_distance_mm / max(steepest, STEEPEST)
        highest = int(np.searchsorted(self.heights.tip_mm, drop_mm + SAME_MM, side="right")) - 1
        lowest = int(np.searchsorted(self.heights.tip_mm, drop_mm - slack_mm - SAME_MM))
        return range(highest, min(lowest, highest) - 1, -1) if highest >= 0 else range(0)

    @property
    def lowest_on_plastic(self) -> int:
        """The layer in which support on plastic below the base plane begins; one more than the last if all are too low."""
        gap_mm = self.process.support_bottom_gap_mm
        return int(np.searchsorted(np.maximum(self.heights.bottom_mm, 0.0), gap_mm - SAME_MM))

    def next_above(self, layer: int) -> int:
        """The first layer above a layer that is far enough for support in it."""
        return int(np.searchsorted(self.heights.bottom_mm, self.heights.tip_mm[layer] + self.process.support_gap_mm - SAME_MM))

    def next_below(self, layer: int) -> int:
        """The number of layers below a layer that are far enough for support in it to stand on them."""
        drop_mm = self.heights.bottom_mm[layer] - self.process.support_bottom_gap_mm
        return min(int(np.searchsorted(self.heights.tip_mm, drop_mm + SAME_MM, side="right")), layer)


def dilate(area: Polygons, distance_mm: float) -> Polygons:
    """The area grown by at most a distance, with round corners."""
    return offset_round(area, distance_mm, SEGMENTS) if distance_mm > 0.0 else area


def drop_slivers(places: Polygons) -> Polygons:
    """The area without parts narrower than twice SLIVER_MM."""
    core = Polygons() if places.area() < SPECK_MM2 else offset(places, -SLIVER_MM)
    return core if core.is_empty() else offset(core, 1.5 * SLIVER_MM) ^ places


def reachable_areas(sections: Sections, blocked: Sequence[Polygons], handed: Polygons | None = None) -> ReachableAreas:
    """The areas of as many layers of a part as there are `blocked` areas; on the build plate all of the plate is placeable.

    handed: area of the base plane that support of an earlier part can reach.
    """
    process, count = sections.support_process, len(blocked)
    radius, angle = process.line_width_mm, min(process.support_branch_angle_deg, process.self_supporting_angle_deg)
    lean_mm = sections.heights.height_mm[:count] * tan(radians(angle))
    areas = ReachableAreas(sections, lean_mm, (), ())
    highest = max(areas.next_above(count - 1), count)
    plain = [outline.simplify(COARSE_MM) for outline in sections.outlines[:highest]]
    wide = [offset(outline, radius + MARGIN_MM) for outline in plain]
    tall = [offset(outline, radius + process.support_distance_mm + MARGIN_MM) for outline in plain[:count]]
    placeable: list[Polygons] = []
    reachable: list[Polygons] = []
    for m in range(count):
        near = areas.next_below(m)
        close = (tall[m], *wide[near:m], *wide[m + 1 : areas.next_above(m)], offset(blocked[m], radius + MARGIN_MM))
        obstacles = union([obstacle for obstacle in close if not obstacle.is_empty()])
        stands = [offset(plain[near - 1], BEYOND * radius)] if near > 0 and process.support_on_part else []
        if sections.plastic_below is not None and m == areas.lowest_on_plastic:
            stands.append(offset(sections.plastic_below, BEYOND * radius))
        if handed is not None and m == 0:
            stands.append(handed)
        placeable.append(union(stands))
        start = offset(sections.plate, -radius) if m == 0 and sections.on_plate else placeable[m]
        if m and not reachable[-1].is_empty():
            start = dilate(reachable[-1], (1.0 - SPARE) * float(lean_mm[m])) + start
        reachable.append((start - obstacles).simplify(FINE_MM))
    is_limb = sections.part.base.limbs_mm is not None
    return replace(areas, placeable=tuple(placeable), reachable=tuple(reachable), blocked=blocked if is_limb else ())


def support_reach_mm(sections: Sections) -> float:
    """Upper bound of the distance of a part's support from the origin, mm."""
    low, high = sections.mesh.bounds_mm
    return float(np.hypot(*np.maximum(np.abs(low), np.abs(high))[:2]) + 2.0 * high[2]) + AROUND_MM


def blocked_areas(sections: Sections, count: int, gap_mm: float, far_mm: float) -> list[Polygons]:
    """For each of the lowest layers, the area in which support is impossible or unwanted.

    gap_mm: distance to later parts' base planes; far_mm: distance from the origin beyond which there is no support.
    """
    heights = sections.heights[:count]
    blocked = above_base_planes(sections.part, sections.later, heights, gap_mm, far_mm, sections.profile.machine)
    if sections.standing:
        blocked = unite_layers(blocked, beside_standing(sections, slice(count), far_mm))
    if sections.no_support:
        blocked = unite_layers(blocked, unwanted_areas(sections)[:count])
    return blocked


def unwanted_areas(sections: Sections) -> list[Polygons]:
    """For each layer, the area in which the user wants no support: inside boxes, and over faces as far as support would stand on
    them.
    """
    heights, gap_mm = sections.heights, sections.process.support_bottom_gap_mm
    near = np.searchsorted(heights.tip_mm, heights.bottom_mm - gap_mm + SAME_MM, side="right")
    return [union(sections.no_support[max(lowest - 1, 0) : k + 1]) for k, lowest in enumerate(near.tolist())]


def above_base_planes(
    part: Part, later: Sequence[Part], heights: Heights, gap_mm: float, far_mm: float, machine: Machine
) -> list[Polygons]:
    """The area of each layer above the base plane of any later part, lowered by gap_mm.

    While a part is printed the head moves above its base plane, so nothing may stand there, whether near that part or not. A limb
    only excludes what the head could meet.
    """
    limbs = [upper for upper in later if upper.base.limbs_mm is not None]
    whole = [upper for upper in later if upper.base.limbs_mm is None]
    planes = [plane_in_frame_of(part, upper.base.normal, upper.base.offset_mm - gap_mm) for upper in whole]
    blocked = _above_planes(planes, heights, far_mm)
    for limb in limbs:
        for low_mm, places in head_room(limb, machine, gap_mm):
            plane = BasePlane(*frame_change(part, limb), heights, far_mm, places)
            blocked = unite_layers(blocked, [plane.band(layer, low_mm, np.inf) for layer in range(len(blocked))])
    return blocked


def beside_standing(sections: Sections, layers: slice, far_mm: float) -> list[Polygons]:
    """For some layers of a limb, the area that is too near to earlier parts, out of the head's reach or too far from the limb."""
    part, process, machine = sections.part, sections.support_process, sections.profile.machine
    gap_mm = max(process.support_gap_mm, process.support_bottom_gap_mm)
    heights, stands = sections.heights[layers], sections.standing[layers]
    outside = Polygons.square((2.0 * far_mm, 2.0 * far_mm), True) - room_of(part)
    reaches = out_of_reach(part, sections.earlier, heights.tip_mm.tolist(), machine)
    low = np.searchsorted(heights.tip_mm, heights.bottom_mm - gap_mm + SAME_MM)
    high = np.searchsorted(heights.bottom_mm, heights.tip_mm + gap_mm - SAME_MM)
    near = [union(stands[a:b]) for a, b in zip(low.tolist(), high.tolist(), strict=True)]
    beside = [offset(area, process.support_distance_mm) for area in near]
    return [union([outside, *areas]) for areas in zip(beside, reaches, strict=True)]


def near_table(sections: Sections, heights: Heights, far_mm: float) -> list[Polygons]:
    """The area of each layer in which the head would meet the table."""
    least_mm = least_tip_height_mm(sections.profile.machine, sections.part.pose)
    return _above_planes([plane_in_frame_of(sections.part, -UP, -least_mm)], heights, far_mm)


def _above_planes(planes: Sequence[Floats], heights: Heights, far_mm: float) -> list[Polygons]:
    """The area of each layer above any plane, given by (4,) unit normal and offset."""
    layers: list[list[Polygons]] = [[] for _ in heights.tip_mm]
    everywhere = Polygons.square((2.0 * far_mm, 2.0 * far_mm), True)
    for x, y, z, offset_mm in planes:
        below_mm = offset_mm - np.maximum(z * heights.bottom_mm, z * heights.tip_mm)
        for layer, rest in zip(layers, below_mm.tolist(), strict=True):
            layer.append(half_plane(everywhere, x, y, -rest))
    return [union(layer) for layer in layers]


def head_room(limb: Part, machine: Machine, gap_mm: float) -> list[tuple[float, Polygons]]:
    """Heights above a limb's base plane, each with the area in which nothing may be higher while the limb is printed.

    The tip is assumed to come down to the base plane everywhere in the limb's room. Nothing below -gap_mm is excluded.
    """
    room, clearance_mm, profile = room_of(limb), machine.clearance_mm, machine.head.silhouette_mm
    rings = [(-gap_mm, profile[0][0])]
    rings += [(height - clearance_mm, wider) for (_, height), (wider, _) in pairwise(profile)]
    levels = [(max(low_mm, -gap_mm), offset_round(room, radius + clearance_mm)) for low_mm, radius in rings]
    x0, y0, x1, y1 = room.bounds()
    for box in machine.head.boxes:
        (left, front, bottom), (right, back, _) = np.array(box.min_mm) - clearance_mm, np.array(box.max_mm) + clearance_mm
        levels.append((max(float(bottom), -gap_mm), rectangle(x0 + left, y0 + front, x1 + right, y1 + back)))
    return levels


def out_of_reach(limb: Part, earlier: Sequence[Part], tips_mm: Sequence[float], machine: Machine) -> list[Polygons]:
    """For each height of the tip, the area of a limb's room, in its frame, in which the head would meet standing parts."""
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
    covered: dict[int, Polygons] = {}  # by number of cells, since those of a higher tip are a subset of those of a lower one
    reaches = []
    for tip_mm in tips_mm:
        met = least_mm > tip_mm
        count = int(met.sum())
        if count not in covered:
            rectangles = [_rectangles(met[row], x0, float(rows[row]), cell_mm) for row in np.flatnonzero(met.any(axis=1))]
            covered[count] = union([rectangle for of_row in rectangles for rectangle in of_row])
        reaches.append(covered[count])
    return reaches


def standing_beside(limb: Part, earlier: Sequence[Part], machine: Machine, cell_mm: float) -> StandingColumns:
    """The columns of earlier parts above a limb's base plane. cell_mm: the grid on which they will be queried."""
    points = [np.zeros((0, 3))]
    for part in earlier:
        mesh = part.in_frame_of(limb)
        corners = mesh.vertices[mesh.faces]
        corners = subdivide(np.ascontiguousarray(corners[corners[:, :, 2].max(axis=1) > 0.0]), 2.0 * cell_mm)
        points.append(corners.reshape(-1, 3))
    tops = np.concatenate(points)
    tops = highest_in_cells(tops[tops[:, 2] > LOW_MM], cell_mm)
    # Half the diagonal of either cell, and the distance from the centre of such a triangle to its corners.
    return StandingColumns.of(tops, 2.6 * cell_mm, machine)


def _rectangles(met: Mask, x0: float, middle_mm: float, cell_mm: float) -> list[Polygons]:
    """Rectangles over the marked cells of a row."""
    steps = np.diff(np.concatenate([[0], met.astype(np.int8), [0]]))
    pairs = zip(np.flatnonzero(steps > 0).tolist(), np.flatnonzero(steps < 0).tolist(), strict=True)
    low, high = middle_mm - 0.5 * cell_mm, middle_mm + 0.5 * cell_mm
    return [rectangle(x0 + begin * cell_mm, low, x0 + end * cell_mm, high) for begin, end in pairs]
