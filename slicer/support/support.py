"""Support: from hanging places down to what it stands on, what of it is printed, and what hanging places it cannot hold."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from math import radians, tan

import numpy as np

from slicer.geometry.polygons import Polygons, bounding_box, closing, islands, offset, opening, union
from slicer.overhangs import LEAST_MM2, Overhang, drop_small
from slicer.sections import Sections
from slicer.support.blocker import blocked_areas, support_reach_mm
from slicer.support.missed import find_missed
from slicer.support.reachable import (
    BEYOND,
    COARSE_MM,
    EVEN_MM,
    SLIVER_MM,
    SMOOTH_MM,
    SPECK_MM2,
    ReachableAreas,
    carrying_area,
    dilate,
    drop_slivers,
    reachable_areas,
)
from slicer.support.tree import JOIN_MM, Branch, add_contact, lower_branches

SLACK_MM = 0.01  # what rounding may add to the lean


@dataclass(frozen=True, eq=False)
class Supports:
    """The support of a part's sections, which go up as far as it does.

    Of every layer: where support is printed, where it is dense, which hanging places want it, which of them nothing holds, and
    which a person wants to be held by nothing.
    """

    sections: Sections
    areas: Sequence[Polygons]
    dense: Sequence[Polygons]
    wanted: Sequence[Polygons]
    missed: Sequence[Polygons]
    unwanted: Sequence[Polygons]

    @property
    def unsupported_mm2(self) -> float:
        """Hanging area, seen from above, that none could reach."""
        return float(sum(hanging.area() for hanging in self.missed))


def own_supports(sections: Sections, overhangs: Sequence[Overhang]) -> Supports:
    """The support that stands on the platform, on the part itself and on what lies below its base plane."""
    process, nothing = sections.support_process, [Polygons()] * len(sections.outlines)
    wanted = unwanted = nothing
    if process.support != "none":
        unwanted = drop_small([overhang.unwanted for overhang in overhangs], process.support_least_mm2)
        wanted = drop_small(_drop_nearly_held(sections, overhangs), process.support_least_mm2)
    count = max((k for k, area in enumerate(wanted) if not area.is_empty()), default=-1)
    if count < 0:
        return Supports(sections, nothing, nothing, nothing, nothing, unwanted)
    blocked = blocked_areas(sections, count, process.support_distance_mm, support_reach_mm(sections))
    areas = reachable_areas(sections, blocked)
    printed, dense = stand(*grow(wanted, {}, areas), areas)
    missed = find_missed(wanted, printed, areas)
    if sections.on_platform:
        printed[0] = widen_foot(printed[0], areas, sections.plate - blocked[0])
    rest = nothing[len(printed) :]
    return Supports(sections, [*printed, *rest], [*dense, *rest], wanted, missed, unwanted)


def _drop_nearly_held(sections: Sections, overhangs: Sequence[Overhang]) -> list[Polygons]:
    """The hanging places without those that have plastic or the platform no farther below than support would be."""
    heights, outlines = sections.heights, sections.outlines
    free = []
    for k, hanging in enumerate(overhang.hanging for overhang in overhangs):
        if not hanging.is_empty():
            drop = float(heights.bottom_mm[k]) - sections.process.support_gap_mm
            near = list(outlines[int(np.searchsorted(heights.tip_mm, drop - EVEN_MM)) : max(k - 1, 0)])
            if k and drop <= EVEN_MM:
                below = sections.plastic_below
                hanging = Polygons() if below is None else hanging - union([*near, below])
            elif near:
                hanging = hanging - union(near)
        free.append(hanging)
    return free


def grow(
    wanted: Sequence[Polygons], begins: Mapping[int, Polygons], areas: ReachableAreas
) -> tuple[list[Polygons], list[Polygons]]:
    """Support from the top down: of every layer all of it, and where it begins.

    wanted: the hanging places of each layer; begins: places of a layer at which support has to begin.
    """
    count, radius = len(areas.reachable), areas.radius_mm
    is_tree, area, branches = areas.process.support_style == "tree", Polygons(), list[Branch]()
    bodies, contacts = [Polygons()] * count, [Polygons()] * count
    beginning: dict[int, list[tuple[Polygons, int]]] = {}
    for k, hanging in enumerate(wanted):
        layers = areas.carrying_layers(k)
        if not hanging.is_empty() and len(layers):
            beginning.setdefault(min(layers[0], count - 1), []).append((hanging, layers[-1]))
    pending: list[tuple[Polygons, int]] = []
    for m in range(count - 1, -1, -1):
        pending += beginning.get(m, [])
        area = union([branch.area for branch in branches]) if is_tree else area
        body = _body(area, radius)
        asked = [hanging for hanging, _ in pending] + ([begins[m]] if m in begins else [])
        if asked:
            contact = _contact(union(asked), body, areas.reachable[m], radius)
            if is_tree:
                branches = add_contact(branches, contact, areas.reachable[m], float(areas.heights.tip_mm[m]))
            elif not contact.is_empty():
                area = closing(area + contact, JOIN_MM).simplify(SMOOTH_MM) ^ areas.reachable[m]
            contacts[m] = _body(contact, radius)
            body = body + contacts[m]
        left = [(hanging - body, last) for hanging, last in pending if last < m]
        pending = [(hanging, last) for hanging, last in left if hanging.area() >= LEAST_MM2]
        if not body.is_empty():
            bodies[m] = body
            if is_tree and m:
                branches = lower_branches(branches, areas, m)
            elif m and not (area - areas.reachable[m - 1]).is_empty():
                carrying = carrying_area(area, areas.reachable[m - 1], areas.placeable[m], float(areas.lean_mm[m]))
                area = carrying.simplify(SLIVER_MM)
    return bodies, contacts


def _body(area: Polygons, radius: float) -> Polygons:
    """Discs around all places of an area."""
    return area if area.is_empty() else dilate(area, radius).simplify(COARSE_MM)


def _contact(hanging: Polygons, body: Polygons, reachable: Polygons, radius: float) -> Polygons:
    """Reached places whose discs cover a hanging place as far as can be, beside the support already present."""
    bare = drop_slivers(hanging - body)
    if bare.area() < LEAST_MM2:
        return Polygons()
    bare = closing(bare, 3.0 * SMOOTH_MM).simplify(2.0 * SMOOTH_MM)
    core = offset(bare, -radius)
    contact = (bare if core.is_empty() else core + (bare - offset(core, radius))) ^ reachable
    beside = drop_slivers(bare - dilate(contact, radius))
    return contact if beside.is_empty() else contact + (dilate(beside, radius) ^ reachable)


def stand(
    bodies: Sequence[Polygons], contacts: Sequence[Polygons], areas: ReachableAreas
) -> tuple[list[Polygons], list[Polygons]]:
    """The grown support that stands, and its dense places, layer by layer. bodies, contacts: as grow gives them."""
    printed = _keep_standing(_add_roots(bodies, areas), areas)
    return printed, _dense(printed, contacts, areas)


def _add_roots(bodies: Sequence[Polygons], areas: ReachableAreas) -> list[Polygons]:
    """Support of every layer with the roots of what ends in the layers above.

    A root is at most as deep as the steepest slope that support may not slide along is high under its disc.
    """
    process = areas.process
    across = process.support_distance_mm + 2.0 * areas.radius_mm
    angle = min(process.support_branch_angle_deg, process.self_supporting_angle_deg)
    deep = across / max(tan(radians(angle)), 0.5)
    grown = list(bodies)
    roots: list[tuple[Polygons, float]] = []
    for m in range(len(bodies) - 2, -1, -1):
        ends = _loose_ends(bodies, areas, m + 1)
        if not ends.is_empty():
            roots.append((ends, float(areas.heights.bottom_mm[m + 1]) - deep))
        if roots:
            blocked = _blocked_area(union([root for root, _ in roots]), areas, m)
            left = [(root - blocked, last) for root, last in roots if areas.heights.bottom_mm[m] >= last]
            roots = [(root, last) for root, last in left if not _only_slivers(root)]
            grown[m] = union([bodies[m], *(root for root, _ in roots)])
    return grown


def _loose_ends(bodies: Sequence[Polygons], areas: ReachableAreas, m: int) -> Polygons:
    """The support of a layer that nothing in the layer below carries, though something to stand on is near."""
    if bodies[m].is_empty() or areas.placeable[m].is_empty():
        return Polygons()
    loose = bodies[m] - bodies[m - 1]
    if loose.area() < SPECK_MM2 or (loose ^ areas.placeable[m]).area() < SPECK_MM2:
        return Polygons()
    return drop_slivers(loose - dilate(bodies[m - 1], float(areas.lean_mm[m])))


def _blocked_area(root: Polygons, areas: ReachableAreas, m: int) -> Polygons:
    """Where the gaps to the part forbid support, about a root."""
    distance_mm, outlines = areas.process.support_distance_mm, areas.sections.outlines
    window = bounding_box(root, distance_mm + 1.0)
    beside = offset((outlines[m] ^ window).simplify(COARSE_MM), distance_mm + COARSE_MM)
    near = [*outlines[areas.next_below(m) : m], *outlines[m + 1 : areas.next_above(m)]]
    return union([beside, *(outline ^ window for outline in near), *areas.shut[m : m + 1]])


def _keep_standing(bodies: Sequence[Polygons], areas: ReachableAreas) -> list[Polygons]:
    """Support from the lowest layer up: what lies within the lean of the layer below or stands, wide enough for a bead."""
    printed: list[Polygons] = []
    for m, body in enumerate(bodies):
        if not body.is_empty() and (m > 0 or not areas.sections.on_platform):
            rest = body - dilate(printed[-1], float(areas.lean_mm[m]) + SLACK_MM) if m else body
            loose = rest if _only_slivers(rest) else _loose(rest, areas, m)
            if not _only_slivers(loose):
                body = _clip_loose(body, loose, areas)
        printed.append(body)
    return printed


def _only_slivers(places: Polygons) -> bool:
    """Whether the places are nothing but slivers."""
    return bool(places.area() < SPECK_MM2 or offset(places, -SLIVER_MM).is_empty())


def _loose(rest: Polygons, areas: ReachableAreas, m: int) -> Polygons:
    """The share that does not stand of support which no support carries: discs reach beyond placeable places, but nothing stands
    beside one alone."""
    placeable = areas.placeable[m]
    beside = rest - dilate(placeable, (1.0 - BEYOND) * areas.radius_mm)
    alone = [piece for piece in islands(rest) if _only_slivers(piece ^ placeable)]
    return union([beside, *alone])


def _clip_loose(body: Polygons, loose: Polygons, areas: ReachableAreas) -> Polygons:
    """A layer's support without what is loose: the islands that had some of it, where they are wide enough for a bead."""
    boxes = np.array([piece.bounds() for piece in islands(loose)])
    least = 0.5 * np.pi * areas.radius_mm**2
    standing = []
    for island in islands(body):
        x0, y0, x1, y1 = island.bounds()
        if ((boxes[:, 0] < x1) & (boxes[:, 2] > x0) & (boxes[:, 1] < y1) & (boxes[:, 3] > y0)).any():
            stands = opening((island - loose).simplify(COARSE_MM), 0.45 * areas.process.line_width_mm)
            standing += [piece for piece in islands(stands) if piece.area() >= least]
        else:
            standing.append(island)
    return Polygons.compose(standing) if standing else Polygons()


