"""Shells: the walls, skins and sparse areas of every layer of a part, and then its beads, not yet ordered.

A part that is cut from a model has full walls and skins along the model's surface, and fewer along the face of a cut.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from math import pi, sqrt
from typing import TypeAlias

import numpy as np

from mdp.kernels.processes import parallel_map
from mdp.mesh import Floats
from profiles.process import Process
from slicer.bead import (
    ROUND_SIDES,
    Bead,
    bulge_flow,
    first_layer_process,
    hanging_area,
    interface_process,
    mean_width_mm,
    outer_wall_width_mm,
    spacing_mm,
    varying,
    wall_rank,
)
from slicer.fill.ends import ANCHORED, anchor_skins, infill_bridges
from slicer.fill.infill import Filling, filling_beads, has_lightning, leaning_walls, open_area, plan_fillings, widest_cell_mm
from slicer.fill.region import Cover, Region, ironed_areas, regions
from slicer.fill.skin import SolidLines, lines_angle_deg, skin_lines
from slicer.geometry.clip import runs_within
from slicer.geometry.polygons import (
    CLOSING_MM,
    Polygons,
    close_loop,
    closing,
    half_plane,
    islands,
    of_contours,
    offset,
    opening,
    strips_beside,
    union,
)
from slicer.geometry.polyline import length_mm
from slicer.interface.interface import limb_planes, plane_in_frame_of
from slicer.modifiers import LEAST_MM2, WallCounts, most_shell_layers, wall_counts
from slicer.overhangs import Bridge, Overhang, bridges_of_layers
from slicer.paths import Kind, bead_area_mm2
from slicer.sectioning import Sections
from slicer.support.beads import auxiliary_beads
from slicer.support.support import Supports
from slicer.walls.variable import Wall
from slicer.walls.walls import Walls, gaps, layer_walls, uncovered_area, walls, walls_under_tops

FEWEST_LAYERS = 60  # number of layers from which several processes compute them

# Loops and walls of varying width, inner walls that end on a cut, and the contours of the area inside the walls, of its narrow
# parts and, if different, of the area inside the uncut model's walls: Polygons cannot be sent between processes.
Contours: TypeAlias = tuple[tuple[tuple[Floats, ...], ...], tuple[Wall, ...], tuple[Bead, ...], list[list[Floats]]]
REACH = 0.1  # share of the line width: overlap of an inner wall that ends on the wall along a cut
TOUCHING_MM2 = 1e-3  # a section that gains less from its neighbours has none
NEAR_MM = 3.0  # width of the solid shell of a limb's cut face beside its base
THREADS_APART_MM = 0.05  # between the threads of a thick bridge, as in PrusaSlicer (BRIDGE_EXTRA_SPACING)
IRONED = 100  # after everything else of an island


@dataclass(frozen=True, eq=False)
class Shell:
    """One layer of the part itself.

    process: the settings, including extra walls of interfaces, overhangs and modifiers, and the widths of the plate's first
    layer; ending: inner walls that end on the face of a cut or of a modifier, and the fill between them; leaning: from
    leaning_walls; ironed: ironed tops; infill: of the region's sparse area, None if not drawn yet.
    """

    process: Process
    walls: Walls
    ending: tuple[Bead, ...]
    region: Region
    leaning: Polygons
    bridges: tuple[Bridge, ...]
    ironed: Polygons
    infill: list[Bead] | None


@dataclass(frozen=True, eq=False)
class Shells:
    """A part's layers with their planned support and sparse infills."""

    supports: Supports
    layers: Sequence[Shell]
    fillings: Sequence[Filling]

    @property
    def sections(self) -> Sections:
        """The part's sections."""
        return self.supports.sections


