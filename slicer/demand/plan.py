"""Plan: the support of all parts together, so that what finds no ground above its base plane stands on support printed earlier.

Every place over the platform lies above the base plane of some part and below those of all later ones: there is just one
part with which support can be printed there. So what a part's own ground does not hold is handed down in three passes:
upward, where support of each part may stand if that of the parts before it may (ReachableAreas); downward, from the last
part to the first, the support itself, whose feet on a base plane become patches for the parts before; and upward again, what
of it stands on what was really built.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from math import hypot, radians, tan

import numpy as np

from mdp.clearance import least_tip_height_mm
from mdp.pose import shift
from slicer.demand.facing import Facing
from slicer.demand.patch import NEAR_MM, Patch, begins_under, keep_off, upper_side
from slicer.demand.site import Site
from slicer.geometry.polygons import Polygons, offset, union
from slicer.support.blocker import blocked_areas, low_areas
from slicer.support.missed import LEAST_MM2, find_missed, window
from slicer.support.reachable import ReachableAreas, reachable_areas
from slicer.support.support import Supports, grow, stand, widen_foot

AROUND_MM = 3.0  # support handed down may go so much farther aside than its lean takes it
SHALLOW_MM = 1.2  # so far below a plane the middles of support that can come up to it lie


@dataclass(eq=False)
class Ground:
    """Where handed-down support of a part may be, and what becomes of it: layers up to the highest that is of use.

    outlines: sections, of use inside `window`; shut: where nothing may stand in its first layer; bodies, contacts: the support
    and where it begins; patches: what of it needs support beneath its base plane.
    """

    site: Site
    window: Polygons
    outlines: Sequence[Polygons]
    areas: ReachableAreas
    shut: Polygons
    far_mm: float
    bodies: Sequence[Polygons] = ()
    contacts: Sequence[Polygons] = ()
    patches: list[Patch] = field(default_factory=list)


def plan_supports(sites: Sequence[Site]) -> list[tuple[Site, Supports]]:
    """Every part's site, as high as its support, and its support; sites: of all parts in print order."""
    planned = [(site, site.supports) for site in sites]
    if all(supports.unsupported_mm2 == 0.0 for _, supports in planned[1:]):
        return planned
    grounds = _grounds(sites)
    for k in range(len(sites) - 1, -1, -1):
        ground = grounds[k]
        if ground is not None:
            _grow(ground, grounds[k + 1 :])
    for k, ground in enumerate(grounds):
        if ground is not None:
            planned[k] = _stand(ground, planned[k][1], planned[:k])
    return planned


def _regions(sites: Sequence[Site]) -> list[tuple[Polygons, float]]:
    """For every part what of its base plane handed-down support may need, and up to which height; empty: nothing."""
    lean = tan(radians(max(site.process.support_branch_angle_deg for site in sites)))
    boxes = [np.array([np.inf, np.inf, -np.inf, -np.inf]) for _ in sites]
    tops = [0.0] * len(sites)

    def take(k: int, box: np.ndarray, top_mm: float) -> None:
        aside = max(top_mm, 0.0) * lean + AROUND_MM
        boxes[k][:2] = np.minimum(boxes[k][:2], box[:2] - aside)
        boxes[k][2:] = np.maximum(boxes[k][2:], box[2:] + aside)
        tops[k] = max(tops[k], top_mm)

    for k in range(len(sites) - 1, 0, -1):
        for layer, place in enumerate(sites[k].supports.missed):
            if not place.is_empty():
                take(k, np.array(place.bounds()), float(sites[k].heights.tip_mm[layer]))
        if not np.isfinite(boxes[k]).all():
            continue
        x0, y0, x1, y1 = boxes[k]
        for m in range(k):
            corners = Facing.of(sites[m].part, sites[k].part).points_mm(np.array([[x0, y0], [x1, y0], [x1, y1], [x0, y1]]))
            top = min(float(corners[:, 2].max()), _highest_mm(sites, m))
            if top > 0.0:
                low, high = corners[:, :2].min(axis=0), corners[:, :2].max(axis=0)
                take(m, np.concatenate([low, high]), top)
    return [
        (
            Polygons.square((box[2] - box[0], box[3] - box[1])).translate((box[0], box[1]))
            if np.isfinite(box).all()
            else Polygons(),
            top,
        )
        for box, top in zip(boxes, tops, strict=True)
    ]


