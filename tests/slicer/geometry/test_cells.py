"""Edges in cells: crossings, points inside and nearest points, judged by shapely."""

import numpy as np
import pytest
import shapely
from hypothesis import given, settings
from hypothesis import strategies as st
from numba import njit

from mdp.mesh import Floats
from slicer.geometry import cells
from slicer.geometry.cells import Cells, cells_of
from slicer.geometry.segments import Segment
from tests.slicer.hand import as_shapely, ragged

ROOM = 200


@njit
def within(of: Cells, x: float, y: float) -> bool:
    return cells.within(of, x, y)


@njit
def free(of: Cells, segment: Segment) -> bool:
    return cells.free(of, segment)


@njit
def nearest(of: Cells, x: float, y: float, reach: float) -> tuple[float, float, int]:
    return cells.nearest(of, x, y, reach)


@njit
def crossings(of: Cells, segment: Segment) -> Floats:
    shares, crossed = np.zeros(ROOM), np.zeros(ROOM, np.int64)
    return shares[: cells.crossings(of, segment, shares, crossed)]


def star(seed: int) -> tuple[shapely.Geometry, Cells, list[Segment]]:
    """A star, its cells, and 40 random segments around it."""
    area = ragged(seed)
    ends = np.random.default_rng(seed).uniform(-25, 25, (40, 4))
    return as_shapely(area), cells_of(area), [Segment(*row) for row in ends.tolist()]


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