def build_shells(supports: Supports, overhangs: Sequence[Overhang], layers: Sequence[int] | None = None) -> Shells:
    """The shells of a part with its planned support.

    layers: the requested ones, None for all; others are computed only as far as these need them.
    """
    sections = supports.sections
    process, places, processes = sections.process, sections.places, layer_processes(sections)
    own, above, (top, bottom), count = sections.own, sections.above, most_shell_layers(process, places), len(processes)
    model = [joined(*three) for three in zip(sections.ungrooved, own, sections.beside, strict=True)]
    counts = wall_counts(own, [layer.walls for layer in processes], process.walls, places)
    # Lightning branches are planned from the top down over all layers.
    runs = [range(count)] if layers is None or has_lightning(process, places) else _with_those_below(layers)
    needed = [layer for run in runs for layer in run]
    # Walls above make infill solid.
    with_those_above = {layer for run in runs for layer in range(run.start, min(run.stop + max(top, 1), count))}
    walled = _walled(sections, model, processes, counts, sorted(with_those_above))
    insides = [walls.inside for walls, _, _ in walled]
    later = [whole - mine if whole is not mine else Polygons() for whole, mine in zip(model, own, strict=True)] + list(above)
    # Unknown earlier parts are assumed to fill the first section; under the build plate is nothing.
    below = sections.beneath or [Polygons() if sections.on_plate else own[0]] * bottom
    known = later if any(not area.is_empty() for area in later) else ()
    cover = Cover(model, [model_inside for _, _, model_inside in walled], below, above[:top], known)
    filled = regions(insides, cover, not sections.on_plate, process, runs, places)
    ironed = ironed_areas(filled, [*sections.beside, *above[:1]], process, places)
    bridges = bridges_of_layers(sections, overhangs, supports.areas, needed)
    sparse = [region.sparse for region in filled]
    fillings = plan_fillings(sparse, own, process, places, sections.heights.height_mm)
    leaning = leaning_walls(sparse, own, insides, runs, process.line_width_mm)
    filled, drawn = anchor_skins(filled, leaning, processes, fillings, sections.heights)
    shells = []
    for k, (usual, numbers, (round_, ending, _)) in enumerate(zip(processes, counts, walled, strict=True)):
        most = usual if numbers.all == [usual.walls] else usual.model_copy(update={"walls": max(numbers.all)})
        shells.append(Shell(most, round_, ending, filled[k], leaning[k], bridges[k], ironed[k], drawn.get(k)))
    return Shells(supports, shells, fillings)


def _with_those_below(layers: Sequence[int]) -> list[range]:
    """Ranges of layers that contain some layers and the layer below each, whose infill determines bridges."""
    needed = np.unique([layer for k in layers for layer in (max(k - 1, 0), k)])
    return [range(int(run[0]), int(run[-1]) + 1) for run in np.split(needed, np.flatnonzero(np.diff(needed) > 1) + 1)]


def _walled(
    sections: Sections,
    model: Sequence[Polygons],
    processes: Sequence[Process],
    counts: Sequence[WallCounts],
    needed: Sequence[int],
) -> list[tuple[Walls, tuple[Bead, ...], Polygons]]:
    """The walls of every layer, as from cut_walls; empty for layers that are not needed."""
    process, nozzle_mm = sections.process, sections.profile.machine.head.nozzle_mm
    heights_mm = sections.heights.height_mm.tolist()
    above = [*model[1:], *(sections.above[:1] or [Polygons()])] if process.only_one_wall_top else [None] * len(model)

    def contours_of(place: int) -> Contours:
        layer = needed[place]
        own, more = processes[layer], max(processes[layer].walls - process.walls, 0)
        walls, ending, inside = cut_walls(
            sections.own[layer], model[layer], own, counts[layer], heights_mm[layer], nozzle_mm, more, above[layer]
        )
        areas = [walls.inside, walls.narrow, *([] if inside is walls.inside else [inside])]
        return walls.loops, walls.varying, ending, [area.to_polygons() for area in areas]

    walled: list[tuple[Walls, tuple[Bead, ...], Polygons]] = [(Walls((), Polygons(), Polygons()), (), Polygons())] * len(model)
    results = parallel_map(contours_of, len(needed), FEWEST_LAYERS)
    for layer, (loops, variable, ending, areas) in zip(needed, results, strict=True):
        # Polygons are rebuilt, which can round, in the same way for all processes.
        inside, narrow, *model_inside = map(of_contours, areas)
        walled[layer] = Walls(loops, inside, narrow, variable), ending, model_inside[0] if model_inside else inside
    return walled


def layer_processes(sections: Sections) -> list[Process]:
    """The settings of every layer: the first has its own line widths, unless on a raft, and on plastic more walls, if it has any;
    a layer with an overhang gets overhang_extra_walls more.
    """
    process, lying = sections.process, sections.own if sections.pedestal_layers else sections.outlines
    processes = [process] * len(lying)
    if not sections.on_raft:
        processes[0] = first_layer_process(process) if sections.on_plate else interface_process(process)
    if process.overhang_extra_walls:
        for k, (own, below) in enumerate(zip(processes, [sections.plastic_below, *lying[:-1]], strict=True)):
            width = own.line_width_mm
            hangs = below is not None and hanging_area(lying[k], below, own.overhang_share, width).area() >= width**2
            if hangs and own.walls:
                processes[k] = own.model_copy(update={"walls": own.walls + own.overhang_extra_walls})
    return processes


