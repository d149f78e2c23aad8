"""Shells: the walls, skins and sparse places of every layer of a part, and then its beads, whose order is not known yet."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TypeAlias

import numpy as np

from mdp.kernels.processes import parallel_map
from mdp.mesh import Floats
from profiles.process import Process
from slicer.bead import WALLS, Bead, first_layer_process, interface_process, simplify_bead, with_line_width
from slicer.fill.bridge import Bridge, bridge_area, bridge_beads, find_bridges, infill_bridge_area
from slicer.fill.infill import infill_beads, pattern_density
from slicer.fill.region import Region, regions
from slicer.fill.skin import SolidLines, ironed_areas, ironing_beads, skin_lines
from slicer.geometry.edge_index import index_edges
from slicer.geometry.polygons import Polygons, islands, of_contours, offset, opening, union
from slicer.interface.cut_faces import cover, cut_walls, model_sections
from slicer.overhangs import RIM_MM, Overhang
from slicer.paths import Kind
from slicer.sections import Sections
from slicer.strokes.overhanging import strengthen_overhangs
from slicer.support.beads import pedestal_beads, support_beads
from slicer.support.support import Supports
from slicer.walls.brim import brim
from slicer.walls.variable import Wall
from slicer.walls.walls import Walls, gaps, wall_beads

DENSE = 0.5  # infill with lines nearer than a line's width to each other carries skin without bridges
FEWEST_LAYERS = 60  # from which on a part's layers are worked out by several processes

# Loops and walls of varying width, inner walls that end on a cut, and the contours of what walls enclose, of its narrow places
# and, where it differs, of what the walls of the uncut model enclose: Polygons cannot go from one process to another.
Contours: TypeAlias = tuple[tuple[tuple[Floats, ...], ...], tuple[Wall, ...], tuple[Bead, ...], list[list[Floats]]]


@dataclass(frozen=True, eq=False)
class Shell:
    """One layer of the part itself.

    process: the settings, with the extra walls of interfaces and overhangs and the widths of part 1's first layer; ending: inner
    walls that end on the face of a cut, and what fills between them; ironed: tops that are smoothed.
    """

    process: Process
    walls: Walls
    ending: tuple[Bead, ...]
    region: Region
    bridges: tuple[Bridge, ...]
    ironed: Polygons


@dataclass(frozen=True, eq=False)
class Shells:
    """A part's layers with the support planned for it; density: of the sparse infill's pattern."""

    supports: Supports
    layers: Sequence[Shell]
    density: float

    @property
    def sections(self) -> Sections:
        """The layers as outlines."""
        return self.supports.sections

    @property
    def regions(self) -> list[Region]:
        """What is skin and what is sparse of each layer."""
        return [shell.region for shell in self.layers]


def build_shells(supports: Supports, overhangs: Sequence[Overhang]) -> Shells:
    """The shells of a part with the support that was planned for it."""
    sections = supports.sections
    process, nozzle_mm = sections.process, sections.profile.machine.head.nozzle_mm
    processes = layer_processes(process, sections.on_platform, len(sections.outlines))
    processes = strengthen_overhangs(processes, sections.own, sections.plastic_below)
    model = model_sections(sections)
    heights_mm = sections.heights.height_mm.tolist()

    def contours_of(layer: int) -> Contours:
        own, usual = processes[layer], process.walls
        walls, ending, inside = cut_walls(
            sections.own[layer], model[layer], own, height_mm=heights_mm[layer], nozzle_mm=nozzle_mm, usual=usual
        )
        areas = [walls.inside, walls.narrow, *([] if inside is walls.inside else [inside])]
        return walls.loops, walls.varying, ending, [area.to_polygons() for area in areas]

    walled = [_walls_from(*found) for found in parallel_map(contours_of, len(processes), FEWEST_LAYERS)]
    covers = cover(sections, model, [model_inside for _, _, model_inside in walled])
    filled = regions([walls.inside for walls, _, _ in walled], covers, not sections.on_platform, process)
    bridges = bridges_of_layers(sections, overhangs, supports.areas)
    ironed = ironed_areas(filled, [*sections.beside, *sections.above[:1]], process)
    infill = with_line_width(process, process.infill_line_width_mm)
    return Shells(
        supports,
        [
            Shell(own, walls, ending, region, spans, smooth)
            for own, (walls, ending, _), region, spans, smooth in zip(processes, walled, filled, bridges, ironed, strict=True)
        ],
        pattern_density([region.sparse for region in filled], infill, process.layer_height_mm),
    )


def _walls_from(
    loops: tuple[tuple[Floats, ...], ...], varying: tuple[Wall, ...], ending: tuple[Bead, ...], areas: list[list[Floats]]
) -> tuple[Walls, tuple[Bead, ...], Polygons]:
    """The walls of a layer from what a process has found: polygons are built anew, which can round, whichever process it was."""
    inside, narrow, *model_inside = map(of_contours, areas)
    return Walls(loops, inside, narrow, varying), ending, model_inside[0] if model_inside else inside


def bridges_of_layers(
    sections: Sections, overhangs: Sequence[Overhang], supported: Sequence[Polygons]
) -> list[tuple[Bridge, ...]]:
    """The bridges of every layer: those that carry themselves, and what hangs over no support, as well as it can be.

    Such places are ledges, a slot with no room for support, or what support could not reach (Supports.missed tells of these).
    supported: where each layer's support is.
    """
    process, heights, outlines = sections.process, sections.heights, sections.outlines
    bridges = [overhang.bridges for overhang in overhangs] + [()] * (len(outlines) - len(overhangs))
    for i, overhang in enumerate(overhangs):
        free, below = overhang.hanging + overhang.ledges, sections.below(i)
        if free.is_empty() or below is None:
            continue
        drop_mm = float(heights.bottom_mm[i]) - process.support_gap_mm - 2.0 * process.layer_height_mm
        lowest = int(np.searchsorted(heights.tip_mm, drop_mm))
        held = union([area for area in supported[lowest:i] if not area.is_empty()])
        held = held if held.is_empty() else offset(held, 0.5 * process.line_width_mm)
        bare = opening(free - held, 0.25 * process.line_width_mm)
        if not bare.is_empty():
            slopes = outlines[i] - union([free, *(bridge.hanging for bridge in overhang.bridges)])
            carrying = union([below if i else offset(below, RIM_MM), held, slopes])
            anchors = index_edges(offset(carrying, 0.25 * process.line_width_mm))
            bridges[i] += tuple(span for island in islands(bare) for span in find_bridges(island, anchors, process.line_width_mm))
    return bridges


def layer_processes(process: Process, on_platform: bool, layers: int) -> list[Process]:
    """The settings of every layer: the first has widths of its own, and on plastic more walls, if it has any."""
    first = first_layer_process(process) if on_platform else interface_process(process)
    return [first if i == 0 else process for i in range(layers)]


def lay_beads(shells: Shells, layer: int) -> tuple[list[Bead], list[Bead]]:
    """What a layer prints of the part itself, and for it; walls that run round come as loops, without their seams."""
    return _simplified(_part_beads(shells, layer)), _simplified(_auxiliary_beads(shells, layer))


def _simplified(beads: list[Bead]) -> list[Bead]:
    return [bead if bead.kind in WALLS else simplify_bead(bead) for bead in beads]


def _part_beads(shells: Shells, layer: int) -> list[Bead]:
    shell, heights = shells.layers[layer], shells.sections.heights
    process, region, height_mm = shell.process, shell.region, float(heights.height_mm[layer])
    width, overlap = process.line_width_mm, process.infill_overlap if process.walls else 0.0
    angle_deg = process.infill_angle_deg + 90.0 * (layer % 2)  # neighbouring layers cross at right angles
    lines = SolidLines(angle_deg, width, height_mm, overlap)
    beads = wall_beads(shell.walls, process, height_mm)
    for bridge in shell.bridges:
        area = bridge_area(bridge, shell.walls.inside, width)
        if not area.is_empty():
            beads += bridge_beads(area, replace(lines, angle_deg=bridge.angle_deg), process.bridge_flow)
            region = region.without(area, width)
    if layer and process.infill_density < DENSE:
        area = infill_bridge_area(region.solid, shells.layers[layer - 1].region.sparse, width)
        if not area.is_empty():
            beads += bridge_beads(area, lines, process.infill_bridge_flow, over_infill=True)
            region = region.without(area, width)
    top = replace(lines, width_mm=process.top_skin_line_width_mm or width, in_order=process.top_skin_monotonic)
    places = {width: [shell.walls.narrow]}  # by the width of the lines around: all of a layer are filled at once
    for area, kind, solid in ((region.solid, Kind.SKIN, lines), (region.top, Kind.TOP_SKIN, top)):
        skin, rests = skin_lines(area, kind, solid)
        beads += skin
        places.setdefault(solid.width_mm, []).extend(rests)
    for width_mm, around in places.items():
        beads += gaps(around, width_mm, height_mm)
    beads += ironing_beads(shell.ironed, lines, process)
    sparse, z_mm = with_line_width(process, process.infill_line_width_mm), float(heights.tip_mm[layer])
    return beads + infill_beads(region.sparse, sparse, density=shells.density, layer=layer, z_mm=z_mm, height_mm=height_mm)


def _auxiliary_beads(shells: Shells, layer: int) -> list[Bead]:
    """Support, pedestal, skirt and brim."""
    sections, supports, process = shells.sections, shells.supports, shells.layers[layer].process
    outline, height_mm = sections.outlines[layer], float(sections.heights.height_mm[layer])
    on_plate = layer == 0 and sections.on_platform
    support_process = with_line_width(process, process.support_line_width_mm)
    beads = support_beads(supports.areas[layer], supports.dense[layer], support_process, height_mm, on_plate)
    if layer < sections.pedestal_layers:
        beads += pedestal_beads(outline, layer, sections.pedestal_layers, process, height_mm)
    if on_plate:
        top_mm = max(float(part.mesh.bounds_mm[1, 2]) for part in (sections.part, *sections.later))
        footprint = union([outline, supports.areas[0]])
        beads += brim(footprint, outline, sections.plate, process, top_mm=top_mm, height_mm=height_mm)
    return beads
