"""Support: grown from overhangs down to the ground, trimmed to the reachable area, with reasons for missing support."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from math import inf, pi, radians, tan

import numpy as np

from mdp.clearance import least_tip_height_mm
from mdp.mesh import Floats
from slicer.geometry.polygons import Polygons, bounding_box, closing, islands, larger, offset, opening, perimeter_mm, union
from slicer.heights import SAME_MM
from slicer.overhangs import LEAST_MM2, Overhang
from slicer.paths import Unsupported
from slicer.sectioning import RIM_MM, Sections
from slicer.support.reachable import (
    BEYOND,
    COARSE_MM,
    SLIVER_MM,
    SMOOTH_MM,
    SPECK_MM2,
    ReachableAreas,
    above_base_planes,
    beside_standing,
    blocked_areas,
    dilate,
    drop_slivers,
    reachable_areas,
    support_reach_mm,
)
from slicer.support.sturdy import hollow_places, thicken, touching
from slicer.support.tree import JOIN_MM, Branch, add_contact, carrying_area, lower_branches

SLACK_MM = 0.01  # allowance for rounding of the lean
LEDGE = 2.0  # line widths: a narrower ledge is self-supporting by the search's definition (mdp.support_need.patches)
UNWANTED = "no support is wanted there"
TIP_MM = 0.8  # height over which support may be thinner than a branch
UNDER = (0.2, 0.5)  # shares of a disc's radius: distance beside an overhang at which a disc may stand; the smaller is tried first
MOST = 0.5  # share of an area to which a reason must apply
HEAP = 12  # layers united at a time: a sweep over all of them at once meets many more crossings


@dataclass(frozen=True, eq=False)
class Supports:
    """The support of a part, and its sections, extended to the height of the support; each list has one area per layer.

    areas: printed support; dense: its interface; hollow: pieces without lines inside the walls; wanted: overhangs to support;
    missed: unsupported ones among them; unwanted: overhangs for which the user wants no support.
    """

    sections: Sections
    areas: Sequence[Polygons]
    dense: Sequence[Polygons]
    hollow: Sequence[Polygons]
    wanted: Sequence[Polygons]
    missed: Sequence[Polygons]
    unwanted: Sequence[Polygons]

    def right_under(self, layer: int) -> Polygons:
        """The dense support whose top is nearest below a layer, support_gap_mm under it."""
        heights, gap_mm = self.sections.heights, self.sections.process.support_gap_mm
        highest = int(np.searchsorted(heights.tip_mm, heights.bottom_mm[layer] - gap_mm + SAME_MM, side="right")) - 1
        return self.dense[highest] if highest >= 0 else Polygons()

    @property
    def unsupported_mm2(self) -> float:
        """Overhanging area, projected, that support could not reach, mm2."""
        return float(union(self.missed).area())


def own_supports(sections: Sections, overhangs: Sequence[Overhang]) -> Supports:
    """The support that stands on the build plate, on the part itself and on plastic below its base plane."""
    process, nothing = sections.support_process, [Polygons()] * len(sections.outlines)
    wanted, unwanted = wanted_places(sections, overhangs), nothing
    if process.support != "none":
        unwanted = drop_small([overhang.unwanted for overhang in overhangs], process.support_least_mm2)
    count = max((k for k, area in enumerate(wanted) if not area.is_empty()), default=-1)
    if count < 0:
        return Supports(sections, nothing, nothing, nothing, nothing, nothing, unwanted)
    blocked = blocked_areas(sections, count, process.support_distance_mm, support_reach_mm(sections))
    areas = reachable_areas(sections, blocked)
    missed = [Polygons()]
    for _ in range(2):
        printed, dense = stand(*grow(wanted, {}, areas, seen_from_above(missed)), areas)
        missed = find_missed(wanted, printed, areas)
        if all(area.is_empty() for area in missed):
            break
    if sections.on_plate and not sections.on_raft:
        printed[0] = widen_foot(printed, areas, sections.plate - blocked[0])
    hollow, rest = hollow_places(printed, dense, process), nothing[len(printed) :]
    return Supports(sections, [*printed, *rest], [*dense, *rest], [*hollow, *rest], wanted, missed, unwanted)


def wanted_places(sections: Sections, overhangs: Sequence[Overhang]) -> list[Polygons]:
    """The overhangs of every layer that get support: large enough, and without plastic or the build plate within the distance of
    support.
    """
    heights, outlines, process = sections.heights, sections.outlines, sections.process
    if process.support == "none":
        return [Polygons()] * len(outlines)
    free = []
    for k, hanging in enumerate(overhang.hanging for overhang in overhangs):
        if process.support == "enforced":
            hanging = hanging ^ sections.enforced[k] if sections.enforced else Polygons()
        if not hanging.is_empty():
            drop = float(heights.bottom_mm[k]) - process.support_gap_mm
            near = list(outlines[int(np.searchsorted(heights.tip_mm, drop - SAME_MM)) : max(k - 1, 0)])
            if k and drop <= SAME_MM:
                below = sections.plastic_below
                hanging = Polygons() if below is None else hanging - union([*near, below])
            elif near:
                hanging = hanging - union(near)
        free.append(hanging)
    return drop_small(free, process.support_least_mm2)


def drop_small(hanging: Sequence[Polygons], least_mm2: float) -> list[Polygons]:
    """The overhangs without those whose projection is too small."""
    small = union([island for island in islands(seen_from_above(hanging)) if island.area() < least_mm2])
    return list(hanging) if small.is_empty() else [_if_large(area - small) for area in hanging]


def _if_large(area: Polygons) -> Polygons:
    """The area, empty if it is only rounding."""
    return area if area.area() >= LEAST_MM2 else Polygons()


def seen_from_above(hanging: Sequence[Polygons]) -> Polygons:
    """The united projection of overhangs of all layers."""
    areas = [offset(area, RIM_MM) for area in hanging if not area.is_empty()]
    return union([union(areas[k : k + HEAP]) for k in range(0, len(areas), HEAP)])


def grow(
    wanted: Sequence[Polygons], begins: Mapping[int, Polygons], areas: ReachableAreas, hard: Polygons
) -> tuple[list[Polygons], list[Polygons]]:
    """Grow support from the top down. Returns one area per layer of all support, and one of the support that begins there.

    wanted: the overhangs of each layer; begins: areas of a layer in which support must begin; hard: area in which support may
    merely touch what it holds.
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
        beginnings = [hanging for hanging, _ in pending] + ([begins[m]] if m in begins else [])
        if beginnings:
            contact = _contact(union(beginnings), body, areas.reachable[m], radius, hard)
            if is_tree:
                branches = add_contact(branches, contact, areas.reachable[m])
            elif not contact.is_empty():
                area = closing(area + contact, JOIN_MM).simplify(SMOOTH_MM) ^ areas.reachable[m]
            contacts[m] = _body(contact, radius)
            body = body + contacts[m]
        left = [(_if_large(hanging - body), last) for hanging, last in pending if last < m]
        pending = [(hanging, last) for hanging, last in left if not hanging.is_empty()]
        if not body.is_empty():
            bodies[m] = body
            if is_tree and m:
                branches = lower_branches(branches, areas, m)
            elif m and not (area - areas.reachable[m - 1]).is_empty():
                carrying = carrying_area(area, areas.reachable[m - 1], areas.placeable[m], float(areas.lean_mm[m]))
                area = carrying.simplify(SLIVER_MM)
    return thicken(bodies, areas), contacts


