"""The campaign of killed hosts: how its runs are judged, and a short one."""

import pytest

from tools.kill_campaign import campaign, judged

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
def test_three_killed_hosts_leave_no_gap_and_repeat_no_more_than_the_documented_lines() -> None:
    for result in campaign(3, 11):
        assert (result.gap, result.twice <= 48) == (0, True), result.how
