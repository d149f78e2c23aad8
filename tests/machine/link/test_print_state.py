"""The states of a print: which may follow which, and what a page is told of a moment."""

import json

import pytest

from machine.link.print_state import OVER, TABLE, PrintState, PrintStatus, follows
from machine.link.protocol.events import Temperature


def test_every_state_has_a_row_and_can_be_reached_from_the_first() -> None:
    assert set(TABLE) == set(PrintState)
    reached, new = set[PrintState](), {PrintState.CHECKING}
    while new:
        reached |= new
        new = {after for state in new for after in TABLE[state]} - reached
    assert reached == set(PrintState)


@pytest.mark.parametrize("state", sorted(PrintState))
def test_what_is_over_stays_over_but_for_a_print_that_its_server_goes_on_with(state: PrintState) -> None:
    assert follows(state, state)
    assert [after for after in PrintState if state in OVER and after is not state and follows(state, after)] == (
        [PrintState.CANCELLING] if state is PrintState.LEFT else []
    )
    if state is not PrintState.OFFLINE and state not in OVER:
        assert any(follows(state, end) for end in (PrintState.FAILED, PrintState.CANCELLED))


def test_a_moment_is_told_to_a_page_as_it_is() -> None:
    status = PrintStatus(PrintState.PAUSED, 2.0, Temperature(210.0, 215.0), file_line=7, at={"X": 1.0}, heat_age_s=20.0)
    page = json.loads(json.dumps(status.json()))
    assert (page["state"], page["file_line"], page["at"], page["nozzle_c"]) == ("paused", 7, {"X": 1.0}, 210.0)
    assert page["heat_is_old"]
    assert "temperature" not in page
