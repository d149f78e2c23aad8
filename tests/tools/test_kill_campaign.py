"""The campaign of killed hosts: how its runs are judged, and a short one."""

import pytest

from machine.simulator.board import BuildOptions
from tools import kill_campaign
from tools.kill_campaign import (
    IN_DOUBT,
    LIFT_MM,
    RING,
    campaign,
    count_repeats,
    curved_program,
    cut_campaign,
    judged,
    judged_cut,
)

WHOLE = [[float(k), 0.0] for k in range(10)]


@pytest.mark.parametrize(("moves", "gap", "twice"), [
    (WHOLE, 0, 0),
    (WHOLE[:6] + WHOLE[6:], 0, 0),
    ([*WHOLE[:6], [99.0, 0.0], *WHOLE[4:]], 0, 2),
    ([*WHOLE[:6], [99.0, 0.0], *WHOLE[8:]], 2, 0),
    (WHOLE[:6], 4, 0),
    ([], 10, 0),
])  # fmt: skip
def test_missing_and_doubled_moves_are_counted(moves: list[list[float]], gap: int, twice: int) -> None:
    result = judged("any", moves, WHOLE)
    assert (result.gap, result.twice) == (gap, twice)


@pytest.mark.slow
def test_three_killed_hosts_leave_no_gap_and_repeat_no_more_than_the_documented_lines(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(kill_campaign, "LAYERS", 8)
    for result in campaign(3, 11):
        assert (result.gap, result.twice <= 23) == (0, True), result.how


STROKES = [[float(k), 0.0, 1.0, 0.0, 0.0, 0.1] for k in range(10)]
APPROACH = [[5.0, 0.0, 9.0, 0.0, 0.0, 0.0], [4.0, 0.0, 1.0, 0.0, 0.0, 0.8]]


@pytest.mark.parametrize(("rest", "gap", "twice", "off_mm"), [
    (STROKES[5:], 0, 0, 0.0),
    (STROKES[3:], 0, 2, 0.0),
    (STROKES[6:], 1, 0, 0.0),
    ([[*move[:2], move[2] + 0.3, *move[3:]] for move in STROKES[5:]], 0, 0, 0.3),
])  # fmt: skip
def test_a_cut_is_judged_by_moves_missing_and_doubled_and_by_the_height(
    rest: list[list[float]], gap: int, twice: int, off_mm: float
) -> None:
    begun = [[4.5, 0.0, 1.0, 0.0, 0.0, 0.05]]  # the move under way when the power went: it does not count
    cut = judged_cut("any", 6, [*STROKES[:5], *begun, *APPROACH, *rest], STROKES)
    assert (cut.gap, cut.twice, cut.off_mm) == (gap, twice, pytest.approx(off_mm))


@pytest.mark.slow
@pytest.mark.parametrize(("advanced", "most"), [(False, 20), (True, 23)])
def test_power_cuts_lose_no_stroke_and_no_height_that_was_not_asked_for(
    monkeypatch: pytest.MonkeyPatch, advanced: bool, most: int
) -> None:
    monkeypatch.setattr(kill_campaign, "LAYERS", 3)
    for cut in cut_campaign(4, 5, BuildOptions(advanced_ok=advanced, rx_ring=RING)):
        assert (cut.gap, cut.twice <= most) == (0, True), cut.how
        assert cut.off_mm < (LIFT_MM / 2 + 0.005 if cut.how == IN_DOUBT else 0.005), cut.how


@pytest.mark.parametrize(("advanced", "most", "usual"), [(False, 15 + 4 + 1, 6.0), (True, 15 + 4 + 4, 3.0)])
def test_at_no_moment_of_a_print_are_more_strokes_off_record_than_the_documented_bound(
    advanced: bool, most: int, usual: float
) -> None:
    """What may wait in the planner, lines since the newest record, lines in flight: docs/serial.md, Journal and resume."""
    counts = count_repeats(BuildOptions(advanced_ok=advanced, rx_ring=RING), curved_program(layers=2, strokes=300))
    mean, worst = counts["file"]
    assert (worst <= most, mean <= usual) == (True, True), counts
