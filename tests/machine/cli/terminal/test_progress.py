"""Progress of long tasks: lines in a log, one live line at a terminal."""

import threading
from pathlib import Path

import pytest

from machine import notices
from machine.cli import cli
from machine.cli.terminal import keys
from machine.notices import PLAIN_AGAIN_S, PLAIN_EVERY_S, PlainLines
from mdp.kernels import threads
from mdp.save import stl
from tests.machine.person import Person
from tests.machine.running_workbench import QUICK
from tests.shapes import tee


def test_a_log_hears_of_what_changes_every_five_seconds_and_of_what_does_not_once_a_minute(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    said = [(1.0, "a"), (PLAIN_EVERY_S, "a"), (3 * PLAIN_EVERY_S, "a"), (4 * PLAIN_EVERY_S, "b"), (2 * PLAIN_AGAIN_S, "b")]
    clock = iter([0.0, *(now for now, _ in said)])
    monkeypatch.setattr(notices, "monotonic", lambda: next(clock))
    lines = PlainLines()
    for _, text in said:
        lines.show(text)
    assert capsys.readouterr().err == "a\nb\nb\n"


def test_on_a_terminal_the_current_work_is_one_live_line_that_disappears(tmp_path: Path) -> None:
    (tmp_path / "tee.stl").write_bytes(stl(tee()))
    with Person("decompose", str(tmp_path / "tee.stl"), *QUICK, "--set=search.directions=200", "--as-is") as person:
        person.see("searching parts: stage")
        person.see("part  tilt deg")
        assert person.end() == 0
    lines = 2 if "compiling the kernels" in person.raw else 1
    assert person.raw.count("\x1b[?25l") == person.raw.count("\x1b[?25h") == lines


def test_the_thread_that_draws_a_live_line_does_not_keep_work_from_being_shared_out_to_copies(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(keys, "is_terminal", lambda: True)
    alone = threading.active_count()
    with cli.progress():
        assert threading.active_count() == alone + 1
        assert threads.come_to_rest()
