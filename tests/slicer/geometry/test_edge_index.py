"""Edge index: crossings, points inside, nearest points and depths, checked by shapely."""

import numpy as np
import pytest
import shapely
from hypothesis import given, settings
from hypothesis import strategies as st
from numba import njit

from mdp.mesh import Floats
from slicer.geometry import edge_index
from slicer.geometry.edge_index import EdgeIndex, depths, index_edges
from slicer.geometry.polygons import Polygons
from slicer.geometry.polyline import Segment
from tests.slicer.hand import as_shapely, ragged

ROOM = 200


@njit
def within(of: EdgeIndex, x: float, y: float) -> bool:
    return edge_index.within(of, x, y)


@njit
def free(of: EdgeIndex, segment: Segment) -> bool:
    return edge_index.free(of, segment)


@njit
def nearest(of: EdgeIndex, x: float, y: float, reach: float) -> tuple[float, float, int]:
    return edge_index.nearest(of, x, y, reach)


@njit
def crossings(of: EdgeIndex, segment: Segment) -> Floats:
    shares, crossed = np.zeros(ROOM), np.zeros(ROOM, np.int64)
    return shares[: edge_index.crossings(of, segment, shares, crossed)]


def star(seed: int) -> tuple[shapely.Geometry, EdgeIndex, list[Segment]]:
    """A star, its edges, and 40 random segments around it."""
    area = ragged(seed)
    ends = np.random.default_rng(seed).uniform(-25, 25, (40, 4))
    return as_shapely(area), index_edges(area), [Segment(*row) for row in ends.tolist()]


@settings(deadline=None, max_examples=25)
@given(st.integers(0, 10**6))
def test_points_within_and_segments_that_cross_are_those_that_shapely_finds(seed: int) -> None:
    area, edges, segments = star(seed)
    for segment in segments:
        x0, y0, x1, y1 = segment
        line = shapely.LineString([(x0, y0), (x1, y1)])
        assert within(edges, x0, y0) == area.contains(shapely.Point(x0, y0))
        assert free(edges, segment) != area.boundary.intersects(line)
        cuts = shapely.get_coordinates(area.boundary.intersection(line))
        shares = np.sort(np.hypot(*(cuts - [x0, y0]).T)) / line.length
        assert crossings(edges, segment) == pytest.approx(shares, abs=1e-9)


@settings(deadline=None, max_examples=25)
@given(st.integers(0, 10**6))
def test_the_nearest_point_of_the_border_is_shapely_s(seed: int) -> None:
    area, edges, segments = star(seed)
    for x, y, _, _ in segments:
        px, py, edge = nearest(edges, x, y, 100.0)
        assert edge >= 0
        assert np.hypot(px - x, py - y) == pytest.approx(area.boundary.distance(shapely.Point(x, y)))


FRAME = Polygons.square((10.0, 8.0)) - Polygons.circle(2.0, 9).translate((4.0, 4.0))


@given(st.lists(st.tuples(st.floats(-30, 30), st.floats(-30, 30)), min_size=1, max_size=20))
def test_depths_are_the_distances_to_the_boundary_and_negative_outside(points: list[tuple[float, float]]) -> None:
    area, places = as_shapely(FRAME), shapely.points(points)
    away = shapely.distance(area.boundary, places)
    expected = np.where(shapely.contains_properly(area, places), away, -away)
    assert np.allclose(depths(np.array(points), index_edges(FRAME)), expected, atol=1e-9)


def test_no_point_is_inside_an_empty_polygon() -> None:
    assert depths(np.zeros((1, 2)), index_edges(Polygons()))[0] == -np.inf
