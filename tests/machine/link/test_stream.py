import errno
import os
import pty
import signal
import threading
import tty
from collections.abc import Callable, Iterator
from dataclasses import replace
from itertools import count
from pathlib import Path

import numpy as np
import pytest

from machine.gcode.reader.parse import parse_gcode
from machine.link.medium import SERIAL
from machine.link.pending_commands import Control
from machine.link.port import open_port, refusal
from machine.link.print_state import PrintStatus
from machine.link.protocol.timeout import Timing
from machine.link.stream import Outcome, print_lines
from machine.simulator.board import BuildOptions
from machine.simulator.faults import Fault
from machine.simulator.record import Record
from machine.simulator.simulator import SimulatedPrinter
from profiles.errors import FirmwareError, LocalProtocolError, PortError, PrinterError, SilenceError
from profiles.profile import load
from tests.machine.peers import PATIENCE_S, happened
from tests.machine.virtual_printer import HEALED, PATH, VirtualPrinter, random_script

MACHINE = load().machine
QUICK = replace(SERIAL, timing=Timing(stall_s=0.25, stall_mute_s=0.25, sync_s=1.0, drain_s=0.05, quiet_s=0.03))
# Without faults no query is repeated, however slow a busy machine is.
PATIENT = replace(
    SERIAL, timing=Timing(stall_s=PATIENCE_S, stall_mute_s=PATIENCE_S, sync_s=PATIENCE_S, drain_s=0.05, quiet_s=0.03)
)
PLAIN = BuildOptions(advanced_ok=False)
HEAT = ["M140 S60", "M104 S200", "M109 S200"]
OFF = ["M104 S0", "M140 S0"]


def strokes(n: int) -> list[str]:
    """n different moves, each with its own amount of filament."""
    return ["M83"] + [f"G1 X{1 + i % 90}.{i:05d} Y{i % 70}.5 E0.{1 + i:05d} F3000" for i in range(n)]


def expected(lines: list[str]) -> np.ndarray:
    """X, Y and extruded filament of the moves of a program of strokes()."""
    rows = [[float(word[1:]) for word in line.split()[1:4]] for line in lines if line.startswith("G1 X")]
    return np.array(rows).reshape(-1, 3)


def done(record: Record) -> np.ndarray:
    return np.column_stack([record.end[:, 0], record.end[:, 1], record.end[:, 5] - record.start[:, 5]])


def assert_executed(record: Record, lines: list[str], whole: bool = True) -> None:
    """The moves of the program, all of them or a beginning, happened exactly once and in order."""
    got, wanted = done(record), expected(lines)
    assert len(got) == len(wanted) if whole else len(got) <= len(wanted)
    assert np.abs(got - wanted[: len(got)]).max(initial=0.0) < 1e-6


def run(lines: list[str], faults: tuple[Fault, ...] = (), build: BuildOptions | None = None) -> tuple[Outcome, Record]:
    with SimulatedPrinter(MACHINE, build=build, faults=faults) as printer:
        return print_lines(lines, printer.path, 250000, medium=QUICK if faults else PATIENT), printer.record


@pytest.mark.parametrize("build", [BuildOptions(), PLAIN, BuildOptions(emergency_parser=False, autoreport=False, busy=False)])
def test_two_thousand_lines_arrive_once_and_in_order(build: BuildOptions) -> None:
    lines = HEAT + strokes(2000) + OFF
    outcome, record = run(lines, build=build)
    assert_executed(record, lines)
    assert (outcome.cancelled, outcome.sent, outcome.acknowledged, outcome.repeated) == (False, 2006, 2006, 0)
    assert (record.nozzle_target_c, record.unknown) == (0.0, 0)
    assert outcome.firmware.startswith("Marlin")


def test_comments_and_blank_lines_are_never_sent() -> None:
    outcome, record = run(["; a", "", "  ", "G21 ; mm", "\n"])
    assert outcome.sent == 1
    assert record.lines == 1 + len(["M110", "M115", "M105", "M155 S2", "M155 S0", "M400", "M105"])


def test_the_end_of_a_print_is_the_end_of_its_moves() -> None:
    with SimulatedPrinter(MACHINE, speed=50.0) as printer:
        print_lines(["G1 X60 F600"], printer.path, 250000, medium=PATIENT)
        record = printer.record
        assert record.begin_s[-1] + record.duration_s[-1] <= printer._firmware.board.now_s


def test_progress_reports_counts_temperatures_part_layer_and_time_left() -> None:
    shown: list[PrintStatus] = []
    body = [";PART:1 of 2", ";LAYER_CHANGE", "G1 X1", ";PART:2 of 2", ";LAYER_CHANGE", ";LAYER_CHANGE", "M73 P50 R3", "G1 X2"]
    with SimulatedPrinter(MACHINE) as printer:
        print_lines(HEAT + body, printer.path, 250000, on_progress=shown.append, medium=PATIENT)
    last = shown[-1]
    assert (last.sent, last.acknowledged, last.total) == (6, 6, 6)
    assert (last.part, last.parts, last.layer, last.share) == (2, 2, 2, 0.5)
    assert last.left_s == pytest.approx(180.0, abs=60.0)
    assert last.temperature.nozzle_c == pytest.approx(200.0, abs=1.5)
    assert last.temperature.bed_target_c == 60.0


