"""Thin walls: beads for the places of a section where less than two beads fit, all of them inside the section."""

from dataclasses import replace
from itertools import pairwise
from math import pi

import numpy as np
from numpy.typing import NDArray

from mdp.mesh import Floats
from slicer.bead import Bead, bulge_flow, length_mm
from slicer.geometry.distance import distances
from slicer.geometry.polygons import Polygons, edges, islands
from slicer.paths import Kind
from slicer.walls.dash import dash
from slicer.walls.gap import FEW_MM2, LEAST_LINE, RANK, SHORTEST, Stroke, drawn_mm2, flow_of, strokes

EVEN = 1.06, 0.4  # factor of the width and line widths of length in which a bead keeps one width
DASHED = 12.0  # line widths squared: larger places are no dashes
POINTS = 9  # of a dash at which its distance to the borders is measured
TAPER = 0.9  # of the middle clearance: ends of a line with less run into a corner
AROUND = 4.5  # line widths: of the section's borders, those so near a place matter
SPARE = 0.04  # of the line width by which a bead may reach over the section where that tapers


def thin_walls(places: Polygons, section: Polygons, line_width_mm: float, height_mm: float, bulge: float) -> list[Bead]:
    """Beads that fill thin walls of a section with their area times height of plastic.

    They keep inside it, but may bulge over it on both sides by a share of the line width, which makes up for their round
    sides. What is narrower than LEAST_LINE of a line stays empty.
    """
    beads: list[Bead] = []
    borders = np.zeros((0, 4)) if places.is_empty() else edges(section)
    boxes = np.hstack([np.minimum(borders[:, :2], borders[:, 2:]), np.maximum(borders[:, :2], borders[:, 2:])])
    for island in islands(places):
        if island.area() < FEW_MM2 * line_width_mm**2:
            continue
        lines = _lines_through(island, borders[_around(boxes, island, AROUND * line_width_mm)], line_width_mm)
        for stroke in lines:
            width = min(max(stroke.across_mm, LEAST_LINE * line_width_mm), 2.0 * line_width_mm)
            flow = flow_of(island.area(), drawn_mm2(lines), stroke.across_mm / width)
            flow *= bulge_flow(width, height_mm, 2, bulge * line_width_mm)
            beads.append(Bead(Kind.GAP, stroke.points, width, RANK, flow))
    return beads


def _around(boxes: Floats, island: Polygons, reach_mm: float) -> NDArray[np.bool_]:
    """Which boxes x0 y0 x1 y1 (n, 4) come near an island: those of the borders that a bead in it could meet."""
    x0, y0, x1, y1 = island.bounds()
    across = (boxes[:, 2] > x0 - reach_mm) & (boxes[:, 0] < x1 + reach_mm)
    near: NDArray[np.bool_] = across & (boxes[:, 3] > y0 - reach_mm) & (boxes[:, 1] < y1 + reach_mm)
    return near


def _lines_through(island: Polygons, borders: Floats, line_width_mm: float) -> list[Stroke]:
    """Lines down the middle, or one straight line where that covers more."""
    least, spare = LEAST_LINE * line_width_mm, SPARE * line_width_mm
    middle = [stroke for _, several in strokes(island, line_width_mm, least, *EVEN) for stroke in several]
    inside = (_keep_inside(borders, stroke, 0.5 * least, spare) for stroke in middle)
    lines = [stroke for stroke in inside if length_mm(stroke.points) > SHORTEST * line_width_mm]
    if island.area() > DASHED * line_width_mm**2 or _covered_mm2(lines) > 0.8 * island.area():
        return lines
    straight = _straight(island, borders, least, 2.0 * line_width_mm, spare)
    return straight if _covered_mm2(straight) > _covered_mm2(lines) else lines


def _straight(island: Polygons, borders: Floats, least_mm: float, most_mm: float, spare_mm: float) -> list[Stroke]:
    """The dash through an island, as wide as its exact distance to the borders allows."""
    bead = dash(island, borders, least_mm, most_mm, spare_mm)
    if bead is None:
        return []
    (start, end), width = bead
    points = start + np.linspace(0.0, 1.0, POINTS)[:, None] * (end - start)
    clear = float(distances(points, borders).min()) + spare_mm
    return [Stroke(bead[0], min(width, 2.0 * clear))] if clear >= 0.5 * least_mm else []


def _covered_mm2(several: list[Stroke]) -> float:
    """About the area that strokes cover, the round ends of one of them included."""
    ends = max((0.25 * pi * stroke.across_mm**2 for stroke in several), default=0.0)
    return sum(length_mm(stroke.points) * stroke.across_mm for stroke in several) + ends


def _keep_inside(borders: Floats, stroke: Stroke, least_mm: float, spare_mm: float) -> Stroke:
    """The stroke without ends that run into a corner, as wide as its distance to the borders allows.

    Where not even a bead that reaches least_mm to both sides keeps inside, there is none.
    """
    points = stroke.points
    clear = distances(points, borders)
    roomy, fits = clear >= least_mm - spare_mm, np.flatnonzero(clear >= TAPER * np.median(clear))
    first = min(int(fits[0]), len(points) - 2) if stroke.ends[0] else 0
    last = max(int(fits[-1]), 1) if stroke.ends[1] else len(points) - 1
    if last <= first:
        first, last = 0, len(points) - 1
    if not roomy[first : last + 1].all():
        first, last = _longest_run(roomy, first, last)
    rising = np.sort(clear[first : last + 1])
    reach = min(float(rising[len(rising) // 10]), float(rising[0]) + spare_mm)
    return replace(stroke, points=points[first : last + 1], across_mm=min(stroke.across_mm, 2.0 * reach))


def _longest_run(fits: NDArray[np.bool_], first: int, last: int) -> tuple[int, int]:
    """The longest stretch of places first .. last that all fit, by its own first and last; one place where none does."""
    cuts = [first - 1, *(first + np.flatnonzero(~fits[first : last + 1])).tolist(), last + 1]
    before, after = max(pairwise(cuts), key=lambda cut: cut[1] - cut[0])
    return (before + 1, after - 1) if after - before > 1 else (first, first)
