"""Bending of plane sections: closed formulas, and every direction tried on an area of small squares."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from mdp.mesh import Floats
from mdp.sweep.bending import greatest_stress_per_moment


def _modulus(*loops: Floats) -> float:
    """Least section modulus of outlines (n, 2), mm3."""
    return 1.0 / greatest_stress_per_moment(np.concatenate([np.hstack([loop, np.roll(loop, -1, axis=0)]) for loop in loops]))


def _rectangle(b: float, h: float) -> Floats:
    return np.array([(0.0, 0.0), (b, 0.0), (b, h), (0.0, h)])


def _circle(radius: float) -> Floats:
    angles = 2.0 * np.pi * np.arange(720) / 720
    return radius * np.stack([np.cos(angles), np.sin(angles)], axis=1)


L_PROFILE = np.array([(0.0, 0.0), (12.0, 0.0), (12.0, 2.0), (3.0, 2.0), (3.0, 20.0), (0.0, 20.0)])


def test_a_rectangle_yields_first_at_its_corner_in_an_oblique_direction() -> None:
    """A moment at an angle t stresses the corner by cos t / (h b^2 / 6) + sin t / (b h^2 / 6): at most their root sum of
    squares."""
    about_weak, about_strong = 20.0 * 5.0**2 / 6.0, 5.0 * 20.0**2 / 6.0  # 83.3 and 333.3 mm3
    assert _modulus(_rectangle(5.0, 20.0)) == pytest.approx(1.0 / np.hypot(1.0 / about_weak, 1.0 / about_strong))
    assert _modulus(_rectangle(5.0, 20.0)) == pytest.approx(80.8, abs=0.05)


def test_a_circle_and_a_tube() -> None:
    assert _modulus(_circle(10.0)) == pytest.approx(np.pi * 10.0**3 / 4.0, rel=1e-4)
    assert _modulus(_circle(10.0), _circle(8.0)[::-1]) == pytest.approx(np.pi * (10.0**4 - 8.0**4) / 40.0, rel=1e-4)


def test_an_l_profile_against_small_squares_in_all_directions() -> None:
    x, y = np.meshgrid(np.arange(0.05, 12.0, 0.1), np.arange(0.05, 20.0, 0.1))
    places = np.stack([x, y], axis=-1)[(x < 3.0) | (y < 2.0)]
    middle = places.mean(axis=0)
    moments = 0.01 * ((places - middle).T @ (places - middle) + len(places) * 0.01 / 12.0 * np.eye(2))  # plus each square's own
    angles = np.pi * np.arange(3600) / 3600
    pushes = np.linalg.solve(moments, np.stack([np.cos(angles), np.sin(angles)]))
    assert _modulus(L_PROFILE) == pytest.approx(1.0 / np.abs((L_PROFILE - middle) @ pushes).max(), rel=1e-6)


@given(st.floats(0.0, 360.0), st.floats(-100.0, 100.0), st.floats(-100.0, 100.0))
def test_position_and_rotation_of_a_section_change_nothing(turn_deg: float, x: float, y: float) -> None:
    turn = np.radians(turn_deg)
    moved = L_PROFILE @ np.array([(np.cos(turn), np.sin(turn)), (-np.sin(turn), np.cos(turn))]) + (x, y)
    assert _modulus(moved) == pytest.approx(_modulus(L_PROFILE), rel=1e-6)


def test_an_empty_section_bears_no_moment() -> None:
    assert greatest_stress_per_moment(np.zeros((0, 4))) == np.inf
