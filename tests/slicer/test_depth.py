"""Depth: shapely agrees on how far points lie inside."""

import numpy as np
import shapely
from hypothesis import given
from hypothesis import strategies as st

from slicer.depth import depths
from slicer.polygons import Polygons, edges
from tests.slicer.hand import as_shapely

FRAME = Polygons.square((10.0, 8.0)) - Polygons.circle(2.0, 9).translate((4.0, 4.0))


@given(st.lists(st.tuples(st.floats(-3, 13), st.floats(-3, 11)), min_size=1, max_size=20))
def test_depths_are_distances_to_the_boundary_negative_outside(points):
    area, places = as_shapely(FRAME), shapely.points(points)
    away = shapely.distance(area.boundary, places)
    expected = np.where(shapely.contains_properly(area, places), away, -away)
    assert np.allclose(depths(np.array(points), edges(FRAME)), expected, atol=1e-9)


def test_nothing_lies_inside_of_nothing():
    assert depths(np.zeros((1, 2)), edges(Polygons()))[0] == -np.inf
