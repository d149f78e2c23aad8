"""Frames across directions."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from mdp.directions.unit_vectors import frame_across, framed, spread
from tests.mdp.solids import random_direction

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
