"""Triangulations of polygons, judged by shapely's constrained Delaunay triangulation."""

import numpy as np
import pytest
import shapely
from hypothesis import given, settings
from hypothesis import strategies as st

from mdp.mesh import Floats
from slicer.geometry.polygons import Polygons, contours, resample
from slicer.geometry.triangulation import _flip, triangulate
from tests.slicer.hand import as_shapely, ragged


def corners(polygons: Polygons) -> Floats:
    """(m, 3, 2) the triangles of our triangulation."""
    triangulation = triangulate(contours(polygons))
    assert triangulation is not None
    return triangulation.points[triangulation.tails].reshape(-1, 3, 2)


def as_rows(triangles: Floats) -> set[tuple[float, ...]]:
    """Triangles as sets of rounded corners, wherever each begins and whichever way it turns."""
    rounded = np.round(triangles, 6).tolist()
    return {tuple(value for corner in sorted(map(tuple, triangle)) for value in corner) for triangle in rounded}


@settings(deadline=None, max_examples=40)
@given(st.integers(0, 10**6))
def test_the_triangles_are_those_of_shapely_s_constrained_delaunay_triangulation(seed: int) -> None:
    star = ragged(seed)
    triangles = shapely.get_parts(shapely.constrained_delaunay_triangles(as_shapely(star)))
    expected = shapely.get_coordinates(triangles).reshape(-1, 4, 2)[:, :3]
    assert as_rows(corners(star)) == as_rows(expected)


@pytest.mark.parametrize("corners", [64, 128, 180, 256])
@pytest.mark.parametrize("radius_mm", [3.0, 13.7, 15.3, 60.0])
def test_points_on_one_circle_are_flipped_only_as_long_as_that_betters_them(corners: int, radius_mm: float) -> None:
    mesh = triangulate([resample(loop, 0.17) for loop in contours(Polygons.circle(radius_mm, corners))])
    assert mesh is not None
    assert _flip(mesh) < 0.01 * len(mesh.tails)  # it ended by itself; seen from its other end a side may round otherwise


def test_a_polygon_without_area_has_no_triangulation() -> None:
    assert triangulate([]) is None
