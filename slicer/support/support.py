"""Support: from hanging places down to ground, what of it is printed, and what hanging places it cannot hold."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from profiles.process import Process
from slicer.geometry.polygons import Polygons, closing, islands, offset, opening, union
from slicer.heights import Heights
from slicer.support.branch import Growth
from slicer.support.columns import Columns
from slicer.support.missed import LEAST_MM2, drop_small, find_missed, window
from slicer.support.reachable import (
    BEYOND,
    COARSE_MM,
    EVEN_MM,
    SMOOTH_MM,
    ReachableAreas,
    dilate,
    drop_slivers,
    only_slivers,
    reachable_areas,
)
from slicer.support.root import add_roots
from slicer.support.tree import Tree

SLACK_MM = 0.01  # what rounding may add to the lean


@dataclass(frozen=True, eq=False)
class Supports:
    """Of every layer: where support is printed, where it is dense, which hanging places want it, which of them nothing holds."""

    areas: tuple[Polygons, ...]
    dense: tuple[Polygons, ...]
    wanted: tuple[Polygons, ...]
    missed: tuple[Polygons, ...]

    @property
    def wanted_mm2(self) -> float:
        """Hanging area, seen from above, that needs support."""
        return float(sum(place.area() for place in self.wanted))

    @property
    def unsupported_mm2(self) -> float:
        """Hanging area, seen from above, that none could reach."""
        return float(sum(place.area() for place in self.missed))


def generate_supports(
    hanging: Sequence[Polygons],
    outlines: Sequence[Polygons],
    heights: Heights,
    process: Process,
    below: Polygons | None,
    blocked: Sequence[Polygons],
    floor: Polygons,
) -> Supports:
    """Support below the hanging places of each layer.

    below: plastic of earlier parts just under the base plane; None: the platform. forbidden: per layer what later parts
    must find empty. floor: the plate, which ends somewhere.
    """
    nothing = (Polygons(),) * len(outlines)
    if process.support == "none":
        return Supports(nothing, nothing, nothing, nothing)
    free_hanging = _drop_nearly_held(hanging, outlines, heights, process, below)
    wanted = drop_small(free_hanging, process.support_least_mm2)
    count = max((k for k, place in enumerate(wanted) if not place.is_empty()), default=-1)
    if count < 0:
        return Supports(nothing, nothing, nothing, nothing)
    areas = reachable_areas(outlines, heights, process, below, blocked[:count], floor)
    printed, dense = stand(*grow(wanted, {}, areas, process), outlines, areas, process, below is None)
    missed = find_missed(wanted, printed, outlines, areas, process, below is None)
    if below is None:
        printed[0] = widen_foot(printed[0], outlines, areas, process, floor - blocked[0])
    rest = nothing[len(printed) :]
    return Supports((*printed, *rest), (*dense, *rest), tuple(wanted), missed)


def stand(
    bodies: Sequence[Polygons],
    contacts: Sequence[Polygons],
    outlines: Sequence[Polygons],
    areas: ReachableAreas,
    process: Process,
    on_platform: bool,
) -> tuple[list[Polygons], list[Polygons]]:
    """What of grown support stands, and where of it is dense: per layer."""
    printed = _keep_standing(add_roots(bodies, outlines, areas, process), areas, process, on_platform)
    return printed, _dense(printed, contacts, areas, process)


def _drop_nearly_held(
    hanging: Sequence[Polygons], outlines: Sequence[Polygons], heights: Heights, process: Process, below: Polygons | None
) -> list[Polygons]:
    """The hanging places without those that have plastic or the platform no farther below than support would be."""
    free = []
    for k, place in enumerate(hanging):
        if not place.is_empty():
            drop = float(heights.bottom_mm[k]) - process.support_gap_mm
            near = list(outlines[int(np.searchsorted(heights.tip_mm, drop - EVEN_MM)) : max(k - 1, 0)])
            if k and drop <= EVEN_MM:
                place = place - union([*near, below]) if below is not None else Polygons()
            elif near:
                place = place - union(near)
        free.append(place)
    return free


def grow(
    wanted: Sequence[Polygons], begins: Mapping[int, Polygons], areas: ReachableAreas, process: Process
) -> tuple[list[Polygons], list[Polygons]]:
    """Support from the top down: per layer all of it, and where it begins.

    wanted: the hanging places of each layer; begins: places of a layer at which support has to begin.
    """
    count, radius = len(areas.reachable), areas.radius_mm
    grows: Columns | Tree = Tree(Growth.of(process, radius)) if process.support_style == "tree" else Columns(Polygons())
    bodies, contacts = [Polygons()] * count, [Polygons()] * count
    beginning: dict[int, list[tuple[Polygons, int]]] = {}
    for k, place in enumerate(wanted):
        span = window(k, areas, process)
        if not place.is_empty() and len(span):
            beginning.setdefault(min(span[0], count - 1), []).append((place, span[-1]))
    pending: list[tuple[Polygons, int]] = []
    for m in range(count - 1, -1, -1):
        pending += beginning.get(m, [])
        body = _body(grows.area, radius)
        asked = [place for place, _ in pending] + ([begins[m]] if m in begins else [])
        if asked:
            contact = _contact(union(asked), body, areas.reachable[m], radius)
            grows = grows.add_contact(contact, areas.reachable[m], float(areas.top_mm[m]))
            contacts[m] = _body(contact, radius)
            body = body + contacts[m]
        left = [(place - body, last) for place, last in pending if last < m]
        pending = [(place, last) for place, last in left if place.area() >= LEAST_MM2]
        if not body.is_empty():
            bodies[m] = body
            grows = grows.lower(areas, m) if m else grows
    return bodies, contacts


def _body(area: Polygons, radius: float) -> Polygons:
    """Discs around all places of an area."""
    return area if area.is_empty() else dilate(area, radius).simplify(COARSE_MM)


def _contact(place: Polygons, body: Polygons, reachable: Polygons, radius: float) -> Polygons:
    """Reached places whose discs cover a hanging place as far as can be, beside the support already present."""
    bare = drop_slivers(place - body)
    if bare.area() < LEAST_MM2:
        return Polygons()
    bare = closing(bare, 3.0 * SMOOTH_MM).simplify(2.0 * SMOOTH_MM)
    core = offset(bare, -radius)
    contact = (bare if core.is_empty() else core + (bare - offset(core, radius))) ^ reachable
    beside = drop_slivers(bare - dilate(contact, radius))
    return contact if beside.is_empty() else contact + (dilate(beside, radius) ^ reachable)


def _keep_standing(bodies: Sequence[Polygons], areas: ReachableAreas, process: Process, on_platform: bool) -> list[Polygons]:
    """Support from the ground up: what lies within the lean of the layer below or on ground, wide enough for a bead."""
    printed: list[Polygons] = []
    for m, body in enumerate(bodies):
        if not body.is_empty() and (m > 0 or not on_platform):
            rest = body - dilate(printed[-1], float(areas.lean_mm[m]) + SLACK_MM) if m else body
            loose = rest if only_slivers(rest) else _loose(rest, areas, m)
            if not only_slivers(loose):
                body = _clip_loose(body, loose, areas, process)
        printed.append(body)
    return printed


def _loose(rest: Polygons, areas: ReachableAreas, m: int) -> Polygons:
    """What of support that no support carries is not on ground: discs reach beyond it, but nothing stands beside it alone."""
    beside = rest - dilate(areas.ground[m], (1.0 - BEYOND) * areas.radius_mm)
    alone = [piece for piece in islands(rest) if only_slivers(piece ^ areas.ground[m])]
    return union([beside, *alone])


def _clip_loose(body: Polygons, loose: Polygons, areas: ReachableAreas, process: Process) -> Polygons:
    """A layer's support without what is loose: the islands that had some of it, where they are wide enough for a bead."""
    boxes = np.array([piece.bounds() for piece in islands(loose)])
    least = 0.5 * np.pi * areas.radius_mm**2
    standing = []
    for island in islands(body):
        x0, y0, x1, y1 = island.bounds()
        if ((boxes[:, 0] < x1) & (boxes[:, 2] > x0) & (boxes[:, 1] < y1) & (boxes[:, 3] > y0)).any():
            stands = opening((island - loose).simplify(COARSE_MM), 0.45 * process.line_width_mm)
            standing += [piece for piece in islands(stands) if piece.area() >= least]
        else:
            standing.append(island)
    return Polygons.compose(standing) if standing else Polygons()