def joined(ungrooved: Polygons, own: Polygons, beside: Polygons) -> Polygons:
    """The islands of the model that contain some of a section; `own` itself if these are equal. beside: area of other parts."""
    alone = own if own is ungrooved or ungrooved.area() < own.area() + TOUCHING_MM2 else ungrooved
    if own.is_empty() or beside.is_empty() or not _boxes_meet(own, beside):
        return alone
    whole = closing(union([ungrooved, beside]), CLOSING_MM)
    touched = [island for island in islands(whole) if not (island ^ own).is_empty()]
    return alone if sum(island.area() for island in touched) < ungrooved.area() + TOUCHING_MM2 else Polygons.compose(touched)


def _boxes_meet(own: Polygons, beside: Polygons) -> bool:
    x0, y0, x1, y1 = own.bounds()
    u0, v0, u1, v1 = beside.bounds()
    reach = CLOSING_MM
    return bool(x0 < u1 + reach and u0 < x1 + reach and y0 < v1 + reach and v0 < y1 + reach)


def cut_walls(
    section: Polygons,
    model: Polygons,
    process: Process,
    counts: WallCounts,
    height_mm: float,
    nozzle_mm: float,
    more: int,
    above: Polygons | None,
) -> tuple[Walls, tuple[Bead, ...], Polygons]:
    """The walls of a part's section in its island of the model, see joined: walls all around; inner walls along the surface that
    end on a cut face, or where a modifier has fewer, all of one width, and the fill between them; and the area that the uncut
    model's walls would enclose with `more` walls fewer. above: the model in the next layer, if uncovered tops have one wall.
    """
    alone, least, most = model is section, min(counts.all), max(counts.all)
    if alone and least == most:

        def walled(count: int) -> Walls:
            if above is None:
                return layer_walls(section, count, process, height_mm, nozzle_mm)
            return walls_under_tops(section, above, count, process, height_mm, nozzle_mm)

        round_ = walled(most)
        fewer = walled(most - more) if more else round_
        return round_, (), fewer.inside
    numbers = {number for count in counts.all for number in (count, count - more)}
    enclosing = {count: walls(model, count, process, height_mm) for count in numbers}
    inside = counts.overlaid(lambda count: enclosing[count].inside)
    model_inside = counts.overlaid(lambda count: enclosing[count - more].inside) if more else inside
    around = least if alone else min(process.interface_walls, least)
    round_ = layer_walls(section, around, process, height_mm, nozzle_mm)
    if around == most or round_.inside.is_empty():
        return round_, (), round_.inside if alone else model_inside
    width, short_mm = process.line_width_mm, 0.5 * spacing_mm(process.line_width_mm, height_mm) - REACH * process.line_width_mm
    within, ranked = offset(round_.inside, -short_mm), process.model_copy(update={"walls": most})
    loops, ending = [*round_.loops, *((),) * (around - len(round_.loops))], []
    for level in range(around, len(enclosing[most].loops)):
        room = counts.where_more(level, within, short_mm)
        runs = [run for loop in enclosing[most].loops[level] for run in runs_within(close_loop(loop), room)]
        beads = [Bead(Kind.INNER_WALL, run, width, wall_rank(level, ranked)) for run in runs if length_mm(run) > width]
        loops.append(tuple(bead.points[:-1] for bead in beads if bead.closed))
        ending += [bead for bead in beads if not bead.closed]
    inside = round_.inside ^ inside
    lines = [*(bead.points for bead in ending), *(close_loop(loop) for level in loops[around:] for loop in level)]
    ending += gaps([uncovered_area(round_.inside - inside, lines, width)], width, height_mm)
    model_inside = inside if alone and not more else model_inside
    return replace(round_, loops=tuple(loops), inside=inside), tuple(ending), model_inside


