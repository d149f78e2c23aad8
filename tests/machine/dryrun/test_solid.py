"""Inside tests, distances and beads, against solid angles, trimesh's nearest points and each bar computed alone."""

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st
from trimesh.triangles import closest_point

from machine.dryrun.agreement import ROUND_MM, fill, fit_shift, inside, outside_mm
from mdp.mesh import Floats, Mesh
from mdp.sweep.rays import nearest_faces, triangle_tree
from tests.mdp.solids import random_solid
from tests.shapes import ball, box, hollow

seeds = st.integers(0, 50)
MOST_MM = 3.0


def points_about(mesh: Mesh, seed: int, count: int = 60) -> Floats:
    low, high = mesh.bounds_mm
    return np.random.default_rng(seed).uniform(low - 2.0, high + 2.0, (count, 3))


def windings(points: Floats, mesh: Mesh) -> Floats:
    """Winding number of the surface about each point: the solid angles of its faces (Van Oosterom and Strackee 1983)."""
    corners = mesh.vertices[mesh.faces][None] - points[:, None, None]
    a, b, c = (corners[:, :, k] for k in range(3))
    p, q, r = (np.linalg.norm(side, axis=2) for side in (a, b, c))
    volume = np.einsum("nfi,nfi->nf", a, np.cross(b, c))
    below = p * q * r + (a * b).sum(2) * r + (b * c).sum(2) * p + (c * a).sum(2) * q
    turns: Floats = np.arctan2(volume, below).sum(axis=1) / (2.0 * np.pi)
    return turns


def distances_mm(points: Floats, mesh: Mesh) -> Floats:
    """(n, m) distances of points from faces, by trimesh."""
    m = len(mesh.faces)
    triangles = np.tile(mesh.vertices[mesh.faces], (len(points), 1, 1))
    each = np.repeat(points, m, axis=0)
    away: Floats = np.linalg.norm(closest_point(triangles, each) - each, axis=1).reshape(-1, m)
    return away


@settings(max_examples=12)
@given(seeds)
def test_a_point_is_inside_if_the_surface_winds_around_it(seed: int) -> None:
    mesh = random_solid(seed)
    points = points_about(mesh, seed)
    assert np.array_equal(inside(points, triangle_tree(mesh)), windings(points, mesh) > 0.5)


@pytest.mark.parametrize(("mesh", "z_mm", "within"), [(box(), 10.0, True), (hollow(), 10.0, False), (hollow(), 2.0, True)])
def test_a_point_right_above_face_edges_is_correctly_classified(mesh: Mesh, z_mm: float, within: bool) -> None:
    assert inside(np.array([(0.0, 0.0, z_mm), (1.0, 1.0, z_mm), (-2.0, 2.0, z_mm)]), triangle_tree(mesh)).tolist() == [within] * 3


def test_a_point_right_below_a_face_corner_is_correctly_classified() -> None:
    sphere = ball(10.0, 24)
    top = sphere.vertices[sphere.vertices[:, 2].argmax()]
    assert inside(top + np.array([(0.0, 0.0, -1.0), (0.0, 0.0, 1.0)]), triangle_tree(sphere)).tolist() == [True, False]


def test_a_point_in_either_of_two_overlapping_bodies_is_inside() -> None:
    low, high = box(20.0, 20.0, 20.0), box(20.0, 20.0, 20.0)
    both = Mesh(
        np.vstack([low.vertices, high.vertices + np.array([5.0, 0.0, 5.0])]),
        np.vstack([low.faces, high.faces + len(low.vertices)]),
    )
    points = np.array([(2.0, 1.0, 2.0), (2.0, 1.0, 7.0), (2.0, 1.0, 22.0), (-9.0, 1.0, 22.0), (14.0, 1.0, 2.0)])
    assert inside(points, triangle_tree(both)).tolist() == [True, True, True, False, False]


def test_a_point_in_an_inside_out_body_is_outside() -> None:
    right = box(20.0, 20.0, 20.0)
    inside_out = Mesh(right.vertices, right.faces[:, ::-1])
    assert [inside(np.array([(2.0, 1.0, 9.0)]), triangle_tree(mesh)).tolist() for mesh in (right, inside_out)] == [
        [True],
        [False],
    ]