def widen_foot(area: Polygons, areas: ReachableAreas, free: Polygons) -> Polygons:
    """The first layer on the platform, wider so that it sticks, as far as the gaps to the part allow; free: of the plate."""
    outlines, process = areas.sections.outlines, areas.process
    beside = offset(outlines[0], process.support_distance_mm)
    return (dilate(area, process.support_foot_mm) - union([beside, *outlines[1 : areas.next_above(0)]])) ^ free


def _dense(printed: Sequence[Polygons], contacts: Sequence[Polygons], areas: ReachableAreas) -> list[Polygons]:
    """Where printed support is next to the part: under what it holds and over what it stands on."""
    process = areas.process
    roofs, floors = process.support_interface_layers, process.support_bottom_interface_layers
    reach_mm = (1.0 - BEYOND) * areas.radius_mm
    dense = []
    for m, area in enumerate(printed):
        if area.is_empty():
            dense.append(area)
            continue
        over = [contact for contact in contacts[m : m + roofs] if not contact.is_empty()]
        stands = [foot for foot in areas.placeable[max(m - floors + 1, 0) : m + 1] if not foot.is_empty()]
        near = union([*over, *(dilate(foot, reach_mm) for foot in stands)])
        dense.append(opening(area ^ near, 0.45 * process.line_width_mm))
    return dense
