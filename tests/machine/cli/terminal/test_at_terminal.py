"""The live screen: its content at a given moment."""

import io
from dataclasses import replace
from datetime import datetime
from typing import Any

import pytest
from rich.console import Console

from machine.cli.terminal.at_terminal import KEYS, render, status_line
from machine.cli.terminal.keys import MORE
from machine.link.print_state import PrintState, PrintStatus
from machine.link.protocol.events import Temperature
from machine.printing.job import Scene
from tests.machine.dryrun.test_timeline import TIMELINE

NOON = datetime(2026, 11, 21, 12, 0, 0)
MOMENT = PrintStatus(
    sent=14, acknowledged=12, total=14, elapsed_s=754.0, left_s=4335.0, share=0.62,
    temperature=Temperature(209.8, 210.0, 60.1, 60.0), part=1, parts=2, layer=1, file_line=13,
)  # fmt: skip


def lines(progress: PrintStatus, words: tuple[str, ...] = (), hint: str = "", keys: bool = True, width: int = 100) -> list[str]:
    """The screen as plain lines without trailing spaces."""
    console = Console(file=io.StringIO(), record=True, width=width, force_terminal=True, no_color=True)
    at = replace(progress, layers=TIMELINE.layers(progress.part), at=TIMELINE.at(progress.file_line))
    scene = Scene("tree.gcode to /dev/ttyACM0", None)  # type: ignore[arg-type]
    scene.messages.last.extend(words)
    console.print(render(scene, at, hint, keys, NOON))
    return [line.rstrip() for line in console.export_text().splitlines()]


def test_a_moment_of_a_print_is_drawn_whole() -> None:
    head, position, heat, bar, times, keys = lines(MOMENT)
    assert head.split() == ["tree.gcode", "to", "/dev/ttyACM0", "printing"]
    assert position == "part 1 of 2   layer 1 of 2   tilt A 0.0 deg   turn C 0.0 deg"
    assert heat == "nozzle 209.8 / 210 °C   bed 60.1 / 60 °C   feed 100 %   flow 100 %"
    assert bar.endswith(" 62 %")
    assert bar.count("━") == pytest.approx(0.62 * 95, abs=1.0)
    assert times == "12m 34s so far   1h 12m 15s left   done at 13:12   line 12 of 14"
    assert keys == KEYS


def test_the_pose_is_that_of_the_acknowledged_line() -> None:
    turned = replace(MOMENT, part=2, layer=None, file_line=16)
    assert lines(turned)[1] == "part 2 of 2   tilt A 30.0 deg   turn C 120.0 deg"


def test_unknown_values_are_omitted() -> None:
    unknown = PrintStatus(elapsed_s=0.0)
    _, position, heat, bar, times, _ = lines(unknown)
    assert (position, heat, times) == ("starting", "feed 100 %   flow 100 %", "0s so far")
    assert "%" not in bar


@pytest.mark.parametrize("old", [{"heat_age_s": 40.0}, {"heat_age_s": 2.0, "state": "reconnecting"}])
def test_temperatures_that_may_be_true_no_more_are_marked_with_their_age(old: dict[str, Any]) -> None:
    moment = replace(MOMENT, **old)
    mark = f"as last known {old['heat_age_s']:.0f} s ago"
    assert lines(moment)[2].startswith(f"{mark}:   nozzle 209.8 / 210 °C   bed 60.1 / 60 °C")
    assert f"nozzle 210 °C, bed 60 °C {mark}, " in status_line(moment)
    for fresh in (replace(MOMENT, heat_age_s=14.0), replace(moment, temperature=Temperature())):
        assert not any("as last known" in line for line in (*lines(fresh), status_line(fresh)))


def test_an_end_time_on_another_day_includes_the_day() -> None:
    assert "done at Sun 22 Nov 04:00" in lines(replace(MOMENT, left_s=16 * 3600.0))[4]


def test_the_printer_s_messages_are_at_the_bottom_and_a_question_replaces_the_keys() -> None:
    drawn_lines = lines(MOMENT, ("echo one", "two"), "cancel?")
    assert drawn_lines[5:] == ["  echo one", "  two", "cancel?"]


def test_a_warning_is_above_the_printer_s_messages() -> None:
    shown = lines(replace(MOMENT, warning="this print can no longer be resumed"), ("hello",))
    assert [line.strip() for line in shown[5:7]] == ["this print can no longer be resumed", "hello"]


def test_words_of_the_printer_command_no_terminal() -> None:
    assert lines(MOMENT, ("\x1b]0;owned\x07\x1b[2J", "\x9b31m"))[5:7] == [r"  \x1b]0;owned\x07\x1b[2J", r"  \x9b31m"]


def test_without_a_keyboard_no_keys_are_offered() -> None:
    assert KEYS not in lines(MOMENT, keys=False)


@pytest.mark.parametrize("width", [20, 40, 80])
def test_a_narrow_terminal_gets_one_line_each(width: int) -> None:
    got = lines(replace(MOMENT, state="reconnecting"), ("a word",), width=width)
    assert all(len(line) <= width for line in got)
    assert len(got) <= 7 + len(KEYS) // width


def test_a_long_word_of_the_printer_is_wrapped_and_cut() -> None:
    got = lines(MOMENT, ("x" * 300,), width=80)
    assert sum(line.count("x") for line in got[5:-1]) == 200
    assert len(got) == 9


def test_the_explanation_of_q_fits_on_two_lines() -> None:
    assert len(lines(MOMENT, hint=MORE, width=80)) <= 7


def test_a_print_that_is_being_cancelled_shows_no_time_left() -> None:
    moment = PrintStatus(PrintState.CANCELLING, temperature=Temperature(210.0, 0.0, 60.0, 0.0), left_s=None, share=0.5)
    assert status_line(moment) == "cancelling"
    assert status_line(replace(moment, message="the printer is waited for")) == "cancelling; the printer is waited for"
    assert not any("as last known 0 s" in line for line in lines(moment))