@settings(max_examples=12)
@given(seeds)
def test_points_are_as_far_from_a_solid_as_from_its_nearest_face(seed: int) -> None:
    mesh = random_solid(seed)
    points = points_about(mesh, seed, 40)
    away = distances_mm(points, mesh)
    nearest = away.min(axis=1)
    distances, faces = nearest_faces(triangle_tree(mesh), points, MOST_MM)
    near = nearest < MOST_MM
    assert distances == pytest.approx(np.minimum(nearest, MOST_MM), abs=1e-9)
    assert away[near, faces[near]] == pytest.approx(nearest[near], abs=1e-9)
    within = windings(points, mesh) > 0.5
    assert outside_mm(points, triangle_tree(mesh), MOST_MM) == pytest.approx(
        np.where(within, 0.0, np.minimum(nearest, MOST_MM)), abs=1e-9
    )


def test_no_points_have_no_distance() -> None:
    assert outside_mm(np.zeros((0, 3)), triangle_tree(box()), 5.0).shape == (0,)


@settings(max_examples=15)
@given(seeds)
@example(33)  # a point at the corner of a bar
def test_a_point_is_filled_if_it_is_in_a_bar_below_its_segment(seed: int) -> None:
    rng = np.random.default_rng(seed)
    count = 40
    ups = rng.normal(size=(count, 3))
    ups /= np.linalg.norm(ups, axis=1, keepdims=True)
    along = np.cross(ups, rng.normal(size=(count, 3)))
    starts = rng.uniform(-8.0, 8.0, (count, 3))
    segments = np.stack([starts, starts + along * rng.uniform(0.0, 6.0, (count, 1))], axis=1)
    segments[0, 1] = segments[0, 0]  # of zero length
    width, height = rng.uniform(0.3, 2.0, count), rng.uniform(0.1, 1.0, count)
    shape = (23, 24, 25)
    places = -9.0 + 0.75 * np.indices(shape).reshape(3, -1).T
    filled, marked = np.zeros(len(places), np.bool_), np.zeros(shape, np.bool_)
    for k in range(1, count):
        length = np.linalg.norm(segments[k, 1] - segments[k, 0])
        way = (segments[k, 1] - segments[k, 0]) / length
        own = (places - segments[k, 0]) @ np.array([way, np.cross(ups[k], way), ups[k]]).T
        beside, below = np.abs(own[:, 1]) <= 0.5 * width[k] + ROUND_MM, np.abs(own[:, 2] + 0.5 * height[k])
        ends = (own[:, 0] >= -0.5 * width[k]) & (own[:, 0] <= length + 0.5 * width[k])
        filled |= beside & ends & (below <= 0.5 * height[k] + ROUND_MM)
    assert filled.sum() > 20
    fill(marked, np.full(3, -9.0), 0.75, segments, ups, np.column_stack([width, height]))
    assert np.array_equal(marked.ravel(), filled)


@settings(max_examples=30)
@given(st.integers(0, 10**6), st.integers(60, 400))
def test_a_shift_is_found_despite_a_constant_offset_and_outlier_walls(seed: int, count: int) -> None:
    rng = np.random.default_rng(seed)
    normals = rng.normal(size=(count, 3))
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    shift, constant = rng.uniform(-0.5, 0.5, 3), rng.uniform(-0.2, 0.2)
    beside = normals @ shift + constant + rng.normal(0.0, 0.005, count)
    beside[: count // 10] += rng.uniform(0.5, 1.4, count // 10)
    found = fit_shift(normals, beside)
    assert found == pytest.approx(shift, abs=0.03)


def test_a_shift_along_a_direction_no_wall_faces_is_zero_and_too_few_walls_give_none() -> None:
    turns = 2.0 * np.pi * np.arange(100) / 100
    level = np.column_stack([np.cos(turns), np.sin(turns), np.zeros(100)])
    assert fit_shift(level, level @ (0.3, -0.1, 9.0) + 0.1) == pytest.approx([0.3, -0.1, 0.0], abs=1e-6)
    assert fit_shift(level[:39], level[:39, 0]) is None