def _body(area: Polygons, radius: float) -> Polygons:
    """The area of discs around all points of an area."""
    return dilate(area, radius).simplify(COARSE_MM)


def _contact(hanging: Polygons, body: Polygons, reachable: Polygons, radius: float, hard: Polygons) -> Polygons:
    """Reachable points whose discs cover an overhang as far as possible, beside the support already present.

    A disc beside the overhang must extend under it by half its radius: a bead that merely touches it holds little, and is used
    only where the overhang is hard to reach.
    """
    bare = drop_slivers(hanging - body)
    if bare.area() < LEAST_MM2:
        return Polygons()
    bare = closing(bare, 3.0 * SMOOTH_MM).simplify(2.0 * SMOOTH_MM)
    core = offset(bare, -radius)
    contact = (bare if core.is_empty() else core + (bare - offset(core, radius))) ^ reachable
    beside = drop_slivers(bare - dilate(contact, radius))
    for share in UNDER if not beside.is_empty() else ():
        contact = contact + (dilate(beside, share * radius) ^ reachable)
        beside = drop_slivers(beside - dilate(contact, radius))
    touched = beside ^ hard
    return contact if touched.is_empty() else contact + (dilate(touched, radius) ^ reachable)


def stand(
    bodies: Sequence[Polygons], contacts: Sequence[Polygons], areas: ReachableAreas
) -> tuple[list[Polygons], list[Polygons]]:
    """The grown support that stands, and its dense areas, layer by layer. bodies, contacts: from grow."""
    printed = _keep_standing(_add_roots(bodies, areas), areas)
    return printed, _dense(printed, contacts, areas)


