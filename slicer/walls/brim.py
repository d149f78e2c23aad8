"""Brim and skirt: beads around part 1's first layer on the plate."""

from math import ceil

from mdp.cost.footing import tips_over
from profiles.process import Process
from slicer.bead import Bead, spacing_mm
from slicer.geometry.polygons import Polygons, area_mm2, contours, offset, offset_round
from slicer.paths import Kind
from slicer.strokes.seam import start_at_rear

RANK = -2000  # before all walls; the loops count down from it
LEAST_MM2 = 1e-3  # areas smaller than this are rounding


def brim(
    footprint: Polygons, base: Polygons, plate: Polygons, process: Process, *, top_mm: float, height_mm: float
) -> list[Bead]:
    """The brim, outermost bead first so that it ends at the part; without a brim the skirt's loops.

    footprint: all that the first layer prints; base: what of it the print stands on; plate: its outline, which no loop
    leaves; top_mm: how high the print will be. A base that would tip over gets a brim of process.small_base_brim_mm.
    """
    spacing = spacing_mm(process.line_width_mm, height_mm)
    width = process.brim_mm
    if width == 0.0 and process.small_base_brim_mm > 0.0 and tips_over(base, top_mm):
        width = process.small_base_brim_mm
    if width > 0.0:
        count, nearest = max(ceil(width / spacing - 1e-9), 1), process.brim_gap_mm + 0.5 * spacing
    else:
        count, nearest = process.skirt_loops, process.skirt_distance_mm + 0.5 * process.line_width_mm
    outside, half = _outside(footprint), 0.5 * process.line_width_mm
    beads: list[Bead] = []
    for k in reversed(range(count)):
        # Along the plate's edge the loops lie beside each other as they do elsewhere; one that finds no room is left out.
        around = offset_round(outside, nearest + k * spacing) ^ offset(plate, -half - (count - 1 - k) * spacing)
        if (offset_round(outside, min(half, nearest)) - around).area() > LEAST_MM2:
            continue
        loops = [loop for loop in contours(around) if area_mm2(loop) > 0]
        beads += [Bead(Kind.SKIRT, start_at_rear(loop), process.line_width_mm, RANK - k) for loop in loops]
    return beads


def _outside(polygons: Polygons) -> Polygons:
    """Without holes."""
    outer = [loop for loop in contours(polygons) if area_mm2(loop) > 0]
    return Polygons(outer) if outer else Polygons()
