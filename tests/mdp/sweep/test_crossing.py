"""The part of a triangle above a plane, against clipped polygons."""

import numpy as np
from hypothesis import given
from hypothesis import strategies as st
from shapely.geometry import Polygon, box

from mdp.sweep.crossing import areas_above

COORDINATE = st.floats(-4.0, 4.0).map(lambda value: round(value, 2))
CORNERS = st.lists(st.tuples(COORDINATE, COORDINATE), min_size=3, max_size=3)
UPPER_HALF = box(-5.0, 0.0, 5.0, 5.0)


@given(CORNERS)
def test_the_area_above_a_plane_is_that_of_the_clipped_triangle(corners: list[tuple[float, float]]) -> None:
    triangle, heights = Polygon(corners), np.array([z for _, z in corners])
    above = areas_above(np.array([[0, 1, 2]], np.int32), heights, np.array([triangle.area]))
    assert abs(above[0] - (triangle & UPPER_HALF).area) < 1e-9


def test_a_triangle_in_the_plane_itself_has_nothing_above_it() -> None:
    assert areas_above(np.array([[0, 1, 2]], np.int32), np.zeros(3), np.array([2.0])).tolist() == [0.0]


def test_a_triangle_touching_the_plane_from_above_is_entirely_above_it() -> None:
    heights = np.array([0.0, 0.0, 3.0])
    assert areas_above(np.array([[0, 1, 2]], np.int32), heights, np.array([2.0])).tolist() == [2.0]