def _add_roots(bodies: Sequence[Polygons], areas: ReachableAreas) -> list[Polygons]:
    """The support of every layer with roots under support that would end in the air.

    A root is at most as deep as the steepest slope along which support may not slide is high under its disc; a thin one is no
    deeper than the greatest length of a tip.
    """
    process = areas.process
    across = process.support_distance_mm + 2.0 * areas.radius_mm
    angle = min(process.support_branch_angle_deg, process.self_supporting_angle_deg)
    deep = across / max(tan(radians(angle)), 0.5)
    grown, least_mm2 = list(bodies), 0.25 * pi * process.support_branch_mm**2
    roots: list[tuple[Polygons, float]] = []
    for m in range(len(bodies) - 2, -1, -1):
        bottom_mm, ends = areas.heights.bottom_mm[m : m + 2].tolist(), _loose_ends(bodies, areas, m + 1)
        if not ends.is_empty():
            roots.append((ends, bottom_mm[1]))
        if roots:
            blocked = _blocked_area(union([root for root, _ in roots]), areas, m)
            left = [(root - blocked, top_mm) for root, top_mm in roots if top_mm - bottom_mm[0] <= deep]
            left = [(larger(root, least_mm2) if top_mm - bottom_mm[0] > TIP_MM else root, top_mm) for root, top_mm in left]
            roots = [(root, top_mm) for root, top_mm in left if not drop_slivers(root).is_empty()]
            grown[m] = union([bodies[m], *(root for root, _ in roots)])
    return grown


def _loose_ends(bodies: Sequence[Polygons], areas: ReachableAreas, m: int) -> Polygons:
    """The support of a layer that nothing in the layer below carries, although ground is near."""
    if bodies[m].is_empty() or areas.placeable[m].is_empty():
        return Polygons()
    loose = bodies[m] - bodies[m - 1]
    if loose.area() < SPECK_MM2 or (loose ^ areas.placeable[m]).area() < SPECK_MM2:
        return Polygons()
    return drop_slivers(loose - dilate(bodies[m - 1], float(areas.lean_mm[m])))


def _blocked_area(root: Polygons, areas: ReachableAreas, m: int) -> Polygons:
    """Area around a root in which the gaps to the part exclude support."""
    distance_mm, outlines = areas.process.support_distance_mm, areas.sections.outlines
    window = bounding_box(root, distance_mm + 1.0)
    beside = offset((outlines[m] ^ window).simplify(COARSE_MM), distance_mm + COARSE_MM)
    near = [*outlines[areas.next_below(m) : m], *outlines[m + 1 : areas.next_above(m)]]
    return union([beside, *(outline ^ window for outline in near), *areas.blocked[m : m + 1]])


def _keep_standing(bodies: Sequence[Polygons], areas: ReachableAreas) -> list[Polygons]:
    """Support from the lowest layer up: the area within the lean of the layer below, or standing, that is wide enough for a
    bead.
    """
    printed: list[Polygons] = []
    for m, body in enumerate(bodies):
        rest = body - dilate(printed[-1], float(areas.lean_mm[m]) + SLACK_MM) if m else body
        if (m or not areas.sections.on_plate) and not drop_slivers(rest).is_empty():
            placeable = areas.placeable[m] ^ bounding_box(rest, areas.radius_mm)
            # Discs extend beyond placeable areas, but none stands beside one alone.
            alone = [piece for piece in islands(rest) if drop_slivers(piece ^ placeable).is_empty()]
            loose = union([rest - dilate(placeable, (1.0 - BEYOND) * areas.radius_mm), *alone])
            body = body if drop_slivers(loose).is_empty() else _clip_loose(body, loose, areas)
        printed.append(body)
    return printed


def _clip_loose(body: Polygons, loose: Polygons, areas: ReachableAreas) -> Polygons:
    """A layer's support without its loose area; islands that lose some keep only the parts wide enough for a bead."""
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


