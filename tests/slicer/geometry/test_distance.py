"""Distance field: shapely agrees on how far points lie inside."""

import numpy as np
import shapely
from hypothesis import given
from hypothesis import strategies as st

from slicer.geometry.distance import distances, signed_distances
from slicer.geometry.polygons import Polygons, edges
from tests.slicer.hand import as_shapely

FRAME = Polygons.square((10.0, 8.0)) - Polygons.circle(2.0, 9).translate((4.0, 4.0))


@given(st.lists(st.tuples(st.floats(-3, 13), st.floats(-3, 11)), min_size=1, max_size=20))
def test_distances_are_those_to_the_boundary_and_negative_outside(points: list[tuple[float, float]]) -> None:
    area, places = as_shapely(FRAME), shapely.points(points)
    away = shapely.distance(area.boundary, places)
    expected = np.where(shapely.contains_properly(area, places), away, -away)
    assert np.allclose(signed_distances(np.array(points), edges(FRAME)), expected, atol=1e-9)
    assert np.allclose(distances(np.array(points), edges(FRAME)), away, atol=1e-9)


def test_nothing_lies_inside_of_nothing() -> None:
    assert signed_distances(np.zeros((1, 2)), edges(Polygons()))[0] == -np.inf
