"""Wipes beside the edge of an interface: they avoid the outer wall unless the stroke itself ends on it."""

import numpy as np
import pytest

from slicer.bead import Bead
from slicer.geometry.polygons import Polygons, offset
from slicer.paths import Kind
from slicer.strokes.strokes import strokes_of
from slicer.strokes.travels import may_wipe_over

SQUARE = Polygons.square((20.0, 20.0))
SKIN = SQUARE - offset(SQUARE, -0.36)
LED = [(10, 0.7), (10, 0.2), (19.8, 0.2), (19.8, 19.8), (0.2, 19.8), (0.2, 0.2), (10, 0.2), (10, 0.45)]
INNER = [(10, 0.7), (19.3, 0.7), (19.3, 19.3), (0.7, 19.3), (0.7, 0.7), (10, 0.7)]
UP_TO_THE_EDGE, BACK_OVER_THE_EDGE = [(10, 5), (10, 0.2)], [(10, 0.2), (10, 1.5)]


@pytest.mark.parametrize(("points", "wiped"), [(LED, False), (INNER, True), (UP_TO_THE_EDGE, True), (BACK_OVER_THE_EDGE, False)])
def test_a_stroke_that_ends_inside_is_not_wiped_over_the_outer_wall(points: list[tuple[float, float]], wiped: bool) -> None:
    bead = Bead(Kind.OUTER_WALL, np.array(points, dtype=float), 0.45, 0)
    strokes = strokes_of([bead], np.array([False]), {}, 0.0)
    assert may_wipe_over(strokes, SKIN, 2.0).tolist() == [wiped]
    assert may_wipe_over(strokes, Polygons(), 2.0).tolist() == [True]