def widen_foot(area: Polygons, outlines: Sequence[Polygons], areas: ReachableAreas, process: Process, free: Polygons) -> Polygons:
    """The first layer on the platform, wider so that it sticks, as far as the gaps to the part allow; free: of the plate."""
    over = int(np.searchsorted(areas.bottom_mm, areas.top_mm[0] + process.support_gap_mm - EVEN_MM))
    beside = offset(outlines[0], process.support_distance_mm)
    return (dilate(area, process.support_foot_mm) - union([beside, *outlines[1:over]])) ^ free


def _dense(printed: Sequence[Polygons], contacts: Sequence[Polygons], areas: ReachableAreas, process: Process) -> list[Polygons]:
    """Where printed support is next to the part: under what it holds and over what it stands on."""
    roofs, floors = process.support_interface_layers, process.support_bottom_interface_layers
    dense = []
    for m, area in enumerate(printed):
        if area.is_empty():
            dense.append(area)
            continue
        over = [contact for contact in contacts[m : m + roofs] if not contact.is_empty()]
        under = [
            dilate(g, (1.0 - BEYOND) * areas.radius_mm) for g in areas.ground[max(m - floors + 1, 0) : m + 1] if not g.is_empty()
        ]
        near = opening(area ^ union([*over, *under]), 0.45 * process.line_width_mm)
        dense.append(near)
    return dense