COMMENTED = {
    "Cura": [";LAYER_COUNT:2", ";LAYER:0", "G1 X1 E1", ";LAYER:1", "G1 X2 E1"],
    "PrusaSlicer": [";LAYER_CHANGE", ";Z:0.2", "G1 X1 E1", ";LAYER_CHANGE", "G1 X2 E1"],
    "with blanks": ["; PART:2 of 3", " ;LAYER_CHANGE", "G1 X1 E1 ;LAYER:7", "G1 X2 E1"],
}


@pytest.mark.parametrize("slicer", COMMENTED)
def test_the_sender_and_the_dry_run_report_the_same_layer_and_part(slicer: str) -> None:
    shown: list[PrintStatus] = []
    with SimulatedPrinter(MACHINE) as printer:
        print_lines(HEAT + COMMENTED[slicer], printer.path, 250000, on_progress=shown.append, medium=PATIENT)
    parsed = parse_gcode(COMMENTED[slicer], MACHINE)
    assert (shown[-1].layer, shown[-1].part or 0) == (2, parsed.part[-1]) == (parsed.layer[-1], parsed.part[-1])


def test_m73_and_m220_count_in_lower_case_too() -> None:
    shown: list[PrintStatus] = []
    with SimulatedPrinter(MACHINE) as printer:
        print_lines([*HEAT, "m73 p50", "m220 s80"], printer.path, 250000, on_progress=shown.append, medium=PATIENT)
    assert (shown[-1].share, shown[-1].feed_percent) == (0.5, 80.0)


def test_the_total_of_an_iterator_of_lines_is_unknown() -> None:
    shown: list[PrintStatus] = []
    with SimulatedPrinter(MACHINE) as printer:
        print_lines(iter(["G21", "G90"]), printer.path, 250000, on_progress=shown.append, medium=PATIENT)
    assert (shown[-1].acknowledged, shown[-1].total) == (2, None)


def test_the_maximum_line_length_depends_on_the_machine_s_firmware() -> None:
    lines = ["G21", "M117 " + "x" * 95]
    duet = load(settings=["machine.dialect=reprapfirmware"])
    printer = VirtualPrinter(duet.machine)
    assert print_lines(lines, PATH, medium=printer.medium, profile=duet).acknowledged == 2
    for profile in (load(), None):
        with pytest.raises(LocalProtocolError, match="at most 95"):
            print_lines(lines, PATH, medium=VirtualPrinter(MACHINE).medium, profile=profile)


@pytest.mark.parametrize("bad", ["G1 X1 ö", "G1 X5 (Y2", "M117 " + "x" * 90, "G1 X1*5", "M112", "M0 wait"])
def test_a_line_that_cannot_be_sent_is_refused_before_anything_is_sent(bad: str) -> None:
    with SimulatedPrinter(MACHINE) as printer:
        with pytest.raises(LocalProtocolError, match="line 3"):
            print_lines(["G28", "G1 X1", bad], printer.path, 250000, medium=PATIENT)
        assert printer.record.lines == 0


def test_a_bad_line_of_a_stream_stops_the_print_with_heaters_off() -> None:
    with SimulatedPrinter(MACHINE) as printer:
        with pytest.raises(LocalProtocolError, match=r"line 4 .*; the printer reports its heaters off"):
            print_lines(iter([*HEAT, "M98 Pö"]), printer.path, 250000, medium=PATIENT)
        assert (printer.record.nozzle_target_c, printer.record.bed_target_c) == (0.0, 0.0)


def test_a_stream_is_consumed_only_as_fast_as_it_is_printed() -> None:
    stop, ahead = threading.Event(), []

    def lines() -> Iterator[str]:
        for i in count():
            yield f"G1 X{i % 50}"
            if i == 500:
                ahead.append(i - printer._firmware._taken)
                stop.set()

    with SimulatedPrinter(MACHINE) as printer:
        outcome = print_lines(lines(), printer.path, 250000, control=Control(stop), medium=PATIENT)
    assert outcome.cancelled
    assert ahead[0] < 20
    assert outcome.sent < 520


def _once_sent(count: int, act: Callable[[], object]) -> Callable[[PrintStatus], None]:
    """A listener to a print that acts once, as soon as this number of commands has been sent."""
    waiting = [act]

    def watch(progress: PrintStatus) -> None:
        if progress.sent >= count and waiting:
            waiting.pop()()

    return watch


@pytest.mark.parametrize("lines", [HEAT + strokes(3000), ["M109 S250"]])
def test_stopping_leaves_heaters_off_and_moves_nothing_home(lines: list[str]) -> None:
    stop = threading.Event()
    with SimulatedPrinter(MACHINE, speed=5.0) as printer:
        outcome = print_lines(
            ["M106 S255", *lines],
            printer.path,
            250000,
            on_progress=_once_sent(2, stop.set),
            control=Control(stop),
            medium=PATIENT,
        )
        record = printer.record
    assert outcome.cancelled
    assert outcome.heaters_off
    assert (record.nozzle_target_c, record.bed_target_c, record.fan) == (0.0, 0.0, 0.0)
    assert happened(record, "M410")
    assert not happened(record, "homed")


