"""The finding for a line that is too slow, compared with the planner of the simulated printer."""

from math import cos, sin

import pytest

from machine.cli.cli import main
from machine.dryrun.dryrun import dry_run
from machine.dryrun.starvation import feeding, find_starvation
from machine.link.stream import print_lines
from machine.printing.destination import SerialPort, parse_destination
from machine.simulator.board import BuildOptions
from machine.simulator.record import Record
from profiles.profile import load
from tests.machine.virtual_printer import PATH, VirtualPrinter

PROFILE = load()
MACHINE = PROFILE.machine
HEAD = ["G21", "G90", "M83", "G28", "M104 S200", "M109 S200", "G92 E0", ";PART:1 of 1", ";LAYER_CHANGE"]


def circles(segment_mm: float, feed: int, count: int) -> tuple[str, ...]:
    """Short strokes along a circle of 20 mm."""
    places = [(120 + 20 * cos(k * segment_mm / 20), 120 + 20 * sin(k * segment_mm / 20)) for k in range(count + 1)]
    way = [f"G1 X{x:.4f} Y{y:.4f} E0.00{400 + k}" for k, (x, y) in enumerate(places)]
    return (*HEAD, "G1 X100 Y100 Z50 F6000", f"G1 X140 Y120 F{feed}", *way, "M104 S0")


def printed(lines: tuple[str, ...], baud: int) -> Record:
    printer = VirtualPrinter(MACHINE, BuildOptions(rx_ring=128, home_start=False), baud=baud)
    print_lines(lines, PATH, baud, medium=printer.medium)
    return printer.record


@pytest.mark.parametrize(("segment_mm", "feed", "baud", "dry"), [
    (0.1, 3600, 19200, True), (0.1, 1200, 19200, True), (0.05, 3600, 19200, True), (0.1, 3600, 115200, False),
    (0.5, 3600, 57600, False), (1.0, 9000, 250000, False)])  # fmt: skip
def test_the_printer_runs_dry_as_often_as_predicted(segment_mm: float, feed: int, baud: int, dry: bool) -> None:
    lines = circles(segment_mm, feed, 400)
    ((slowed, stopped), _), record = feeding(dry_run(lines, PROFILE).program, lines, MACHINE, baud), printed(lines, baud)
    assert (record.underruns > 30) == dry
    assert int(stopped.sum()) == pytest.approx(record.underruns, rel=0.1, abs=1)
    assert int(slowed.sum()) == pytest.approx(record.slowed, rel=0.12, abs=2)


def test_lines_with_no_transfer_time_do_not_slow_the_moves() -> None:
    lines = circles(0.5, 3600, 400)
    run = dry_run(lines, PROFILE)
    assert feeding(run.program, lines, MACHINE, 1e12)[1] == pytest.approx(run.time_s, rel=0.03)


def test_scenario_35_starvation_is_predicted_with_part_layer_line_and_count() -> None:
    lines = circles(0.1, 3600, 400)
    (found,) = (f for f in find_starvation(dry_run(lines, PROFILE), lines, MACHINE, 115200).findings if f.code == "starvation")
    assert (found.severity, found.part, found.layer) == ("warning", 1, 1)
    assert lines[found.line - 1].startswith("G1 X")
    assert "at 115200 baud" in found.message
    assert "600 lines/s are needed" in found.message


@pytest.mark.parametrize(("segment_mm", "baud"), [(0.5, 115200), (0.1, 1_000_000)])
def test_a_line_that_is_fast_enough_is_not_blamed(segment_mm: float, baud: int) -> None:
    lines = circles(segment_mm, 3600, 400)
    assert not [f for f in find_starvation(dry_run(lines, PROFILE), lines, MACHINE, baud).findings if f.code == "starvation"]


def test_lines_of_other_commands_take_their_time_on_the_line_too() -> None:
    lines = circles(0.5, 3600, 100)
    talkative = tuple(text for line in lines for text in ([line, "M117 " + "x" * 70] if line.startswith("G1 X") else [line]))
    quiet, loud = (feeding(dry_run(text, PROFILE).program, text, MACHINE, 57600)[0][0].sum() for text in (lines, talkative))
    assert loud > 2 * quiet


@pytest.mark.parametrize("lines", [("G21",), ("M104 S0", "G28"), (";nothing", "G4 P1")])
def test_a_program_without_moves_starves_nothing(lines: tuple[str, ...]) -> None:
    assert find_starvation(dry_run(lines, PROFILE), lines, MACHINE, 9600).findings == dry_run(lines, PROFILE).findings


@pytest.mark.parametrize(("port", "slow"), [
    ("/dev/ttyUSB0", True), ("/dev/ttyS3", True), ("COM4", True), ("/dev/ttyACM0", False), ("/dev/pts/7", False), ("sim", False),
    ("socket://printer:5000", False)])  # fmt: skip
def test_print_looks_at_the_line_s_speed_where_the_baud_rate_means_something(port: str, slow: bool) -> None:
    at = parse_destination(port)
    assert (isinstance(at, SerialPort) and at.is_rate_limited) == slow


def test_simulate_takes_a_baud_rate(tmp_path, capsys: pytest.CaptureFixture[str]) -> None:  # type: ignore[no-untyped-def]
    (tmp_path / "a.gcode").write_text("\n".join(circles(0.1, 3600, 400)))
    main(["simulate", str(tmp_path / "a.gcode"), "--baud", "115200"])
    assert "warning: at 115200 baud" in capsys.readouterr().out
    assert main(["simulate", str(tmp_path / "a.gcode"), "--baud", "12"]) == 1
    assert (
        capsys.readouterr().err
        == "tiltprint: baud rate 12 is not possible: 1200 to 4000000 is allowed, printers use 115200 or 250000\n"
    )
