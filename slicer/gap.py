"""Gaps: beads for the places that the walls leave because two of them do not fit."""

from math import pi

import numpy as np

from mdp.mesh import Floats
from slicer.bead import Bead, length_mm, width_for_mm
from slicer.centreline import centrelines
from slicer.paths import Kind
from slicer.polygons import Polygons, area_mm2, closed, contours, grown

RANK = 1
COMPACT = 0.6  # 4 pi area / perimeter^2; a rectangle of 1:3 has 0.59: rounder places get a small ring, longer ones a line
LEAST_FLOW, MOST_FLOW = 0.5, 1.3
STEP = 0.5  # of the line width: sampling of the boundary for the centreline


def gaps(places: Polygons, between: bool, line_width_mm: float, height_mm: float) -> list[Bead]:
    """Beads that fill narrow places with their area times height of plastic.

    between: the places lie between walls, so their beads' rounded sides are covered; else they are free on both sides.
    No bead is narrower than half a line or wider than two.
    """
    rings: list[tuple[Floats, float, float]] = []
    long: list[Floats] = []
    for island in places.decompose():
        loops = contours(island)
        perimeter = length_mm(closed(loops[0])) if loops else 0.0
        if len(loops) == 1 and 4.0 * pi * area_mm2(loops[0]) > COMPACT * perimeter**2:
            rings += _ring(island, perimeter)
        else:
            long += loops
    lines = rings + [(line.points, line.width_mm, line.share) for line in centrelines(long, STEP * line_width_mm)]
    beads = []
    for points, across, share in lines:
        wished = width_for_mm(across, height_mm) if between else across
        width = min(max(wished, 0.5 * line_width_mm), 2.0 * line_width_mm)
        flow = share * min(wished / width, 1.0)
        if length_mm(points) > 0.5 * line_width_mm:
            beads.append(Bead(Kind.GAP, points, width, RANK, float(np.clip(flow, LEAST_FLOW, MOST_FLOW))))
    return beads


def _ring(island: Polygons, perimeter_mm: float) -> list[tuple[Floats, float, float]]:
    """Centreline, width and share of a ring whose two sides meet in the middle of a round place."""
    radius = 2.0 * island.area() / perimeter_mm
    loops = [closed(loop) for loop in contours(grown(island, -0.5 * radius))]
    total = sum(length_mm(loop) for loop in loops)
    return [(loop, radius, island.area() / (total * radius)) for loop in loops]
