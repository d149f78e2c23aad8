"""Counting executed lines from the printer's acknowledgements and its reports of free planner blocks."""

from collections.abc import Iterator

import pytest
from hypothesis import given
from hypothesis import strategies as st

from machine.link.line_history import CHECK_MUTE_S, CHECK_S, Barriers, LineHistory, PlannerReports, SentLine, shifts

MM = 2.0  # between the ends of moves


def moves(count: int, step_mm: float = MM) -> Iterator[SentLine]:
    """Commands of lines 1, 2, ..., with wire numbers from 4, along X; every fourth one does not move."""
    for line in range(1, count + 1):
        yield SentLine(line + 3, line, bool(line % 4), (step_mm * line, -2.0, 60.25, 30.0, 725.0, 12.34567))


def test_acknowledged_moves_are_executed_as_far_as_the_planner_has_room() -> None:
    history = LineHistory()
    for step in moves(40):
        history.send(step)
    for _ in range(2):
        history.acknowledge(33, 14)
    assert (history.sent, history.acknowledged, history.executed) == (40, 30, 29)
    for _ in range(2):
        history.acknowledge(33, 15)
    assert history.executed == 30
    history.acknowledge(33, 5)
    assert history.executed == 30


@given(
    st.lists(st.tuples(st.integers(0, 15), st.sampled_from([0.0, 0.03, -0.03, 0.08, -0.08, 0.2, 2.0])), min_size=1, max_size=60)
)
def test_executed_lines_never_include_a_waiting_move(steps: list[tuple[int, float]]) -> None:
    """The simulated planner holds at most 15 blocks, the oldest leave until the required places are free, and a move of fewer
    than 6 of 80 steps per mm is dropped and added to the next one, as in Marlin (MIN_STEPS_PER_SEGMENT).
    """
    history, blocks = LineHistory(), list[list[int]]()
    at_mm, planned_mm, dropped = 0.0, 0.0, list[int]()
    for line, (places, length_mm) in enumerate(steps, 1):
        at_mm += length_mm
        history.send(SentLine(line, line, length_mm != 0.0, (at_mm, 0.0, 0.0, 0.0, 0.0, 0.0)))
        if length_mm != 0.0:
            dropped.append(line)
            if abs(at_mm - planned_mm) >= 6 / 80:
                blocks.append(dropped)
                planned_mm, dropped = at_mm, []
        del blocks[: max(0, len(blocks) - (15 - places))]
        history.acknowledge(line, 15 - len(blocks))
        waiting = [*(block[0] for block in blocks), *dropped]
        assert history.executed < min(waiting, default=line + 1)


def test_moves_too_short_for_their_own_planner_block_wait_together() -> None:
    history = LineHistory(waiting=15)
    for step in moves(160, step_mm=0.04):
        history.send(step)
        history.acknowledge(step.number)
    assert 160 - 70 <= history.executed <= 160 - 15 * 2  # two moves of 0.04 mm make a block of 6 steps at 80 per mm


def test_a_smaller_planner_is_known_once_it_has_been_at_rest_twice() -> None:
    planner = PlannerReports()
    for _ in range(2):
        planner.waiting_beside(7)
        planner.rest()
    assert [planner.waiting_beside(7), planner.waiting_beside(0)] == [0, 7]


def test_an_answer_from_before_the_end_of_the_moves_says_nothing_of_the_size_of_the_planner() -> None:
    planner = PlannerReports()
    history = LineHistory(planner=planner)
    for step in moves(3):
        history.send(step)
        history.acknowledge(step.number, 0)
        history.end_moves(step.number + 1)  # the answer to M400 was lost
    assert [planner.waiting_beside(0), planner.waiting_beside(3)] == [15, 15]


def test_a_larger_planner_is_known_as_soon_as_it_reports_more() -> None:
    planner = PlannerReports()
    planner.waiting_beside(31)
    assert [planner.waiting_beside(31), planner.waiting_beside(11)] == [0, 20]


def test_a_damaged_number_of_free_places_moves_nothing_on() -> None:
    history = LineHistory()
    for step in moves(40):
        history.send(step)
        history.acknowledge(step.number, 95 if step.line == 30 else 5)
    assert history.executed < 40 - 10


def test_without_planner_reports_only_a_barrier_confirms_execution() -> None:
    history = LineHistory()
    for step in moves(40):
        history.send(step)
        history.acknowledge(step.number)
    assert (history.acknowledged, history.executed) == (40, 0)
    history.end_moves(44)
    assert history.executed == 40


def test_without_planner_reports_the_firmware_s_queue_limits_the_waiting_moves() -> None:
    history = LineHistory(waiting=20)
    for step in moves(40):
        history.send(step)
        history.acknowledge(step.number)
    assert (history.acknowledged, history.executed) == (40, 40 - 27)  # 20 moves, and 6 commands among them that do not move


def test_the_history_of_a_mute_printer_stays_small() -> None:
    history = LineHistory()
    for step in moves(20000):
        history.send(step)
        history.acknowledge(step.number)
    assert len(history._planned) < 5000
    assert history.commands == 20000


@pytest.mark.parametrize(("command", "shifted"), [
    ("G0 Z5 F600", True), ("g01 z5", True), ("G1 X5 Z5 F600", True), ("G0 A30 C10", True),
    ("MANUAL_STEPPER STEPPER=a MOVE=5", True),
    ("G1 X5 Z5 E1", False), ("G0 X5 Y5", False), ("M104 S200", False), ("G28 Z", False),
])  # fmt: skip
def test_a_z_move_or_table_turn_without_filament_is_a_shift(command: str, shifted: bool) -> None:
    assert shifts(command, ("X", "Y", "Z", "A", "C", "E")) is shifted


LETTERS = ("X", "Y", "Z", "A", "C", "E")
LIFTED = ["G1 X5 E1", "G0 Z2 F600", "G0 X9 F9000", "G0 Z1 F600", "M106 S9", "G1 E0.8", "G1 X7 E1"]


@pytest.mark.parametrize(("tracked", "held"), [(False, ["G0 Z2 F600", "G1 E0.8"]), (True, ["G0 Z2 F600"])])
def test_a_lifted_travel_begins_when_all_moves_are_over_and_a_mute_printer_is_waited_for_at_its_end(
    tracked: bool, held: list[str]
) -> None:
    barriers = Barriers(LETTERS, 0.0)
    assert [command for command in LIFTED if barriers.due(command, lambda line: "E" in line, tracked)] == held


@pytest.mark.parametrize(("tracked", "after_s", "command"), [(True, CHECK_S, "G1 X5 E1"), (False, CHECK_MUTE_S, "G0 X5")])
def test_the_position_is_checked_periodically(tracked: bool, after_s: float, command: str) -> None:
    barriers, looked = Barriers(LETTERS, 0.0), []
    for second in range(100):
        barriers.layer_ended = True
        looked += [second] if barriers.check_due(command, tracked, float(second)) else []
    assert looked == [second for second in range(1, 100) if second % after_s == 0]
    assert not barriers.check_due("G1 X5 E1", tracked, 1000.0)  # no layer has ended