def widen_foot(printed: Sequence[Polygons], areas: ReachableAreas, free: Polygons) -> Polygons:
    """The first layer on the build plate, widened for adhesion as far as the gaps to the part allow. free: free area of the
    plate.

    Each piece becomes up to twice as wide as the support on it is high, but grows by at most support_foot_mm on each side.
    """
    outlines, process = areas.sections.outlines, areas.process
    widths_mm = [4.0 * piece.area() / perimeter_mm(piece) for piece in islands(printed[0])]  # for a long strip, twice its width
    enough_mm = process.support_foot_mm + 0.5 * max(widths_mm, default=0.0)  # higher support gets no wider foot
    layers = range(min(int(np.searchsorted(areas.heights.tip_mm[: len(printed)], enough_mm)) + 1, len(printed)))
    over, tops_mm = list[Polygons](), np.zeros(0)
    for layer in reversed(layers):
        pieces, boxes = islands(printed[layer]), np.array([piece.bounds() for piece in over]).reshape(-1, 4)
        tip_mm = float(areas.heights.tip_mm[layer])
        tops_mm = np.array([max([tip_mm, *tops_mm[touching(piece, over, boxes)]]) for piece in pieces])
        over = pieces
    lacking_mm = tops_mm - 0.5 * np.array(widths_mm)
    feet = [dilate(piece, min(lack, process.support_foot_mm)) for piece, lack in zip(over, lacking_mm.tolist(), strict=True)]
    beside = offset(outlines[0], process.support_distance_mm)
    return (union(feet) - union([beside, *outlines[1 : areas.next_above(0)]])) ^ free


def _dense(printed: Sequence[Polygons], contacts: Sequence[Polygons], areas: ReachableAreas) -> list[Polygons]:
    """The area of printed support next to the part: under the overhangs that it holds and over the surface on which it stands."""
    process = areas.process
    roofs, floors = process.support_interface_layers, process.support_bottom_interface_layers
    feet = [dilate(foot, (1.0 - BEYOND) * areas.radius_mm) for foot in areas.placeable]
    near = [[*contacts[m : m + roofs], *feet[max(m - floors + 1, 0) : m + 1]] for m in range(len(printed))]
    beside = [union([area for area in of_layer if not area.is_empty()]) for of_layer in near]
    return [opening(area ^ close, 0.45 * process.line_width_mm) for area, close in zip(printed, beside, strict=True)]


def find_missed(wanted: Sequence[Polygons], printed: Sequence[Polygons], areas: ReachableAreas) -> list[Polygons]:
    """The overhangs that support does not hold, layer by layer.

    A point is held over printed support and half a bead beyond its edge, where lines span from there to the part, where no layer
    of support fits between it and the part, the build plate or the plastic below the base plane, and on a ledge.
    """
    process, heights, outlines = areas.process, areas.heights, areas.sections.outlines
    distance_mm, missed = process.support_distance_mm, [Polygons()] * len(wanted)
    below, first_mm = areas.sections.plastic_below, np.append(heights.tip_mm, inf)[areas.lowest_on_plastic]
    for k, hanging in enumerate(wanted):
        if hanging.is_empty():
            continue
        held = _held(k, printed, areas)
        bare = _if_large(hanging - held)
        if k and not held.is_empty() and not bare.is_empty():
            around = (held + outlines[k - 1]) ^ bounding_box(bare, 2.0 * distance_mm + 1.0)
            bare = bare - closing(around, 0.5 * distance_mm + RIM_MM)
        lowest = float(heights.bottom_mm[k]) - process.support_gap_mm - process.layer_height_mm
        if k and lowest <= SAME_MM and areas.sections.on_plate:
            continue
        near = list(outlines[int(np.searchsorted(heights.tip_mm, lowest - SAME_MM)) : k - 1]) if k else []
        if k and below is not None and first_mm > heights.bottom_mm[k] - process.support_gap_mm + SAME_MM:
            near.append(below)
        missed[k] = _if_large(bare - union(near) if near else bare)
    return _drop_ledges(missed, printed, areas)


