"""Evenly spread directions: every cap holds its share of them; and frames across directions."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from mdp.directions.unit_vectors import frame_across, framed, spread, spread_like_light
from tests.mdp.solids import random_direction


@pytest.mark.parametrize(("count", "least_z"), [(1000, -1.0), (600, 0.17), (400, 0.0)])
def test_a_cap_holds_as_large_a_share_of_the_directions_as_of_the_sphere(count: int, least_z: float) -> None:
    directions = spread(count, least_z)
    assert np.linalg.norm(directions, axis=1) == pytest.approx(1.0)
    assert directions[:, 2].min() > least_z
    inside = np.sin(np.arcsin(least_z) + np.radians(20.0))
    for middle in spread(20, inside):
        held = (directions @ middle > np.cos(np.radians(20.0))).mean()
        assert held == pytest.approx((1.0 - np.cos(np.radians(20.0))) / (1.0 - least_z), abs=0.01)


def test_neighbours_are_as_far_apart_everywhere() -> None:
    directions = spread(500)
    nearest = np.sort(np.degrees(np.arccos(np.clip(directions @ directions.T, -1.0, 1.0))), axis=1)[:, 1]
    assert nearest.min() > 0.7 * nearest.max()


def test_light_on_a_matt_face_comes_from_above_by_the_square_of_the_cosine() -> None:
    directions = spread_like_light(200)
    for z in (0.2, 0.5, 0.9):
        assert (directions[:, 2] > z).mean() == pytest.approx(1.0 - z * z, abs=0.01)
    assert directions.mean(axis=0) == pytest.approx([0.0, 0.0, 2.0 / 3.0], abs=0.01)


AXES = np.concatenate([np.eye(3), -np.eye(3)])


@given(st.tuples(st.integers(0, 1000), st.integers(0, 1000)))
def test_a_direction_and_its_frame_are_right_handed_and_at_right_angles(place: tuple[int, int]) -> None:
    for direction in (random_direction(*place), *AXES):
        axes = np.array([*frame_across(direction), direction])
        assert axes @ axes.T == pytest.approx(np.eye(3), abs=1e-12)
        assert np.linalg.det(axes) == pytest.approx(1.0)


def test_many_directions_have_the_frames_of_each() -> None:
    directions = spread(50)
    assert np.array_equal(framed(directions)[1], [frame_across(direction) for direction in directions])
