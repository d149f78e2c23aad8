"""The states of a print, their permitted transitions, and the status that a page receives."""

import ast
import json
import re
from pathlib import Path

import pytest

from machine.link import print_state
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
def test_a_print_can_end_from_every_state_and_stays_over(state: PrintState) -> None:
    """States that follow each other quickly are merged into one report, so any end may follow the first state."""
    assert follows(state, state)
    if state not in OVER:
        assert all(follows(state, end) for end in OVER)
    else:
        assert TABLE[state] == ({PrintState.CANCELLING} if state is PrintState.LEFT else set())


def test_a_status_is_sent_to_a_page_unchanged() -> None:
    status = PrintStatus(PrintState.PAUSED, 2.0, Temperature(210.0, 215.0), file_line=7, at={"X": 1.0}, heat_age_s=20.0)
    page = json.loads(json.dumps(status.json()))
    assert (page["state"], page["file_line"], page["at"], page["nozzle_c"]) == ("paused", 7, {"X": 1.0}, 210.0)
    assert (page["is_printing"], page["is_away"], page["is_over"]) == (True, True, False)
    assert page["heat_is_old"]
    assert "temperature" not in page


MACHINE = Path(print_state.__file__).parents[1]
WORDS = {state.value for state in PrintState}


def test_no_script_lists_states_of_a_print() -> None:
    lists = {
        (script.name, array)
        for script in MACHINE.rglob("*.js")
        for array in re.findall(r"\[[^][]*\]", script.read_text("utf-8"))
        if len(WORDS & set(re.findall(r"\"([a-z ]+)\"", array))) > 1
    }
    assert lists == set()


def test_the_states_in_which_a_print_is_over_are_listed_in_one_place() -> None:
    def states(items: list[ast.expr]) -> set[str]:
        names = {item.attr.lower() for item in items if isinstance(item, ast.Attribute)}
        return {*names, *(str(item.value) for item in items if isinstance(item, ast.Constant))} & OVER

    places = {
        file.name
        for file in MACHINE.rglob("*.py")
        for node in ast.walk(ast.parse(file.read_text("utf-8")))
        if isinstance(node, ast.List | ast.Tuple | ast.Set) and len(states(node.elts)) > len(OVER) // 2
    }
    assert places == {"print_state.py"}


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