def lay_beads(shells: Shells, layer: int) -> tuple[list[Bead], list[Bead]]:
    """The beads of the part itself in one layer, and those of its support, skirt and brim; walls all around are loops without
    seams.
    """
    shell, heights = shells.layers[layer], shells.sections.heights
    process, region, height_mm = shell.process, shell.region, float(heights.height_mm[layer])
    width, overlap = process.line_width_mm, process.infill_overlap if process.walls else 0.0
    lines = SolidLines(lines_angle_deg(process, layer), width, height_mm, overlap)
    beads = wall_beads(shell.walls, process, height_mm)
    for bridge in shell.bridges:
        wide = opening(bridge.hanging ^ shell.walls.inside, 0.5 * width)
        if not wide.is_empty():
            area = offset(wide, ANCHORED * width) ^ shell.walls.inside  # overlapping the anchors as far as the inside extends
            # where infill beside it would be narrower than a cell it extends to the walls
            area += union(strips_beside(area, region.sparse, widest_cell_mm(shells.fillings, process, layer)))
            across = replace(lines, angle_deg=bridge.angle_deg)
            if process.thick_bridges:
                beads += thread_beads(area, across, sqrt(process.bridge_flow) * shells.sections.profile.machine.head.nozzle_mm)
            else:
                beads += bridge_beads(area, across, process.bridge_flow)
            region = _without(region, area, width)
    if layer:
        below = shells.layers[layer - 1]
        area = infill_bridges(region, open_area(below.region.sparse, shells.fillings, below.process, layer - 1), width)
        if not area.is_empty():
            held = area
            if process.walls:  # lines end over the walls, not beside them
                onto_mm = 0.5 * lines.spacing_mm - (overlap - REACH) * width
                held += offset(area, onto_mm) - shell.walls.inside
            above = replace(lines, seen=not (offset(area, width) ^ region.bare).is_empty())
            beads += bridge_beads(held, above, process.infill_bridge_flow, over_infill=True)
            region = replace(_without(region, area, width), sparse=region.sparse)
    skins = lines if process.skin_angle_deg is None else replace(lines, angle_deg=process.skin_angle_deg + 90.0 * (layer % 2))
    skins = replace(skins, seen=layer == 0 and shells.sections.on_plate)
    top = replace(skins, width_mm=process.top_skin_line_width_mm or width, pattern=process.top_skin_pattern, seen=True)
    bottom = replace(skins, pattern=process.bottom_skin_pattern)
    solid, under = region.solid, Polygons()
    if bottom != skins:
        bare = shells.sections.below(layer)
        under = solid if bare is None else opening(solid - bare, 0.5 * width)
        solid = solid - under
    places = {width: [shell.walls.narrow]}  # by the width of the lines around: all gaps of a layer are filled at once
    for area, kind, laid in ((solid, Kind.SKIN, skins), (under, Kind.SKIN, bottom), (region.top, Kind.TOP_SKIN, top)):
        skin, rests = skin_lines(area, kind, laid)
        beads += skin
        places.setdefault(laid.width_mm, []).extend(rests)
    for width_mm, around in places.items():
        beads += gaps(around, width_mm, height_mm)
    beads += ironing_beads(shell.ironed, skins, process)
    beads = [bead for bead in beads if bead.kind is not Kind.GAP or bead.length_mm >= process.gap_least_mm]
    infill = shell.infill if region.sparse is shell.region.sparse else None
    if infill is None:
        infill = filling_beads(region.sparse, shell.leaning, shells.fillings, process, heights, layer)
    return beads + infill, auxiliary_beads(shells.supports, process, layer)


def wall_beads(walled: Walls, process: Process, height_mm: float) -> list[Bead]:
    """The walls as beads; all ranks are at most 0, so that walls come before gap fill, skin and infill.

    The flow of outer beads compensates for the round side, which would leave the section unfilled.
    """
    outer, beads = outer_wall_width_mm(process), []
    outer_flow = bulge_flow(outer, height_mm, 1, process.outer_bulge * outer)
    for level, loops in enumerate(walled.loops):
        kind, width, flow = (Kind.INNER_WALL, process.line_width_mm, 1.0) if level else (Kind.OUTER_WALL, outer, outer_flow)
        beads += [Bead(kind, loop, width, wall_rank(level, process), flow) for loop in loops]
    for wall in walled.varying:  # one that fills an area from side to side bulges on both
        kind, width = Kind.INNER_WALL if wall.level else Kind.OUTER_WALL, mean_width_mm(wall.course)
        flow = bulge_flow(width, height_mm, wall.free, process.outer_bulge * process.line_width_mm)
        rank, course = wall_rank(wall.level, process), varying(wall.course)
        beads.append(Bead(kind, wall.points, width, rank, flow, line=not wall.closed, course=course))
    return beads


def _without(region: Region, area: Polygons, width_mm: float) -> Region:
    """The region without the area of a bridge."""

    def rest(polygons: Polygons) -> Polygons:
        left = polygons - area
        return left if left.is_empty() or left.area() == polygons.area() else opening(left, 0.25 * width_mm)

    return replace(region, top=rest(region.top), solid=rest(region.solid), sparse=rest(region.sparse))