def _drop_ledges(missed: Sequence[Polygons], printed: Sequence[Polygons], areas: ReachableAreas) -> list[Polygons]:
    """The unsupported overhangs without ledges, which have no large area beyond a ledge's reach from held area."""
    above, outlines, process = seen_from_above(missed), areas.sections.outlines, areas.process
    reach, beyond = LEDGE * process.line_width_mm, []
    for k, bare in enumerate(missed):
        if k and not bare.is_empty():
            carrying = (outlines[k - 1] ^ bounding_box(bare, 2.0 * reach)) - above
            bare = bare - offset(carrying + _held(k, printed, areas), reach)
        beyond.append(bare)
    seen = offset(union([area for area in drop_small(beyond, process.support_least_mm2) if not area.is_empty()]), RIM_MM)
    wide = union([island for island in islands(above) if not (island ^ seen).is_empty()])
    return [area ^ wide for area in missed]


def _held(k: int, printed: Sequence[Polygons], areas: ReachableAreas) -> Polygons:
    """The area of a layer over printed support."""
    return offset(union([printed[m] for m in areas.carrying_layers(k) if m < len(printed)]), 0.5 * areas.process.line_width_mm)


def explain(supports: Supports, tops_mm: Floats) -> tuple[Unsupported, ...]:
    """All unsupported areas, largest first, with the numbers of their layers among those that print anything.

    Area that the layer below carries, a line on it or beside one, is left out: slopes too steep for the process are printed like
    that, layer upon layer. tops_mm: heights of the layers that print anything.
    """
    sections, process, bare = supports.sections, supports.sections.process, list(supports.missed)
    for k, missed in enumerate(bare):
        if k and not missed.is_empty():
            near = sections.outlines[k - 1] ^ bounding_box(missed, 2.0 * process.line_width_mm)
            bare[k] = missed - offset(near, process.line_width_mm)
    hanging = _connected_areas(drop_small(bare, process.support_least_mm2))
    places = [(mm2, layer, _reason(layer, area, sections)) for mm2, layer, area in hanging]
    places += [(mm2, layer, UNWANTED) for mm2, layer, _ in _connected_areas(supports.unwanted)]
    places.sort(key=lambda place: (-place[0], place[1]))
    number = np.searchsorted(tops_mm, sections.heights.tip_mm, side="right")
    return tuple(Unsupported(mm2, int(number[layer]), reason) for mm2, layer, reason in places)


def _connected_areas(hanging: Sequence[Polygons]) -> Iterator[tuple[float, int, Polygons]]:
    """Connected overhangs in projection: the area of each, the layer with most of it, and its share there."""
    for island in islands(seen_from_above(hanging)):
        pieces = {k: piece ^ island for k, piece in enumerate(hanging) if not piece.is_empty()}
        mm2 = {k: piece.area() for k, piece in pieces.items()}
        worst = max(mm2, key=lambda k: mm2[k], default=-1)
        if worst >= 0 and mm2[worst] > 0.0:
            yield float(union(list(pieces.values())).area()), worst, pieces[worst]


def _reason(layer: int, hanging: Polygons, sections: Sections) -> str:
    """The reason why an overhang of a layer could not be supported."""
    process, heights, least_mm2 = sections.support_process, sections.heights, MOST * hanging.area()
    drop = float(heights.bottom_mm[layer]) - process.support_gap_mm
    top = max(int(np.searchsorted(heights.tip_mm, drop + SAME_MM, side="right")) - 1, 0)
    if sections.on_plate and (hanging - offset(sections.plate, -process.line_width_mm)).area() >= least_mm2:
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
    lowest = int(np.searchsorted(heights.tip_mm, drop - room_mm + SAME_MM))
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
    """The part with which support could be printed under an overhang if the table were not in the way of the head."""
    middle = 0.5 * (np.array(hanging.bounds()[:2]) + hanging.bounds()[2:])
    base_mm, machine = sections.part.base.offset_mm, sections.profile.machine
    below, under = (np.append(middle, base_mm + z) @ sections.part.rotation for z in (z_mm, 0.0))
    if not sections.on_plate and below[2] < least_tip_height_mm(machine, sections.part.pose):
        return sections.part.index
    earlier = [part for part in reversed(sections.earlier) if part.base.limbs_mm is None]
    lower = next((part for part in earlier if part.base.heights_mm(under[None])[0] > 0.0), None)
    if lower is None or lower.on_plate or under[2] >= least_tip_height_mm(machine, lower.pose):
        return None
    return lower.index
