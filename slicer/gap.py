"""Gaps: beads for the places that the walls and the skin leave because no pair of beads fits."""

from collections.abc import Iterable
from dataclasses import dataclass
from itertools import groupby
from math import pi

import numpy as np

from mdp.kernel import floats, kernel
from mdp.mesh import Floats
from slicer.bead import Bead, bulged, length_mm, width_for_mm
from slicer.centreline import centrelines
from slicer.paths import Kind
from slicer.polygons import Polygons, area_mm2, closed, contours, edges, grown

RANK = 1
LEAST_LINE = 0.35  # of the line width: a thinner place of the section stays empty
LEAST_GAP = 0.12  # of the line width: a narrower place between beads stays empty, as PrusaSlicer's classic walls leave it
FEW_MM2 = 0.25  # of the line width squared: a smaller place between beads stays empty
COMPACT = 0.55  # 4 pi area / perimeter^2; a rectangle of 1:3 has 0.59: rounder places get a small ring, longer ones a line
TAPER = 0.9  # of the middle clearance: ends of a thin wall's line with less run into a corner
SPARE = 0.04  # of the line width by which a thin wall's bead may reach over the section where that tapers
LEAST_FLOW, MOST_FLOW = 0.3, 1.3
SHORTEST = 0.25  # of the line width: what is shorter is no stroke
STEP = 0.5  # of the line width: sampling of the boundary for the centreline
LOOSE, CLOSE = (1.2, 1.25), (1.06, 0.4)  # factor of the width and line widths of length in which a bead keeps one width


@dataclass(frozen=True, eq=False)
class Stroke:
    """points: (n, 2) mm; across_mm: width of the place across them; ends: whether each end is one, or another stroke goes on."""

    points: Floats
    across_mm: float
    ends: tuple[bool, bool] = (True, True)


def gaps(
    places: Polygons, line_width_mm: float, height_mm: float, section: Polygons | None = None, bulge: float = 0.0
) -> list[Bead]:
    """Beads that fill narrow places with their area times height of plastic; none is wider than two lines.

    Without a section the places lie between beads, which cover the round sides; no bead is narrower than half a line.
    Else the places are thin walls of the section: their beads keep inside it, and may bulge over it on both sides by a
    share of the line width, which makes up for their round sides.
    """
    beads: list[Bead] = []
    borders = None if section is None or places.is_empty() else edges(section)
    least = (0.5 if section is None else LEAST_LINE) * line_width_mm
    for area, strokes in _strokes(
        places, line_width_mm, 0.0 if section is None else least, *(LOOSE if section is None else CLOSE)
    ):
        long = [stroke for stroke in strokes if length_mm(stroke.points) > SHORTEST * line_width_mm]
        if borders is not None:
            inside = (_kept_inside(borders, stroke, SPARE * line_width_mm) for stroke in long)
            long = [stroke for stroke in inside if length_mm(stroke.points) > SHORTEST * line_width_mm]
        drawn = sum(length_mm(stroke.points) * stroke.across_mm for stroke in long)
        for stroke in long:
            wished = width_for_mm(stroke.across_mm, height_mm) if section is None else stroke.across_mm
            width = min(max(wished, least), 2.0 * line_width_mm)
            flow = area / drawn * min(wished / width, 1.0)
            if section is not None:
                flow *= bulged(width, height_mm, 2, bulge * line_width_mm)
            beads.append(Bead(Kind.GAP, stroke.points, width, RANK, float(np.clip(flow, LEAST_FLOW, MOST_FLOW))))
    return beads


def _kept_inside(borders: Floats, stroke: Stroke, spare_mm: float) -> Stroke:
    """The stroke without ends that run into a corner, as wide as its way to the borders allows."""
    points = stroke.points
    clear = _clearances(borders, points)
    fits = np.flatnonzero(clear >= TAPER * np.median(clear))
    first = min(int(fits[0]), len(points) - 2) if stroke.ends[0] else 0
    last = max(int(fits[-1]), 1) if stroke.ends[1] else len(points) - 1
    if last <= first:
        first, last = 0, len(points) - 1
    kept = np.sort(clear[first : last + 1])
    reach = min(float(kept[len(kept) // 10]), float(kept[0]) + spare_mm)
    return Stroke(points[first : last + 1], min(stroke.across_mm, 2.0 * reach), stroke.ends)


@kernel
def _clearances(borders: Floats, points: Floats) -> Floats:
    """Distance of each point (n, 2) to (m, 4) edges."""
    least: Floats = floats(len(points), np.inf)
    for e in range(len(borders)):
        ax, ay = borders[e, 0], borders[e, 1]
        dx, dy = borders[e, 2] - ax, borders[e, 3] - ay
        square = max(dx * dx + dy * dy, 1e-18)
        for k in range(len(points)):
            x, y = points[k, 0] - ax, points[k, 1] - ay
            share = min(max((x * dx + y * dy) / square, 0.0), 1.0)
            least[k] = min(least[k], (x - share * dx) ** 2 + (y - share * dy) ** 2)
    for k in range(len(points)):
        least[k] = np.sqrt(least[k])
    return least


def _strokes(
    places: Polygons, line_width_mm: float, least_mm: float, even: float, shortest: float
) -> Iterable[tuple[float, list[Stroke]]]:
    """For each place its area and the strokes that fill it; rings keep inside it with beads of at least least_mm."""
    long: list[Polygons] = []
    for island in places.decompose() if not places.is_empty() else []:
        loops = contours(island)
        perimeter = length_mm(closed(loops[0])) if loops else 0.0
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
    return [Stroke(closed(loop), radius) for loop in contours(grown(island, -0.5 * max(radius, least_mm)))]