def bridge_beads(area: Polygons, lines: SolidLines, flow: float, over_infill: bool = False) -> list[Bead]:
    """The lines of a bridge with its own flow. over_infill: the first solid lines over sparse infill, across the infill lines
    where those have one direction; gaps beside them stay open, since gap fill would lie on nothing.
    """
    beads, rests = skin_lines(area, Kind.BRIDGE, lines)
    beads += [] if over_infill else gaps(rests, lines.width_mm, lines.height_mm)
    return [replace(bead, flow=bead.flow * flow, over_infill=over_infill) for bead in beads]


def thread_beads(area: Polygons, lines: SolidLines, diameter_mm: float) -> list[Bead]:
    """The lines of a bridge as round threads that hang below the layer, far enough apart not to touch."""
    height_mm = lines.height_mm
    apart = replace(lines, width_mm=diameter_mm + THREADS_APART_MM + height_mm * ROUND_SIDES)
    flow = 0.25 * pi * diameter_mm**2 / bead_area_mm2(diameter_mm, height_mm)
    return [replace(bead, width_mm=diameter_mm, flow=flow) for bead in skin_lines(area, Kind.BRIDGE, apart)[0]]


def ironing_beads(area: Polygons, skin: SolidLines, process: Process) -> list[Bead]:
    """Ironing lines across those of the skin; their flow refers to a bead of the line width."""
    if area.is_empty():
        return []
    spacing, width, height_mm = process.ironing_spacing_mm, process.line_width_mm, skin.height_mm
    flow = process.ironing_flow * spacing * height_mm / bead_area_mm2(width, height_mm)
    dense = SolidLines(skin.angle_deg + 90.0, spacing + height_mm * ROUND_SIDES, height_mm, pattern="monotonic")
    beads, _ = skin_lines(area, Kind.IRONING, dense)
    return [replace(bead, width_mm=width, flow=flow, rank=IRONED) for bead in beads]


def interface_mm3(shells: Shells) -> dict[int, float]:
    """Additional plastic of a part compared with the uncut model, mm3, by the part with the nearest base plane: walls and skins
    on cut faces instead of sparse infill, and the extra flow of its first layer on plastic.
    """
    sections, regions = shells.sections, [shell.region for shell in shells.layers]
    part, process, heights = sections.part, sections.process, sections.heights
    planes = {} if sections.on_plate else {part.index: np.array([0.0, 0.0, -1.0, 0.0])}
    upper_parts = [upper for upper in sections.later if not upper.on_plate]
    planes |= {upper.index: plane_in_frame_of(part, upper.base.normal, upper.base.offset_mm) for upper in upper_parts}
    more, near = dict.fromkeys(planes, 0.0), limb_planes(part, sections.later, heights, NEAR_MM)
    for layer, (section, region) in enumerate(zip(sections.own, regions, strict=True)):
        height_mm, z_mm = heights.height_mm[layer], heights.cut_mm[layer]
        if not planes or region.uncut.is_empty():
            continue
        closed = (region.uncut ^ section) - region.sparse
        if closed.area() > LEAST_MM2:
            distances = [np.array([-plane[0], -plane[1], plane[3] - plane[2] * z_mm]) for plane in planes.values()]
            counting = [near[index].band(layer, -np.inf, np.inf) if index in near else None for index in planes]
            for index, area in zip(planes, nearest_areas(closed, distances, counting), strict=True):
                more[index] += (1.0 - process.infill_density) * float(height_mm) * area
    if not sections.on_plate:
        filled = sections.own[0].area() - (1.0 - process.infill_density) * regions[0].sparse.area()
        more[part.index] += filled * (process.interface_flow - 1.0) * float(heights.height_mm[0])
    return more


def nearest_areas(whole: Polygons, distances: Sequence[Floats], near: Sequence[Polygons | None]) -> list[float]:
    """The areas, mm2, in which each of several linear functions a x + b y + c is the least of those that count there. near: the
    area in which each counts, None for everywhere.
    """
    areas = []
    for k, (mine, own) in enumerate(zip(distances, near, strict=True)):
        nearer = whole if own is None else whole ^ own
        for j, (distance, other) in enumerate(zip(distances, near, strict=True)):
            if j != k and not nearer.is_empty():
                a, b, c = distance - mine
                away = Polygons() if other is None else nearer - other
                nearer = half_plane(nearer, a, b, c)
                nearer = nearer if away.is_empty() else nearer + away
        areas.append(nearer.area())
    return areas