def test_without_an_emergency_parser_stopping_still_switches_the_heaters_off() -> None:
    stop = threading.Event()
    with SimulatedPrinter(MACHINE, speed=5.0, build=BuildOptions(emergency_parser=False)) as printer:
        lines = ["M104 S200", *(["G1 X5 F3000", "G1 X0"] * 999)]
        outcome = print_lines(
            lines, printer.path, 250000, on_progress=_once_sent(9, stop.set), control=Control(stop), medium=PATIENT
        )
        assert outcome.heaters_off
        assert printer.record.nozzle_target_c == 0.0


def test_ctrl_c_leaves_heaters_off_and_is_passed_on() -> None:
    with SimulatedPrinter(MACHINE, speed=5.0) as printer:
        press = _once_sent(9, lambda: signal.pthread_kill(threading.main_thread().ident or 0, signal.SIGINT))
        with pytest.raises(KeyboardInterrupt):
            print_lines(["M302 P1", "M104 S200", *strokes(3000)], printer.path, 250000, on_progress=press, medium=PATIENT)
        assert printer.record.nozzle_target_c == 0.0
        assert happened(printer.record, "nozzle 200")


def test_an_error_in_the_callers_code_leaves_the_heaters_off() -> None:
    def burst(progress: PrintStatus) -> None:
        if progress.sent > 1:
            raise ZeroDivisionError

    with SimulatedPrinter(MACHINE, speed=5.0) as printer:
        with pytest.raises(ZeroDivisionError):
            print_lines(["M302 P1", "M104 S200", *strokes(3000)], printer.path, 250000, on_progress=burst, medium=PATIENT)
        assert printer.record.nozzle_target_c == 0.0


PROGRAM = ["M104 S200", "M109 S200", *strokes(300)]


@pytest.mark.parametrize("seed", range(8))
def test_random_faults_end_in_the_exact_moves_or_in_an_error(seed: int) -> None:
    build = BuildOptions(advanced_ok=seed % 2 == 0, emergency_parser=seed % 3 > 0, busy=seed % 5 > 0)
    with SimulatedPrinter(MACHINE, build=build, faults=random_script(seed, 8, range(3, 280), HEALED, 30)) as printer:
        try:
            print_lines(PROGRAM, printer.path, 250000, medium=QUICK)
            whole = True
        except PrinterError:
            whole = False
        assert_executed(printer.record, PROGRAM, whole)


def test_a_killed_printer_ends_the_print_with_its_own_error() -> None:
    with SimulatedPrinter(MACHINE, speed=5.0) as printer:
        intruder = os.open(printer.path, os.O_WRONLY | os.O_NOCTTY)
        kill = _once_sent(9, lambda: os.write(intruder, b"\nM112\n"))
        with pytest.raises(FirmwareError, match="Printer halted"):
            print_lines(["M302 P1", "M104 S200", *strokes(3000)], printer.path, 250000, on_progress=kill, medium=PATIENT)
        os.close(intruder)
        assert printer.record.nozzle_target_c == 0.0


def test_a_printer_that_never_answers_is_given_up() -> None:
    master, slave = pty.openpty()
    tty.setraw(slave)
    hasty = replace(SERIAL, timing=Timing(stall_s=0.1, stall_mute_s=0.1, sync_s=0.1, drain_s=0.05))
    with pytest.raises(SilenceError, match="greetings"):
        print_lines(["G28"], os.ttyname(slave), 250000, medium=hasty)
    os.close(master)
    os.close(slave)


@pytest.mark.parametrize(("name", "words"), [
    ("/dev/no-such-port", "does not exist"),
    ("/dev", "is a folder"),
    (__file__, "is a file"),
    ("/dev/null", "not a working serial device"),
    ("/dev/null/x", "port /dev/null/x"),
    ("socket://localhost:1", "cannot be opened"),
    ("nonsense://x", "cannot be opened"),
])  # fmt: skip
def test_a_port_that_cannot_be_opened_gives_one_sentence(name: str, words: str) -> None:
    with pytest.raises(PortError, match=words) as caught:
        open_port(name, 115200)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize("baud", [0, -1, 10**9])
def test_an_impossible_baud_rate_is_named(baud: int) -> None:
    with pytest.raises(PortError, match=f"baud rate {baud}"):
        open_port("/dev/null", baud)


def test_a_port_without_rights_names_the_group_that_has_them(tmp_path: Path) -> None:
    sentence = refusal(str(tmp_path), 115200, PermissionError(errno.EACCES, "denied"))
    assert "belongs to group" in sentence
    assert "usermod" in sentence


def test_a_cable_pulled_out_is_one_error_for_reading_and_writing() -> None:
    master, slave = pty.openpty()
    port = open_port(os.ttyname(slave), 115200)
    os.close(slave)
    os.close(master)
    for act in (port.read, lambda: port.write(b"G28\n")):
        with pytest.raises(PortError, match="was lost"):
            act()
    port.close()
