"""Triangles over the rim of a hole."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from mdp.repair.holes import triangulate_loop


@given(st.integers(3, 30), st.integers(0, 2**32 - 1))
def test_the_triangles_that_fill_a_planar_loop_have_its_area(corners: int, seed: int) -> None:
    random = np.random.default_rng(seed)
    turn = np.sort(random.uniform(0, 2 * np.pi, corners))
    radius = random.uniform(0.99, 1.0, corners)
    points = np.stack([radius * np.cos(turn), radius * np.sin(turn), 0 * turn], axis=1)
    a, b, c = (points[triangulate_loop(points)[:, k]] for k in range(3))
    x, y = points[:, 0], points[:, 1]
    shoelace = 0.5 * float(np.sum(x * np.roll(y, -1) - y * np.roll(x, -1)))
    assert 0.5 * np.cross(b - a, c - a)[:, 2].sum() == pytest.approx(shoelace, abs=1e-9)
