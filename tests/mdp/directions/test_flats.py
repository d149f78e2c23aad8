"""Flats: the directions along a model's large flat faces, for solids with known faces."""

import manifold3d as m3
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mdp.cut import mesh_of
from mdp.directions.flats import Flats
from mdp.mesh import Floats, Mesh
from mdp.pose import about
from tests import shapes


def prism(sides: int, height_mm: float = 30.0) -> Mesh:
    """A regular prism along z."""
    return mesh_of(m3.Manifold.cylinder(height_mm, 10.0, 10.0, sides))


def same(directions: Floats, expected: Floats) -> bool:
    """Whether two sets hold equal directions, within half a degree."""
    near = directions @ np.asarray(expected).T > np.cos(np.radians(0.5))
    return bool(near.any(axis=0).all() and near.any(axis=1).all())


def test_a_box_has_its_three_axes_both_ways() -> None:
    assert same(Flats.of(shapes.box(10, 20, 30)).directions(-1.0), np.concatenate([np.eye(3), -np.eye(3)]))
    assert same(Flats.of(shapes.box(10, 20, 30)).directions(0.1), np.array([[0.0, 0.0, 1.0]]))


def test_the_axis_of_a_prism_comes_first_for_all_of_its_faces_are_level_or_walls_along_it() -> None:
    first = Flats.of(prism(6)).directions(0.0)[0]
    assert first == pytest.approx([0.0, 0.0, 1.0])


@settings(max_examples=25, deadline=None)
@given(st.floats(-1.5, 1.5), st.floats(-1.5, 1.5), st.floats(-1.5, 1.5))
def test_a_model_that_is_turned_has_its_directions_turned(x: float, y: float, z: float) -> None:
    turn = np.linalg.multi_dot([about(axis, angle) for axis, angle in zip(np.eye(3), (x, y, z), strict=True)])
    mesh = prism(5)
    assert same(Flats.of(mesh.transform(turn)).directions(-1.0), Flats.of(mesh).directions(-1.0) @ turn.T)


def test_a_ball_has_no_flats() -> None:
    assert len(Flats.of(mesh_of(m3.Manifold.sphere(10.0, 64))).shares) == 0


def test_no_direction_is_within_half_a_degree_of_another() -> None:
    directions = Flats.of(mesh_of(m3.Manifold.cylinder(20.0, 10.0, 6.0, 24))).directions(-1.0)
    between = np.degrees(np.arccos(np.clip(directions @ directions.T - 2.0 * np.eye(len(directions)), -1.0, 1.0)))
    assert between.min() >= 0.5


def test_directions_near_a_given_one_are_ranked_by_their_flats() -> None:
    flats = Flats.of(shapes.box(10, 20, 30))
    askew = about(np.array([0.0, 1.0, 0.0]), 0.1) @ about(np.array([0.0, 0.0, 1.0]), 0.1) @ np.array([1.0, 0.0, 0.0])
    first, *others = flats.beside(askew, -1.0)
    assert first == pytest.approx([1.0, 0.0, 0.0])
    assert len(others) == 2  # leaning about y or about z only
    assert len(flats.beside(np.array([1.0, 0.0, 0.0]), -1.0)) == 0
    assert len(flats.beside(np.array([1.0, 1.0, 1.0]) / np.sqrt(3.0), -1.0)) == 0
