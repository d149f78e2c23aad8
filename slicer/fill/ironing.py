"""Ironing: the nozzle goes once more over tops that stay visible, in dense lines that hardly push any plastic."""

from collections.abc import Sequence
from dataclasses import replace

from profiles.process import Process
from slicer.bead import Bead, width_for_mm
from slicer.fill.region import Region
from slicer.fill.skin import SolidLines, skin_lines
from slicer.geometry.polygons import Polygons, larger, offset, opening
from slicer.paths import Kind, bead_area_mm2

RANK = 100  # after all else of an island
LEAST_MM2 = 2.0  # a speck: the flat around the orifice is about as wide, and smooths it as it is printed


def ironed_areas(regions: Sequence[Region], beside: Sequence[Polygons], process: Process) -> list[Polygons]:
    """The skin of each layer that has nothing above it, a line's width away from where a later part will stand.

    beside: what later parts have of each layer and of the one over the last.
    """
    if not process.ironing:
        return [Polygons()] * len(regions)
    width = process.line_width_mm
    tops = [
        region.bare if above.is_empty() else region.bare - offset(above, width)
        for region, above in zip(regions, beside[1:], strict=True)
    ]
    return [larger(opening(top, 0.5 * width), LEAST_MM2) for top in tops]


def ironing_beads(area: Polygons, skin: SolidLines, process: Process) -> list[Bead]:
    """Lines across those of the skin; their flow is counted on a bead of the line's width."""
    if area.is_empty():
        return []
    spacing, width, height_mm = process.ironing_spacing_mm, process.line_width_mm, skin.height_mm
    flow = process.ironing_flow * spacing * height_mm / bead_area_mm2(width, height_mm)
    dense = SolidLines(skin.angle_deg + 90.0, width_for_mm(spacing, height_mm), height_mm, in_order=True)
    beads, _ = skin_lines(area, Kind.IRONING, dense)
    return [replace(bead, width_mm=width, flow=flow, rank=RANK) for bead in beads]
