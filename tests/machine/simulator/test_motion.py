from math import sqrt

import pytest

from machine.simulator.motion import Motion
from profiles.profile import load


def _seconds(words: dict[str, float], limits: dict[str, float]) -> float:
    """Duration of a single move with a corner speed of 0."""
    motion = Motion(load().machine.model_copy(update={"junction_speed_mm_s": 0.0}), home_start=False)
    motion.accelerate(limits)
    motion.reach(motion.target(words), 0.0)
    return motion.planner.ahead()[0].duration_s


STROKE = {"X": 20.0, "E": 1.0, "F": 60000.0}
TRAVEL = {"X": 20.0, "F": 60000.0}


@pytest.mark.parametrize("limits", [{"P": 500.0}, {"S": 500.0}, {"P": 500.0, "T": 1000.0}])
def test_a_stroke_is_accelerated_as_set_by_m204_p(limits: dict[str, float]) -> None:
    assert _seconds(STROKE, limits) == pytest.approx(2 * sqrt(20 / 500))


@pytest.mark.parametrize("limits", [{"T": 500.0}, {"S": 500.0}, {"P": 1000.0, "T": 500.0}])
def test_a_travel_is_accelerated_as_set_by_m204_t(limits: dict[str, float]) -> None:
    assert _seconds(TRAVEL, limits) == pytest.approx(2 * sqrt(20 / 500))


@pytest.mark.parametrize("limits", [{}, {"S": 0.0}, {"P": 1e6, "T": 1e6}, {"T": 500.0}])
def test_more_than_the_axes_allow_or_nothing_changes_nothing(limits: dict[str, float]) -> None:
    assert _seconds(STROKE, limits) == pytest.approx(2 * sqrt(20 / 1500))


def test_a_rotary_move_keeps_the_acceleration_of_its_axis() -> None:
    assert _seconds({"C": 30.0, "F": 60000.0}, {"S": 1.0}) == pytest.approx(30 / 60 + 60 / 400)
