"""Print history: what the list of past prints has of prints that ended, failed, were killed or go on."""

import json
import os
from collections.abc import Callable
from pathlib import Path

import pytest

from machine.dryrun.dryrun import dry_run
from machine.link.print_state import PrintState
from machine.pipeline.programs import LoadedProgram
from machine.printing import history
from machine.printing.history import FILE, MOST_BYTES, MOST_PRINTS, past_prints, recorded
from machine.printing.job import CANCELLED, DONE, NOT_BEGUN, End
from machine.program import Program
from profiles.errors import PrinterError
from profiles.folders import state_folder
from profiles.profile import load

LINES = ("G21", "G90", "M83", "G1 X1 E1500 F600", "G1 X2 E500")
NO_PID = 2**22 + 1  # above the largest number of a process on Linux


@pytest.fixture(autouse=True)
def times(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> list[float]:
    """The times that are told, one after the other."""
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path))
    told = [1000.0, 1090.0, 2000.0, 2005.0, 3000.0, 3001.0]
    monkeypatch.setattr(history, "time", lambda: told.pop(0))
    return told


def file() -> Path:
    return state_folder() / FILE


def printed(name: str, act: Callable[[], End]) -> End:
    return recorded(LoadedProgram(name, Program(LINES, dry_run(LINES, load()), None), load()), "sim", act)


def test_prints_are_listed_with_outcome_duration_and_filament_the_newest_first() -> None:
    assert printed("vase", lambda: DONE) is DONE
    assert printed("bracket", lambda: CANCELLED) is CANCELLED
    assert printed("unwanted", lambda: NOT_BEGUN) is NOT_BEGUN
    assert past_prints() == [
        {"name": "bracket", "port": "sim", "outcome": "cancelled", "begun": 2000.0, "seconds": 5.0, "filament_m": None},
        {"name": "vase", "port": "sim", "outcome": "done", "begun": 1000.0, "seconds": 90.0, "filament_m": 2.0},
    ]


def test_a_print_that_fails_with_an_error_is_listed_as_failed() -> None:
    def act() -> End:
        raise PrinterError("the heater is off")

    with pytest.raises(PrinterError):
        printed("vase", act)
    assert [(past["outcome"], past["seconds"]) for past in past_prints()] == [("failed", 90.0)]


def test_a_print_that_goes_on_is_not_listed_and_one_that_was_killed_has_failed() -> None:
    def act() -> End:
        assert past_prints() == []
        return End(PrintState.LEFT)

    printed("vase", act)
    file().write_text(json.dumps({"key": "a", "pid": NO_PID, "name": "killed", "port": "sim", "begun": 1.0}) + "\n")
    assert [(past["name"], past["outcome"], past["seconds"]) for past in past_prints()] == [("killed", "failed", None)]


def test_damaged_lines_are_left_out_and_a_large_file_keeps_the_newest_prints() -> None:
    ended = {"pid": os.getpid(), "name": "old", "port": "sim", "begun": 1.0, "ended": 2.0, "outcome": "done"}
    damaged = ['{"key": ', "[]", '{"key": 1}', '{"key": "b"}', '{"key": "c", "name": "x", "port": "", "begun": "a", "ended": 1}']
    many = MOST_BYTES // 100
    file().write_text("\n".join([*damaged, *(json.dumps({"key": f"{k}", **ended}) for k in range(many))]) + "\n")
    assert len(past_prints()) == MOST_PRINTS
    printed("new", lambda: DONE)
    assert file().stat().st_size < MOST_BYTES
    assert [past["name"] for past in past_prints()][:2] == ["new", "old"]


def test_a_print_is_not_held_up_where_nothing_can_be_written(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setattr(history, "state_folder", lambda: tmp_path / "missing")
    assert printed("vase", lambda: DONE) is DONE
    assert past_prints() == []
