"""The states of a print: which may follow which, and what a page is told of a moment."""

import json

import pytest

from machine.link.print_state import OVER, TABLE, PrintState, PrintStatus, follows
from machine.link.protocol.events import Temperature
from machine.printing import server_print
from machine.printing.server_print import ReportedProgress


def test_every_state_has_a_row_and_can_be_reached_from_the_first() -> None:
    assert set(TABLE) == set(PrintState)
    reached, new = set[PrintState](), {PrintState.CHECKING}
    while new:
        reached |= new
        new = {after for state in new for after in TABLE[state]} - reached
    assert reached == set(PrintState)


@pytest.mark.parametrize("state", sorted(PrintState))
def test_a_print_can_end_in_every_way_whatever_it_is_at_and_stays_over(state: PrintState) -> None:
    """What its process tells in quick succession is put together, so that any end may follow the first state."""
    assert follows(state, state)
    if state not in OVER:
        assert all(follows(state, end) for end in OVER)
    else:
        assert TABLE[state] == ({PrintState.CANCELLING} if state is PrintState.LEFT else set())


def test_a_moment_is_told_to_a_page_as_it_is() -> None:
    status = PrintStatus(PrintState.PAUSED, 2.0, Temperature(210.0, 215.0), file_line=7, at={"X": 1.0}, heat_age_s=20.0)
    page = json.loads(json.dumps(status.json()))
    assert (page["state"], page["file_line"], page["at"], page["nozzle_c"]) == ("paused", 7, {"X": 1.0}, 210.0)
    assert page["heat_is_old"]
    assert "temperature" not in page


def test_the_temperatures_of_a_server_that_does_not_answer_grow_old(monkeypatch: pytest.MonkeyPatch) -> None:
    now_s = 100.0
    monkeypatch.setattr(server_print, "monotonic", lambda: now_s)
    progress = ReportedProgress()
    first, second = (PrintStatus(PrintState.PRINTING, temperature=Temperature(209.6, 210.0, 60.0, 60.0)) for _ in range(2))
    assert progress.at(first, "").heat_age_s == 0.0
    now_s += 20.0
    assert (progress.at(first, "no answer").heat_age_s, progress.at(first, "no answer").heat_is_old) == (20.0, True)
    assert progress.last_known == "; nozzle 210 °C, bed 60 °C as last known, 20 s before"
    assert (progress.at(second, "").heat_age_s, progress.at(second, "").heat_is_old) == (0.0, False)
