"""Azimuth: a bearing about z that turns with a model."""

import manifold3d as m3
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from mdp.cut import Solid, mesh_of
from mdp.directions.orientation import azimuth_rad
from mdp.mesh import Mesh
from mdp.pose import UP, about

ANGLES_DEG = st.floats(-180.0, 180.0)


def azimuth_deg(solid: Solid, turn_deg: float = 0.0) -> float:
    mesh = mesh_of(solid)
    return float(np.degrees(azimuth_rad(Mesh(mesh.vertices @ about(UP, np.radians(turn_deg)).T, mesh.faces))))


def apart_deg(one: float, other: float, period_deg: float = 360.0) -> float:
    return abs((one - other + 0.5 * period_deg) % period_deg - 0.5 * period_deg)


def star(corners: int) -> Solid:
    """An upright prism over a circle with waves on it, a crest along x."""
    turns = np.linspace(0.0, 2.0 * np.pi, 240, endpoint=False)
    radius = 10.0 + 3.0 * np.cos(corners * turns)
    return m3.CrossSection([np.stack([radius * np.cos(turns), radius * np.sin(turns)], axis=1)]).extrude(5.0)


def test_the_azimuth_of_a_box_is_along_its_longer_side() -> None:
    assert apart_deg(azimuth_deg(m3.Manifold.cube((30.0, 10.0, 5.0), True)), 0.0, 180.0) < 1e-6
    assert apart_deg(azimuth_deg(m3.Manifold.cube((10.0, 30.0, 5.0), True)), 90.0, 180.0) < 1e-6


def test_the_azimuth_of_a_post_with_an_arm_is_along_the_arm() -> None:
    post = m3.Manifold.cylinder(30.0, 5.0, 5.0, 64) + m3.Manifold.cube((20.0, 4.0, 4.0)).translate((0.0, -2.0, 10.0))
    assert apart_deg(azimuth_deg(post), 0.0) < 1e-6


@given(ANGLES_DEG)
def test_the_azimuth_turns_with_a_model_of_no_symmetry(turn_deg: float) -> None:
    solid = m3.Manifold.cube((30.0, 10.0, 5.0)) + m3.Manifold.cube((4.0, 12.0, 20.0)) + m3.Manifold.sphere(3.0, 24)
    assert apart_deg(azimuth_deg(solid, turn_deg), azimuth_deg(solid) + turn_deg) < 1e-4


@pytest.mark.parametrize("corners", [2, 3, 4, 5, 6])
@given(turn_deg=ANGLES_DEG)
def test_of_a_model_that_looks_the_same_from_several_sides_it_is_one_of_these(corners: int, turn_deg: float) -> None:
    assert apart_deg(azimuth_deg(star(corners), turn_deg), turn_deg, 360.0 / corners) < 1e-4


def test_a_body_of_revolution_has_azimuth_0_however_it_is_turned() -> None:
    assert azimuth_deg(m3.Manifold.cylinder(30.0, 5.0, 8.0, 64), 7.0) == 0.0


def test_the_azimuth_does_not_depend_on_how_a_surface_is_cut_into_triangles() -> None:
    solid = m3.Manifold.cube((30.0, 10.0, 5.0)) + m3.Manifold.cube((4.0, 12.0, 20.0))
    assert apart_deg(azimuth_deg(solid.refine(3)), azimuth_deg(solid)) < 1e-6
