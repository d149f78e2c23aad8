"""Gaps: the places that lines of skin or the walls along a cut leave, filled as variable walls fill a section."""

from collections.abc import Sequence
from itertools import groupby

import numpy as np

from slicer.bead import Bead, mean_width_mm, spacing_mm, varying
from slicer.geometry.polygons import Polygons
from slicer.geometry.polyline import length_mm, simplify
from slicer.paths import Kind
from slicer.walls.variable.rule import SPLIT, Rule
from slicer.walls.variable.variable import variable_walls

RANK = 1  # behind walls, which have 0 and less
LEAST_GAP = 0.12  # of the line width: a narrower place between beads stays empty, as PrusaSlicer's classic walls leave it
MOST_WIDTH = 2.0  # line widths of a bead, and spacings from which on two lie beside each other
ROUNDS = 50  # beads round a place at most: as many as walls
SHORTEST = 0.25  # of the line width: what is shorter is no bead
MOST_WIDER = 1.3  # times as wide as its place is a bead, at most, to make up for the tips of the place that it does not reach


def gaps(places: Sequence[Polygons], line_width_mm: float, height_mm: float) -> list[Bead]:
    """Beads that fill places between other beads, which cover their round sides, with their area times height of plastic.

    They are as wide as the place. What is narrower than LEAST_GAP of a line stays empty.
    """
    spacing, widest_mm = spacing_mm(line_width_mm, height_mm), MOST_WIDTH * line_width_mm
    rule = Rule(ROUNDS, MOST_WIDTH / SPLIT * spacing, spacing, 0.0, LEAST_GAP * line_width_mm, spacing_mm(widest_mm, height_mm))
    filled = [place for place in places if not place.is_empty()]
    beads: list[Bead] = []
    for piece, there in groupby(variable_walls(filled, rule), key=lambda wall: wall.piece):
        courses = [wall.course for wall in there if length_mm(wall.course) > SHORTEST * line_width_mm]
        covered_mm2 = sum(mean_width_mm(course) * length_mm(course) for course in courses)
        wider = min(filled[piece].area() / covered_mm2, MOST_WIDER) if courses else 1.0
        for course in courses:
            course[:, 2] = np.minimum(wider * course[:, 2] + line_width_mm - spacing, widest_mm)
            points = simplify(np.ascontiguousarray(course[:, :2]))
            beads.append(Bead(Kind.GAP, points, mean_width_mm(course), RANK, course=varying(course)))
    return beads
