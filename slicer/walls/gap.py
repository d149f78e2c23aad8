"""Gaps: beads for the places that the walls and the skin leave because no pair of beads fits."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from itertools import groupby
from math import pi

from mdp.mesh import Floats
from slicer.bead import Bead, length_mm, width_for_mm
from slicer.geometry.polygons import Polygons, area_mm2, close_loop, contours, islands, offset
from slicer.paths import Kind
from slicer.walls.centreline import centrelines

RANK = 1
LEAST_LINE = 0.35  # of the line width: a thinner place of the section stays empty
LEAST_GAP = 0.12  # of the line width: a narrower place between beads stays empty, as PrusaSlicer's classic walls leave it
FEW_MM2 = 0.25  # of the line width squared: a smaller place between beads stays empty
COMPACT = 0.55  # 4 pi area / perimeter^2; a rectangle of 1:3 has 0.59: rounder places get a small ring, longer ones a line
LEAST_FLOW, MOST_FLOW = 0.3, 1.3
SHORTEST = 0.25  # of the line width: what is shorter is no stroke
STEP = 0.5  # of the line width: sampling of the boundary for the centreline
EVEN = 1.2, 1.25  # factor of the width and line widths of length in which a bead keeps one width


@dataclass(frozen=True, eq=False)
class Stroke:
    """points: (n, 2) mm; across_mm: width of the place across them; ends: whether each end is one, or another stroke goes on."""

    points: Floats
    across_mm: float
    ends: tuple[bool, bool] = (True, True)


def gaps(places: Polygons, line_width_mm: float, height_mm: float) -> list[Bead]:
    """Beads that fill places between other beads, which cover their round sides, with their area times height of plastic.

    None is narrower than half a line nor wider than two.
    """
    beads: list[Bead] = []
    for area, several in strokes(places, line_width_mm, 0.0, *EVEN):
        long = [stroke for stroke in several if length_mm(stroke.points) > SHORTEST * line_width_mm]
        drawn = drawn_mm2(long)
        for stroke in long:
            ideal = width_for_mm(stroke.across_mm, height_mm)
            width = min(max(ideal, 0.5 * line_width_mm), 2.0 * line_width_mm)
            beads.append(Bead(Kind.GAP, stroke.points, width, RANK, flow_of(area, drawn, ideal / width)))
    return beads


def drawn_mm2(several: Sequence[Stroke]) -> float:
    """Area that strokes as wide as their places cover."""
    return sum(length_mm(stroke.points) * stroke.across_mm for stroke in several)


def flow_of(area: float, drawn: float, widening: float) -> float:
    """Flow with which strokes that cover `drawn` give an area, mm2, times height; widening: ideal width over the bead's."""
    return min(max(area / drawn * min(widening, 1.0), LEAST_FLOW), MOST_FLOW)


def strokes(
    places: Polygons, line_width_mm: float, least_mm: float, even: float, shortest: float
) -> Iterable[tuple[float, list[Stroke]]]:
    """For each place its area and the strokes that fill it; rings keep inside it with beads of at least least_mm."""
    long: list[Polygons] = []
    for island in islands(places):
        loops = contours(island)
        perimeter = length_mm(close_loop(loops[0])) if loops else 0.0
        if not loops or island.area() < FEW_MM2 * line_width_mm**2:
            continue
        if len(loops) == 1 and 4.0 * pi * area_mm2(loops[0]) > COMPACT * perimeter**2:
            yield island.area(), _ring(island, perimeter, least_mm)
        else:
            long.append(island)
    outlines = [loop for island in long for loop in contours(island)]
    for _, lines in groupby(
        centrelines(outlines, STEP * line_width_mm, even, shortest * line_width_mm), key=lambda line: line.place
    ):
        several = list(lines)
        yield several[0].area_mm2, [Stroke(line.points, line.width_mm, line.ends) for line in several]


def _ring(island: Polygons, perimeter_mm: float, least_mm: float) -> list[Stroke]:
    """A ring whose two sides meet in the middle of a round place, or overlap there."""
    radius = 2.0 * island.area() / perimeter_mm
    return [Stroke(close_loop(loop), radius) for loop in contours(offset(island, -0.5 * max(radius, least_mm)))]
