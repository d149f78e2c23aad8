"""Triangulations of polygons, checked by shapely's constrained Delaunay triangulation."""

import numpy as np
import pytest
import shapely
from hypothesis import given, settings
from hypothesis import strategies as st

from mdp.mesh import Floats
from slicer.geometry.polygons import Polygons, area_mm2, contours
from slicer.geometry.triangulation import Triangulation, triangulate
from tests.slicer.hand import as_shapely, ragged


def corners(polygons: Polygons) -> Floats:
    """(m, 3, 2) the triangles of our triangulation."""
    triangulation = triangulate([contours(polygons)])
    assert triangulation is not None
    return triangulation.points[triangulation.tails].reshape(-1, 3, 2)


def as_rows(triangles: Floats) -> set[tuple[float, ...]]:
    """Triangles as sets of rounded corners, independent of the first corner and the orientation."""
    rounded = np.round(triangles, 6).tolist()
    return {tuple(value for corner in sorted(map(tuple, triangle)) for value in corner) for triangle in rounded}


@settings(deadline=None, max_examples=40)
@given(st.integers(0, 10**6))
def test_the_triangles_are_those_of_shapely_s_constrained_delaunay_triangulation(seed: int) -> None:
    star = ragged(seed)
    triangles = shapely.get_parts(shapely.constrained_delaunay_triangles(as_shapely(star)))
    expected = shapely.get_coordinates(triangles).reshape(-1, 4, 2)[:, :3]
    assert as_rows(corners(star)) == as_rows(expected)


def points_in_circles(mesh: Triangulation) -> int:
    """Number of inner edges whose opposite corner lies clearly inside the circumcircle of their triangle."""
    corners = mesh.points[mesh.tails].reshape(-1, 3, 2)
    inner = np.flatnonzero(mesh.across >= 0)
    beyond = mesh.points[mesh.tails[mesh.across[inner] - mesh.across[inner] % 3 + (mesh.across[inner] + 2) % 3]]
    rows = corners[inner // 3] - beyond[:, None]
    terms = np.concatenate([rows, (rows**2).sum(axis=2)[:, :, None]], axis=2)
    size = np.abs(rows).max(axis=(1, 2)) ** 4
    return int((np.linalg.det(terms) > 1e-9 * size).sum())


@pytest.mark.parametrize("corners", [64, 128, 180, 256])
@pytest.mark.parametrize("radius_mm", [3.0, 13.7, 15.3, 60.0])
def test_points_on_one_circle_have_a_triangulation_of_delaunay(corners: int, radius_mm: float) -> None:
    mesh = triangulate([contours(Polygons.circle(radius_mm, corners))], 0.17)
    assert mesh is not None
    assert points_in_circles(mesh) == 0


@settings(deadline=None, max_examples=40)
@given(st.integers(0, 10**6), st.sampled_from([0.17, 0.5, 3.0]))
def test_sides_with_samples_have_the_triangles_of_polygons_that_have_these_points(seed: int, step_mm: float) -> None:
    star = ragged(seed)
    mesh = triangulate([contours(star)], step_mm)
    assert mesh is not None
    assert points_in_circles(mesh) == 0
    outer = sum(area_mm2(loop) > 0 for loop in contours(star))
    holes = len(contours(star)) - outer
    assert len(mesh.tails) // 3 == len(mesh.points) - 2 * outer + 2 * holes  # Euler's formula
    sides = np.flatnonzero(mesh.across < 0)
    ends = mesh.points[mesh.tails[sides - sides % 3 + (sides + 1) % 3]]
    lengths = np.hypot(*(ends - mesh.points[mesh.tails[sides]]).T)
    assert lengths.max() <= step_mm + 1e-9
    assert lengths.sum() == pytest.approx(as_shapely(star).length)
    assert (mesh.tails[mesh.across[mesh.across >= 0]] == mesh.tails.reshape(-1, 3)[:, [1, 2, 0]].ravel()[mesh.across >= 0]).all()


def test_a_polygon_without_area_has_no_triangulation() -> None:
    assert triangulate([]) is None
