"""Durations of single strokes, by the formulas of uniform acceleration."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mdp.mesh import Floats
from slicer.estimate.duration import line_s, loop_s

SQUARE = np.array([[0.0, 0.0], [20.0, 0.0], [20.0, 20.0], [0.0, 20.0]])


def test_a_long_line_loses_the_time_of_one_acceleration() -> None:
    assert line_s(10.0, 50.0, 1000.0, 0.0) == pytest.approx(10.0 / 50.0 + 50.0 / 1000.0)


def test_a_short_line_never_reaches_its_speed() -> None:
    assert line_s(1.0, 50.0, 1000.0, 0.0) == pytest.approx(2.0 * (1.0 / 1000.0) ** 0.5)


def test_a_line_begun_and_ended_at_its_speed_loses_nothing() -> None:
    assert line_s(10.0, 50.0, 1000.0, 50.0) == pytest.approx(0.2)


def test_a_square_that_stops_at_its_corners_is_four_lines() -> None:
    assert loop_s(SQUARE, 50.0, 1000.0, 1e-6) == pytest.approx(4.0 * line_s(20.0, 50.0, 1000.0, 0.0), rel=1e-3)


def test_a_square_is_slowed_at_its_corners_to_the_junction_speed() -> None:
    inner = (20.0 - 2.5 / 2.0 - 2.4 / 2.0) / 50.0 + 50.0 / 1000.0 + 40.0 / 1000.0
    between = (20.0 - 2.4) / 50.0 + 2.0 * 40.0 / 1000.0
    assert loop_s(SQUARE, 50.0, 1000.0, 10.0) == pytest.approx(2.0 * inner + 2.0 * between, rel=1e-6)


def integrated_s(points: Floats, speed: float, acceleration: float, corners_mm_s: Floats) -> float:
    """Seconds along a line (n, 2) whose corners are passed no faster than that, summed over 40,000 short steps: everywhere as
    fast as the speed allows and as can be had from, and got rid of until, every corner."""
    sides = np.diff(points, axis=0)
    lengths = np.hypot(*sides.T)
    ramps = acceleration * lengths / np.abs(sides).max(axis=1)  # the axis that moves most has the acceleration
    at, energy = np.concatenate([[0.0], np.cumsum(lengths)]), np.concatenate([[0.0], np.cumsum(2.0 * ramps * lengths)])
    places = (np.arange(40_000) + 0.5) / 40_000 * at[-1]
    between = np.abs(np.interp(places, at, energy)[:, None] - energy)
    fastest = np.sqrt((corners_mm_s**2 + between).min(axis=1))
    return float((at[-1] / 40_000 / np.minimum(speed, fastest)).sum())


@settings(max_examples=40)
@given(st.integers(0, 10**6), st.floats(0.3, 10.0), st.floats(5.0, 200.0), st.floats(20.0, 1000.0), st.floats(0.5, 60.0))
def test_a_loop_takes_as_long_as_a_body_that_is_everywhere_as_fast_as_it_may(
    seed: int, size: float, speed: float, acceleration: float, junction: float
) -> None:
    rng = np.random.default_rng(seed)
    loop = rng.uniform(0.0, size, (int(rng.integers(3, 12)), 2))
    sides = np.diff(np.vstack([loop, loop[:1]]), axis=0)
    heads = sides / np.hypot(*sides.T)[:, None]
    turns = np.abs(np.diff(heads, axis=0)).max(axis=1)
    corners = np.array([0.0, *(junction / turns), 0.0])
    expected = integrated_s(np.vstack([loop, loop[:1]]), speed, acceleration, corners)
    assert loop_s(loop, speed, acceleration, junction) == pytest.approx(expected, rel=0.01)


@settings(max_examples=40)
@given(st.floats(0.1, 50.0), st.floats(5.0, 200.0), st.floats(100.0, 5000.0), st.floats(0.0, 250.0))
def test_a_line_takes_as_long_as_a_body_that_is_everywhere_as_fast_as_it_may(
    length: float, speed: float, acceleration: float, ends: float
) -> None:
    expected = integrated_s(np.array([(0.0, 0.0), (length, 0.0)]), speed, acceleration, np.array([ends, ends]))
    assert line_s(length, speed, acceleration, ends) == pytest.approx(expected, rel=0.01)