def _highest_mm(sites: Sequence[Site], k: int) -> float:
    """How high the parts from part k on reach along its direction."""
    up, base = sites[k].part.direction, sites[k].part.base.offset_mm
    return max(float((site.part.mesh.vertices @ up).max()) for site in sites[k:]) - base


def _grounds(sites: Sequence[Site]) -> list[Ground | None]:
    grounds: list[Ground | None] = []
    for site, (region, top_mm) in zip(sites, _regions(sites), strict=True):
        if region.is_empty() or site.process.support == "none":
            grounds.append(None)
            continue
        grounds.append(_ground(site.up_to(top_mm), region, top_mm, grounds))
    return grounds


def _ground(site: Site, region: Polygons, top_mm: float, earlier: Sequence[Ground | None]) -> Ground:
    """Where support of a part may stand if that of earlier parts may."""
    heights, process, part = site.heights, site.process, site.part
    window = region ^ _within_axes(site)
    far_mm = max(site.far_mm, _reach_mm(region))
    count = max(min(int(np.searchsorted(heights.bottom_mm, top_mm)), len(heights.tip_mm)), 1)
    low = replace(heights, tip_mm=heights.tip_mm[:count], height_mm=heights.height_mm[:count], cut_mm=heights.cut_mm[:count])
    blocked = site.shut(blocked_areas(part, site.later, low, 0.0, far_mm), low)
    if site.beneath is not None:
        near_table = low_areas(part, least_tip_height_mm(site.profile.machine, part.pose), low, far_mm)
        blocked = [union([one, other]) for one, other in zip(blocked, near_table, strict=True)]
    outside = offset(region, AROUND_MM) - window
    blocked = [union([layer, outside]) for layer in blocked] if outside.area() > 4.0 * AROUND_MM**2 else blocked
    outlines = [outline if outline.is_empty() else outline ^ region for outline in site.outlines]
    below = None if site.beneath is None else site.beneath ^ region
    handed = union([_reached(ground, site, window) for ground in earlier if ground is not None])
    areas = reachable_areas(outlines, heights, process, below, blocked, site.floor ^ window, handed)
    return Ground(site, window, outlines, areas, blocked[0], far_mm)


def _within_axes(site: Site) -> Polygons:
    """The places of a part's frame that the axes reach."""
    machine = site.profile.machine
    moved = shift(machine, site.part.pose)
    x, y = (np.array(axis.limits_mm) - moved[k] for k, axis in enumerate((machine.x, machine.y)))
    return Polygons.square((x[1] - x[0], y[1] - y[0])).translate((x[0], y[0]))


def _reach_mm(region: Polygons) -> float:
    x0, y0, x1, y1 = region.bounds()
    return 2.0 * hypot(max(abs(x0), abs(x1)), max(abs(y0), abs(y1))) + AROUND_MM


def _reached(ground: Ground, site: Site, window: Polygons) -> Polygons:
    """The places on a later part's base plane that support of a part can come up to."""
    facing = Facing.of(ground.site.part, site.part)
    return upper_side(ground.areas.reachable, facing, ground.site.heights, window, -SHALLOW_MM, 0.0, ground.far_mm)


def _grow(ground: Ground, later: Sequence[Ground | None]) -> None:
    """The support that a part's own ground misses, and that later parts ask for; its feet become patches."""
    site, areas = ground.site, ground.areas
    count = len(areas.reachable)
    begins: dict[int, list[Polygons]] = {}
    asking = [(Facing.of(site.part, other.site.part), other.patches) for other in later if other is not None]
    for facing, patches in asking:
        for patch in patches:
            for layer, place in begins_under(patch, facing, site.heights, count, ground.far_mm).items():
                begins.setdefault(layer, []).append(place)
    missed = [place if site.beneath is not None else Polygons() for place in site.supports.missed]
    wanted = [*missed, *[Polygons()] * (len(site.outlines) - len(missed))]
    bodies, contacts = grow(wanted, {layer: union(places) for layer, places in begins.items()}, areas, site.process)
    for facing, patches in asking:
        bodies = keep_off(bodies, patches, facing, site.heights, site.process.support_distance_mm, ground.far_mm)
    ground.bodies, ground.contacts = bodies, contacts
    if site.beneath is not None:
        ground.patches = _patches(ground, wanted)


