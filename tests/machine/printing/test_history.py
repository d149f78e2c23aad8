"""Print history: the entries of prints that ended, failed, were killed or are still running."""

import json
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import pytest

from machine.dryrun.dryrun import dry_run
from machine.link.print_state import PrintState
from machine.pipeline.programs import LoadedProgram
from machine.printing import history
from machine.printing.history import FOLDER, MOST_PRINTS, Reach, past_prints, recorded
from machine.printing.job import DONE, NOT_BEGUN, End
from machine.program import Program
from profiles.errors import PrinterError
from profiles.files import lock
from profiles.folders import state_folder
from profiles.profile import load

LINES = ("G21", "G90", "M83", "G1 X1 E1500 F600", "G1 X2 E500")


@pytest.fixture(autouse=True)
def times(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> list[float]:
    """The times that the clock returns, one after the other."""
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path))
    told = [1000.0, 1090.0, 2000.0, 2005.0, 3000.0, 3001.0]
    monkeypatch.setattr(history, "time", lambda: told.pop(0))
    return told


def folder() -> Path:
    return state_folder() / FOLDER


def printed(name: str, act: Callable[[], End]) -> End:
    return printed_to(name, lambda reach: act())


def printed_to(name: str, act: Callable[[Reach], End]) -> End:
    return recorded(LoadedProgram(name, Program(LINES, dry_run(LINES, load()), None), load()), "sim", act)


def test_prints_are_listed_with_outcome_duration_and_filament_the_newest_first() -> None:
    assert printed("vase", lambda: DONE) is DONE
    cancelled = End(PrintState.CANCELLED)
    assert printed("bracket", lambda: cancelled) is cancelled
    assert printed("unwanted", lambda: NOT_BEGUN) is NOT_BEGUN
    assert past_prints() == [
        {"name": "bracket", "port": "sim", "outcome": "cancelled", "begun": 2000.0, "seconds": 5.0, "filament_m": 0.0},
        {"name": "vase", "port": "sim", "outcome": "done", "begun": 1000.0, "seconds": 90.0, "filament_m": 2.0},
    ]


@pytest.mark.parametrize(("first", "last", "filament_m"), [(1, 3, 0.0), (1, 4, 1.5), (1, 5, 2.0), (5, 5, 0.5)])
def test_a_stopped_print_is_listed_with_the_filament_of_the_lines_that_were_printed(
    first: int, last: int, filament_m: float
) -> None:
    def act(reach: Reach) -> End:
        reach(first, last)
        raise PrinterError("the heater is off")

    with pytest.raises(PrinterError):
        printed_to("vase", act)
    assert [past["filament_m"] for past in past_prints()] == [filament_m]


def test_a_resumed_print_is_listed_with_the_filament_of_its_rest() -> None:
    def act(reach: Reach) -> End:
        reach(5, 5)
        return DONE

    printed_to("vase", act)
    assert [past["filament_m"] for past in past_prints()] == [0.5]


def test_a_print_that_fails_with_an_error_is_listed_as_failed() -> None:
    def act() -> End:
        raise PrinterError("the heater is off")

    with pytest.raises(PrinterError):
        printed("vase", act)
    assert [(past["outcome"], past["seconds"]) for past in past_prints()] == [("failed", 90.0)]


def test_a_running_print_is_not_listed_and_a_killed_one_has_failed() -> None:
    def act() -> End:
        assert past_prints() == []
        return End(PrintState.LEFT)

    printed("vase", act)
    (file,) = folder().iterdir()
    file.write_text(json.dumps({"name": "killed", "port": "sim", "begun": 1.0}) + "\n")
    assert [(past["name"], past["outcome"], past["seconds"]) for past in past_prints()] == [("killed", "failed", None)]


def test_a_reader_that_holds_the_file_for_a_moment_does_not_leave_it_unlocked(monkeypatch: pytest.MonkeyPatch) -> None:
    held = [True, True]
    monkeypatch.setattr(history, "lock", lambda descriptor: not held.pop() if held else lock(descriptor))

    def act() -> End:
        (file,) = folder().iterdir()
        with file.open("rb") as other:
            assert not lock(other.fileno(), shared=True)
        return DONE

    assert printed("vase", act) is DONE


def test_a_print_of_another_process_runs_until_that_ends(tmp_path: Path) -> None:
    program = """
from machine.link.print_state import PrintState
from machine.printing import history
file = history._new_file()
history._write(file, {"name": "vase", "port": "sim", "begun": 1.0})
print(flush=True)
input()
"""
    with subprocess.Popen([sys.executable, "-c", program], stdin=subprocess.PIPE, stdout=subprocess.PIPE) as process:
        assert process.stdout is not None
        process.stdout.readline()
        assert past_prints() == []
        process.kill()
    assert [past["outcome"] for past in past_prints()] == ["failed"]


def test_damaged_files_are_ignored_and_the_newest_and_running_prints_are_kept() -> None:
    printed("new", lambda: DONE)
    ended = json.dumps({"name": "old", "port": "sim", "begun": 1.0, "ended": 2.0, "outcome": "done"})
    for number in range(MOST_PRINTS + 9):
        (folder() / f"1999-{number:03}.json").write_text(ended)
    with (folder() / "1999-000.json").open("ab") as goes_on:
        lock(goes_on.fileno())
        printed("newer", lambda: DONE)
        assert (folder() / "1999-000.json").exists()
    for number, text in enumerate(['{"name": ', "[]", "1", '{"name": "x", "port": "", "begun": "a", "ended": 1}', "\0"]):
        (folder() / f"2000-{number}.json").write_text(text)
    assert [past["name"] for past in past_prints()] == ["newer", "new", *["old"] * (MOST_PRINTS - 1)]


def test_a_declined_print_takes_no_place_in_the_history() -> None:
    printed("unwanted", lambda: NOT_BEGUN)
    assert list(folder().iterdir()) == []


def test_a_print_is_not_held_up_where_nothing_can_be_written(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setattr(history, "state_folder", lambda: tmp_path / "missing")
    assert printed("vase", lambda: DONE) is DONE
    assert past_prints() == []
