"""Solids of revolution: their axes are found in any orientation, and other solids have none."""

import manifold3d as m3
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mdp.cut import mesh_of
from mdp.directions.revolution import find_revolution
from mdp.mesh import Mesh
from mdp.pose import about, unit
from tests.shapes import ball, box, tee

PROFILES = {
    "a vase": [(0.0, 0.0), (12.0, 0.0), (20.0, 25.0), (9.0, 40.0), (11.0, 50.0), (0.0, 50.0)],
    "a cone": [(0.0, 0.0), (20.0, 0.0), (0.0, 40.0)],
    "a ring": [(20.0, 0.0), (26.0, 0.0), (26.0, 10.0), (20.0, 10.0)],
}
vectors = st.tuples(*[st.floats(-1, 1)] * 3).filter(lambda v: np.linalg.norm(v) > 0.1)


def turned(name: str, rotation: np.ndarray | None = None) -> Mesh:
    mesh = mesh_of(m3.CrossSection([PROFILES[name]]).revolve(64))
    return mesh.transform(np.eye(3) if rotation is None else rotation, (3.0, -40.0, 7.0))


@settings(max_examples=20, deadline=None)
@given(st.sampled_from(sorted(PROFILES)), vectors, st.floats(0.0, 6.3))
def test_the_axis_of_a_body_of_revolution_is_found_in_any_rotation(
    name: str, vector: tuple[float, ...], angle_rad: float
) -> None:
    rotation = about(unit(vector), angle_rad)
    found = find_revolution(turned(name, rotation))
    assert found is not None
    assert abs(float(found.axis @ rotation[:, 2])) == pytest.approx(1.0, abs=1e-3)
    away = found.middle - np.array([3.0, -40.0, 7.0])
    assert np.linalg.norm(away - (away @ found.axis) * found.axis) < 0.2
    assert found.is_all


def test_a_handle_does_not_hide_the_axis_of_a_mug() -> None:
    mug = m3.Manifold.cylinder(60.0, 25.0, 25.0, 64) + m3.Manifold.cube((30.0, 8.0, 40.0)).translate((20.0, -4.0, 10.0))
    found = find_revolution(mesh_of(mug))
    assert found is not None
    assert abs(found.axis[2]) == pytest.approx(1.0, abs=1e-3)
    assert found.radius_mm == pytest.approx(25.0, rel=0.02)


@pytest.mark.parametrize("mesh", [box(20, 30, 40), box(60, 60, 3), tee(), ball()], ids=["box", "plate", "tee", "ball"])
def test_other_bodies_have_no_axis_of_revolution(mesh: Mesh) -> None:
    assert find_revolution(mesh) is None


def test_an_axis_is_aligned_with_faces_along_or_across_it() -> None:
    found = find_revolution(turned("a vase"))
    assert found is not None
    answers = [found.is_square_to(unit(direction)) for direction in ((0, 0, -1), (1, 2, 0), (0.07, 0, 1), (0.1, 0, 1), (1, 0, 1))]
    assert answers == [True, True, True, False, False]  # upright, level, and 4, 6 and 45 degrees aslant
