"""The state at any line of a program: axis positions after it, remaining time, and the number of layers of its part."""

import pytest

from machine.dryrun.dryrun import Timeline, dry_run
from profiles.profile import load

PROFILE = load()
PROGRAM = [
    "G21", "G90", "M83", "G28", "G92 A0 C0", "M104 S210", "M109 S210",
    ";PART:1 of 2", ";POSE:A0 C0", ";LAYER_CHANGE", "G1 X10 E1 F600", ";LAYER_CHANGE", "G1 X20 E1",
    ";PART:2 of 2", "G0 Z50", "G0 A30 C120", ";LAYER_CHANGE", "G1 X30 E1", "M104 S0",
]  # fmt: skip
TIMELINE = Timeline(dry_run(PROGRAM, PROFILE))


def test_the_time_left_after_a_line_is_that_of_the_following_moves_and_dwells() -> None:
    run = dry_run(["G21", "G90", "M83", "G28", "G1 X60 F600", "G4 S5", "G1 X0 F600", "G4 S7"], PROFILE)
    timeline, ends_s = Timeline(run), run.times_s
    assert timeline.remaining_s(0) == pytest.approx(run.time_s)
    assert timeline.remaining_s(5) == pytest.approx(ends_s[1] + 12.0)
    assert timeline.remaining_s(7) == pytest.approx(7.0)


def test_travel_to_a_part_is_not_counted_as_its_layer() -> None:
    assert [TIMELINE.layers(part) for part in (1, 2, 3, None)] == [2, 1, None, None]


@pytest.mark.parametrize(("line", "place"), [(11, (10.0, 0.0, 0.0)), (15, (20.0, 0.0, 0.0)), (99, (30.0, 30.0, 120.0))])
def test_the_axes_are_where_the_last_move_before_a_line_left_them(line: int, place: tuple[float, ...]) -> None:
    assert tuple(TIMELINE.at(line)[letter] for letter in "XAC") == place


@pytest.mark.parametrize("line", [0, 10])
def test_before_the_first_move_the_axis_positions_are_unknown(line: int) -> None:
    assert TIMELINE.at(line) == {}
