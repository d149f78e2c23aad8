"""Pieces of polygons keep their holes."""

import numpy as np
import pytest

from slicer.geometry.polygons import Polygons, islands, offset

# a section of a thin curved shell without its infill: the hole touches the outline in two corners, to 1e-8 mm
OUTLINE = [
    (-7.61836115, 68.88669977), (-10.77783701, 72.16484606), (-13.81933971, 70.4981398), (-16.24925241, 57.79847275),
    (-16.40994936, 55.98709728), (-16.2319522, 54.25942789), (-16.05534578, 53.72724398),
]  # fmt: skip
HOLE = [
    (-16.4050434, 56.04239728), (-16.2492524, 57.7984728), (-13.81933971, 70.49813979), (-11.72465853, 71.64599944),
    (-10.77783701, 72.16484606), (-8.1398312, 69.42775632), (-15.70857212, 55.82834867),
]  # fmt: skip
RING = Polygons([np.array(OUTLINE)]) - Polygons([np.array(HOLE)[::-1]])


def test_a_hole_that_touches_the_outline_stays_a_hole() -> None:
    pieces = islands(RING)
    assert [piece.area() for piece in pieces] == [pytest.approx(RING.area(), abs=1e-6)]


def test_every_piece_has_its_own_holes() -> None:
    square = Polygons.square((4.0, 4.0), True)
    frame = square - offset(square, -1.0)
    two = Polygons.compose([frame, frame.translate((10.0, 0.0)), Polygons.square((1.0, 1.0), True)])
    assert sorted(piece.area() for piece in islands(two)) == [pytest.approx(area) for area in (1.0, 12.0, 12.0)]
