"""Wipes beside the edge of an interface: they stay off the outer wall unless the stroke itself ends on it."""

import numpy as np
import pytest

from slicer.geometry.polygons import Polygons, offset
from slicer.paths import Kind, Path
from slicer.travel.wiping import keep_wipes_off

SQUARE = Polygons.square((20.0, 20.0))
SKIN = SQUARE - offset(SQUARE, -0.36)
LED = [(10, 0.7), (10, 0.2), (19.8, 0.2), (19.8, 19.8), (0.2, 19.8), (0.2, 0.2), (10, 0.2), (10, 0.45)]
INNER = [(10, 0.7), (19.3, 0.7), (19.3, 19.3), (0.7, 19.3), (0.7, 0.7), (10, 0.7)]
UP_TO_THE_EDGE, BACK_OVER_THE_EDGE = [(10, 5), (10, 0.2)], [(10, 0.2), (10, 1.5)]


@pytest.mark.parametrize(("points", "wiped"), [(LED, False), (INNER, True), (UP_TO_THE_EDGE, True), (BACK_OVER_THE_EDGE, False)])
def test_what_ends_inside_is_not_wiped_over_the_outer_wall(points: list[tuple[float, float]], wiped: bool) -> None:
    path = Path(Kind.OUTER_WALL, np.array(points, dtype=float), 0.45, 30.0, 1.0, np.zeros((0, 2)), False)
    assert keep_wipes_off([path], SKIN, 2.0)[0].wiped is wiped
    assert keep_wipes_off([path], Polygons(), 2.0) == (path,)
