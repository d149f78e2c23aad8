"""Durations of single strokes, by the formulas of uniform acceleration."""

import numpy as np
import pytest

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
