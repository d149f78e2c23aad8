"""Brim and skirt: beads around part 1's first layer."""

from math import ceil

from profiles.process import Process
from slicer.bead import Bead, spacing_mm
from slicer.paths import Kind
from slicer.polygons import Polygons, area_mm2, contours, rounded
from slicer.seam import begun_at_rear

RANK = -2000


def brim(footprint: Polygons, process: Process, height_mm: float) -> list[Bead]:
    """The brim, outermost bead first so that it ends at the part; without a brim the skirt's loops."""
    spacing = spacing_mm(process.line_width_mm, height_mm)
    if process.brim_mm > 0:
        count, nearest = max(ceil(process.brim_mm / spacing - 1e-9), 1), 0.5 * spacing
    else:
        count, nearest = process.skirt_loops, process.skirt_distance_mm + 0.5 * process.line_width_mm
    outside = _outside(footprint)
    beads: list[Bead] = []
    for k in reversed(range(count)):
        loops = [loop for loop in contours(rounded(outside, nearest + k * spacing)) if area_mm2(loop) > 0]
        beads += [Bead(Kind.SKIRT, begun_at_rear(loop), process.line_width_mm, RANK - k) for loop in loops]
    return beads


def _outside(polygons: Polygons) -> Polygons:
    """Without holes."""
    outer = [loop for loop in contours(polygons) if area_mm2(loop) > 0]
    return Polygons(outer) if outer else Polygons()
