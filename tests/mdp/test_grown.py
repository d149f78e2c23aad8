"""Faces around a point: where they end, and what lies nearest to a point."""

import numpy as np
import pytest
import trimesh
from hypothesis import given, settings
from hypothesis import strategies as st

from mdp.grown import Grown, nearest_face
from mdp.mesh import Mesh
from tests import shapes
from tests.mdp.files import both
from tests.mdp.solids import random_solid


def test_an_angle_of_nothing_takes_the_flat_place_and_ninety_degrees_its_neighbours() -> None:
    box = shapes.box()
    top = Grown((3.0, 4.0, 20.0), 0.0).faces(box)
    assert box.normals[top].tolist() == [[0.0, 0.0, 1.0]] * 2
    around = Grown((3.0, 4.0, 20.0), 90.0).faces(box)
    assert (int(around.sum()), float(box.normals[~around][:, 2].max())) == (10, -1.0)


@pytest.mark.parametrize("angle_deg", [20.0, 70.0, 130.0])
def test_on_a_ball_it_is_a_cap_of_that_angle(angle_deg: float) -> None:
    ball = shapes.ball(10.0, 96)
    area = float(ball.areas_mm2[Grown((0.0, 0.0, 20.0), angle_deg).faces(ball)].sum())
    assert area == pytest.approx(2 * np.pi * 100 * (1 - np.cos(np.radians(angle_deg))), rel=0.06)


def test_what_does_not_hang_together_with_it_is_left_out() -> None:
    two = both(shapes.box(), shapes.box().transform(np.eye(3), (50.0, 0.0, 0.0)))
    marked = Grown((50.0, 0.0, 20.0), 1.0).faces(two)
    assert two.vertices[two.faces[marked]][:, :, 0].min() == 40.0


@settings(max_examples=20, deadline=None)
@given(st.integers(0, 50), st.tuples(*[st.floats(-20.0, 20.0)] * 3))
def test_the_nearest_face_is_the_one_that_trimesh_finds(seed: int, point: tuple[float, float, float]) -> None:
    mesh: Mesh = random_solid(seed)
    corners = mesh.vertices[mesh.faces]
    nearest = trimesh.triangles.closest_point(corners, np.tile(point, (len(corners), 1)))
    assert nearest_face(mesh, np.array(point))[1] == pytest.approx(np.linalg.norm(nearest - point, axis=1).min(), abs=1e-9)
