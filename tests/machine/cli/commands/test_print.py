"""`tiltprint print` from the user's side: screen and keys at a terminal, plain lines elsewhere, and the log."""

import os
import re
import signal
import subprocess
import sys
from pathlib import Path

import pytest

from machine.cli.cli import main
from machine.cli.terminal.keys import SURE
from machine.simulator.simulator import SimulatedPrinter
from profiles.profile import load
from tests.machine.person import HASTY, ROOT, Person

MACHINE = load().machine
HEAT = ["G21", "G90", "M83", "G28", "G92 A0 C0", "M140 S60", "M104 S210", "M109 S210", "G0 Z0.2 F600"]
OFF = ["M104 S0", "M140 S0"]


@pytest.fixture
def hours(tmp_path: Path) -> str:
    """A file of ten hours of separate, slow strokes: even at 240 times real time it does not end during a test."""
    places = [(25 * (k // 250), 0.4 * (k % 250)) for k in range(2000)]
    strokes = [f"G0 X{x} Y{y:.1f}\nG1 X{x + 20} E1.0 F60" for x, y in places]
    file = tmp_path / "hours.gcode"
    file.write_text("\n".join([*HEAT, ";PART:1 of 1", ";LAYER_CHANGE", *strokes, *OFF]) + "\n")
    return str(file)


def print_of(file: str, *options: str) -> list[str]:
    return ["print", file, "--port", "sim", "--sim-speed", "240", "--force", *options]


@pytest.mark.slow
def test_a_print_is_watched_paused_resumed_and_cancelled_by_keys(hours: str) -> None:
    with Person(*print_of(hours)) as person:
        person.see("so far")
        while_printing = person.settings()
        person.see("part 1 of 1   layer 1 of 1")
        person.press("+")
        person.see("feed 110 %")
        person.press("p")
        person.see("paused")
        person.press(" ")
        person.see("printing")
        person.press("c")
        person.see(SURE)
        person.press("y")
        person.see("tiltprint: the print was cancelled after")
        assert person.end() == 130
    assert "heaters off" in person.seen
    assert not int(str(while_printing[3])) & 2  # without ICANON, keys arrive as they are pressed
    assert person.raw.count("\x1b[?25l") == person.raw.count("\x1b[?25h") >= 1


@pytest.mark.slow
def test_ctrl_c_at_the_screen_ends_safely_and_gives_the_terminal_back(hours: str) -> None:
    with Person(*print_of(hours)) as person:
        before = person.settings()
        person.see("so far")
        person.see("layer 1 of 1")
        during = person.settings()
        person.press("\x03")
        person.see("heaters off")
        after = person.settings()
        assert person.end() == 130
    assert during != before
    assert after == before


@pytest.mark.slow
def test_the_emergency_key_stops_the_machine_and_the_log_is_named(hours: str) -> None:
    with Person(*print_of(hours)) as person:
        person.see("layer 1 of 1")
        person.press("ee")
        person.see("all that was sent and received is in ")
        person.see("tiltprint: emergency stop: the printer has halted")
        assert person.end() == 1
    log = Path(re.findall(r"received is in (\S+)", person.seen)[-1])
    assert re.search(r"> M112\n.*< .*Printer halted", log.read_text(), re.DOTALL)


@pytest.mark.slow
def test_a_closed_terminal_ends_the_print_with_heaters_off(hours: str, tmp_path: Path) -> None:
    log = tmp_path / "traffic.log"
    with Person(*print_of(hours, "--log", str(log))) as person:
        person.see("layer 1 of 1")
        assert person.hang_up() == 130
    assert re.search(r"> M104 S0\n(.*\n)*.*< ok T:[\d.]+ /0\.00 ", log.read_text())


@pytest.mark.slow
def test_a_stopped_print_names_the_journal_to_go_on_with(hours: str, tmp_path: Path) -> None:
    journal = tmp_path / "journal"
    with (
        SimulatedPrinter(MACHINE, speed=240.0) as printer,
        Person("print", hours, "--port", printer.path, "--force", "--journal", str(journal)) as person,
    ):
        person.see("layer 1 of 1")
        person.press("\x03")
        person.see(f"tiltprint resume {journal} continues it")
        assert person.end() == 130


@pytest.mark.slow
def test_a_dumb_terminal_gets_plain_lines_and_no_keys(tmp_path: Path) -> None:
    file = tmp_path / "short.gcode"
    file.write_text("\n".join([*HEAT, *OFF]) + "\n")
    with Person(*print_of(str(file), "--sim-speed", "0"), term="dumb") as person:
        assert person.end() == 0
    assert "\x1b" not in person.raw


@pytest.mark.slow
def test_without_a_terminal_progress_is_reported_in_plain_lines(hours: str) -> None:
    command = [sys.executable, "-c", HASTY, *print_of(hours)]
    process = subprocess.Popen(command, stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.PIPE, cwd=ROOT)
    assert process.stderr is not None
    line = next(line for line in process.stderr if line.startswith(b"printing:") and b"nozzle" in line)
    os.kill(process.pid, signal.SIGHUP)
    assert process.wait(60) == 130
    process.communicate()
    assert re.fullmatch(r"printing: \d+ %, (part 1 of 1, layer 1, )?nozzle \d+ °C, bed \d+ °C, .* left\n", line.decode())


def test_the_log_is_written_to_the_requested_path(tmp_path: Path) -> None:
    file, log = tmp_path / "short.gcode", tmp_path / "traffic.log"
    file.write_text("\n".join([*HEAT, *OFF]) + "\n")
    with SimulatedPrinter(MACHINE) as printer:
        assert main(["print", str(file), "--port", printer.path, "--log", str(log), "--force"]) == 0
    text = log.read_text()
    assert text.splitlines()[0].endswith(f"short.gcode to {printer.path}")
    assert re.search(r"> N\d+ M109 S210\*\d+\n", text)


def test_a_line_the_printer_rejected_is_reported_with_the_log_s_path(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    file, log = tmp_path / "odd.gcode", tmp_path / "traffic.log"
    file.write_text("\n".join([*HEAT, "M9876", *OFF]) + "\n")
    with SimulatedPrinter(MACHINE) as printer:
        assert main(["print", str(file), "--port", printer.path, "--log", str(log), "--force"]) == 0
    assert capsys.readouterr().err.splitlines()[-2:] == [
        "the printer said: Unknown command: M9876",
        f"all that was sent and received is in {log}",
    ]


def test_a_log_that_cannot_be_written_is_refused_before_the_print(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["print", "demo:tree", "--port", "sim", "--log", str(tmp_path / "nowhere" / "a.log")]) == 1
    assert "the folder" in capsys.readouterr().err
