"""Planes whose normals have any length: from files, from pages and from moves that accumulate rounding."""

from math import inf, isfinite, nan, nextafter

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mdp.cut import above, below, solid_of
from mdp.directions.unit_vectors import spread
from mdp.plane import Plane
from mdp.pose import poses
from profiles.errors import PlanError
from profiles.profile import load
from tests.shapes import box

GENERIC = load().machine
ROUNDED = st.sampled_from([1.0, nextafter(1.0, 2.0), nextafter(1.0, 0.0), 1.0000000000001, -nextafter(1.0, 2.0)])
TINY = st.sampled_from([0.0, -0.0, 5e-324, 1e-17, -1e-9, 3e-8])
NEARLY_AXES = st.tuples(TINY, TINY, ROUNDED).flatmap(st.permutations)
ANY = st.tuples(*[st.floats(-1e5, 1e5)] * 3).filter(lambda normal: np.linalg.norm(normal) > 1e-5)


@settings(max_examples=300, deadline=None)
@given(ANY | NEARLY_AXES)
def test_a_normal_of_any_length_becomes_a_unit_vector_of_the_same_direction(normal: tuple[float, float, float]) -> None:
    unit = Plane(np.array(normal), 1.0).normal
    assert abs(float(unit @ unit) - 1.0) <= 1e-12
    assert np.abs(unit).max() <= 1.0
    assert unit * np.linalg.norm(normal) == pytest.approx(np.array(normal), rel=1e-9, abs=1e-9)


@settings(max_examples=100, deadline=None)
@given(ANY | NEARLY_AXES)
def test_every_plane_that_can_be_made_has_finite_poses_and_cuts(normal: tuple[float, float, float]) -> None:
    plane, cube = Plane(np.array(normal), 1.0), solid_of(box(10.0, 10.0, 10.0))
    assert all(isfinite(pose.tilt_deg) and isfinite(pose.turn_deg) for pose in poses(GENERIC, plane.normal))
    assert above(cube, plane).volume() + below(cube, plane).volume() == pytest.approx(1000.0)


def test_the_directions_of_a_search_keep_their_bits() -> None:
    directions = spread(600, 0.17).copy()
    assert np.array([Plane(direction, 1.0).normal for direction in directions]).tobytes() == directions.tobytes()


@pytest.mark.parametrize("normal", [(0.0, 0.0, 0.0), (0.0, nan, 1.0), (inf, 0.0, 0.0), (1e200, 0.0, 0.0), (0.0, 0.0, 5e-324)])
def test_a_normal_that_is_no_direction_is_refused(normal: tuple[float, float, float]) -> None:
    with pytest.raises(PlanError, match=r"the normal of a plane is \[.*\]: a direction of a length of about 1 is expected"):
        Plane(np.array(normal), 1.0)
