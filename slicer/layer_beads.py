"""Layer beads: what one layer prints, bead by bead, before their order is known."""

from dataclasses import replace

from slicer.bead import WALLS, Bead, simplify_bead, with_line_width
from slicer.fill.bridge import bridge_area, bridge_beads, infill_bridge_area
from slicer.fill.infill import infill_beads
from slicer.fill.ironing import ironing_beads
from slicer.fill.skin import SolidLines, angle_of_layer_deg, skin_beads
from slicer.geometry.polygons import union
from slicer.paths import Kind
from slicer.shells import Shells
from slicer.support.beads import support_beads
from slicer.support.pedestal import pedestal_beads
from slicer.walls.brim import brim
from slicer.walls.gap import gaps
from slicer.walls.walls import wall_beads

DENSE = 0.5  # infill with lines nearer than a line's width to each other carries skin without bridges


def lay_beads(shells: Shells, layer: int) -> tuple[list[Bead], list[Bead]]:
    """What a layer prints of the part itself, and for it; walls that run round come as loops, without their seams."""
    return _simplified(_part_beads(shells, layer)), _simplified(_auxiliary_beads(shells, layer))


def _simplified(beads: list[Bead]) -> list[Bead]:
    return [bead if bead.kind in WALLS else simplify_bead(bead) for bead in beads]


def _part_beads(shells: Shells, layer: int) -> list[Bead]:
    shell, heights = shells.layers[layer], shells.sections.heights
    process, region, height_mm = shell.process, shell.region, float(heights.height_mm[layer])
    width, overlap = process.line_width_mm, process.infill_overlap if process.walls else 0.0
    lines = SolidLines(angle_of_layer_deg(process.infill_angle_deg, layer), width, height_mm, overlap)
    beads = wall_beads(shell.walls, process, height_mm) + gaps(shell.walls.narrow, width, height_mm)
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
    beads += skin_beads(region.solid, Kind.SKIN, lines)
    top = replace(lines, width_mm=process.top_skin_line_width_mm or width, in_order=process.top_skin_monotonic)
    beads += skin_beads(region.top, Kind.TOP_SKIN, top)
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
