"""Independent hosts print whole files on the simulated printer: Printrun's core, and idioms of others."""

import time
from collections.abc import Callable
from functools import cache

import numpy as np
import pytest
import serial

from machine.gcode.reader.parse import parse_gcode
from machine.gcode.reader.parsed import MoveKind
from machine.gcode.writer import write_gcode
from machine.link.protocol.framing import checksum
from machine.simulator.board import BuildOptions
from machine.simulator.faults import Fault, FaultScript
from machine.simulator.record import Record
from machine.simulator.simulator import SimulatedPrinter
from tests.machine.firmware.test_dialects import profile
from tests.machine.hand import printed
from tests.machine.peers import PATIENCE_S

CHOSEN = profile("marlin")
PLAIN = BuildOptions(advanced_ok=False)


@cache
def lines() -> tuple[str, ...]:
    """A post and an arm: heated, tilted, retracted."""
    return tuple(write_gcode(printed()[3], CHOSEN))


def assert_printed(record: Record) -> None:
    """Check that every stroke of the file, as parsed, was printed and that the printer understood every line."""
    parsed = parse_gcode(lines(), CHOSEN.machine)
    strokes = parsed.kind == MoveKind.EXTRUDE
    laid = (record.end[:, 5] > record.start[:, 5]) & (record.start[:, :5] != record.end[:, :5]).any(axis=1)
    assert record.end[laid, :5] == pytest.approx(parsed.end[strokes], abs=1e-3)
    assert np.diff(record.end[laid, 5], prepend=0).sum() == pytest.approx(parsed.filament_mm[strokes][-1], abs=0.01)
    assert (record.unknown, record.clamped, record.nozzle_target_c, record.bed_target_c) == (0, 0, 0.0, 0.0)


def soon(what: Callable[[], object], seconds: float = PATIENCE_S) -> None:
    """Wait until a condition holds."""
    end_s = time.monotonic() + seconds
    while not what():
        assert time.monotonic() < end_s, "nothing comes of it"
        time.sleep(0.02)


def print_with_printcore(printer: SimulatedPrinter, heard: list[str] | None = None) -> Record:
    """Print as Printrun's own command line tool does; heard: receives the printer's lines."""
    core_of = pytest.importorskip("printrun.printcore", reason="pip install --no-deps printrun")
    core = core_of.printcore()
    core.recvcb = (heard if heard is not None else []).append
    core.connect(printer.path, 115200)
    try:
        soon(lambda: core.online)
        assert core.startprint(core_of.gcoder.LightGCode(list(lines())))
        # It reports the end of the print before the thread with which it continues has begun.
        soon(lambda: not (core.printing or core.print_thread) and core.send_thread and core.send_thread.is_alive())
        soon(lambda: printer.record.events[-1][1] == "motors off")
    finally:
        core.disconnect()
    return printer.record


@pytest.mark.parametrize("build", [BuildOptions(), PLAIN, BuildOptions(emergency_parser=False, autoreport=False, busy=False)])
def test_printrun_s_core_prints_a_whole_file(build: BuildOptions) -> None:
    with SimulatedPrinter(CHOSEN.machine, build=build) as printer:
        assert_printed(print_with_printcore(printer))


def test_printrun_s_core_prints_through_a_uart() -> None:
    with SimulatedPrinter(CHOSEN.machine, build=BuildOptions(rx_ring=128), baud=115200) as printer:
        record = print_with_printcore(printer)
    assert_printed(record)
    assert record.lost_bytes == 0


def test_printrun_s_core_heals_damaged_lines_as_on_a_real_printer() -> None:
    faults = FaultScript((Fault("flip", 803, value=1), Fault("drop", 1303), Fault("flip", 2103, value=0)))
    heard: list[str] = []
    with SimulatedPrinter(CHOSEN.machine, faults=faults) as printer:
        assert_printed(print_with_printcore(printer, heard))
    assert sum(line.startswith("Resend:") for line in heard) >= 3


def framed(number: int, command: str) -> bytes:
    body = f"N{number} {command}".encode()
    return b"%s*%d\n" % (body, checksum(body))


def ask(host: serial.Serial, line: bytes) -> list[bytes]:
    """Send a line and read up to its ok, as the simplest hosts do."""
    host.write(line)
    said = []
    while not said or not said[-1].startswith(b"ok"):
        said.append(host.readline())
        assert said[-1], f"no answer to {line!r}"
    return said


@pytest.mark.parametrize(("first", "number"), [
    (b"N-1 M110 N-1*125\n", 0), (b"M110 N0\n", 1), (b"N0 M110 N0*125\n", 1), (b"\nM110\n", None)])  # fmt: skip
def test_a_host_that_sends_line_by_line_prints_a_whole_file(first: bytes, number: int | None) -> None:
    with SimulatedPrinter(CHOSEN.machine) as printer, serial.Serial(printer.path, 250000, timeout=PATIENCE_S) as host:
        assert ask(host, first)[-1].startswith(b"ok")
        assert any(b"FIRMWARE_NAME:Marlin" in line for line in ask(host, b"M115\n"))
        for line in lines():
            command = line.partition(";")[0].strip()
            if command:
                sent = command.replace("G1 X", "G1X") if number is None else framed(number, command).decode().rstrip("\n")
                assert b"Error" not in b"".join(ask(host, f"{sent}\n".encode()))
                number = None if number is None else number + 1
        ask(host, b"M400\n")
        assert_printed(printer.record)