def _patches(ground: Ground, wanted: Sequence[Polygons]) -> list[Patch]:
    """What of a part and of its support hangs over its base plane."""
    site = ground.site
    patches = [Patch(place, _gap_mm(ground, layer)) for layer, place in _hanging_low(ground, wanted)]
    if ground.bodies and not ground.bodies[0].is_empty():
        patches.append(Patch(ground.bodies[0] - _own_ground(site), 0.0))
    return [patch for patch in patches if patch.places.area() >= LEAST_MM2]


def _hanging_low(ground: Ground, wanted: Sequence[Polygons]) -> list[tuple[int, Polygons]]:
    """The hanging places that support above the base plane has no room under, with their layers."""
    low = enumerate(wanted[: int(np.searchsorted(ground.areas.bottom_mm, ground.site.process.support_gap_mm + 1.0))])
    return [(k, place) for k, place in low if not place.is_empty() and not len(window(k, ground.areas, ground.site.process))]


def _gap_mm(ground: Ground, layer: int) -> float:
    """How far below the base plane support under a layer ends."""
    return max(ground.site.process.support_gap_mm - max(float(ground.areas.bottom_mm[layer]), 0.0), 0.0)


def _own_ground(site: Site) -> Polygons:
    """Where support stands on plastic without a gap."""
    if site.beneath is None or site.process.support_bottom_gap_mm > 0.0:
        return Polygons()
    return offset(site.beneath, site.process.line_width_mm)


def _stand(ground: Ground, first: Supports, earlier: Sequence[tuple[Site, Supports]]) -> tuple[Site, Supports]:
    """A part's support with what of the handed-down one stands; earlier: what was built before it."""
    site, process, areas = ground.site, ground.site.process, ground.areas
    on_platform = site.beneath is None
    if not on_platform:
        held = offset(_held(ground, earlier, 0.0), 0.5 * areas.radius_mm)
        areas = replace(areas, ground=(union([held, _own_ground(site)]), *areas.ground[1:]))
    printed, dense = stand(ground.bodies, ground.contacts, ground.outlines, areas, process, on_platform)
    count = len(site.outlines)
    layers = [[*places, *[Polygons()] * (count - len(places))] for places in (printed, dense, first.areas, first.dense)]
    both = [union([one, other]) for one, other in zip(layers[0], layers[2], strict=True)]
    wanted, missed = ([*places, *[Polygons()] * (count - len(places))] for places in (first.wanted, first.missed))
    left = list(missed) if on_platform else list(find_missed(missed, both, site.outlines, areas, process, False))
    for layer, _ in () if on_platform else _hanging_low(ground, missed):
        left[layer] = left[layer] - offset(_held(ground, earlier, _gap_mm(ground, layer)), 0.5 * process.line_width_mm)
    if on_platform:
        foot = widen_foot(printed[0], site.outlines, areas, process, (ground.window ^ site.floor) - ground.shut)
        both[0] = union([both[0], foot])
    all_dense = tuple(union([one, other]) for one, other in zip(layers[1], layers[3], strict=True))
    return site, Supports(tuple(both), all_dense, tuple(wanted), tuple(left))


def _held(ground: Ground, earlier: Sequence[tuple[Site, Supports]], gap_mm: float) -> Polygons:
    """The places on a part's base plane that have support of earlier parts gap_mm beneath them."""
    pieces = []
    for site, supports in earlier:
        facing = Facing.of(site.part, ground.site.part)
        pieces.append(upper_side(supports.areas, facing, site.heights, ground.window, -gap_mm - NEAR_MM, 0.0, ground.far_mm))
    return union(pieces)
