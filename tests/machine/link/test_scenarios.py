"""Faults of a serial line: one test for each entry, by its number, of the list of 47 scenarios.

Most tests stream whole prints to a simulated printer with a virtual clock; scenarios about single answers of the printer test
the protocol alone.
"""

import re
import threading
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest

from machine import firmware
from machine.dryrun.dryrun import dry_run
from machine.firmware.marlin import MARLIN
from machine.link import journal as journal_module
from machine.link.journal import Journal, JournalHeading, read_journal
from machine.link.medium import Wire
from machine.link.pending_commands import Command, Control
from machine.link.port import open_port
from machine.link.print_state import PrintStatus
from machine.link.protocol.answers import ASKED_LIMIT
from machine.link.protocol.connection import Connection
from machine.link.protocol.events import Temperature, read_event
from machine.link.protocol.framing import command_of, frame
from machine.link.stream import Outcome, print_lines
from machine.printing.serial_log import tap
from machine.simulator.board import BuildOptions
from machine.simulator.faults import Fault, FaultScript
from machine.simulator.firmware import SimulatedFirmware
from machine.simulator.record import Record
from machine.simulator.simulator import SimulatedPrinter
from profiles.errors import (
    FirmwareError,
    LocalProtocolError,
    PortError,
    PrinterError,
    SilenceError,
)
from profiles.profile import load
from tests.machine.virtual_printer import PATH, VirtualPrinter

PROFILE = load()
PLAIN = BuildOptions(advanced_ok=False)
HEAT = ["M104 S200", "M109 S200", "G92 E0", "M83"]
STROKES = [f"G1 X{20 + k % 60}.{k:03d} Y{30 + k % 41}.5 E0.{10000 + k:05d} F6000" for k in range(150)]
PROGRAM = [*HEAT, *STROKES, "M104 S0"]
LINE = 60  # the wire line that most faults affect
STALL_S = 4.0
BOTH = pytest.mark.parametrize("build", [BuildOptions(), PLAIN], ids=["advanced", "plain"])


@dataclass
class Print:
    """One print: how it ended, and the bytes in both directions."""

    printer: VirtualPrinter
    traffic: list[tuple[float, str, bytes]]
    outcome: Outcome | None = None
    error: PrinterError | None = None

    @property
    def record(self) -> Record:
        return self.printer.record

    @property
    def sent(self) -> bytes:
        return b"".join(data for _, way, data in self.traffic if way == ">")

    @property
    def heard(self) -> bytes:
        return b"".join(data for _, way, data in self.traffic if way == "<")

    def after(self, words: bytes) -> bytes:
        """All bytes sent after these words were received."""
        index = next(k for k, (_, way, data) in enumerate(self.traffic) if way == "<" and words in data)
        return b"".join(data for _, way, data in self.traffic[index:] if way == ">")


def printed(
    faults: Sequence[Fault] = (),
    build: BuildOptions | None = None,
    lines: Sequence[str] = PROGRAM,
    baud: int | None = None,
    listen: Callable[[float, str, bytes], None] = lambda now_s, way, data: None,
    wrap: Callable[[Wire], Wire] = lambda wire: wire,
    **more: object,
) -> Print:
    """Print a program on a virtual printer."""
    printer = VirtualPrinter(PROFILE.machine, build, FaultScript(tuple(faults)), baud, most_s=7200.0)
    done = Print(printer, [])

    def note(way: str, data: bytes) -> None:
        done.traffic.append((printer.now_s, way, data))
        listen(printer.now_s, way, data)

    medium = tap(note, replace(printer.medium, open=lambda name, rate: wrap(printer.medium.open(name, rate))))
    try:
        done.outcome = print_lines(lines, PATH, medium=medium, profile=PROFILE, **more)  # type: ignore[arg-type]
    except PrinterError as error:
        done.error = error
    return done


def assert_exact(done: Print, whole: bool = True, strokes: Sequence[str] = STROKES) -> None:
    """Every stroke of the program, or of its beginning, happened once and in order; the last one may be cut short."""
    assert (done.error is None) == whole, done.error
    record = done.record
    pushed, moved = record.end[:, 5] - record.start[:, 5], (record.end[:, :2] != record.start[:, :2]).any(axis=1)
    got = np.column_stack([record.end[:, :2], pushed])[moved & (pushed > 1e-9)]
    wanted = np.array([[float(word[1:]) for word in line.split()[1:4]] for line in strokes])
    assert len(got) == len(wanted) if whole else len(got) <= len(wanted)
    compared = len(got) if whole else max(0, len(got) - 1)
    assert np.abs(got[:compared] - wanted[:compared]).max(initial=0.0) < 1e-6


def assert_cold(done: Print) -> None:
    assert (done.record.nozzle_target_c, done.record.bed_target_c) == (0.0, 0.0)


def times(done: Print, number: int) -> int:
    """How often a line was sent."""
    return done.sent.count(b"\nN%d " % number)


@cache
def clean(build: BuildOptions | None = None) -> Print:
    """The print without faults."""
    return printed(build=build)


def wire(build: BuildOptions | None = None) -> bytes:
    """The bytes that the host sends without faults."""
    return clean(build).sent


def byte(line: int, offset: int = 0, build: BuildOptions | None = None) -> int:
    """The index of a byte of a wire line in the faultless stream; negative offsets count from the line's end."""
    stream = wire(build)
    begin = stream.index(b"\nN%d " % line) + 1
    return begin + offset if offset >= 0 else stream.index(b"\n", begin) + 1 + offset


def answer(line: int, build: BuildOptions | None = None) -> int:
    """Which ok of the printer, counted from 1, acknowledges a wire line that moves an axis."""
    done = clean(build)
    before = done.heard[: done.heard.index(b"ok T:")].count(b"\n")
    oks = [k for k, text in enumerate(done.heard.split(b"\n"), 1) if text.startswith(b"ok") and k > before]
    return oks[line - 2]


def lost(line: int, build: BuildOptions | None = None) -> list[Fault]:
    """All bytes of a line are lost."""
    begin, end = byte(line, 0, build), byte(line, -1, build)
    return [Fault("drop", at) for at in range(begin, end + 1)]


@BOTH
def test_scenario_01_a_byte_lost_in_a_line(build: BuildOptions) -> None:
    done = printed([Fault("drop", byte(LINE, 9, build))], build)
    assert_exact(done)
    assert done.outcome is not None
    assert 1 <= done.outcome.repeated <= 4


@BOTH
def test_scenario_02_a_bit_flipped_in_a_number(build: BuildOptions) -> None:
    done = printed([Fault("flip", byte(LINE, 8, build), value=0)], build)
    assert_exact(done)
    assert b"checksum mismatch" in done.heard


@BOTH
def test_scenario_03_the_leading_n_lost_and_its_surplus_ok_not_credited(build: BuildOptions) -> None:
    done = printed([Fault("drop", byte(LINE, 0, build))], build)
    assert_exact(done)
    assert b"Unknown command" in done.heard
    assert times(done, LINE) == 2


@BOTH
def test_scenario_04_the_newline_lost_and_two_lines_melt(build: BuildOptions) -> None:
    assert_exact(printed([Fault("drop", byte(LINE, -1, build))], build))


@BOTH
def test_scenario_05_a_whole_line_lost_and_the_next_one_too_high(build: BuildOptions) -> None:
    done = printed(lost(LINE, build), build)
    assert_exact(done)
    assert times(done, LINE) == 2


@BOTH
def test_scenario_06_a_repeat_of_an_accepted_line_is_never_used_as_a_question(build: BuildOptions) -> None:
    done = printed([Fault("swallow ok", answer(LINE, build) + k) for k in range(4)], build)
    assert_exact(done)
    assert max(times(done, number) for number in range(3, 150)) == 1


def test_scenario_07_an_ok_lost_with_a_window_of_one() -> None:
    done = printed([Fault("swallow ok", answer(LINE, PLAIN))], PLAIN)
    assert_exact(done)
    assert done.printer.now_s - clean(PLAIN).printer.now_s < STALL_S + 1.0


def test_scenario_08_an_ok_lost_with_a_window_of_four_and_plain_oks(monkeypatch: pytest.MonkeyPatch) -> None:
    pipelined = replace(MARLIN, line=replace(MARLIN.line, places_plain=4))
    monkeypatch.setattr(firmware, "FIRMWARES", (pipelined, *firmware.FIRMWARES[1:]))
    done = printed([Fault("swallow ok", answer(LINE, PLAIN))], PLAIN)
    assert_exact(done)
    assert done.outcome is not None
    assert done.outcome.acknowledged == len(PROGRAM)
    assert done.sent.count(b"M105") <= wire(PLAIN).count(b"M105") + 1


def test_scenario_09_an_ok_truncated_to_o() -> None:
    done = printed([Fault("truncate ok", answer(LINE, PLAIN))], PLAIN)
    assert_exact(done)
    assert done.printer.now_s - clean(PLAIN).printer.now_s < STALL_S + 1.0


@BOTH
def test_scenario_10_an_ok_doubled(build: BuildOptions) -> None:
    done = printed([Fault("double ok", answer(LINE, build) + k) for k in (0, 1, 5)], build)
    assert_exact(done)
    assert_window(done)


def assert_window(done: Print) -> None:
    """Never more than 127 bytes beyond those that the printer has acknowledged."""
    open_bytes: dict[int, int] = {}
    for _, way, data in done.traffic:
        for text in data.split(b"\n"):
            if way == ">" and text[:1] == b"N":
                open_bytes[int(text[1:].split(b" ")[0])] = len(text) + 1
            elif way == "<" and text.startswith(b"ok N"):
                taken = int(text[4:].split(b" ")[0])
                open_bytes = {number: size for number, size in open_bytes.items() if number > taken}
        assert not done.printer.firmware.record().lost_bytes
        if any(b"ok N" in data for _, _, data in done.traffic):
            assert sum(open_bytes.values()) <= 127 + 16


def test_scenario_11_an_ok_glued_to_garbage_counts_as_lost() -> None:
    done = printed([Fault("garbage", answer(LINE, PLAIN), unit="answer", text="\xff\xfe..")], PLAIN)
    assert_exact(done)
    assert b"\xff\xfe..ok\n" in done.heard
    assert done.sent.count(b"M105") == wire(PLAIN).count(b"M105") + 1


def test_scenario_12_a_resend_without_its_ok() -> None:
    faults, build = [Fault("drop", byte(LINE, 9, PLAIN))], replace(PLAIN, resend_ok=False)
    done = printed(faults, build)
    assert_exact(done)
    assert done.printer.now_s - clean(build).printer.now_s < 0.5


def test_scenario_13_a_resend_for_each_line_in_flight_is_one_repetition() -> None:
    short = [f"G1 X{20 + k / 10:.1f} Y30 E0.{10000 + k} F6000" for k in range(150)]
    lines = [*HEAT, *short]
    begin = printed(lines=lines, baud=115200).sent.index(b"\nN%d " % LINE)
    done = printed([Fault("drop", begin + 9)], lines=lines, baud=115200)
    assert_exact(done, strokes=short)
    assert done.heard.count(b"Resend:") > 1
    assert max(times(done, number) for number in range(3, 150)) == 2


@BOTH
@pytest.mark.parametrize("back", [1, 2, 7, 30])
def test_scenario_14_a_spurious_resend_of_an_acknowledged_line(build: BuildOptions, back: int) -> None:
    assert_exact(printed([Fault("spurious resend", LINE, value=LINE - back)], build))


@BOTH
@pytest.mark.parametrize("number", [9999, 3])
def test_scenario_15_a_resend_beyond_history_or_in_the_future_ends_the_print_safely(build: BuildOptions, number: int) -> None:
    done = printed([Fault("spurious resend", LINE + k, value=number) for k in range(3)], build)
    assert isinstance(done.error, PrinterError)
    assert f"asks for line {number}" in str(done.error)
    assert_exact(done, whole=False)
    assert_cold(done)


def test_scenario_16_the_same_line_is_requested_repeatedly() -> None:
    begin, size = byte(LINE, 9, PLAIN), byte(LINE + 1, 0, PLAIN) - byte(LINE, 0, PLAIN)
    done = printed([Fault("drop", begin + k * size) for k in range(40)], PLAIN)
    assert isinstance(done.error, PrinterError)
    assert re.match(rf"the printer has refused line \d+ \(G1 .*\) {ASKED_LIMIT} times: .Error:checksum mismatch", str(done.error))
    assert times(done, LINE) <= ASKED_LIMIT + 1
    assert_exact(done, whole=False)
    assert_cold(done)


def test_scenario_17_a_line_error_without_a_resend_is_queried_at_once() -> None:
    words = "Error:No Line Number with checksum, Last Line: 59\n"
    done = printed([Fault("garbage", byte(LINE, 0, PLAIN), unit="byte", text=words), *lost(LINE, PLAIN)], PLAIN)
    assert_exact(done)
    assert done.printer.now_s - clean(PLAIN).printer.now_s < 1.0


def test_scenario_18_a_line_longer_than_ninety_five_characters_is_never_sent() -> None:
    done = printed(lines=["G21", "M83", "M117 " + "x" * 90])
    assert isinstance(done.error, LocalProtocolError)
    assert "has 95 characters: with number and checksum at most 95 are allowed" in str(done.error)
    assert done.sent == b""
    assert command_of("M117 " + "x" * 79, 10**7)


@BOTH
def test_scenario_19_a_reset_in_mid_print(build: BuildOptions) -> None:
    done = printed([Fault("reset", LINE)], build)
    assert isinstance(done.error, FirmwareError)
    assert "restarted" in str(done.error)
    assert b"G1 X" not in done.after(b"start")
    assert_exact(done, whole=False)
    assert_cold(done)


@BOTH
def test_scenario_20_a_reset_without_banner_is_no_reason_to_repeat_from_line_1(build: BuildOptions) -> None:
    done = printed([Fault("silent reset", LINE)], build)
    assert isinstance(done.error, FirmwareError)
    assert "restarted without a word" in str(done.error)
    assert times(done, 3) == 1
    assert_exact(done, whole=False)


@pytest.mark.parametrize("unit", ["byte", "line"])
def test_scenario_21_the_cable_pulled_for_good(unit: str) -> None:
    at = byte(LINE, 5) if unit == "byte" else LINE
    before = set(threading.enumerate())
    done = printed([Fault("disconnect", at, unit=unit)])  # type: ignore[arg-type]
    assert isinstance(done.error, PortError)
    assert str(done.error).count("was lost") == 1
    assert "its heaters may still be on" in str(done.error)
    assert set(threading.enumerate()) <= before
    assert_exact(done, whole=False)


@BOTH
def test_scenario_22_the_cable_back_after_two_seconds_the_same_printer(build: BuildOptions) -> None:
    done = printed([Fault("disconnect", LINE, seconds=2.0)], build)
    assert_exact(done)


def test_scenario_22_the_cable_back_with_a_printer_that_restarted() -> None:
    done = printed([Fault("disconnect", LINE, seconds=2.0), Fault("silent reset", LINE)])
    assert isinstance(done.error, FirmwareError)
    assert "restarted" in str(done.error)
    assert_exact(done, whole=False)


@pytest.mark.parametrize("late_s", [0.0, 1.5])
def test_scenario_23_a_board_that_restarts_when_the_port_opens(late_s: float) -> None:
    done = printed([Fault("reset", 3, unit="byte"), Fault("delay", 0, to_host=True, seconds=late_s)])
    assert_exact(done)
    assert done.heard.startswith(b"start")


def test_scenario_24_a_printer_silent_for_ever() -> None:
    said_s: dict[str, float] = {}
    done = printed([Fault("stall", LINE)], on_progress=lambda progress: said_s.setdefault(progress.message, progress.elapsed_s))
    last_s = max(now_s for now_s, way, _ in done.traffic if way == "<" and now_s < 60)
    assert said_s["no answer from the printer, it is asked again"] - last_s < 31.0
    assert isinstance(done.error, SilenceError | PrinterError)
    assert done.printer.now_s < 600
    assert "its heaters may still be on, look at the printer" in str(done.error)
    assert_exact(done, whole=False)


@BOTH
def test_scenario_25_three_seconds_of_silence_then_all_answers_at_once(build: BuildOptions) -> None:
    done = printed([Fault("stall", LINE, seconds=3.0)], build)
    assert_exact(done)
    assert done.outcome is not None
    assert done.outcome.repeated == 0


def cancelled_at(done_after_s: float) -> tuple[Control, Callable[[float, str, bytes], None], list[float]]:
    """Requests the end once the clock has passed a time, which it appends to the list."""
    control, asked = Control(), []

    def listen(now_s: float, way: str, data: bytes) -> None:
        del way, data
        if now_s > done_after_s and not asked:
            asked.append(now_s)
            control.ask(Command.CANCEL)

    return control, listen, asked


def test_scenario_26_ten_minutes_of_waiting_with_busy_and_a_cancel_that_works_at_once() -> None:
    assert printed(lines=["M155 S1", "G4 S600"]).error is None
    control, listen, asked = cancelled_at(30.0)
    done = printed(lines=["M104 S250", "M109 S250"], listen=listen, control=control)
    assert done.outcome is not None
    assert done.outcome.cancelled
    assert b"\nM108\n" in done.sent
    assert next(now_s for now_s, way, data in done.traffic if way == ">" and b"M108" in data) - asked[0] < 1.0
    assert_cold(done)


def test_scenario_27_ten_minutes_of_waiting_without_busy() -> None:
    done = printed(lines=["M155 S1", "G4 S600", "G1 X5"], build=BuildOptions(busy=False))
    assert done.error is None
    assert done.printer.now_s > 600


@BOTH
def test_scenario_28_thermal_runaway(build: BuildOptions) -> None:
    done = printed([Fault("thermal runaway", LINE)], build)
    assert isinstance(done.error, FirmwareError)
    assert "Thermal Runaway" in str(done.error)
    assert b"G1 X" not in done.after(b"Thermal Runaway")
    assert_exact(done, whole=False)
    assert_cold(done)


@pytest.mark.parametrize("dialect", ["marlin", "reprapfirmware", "klipper"])
def test_a_nozzle_too_cold_to_print_ends_the_print(dialect: str) -> None:
    profile = load(settings=[f"machine.dialect={dialect}"])
    printer = VirtualPrinter(profile.machine)
    with pytest.raises(PrinterError, match=r"nozzle is too cold|below minimum temp"):
        print_lines(["M104 S190", "M109 S190", "G92 E0", "M83", "M104 S0", "G4 S300", *STROKES], PATH, medium=printer.medium)
    assert printer.record.strokes <= 1


@BOTH
def test_scenario_29_klipper_s_two_exclamation_marks_stop_although_an_ok_follows(build: BuildOptions) -> None:
    done = printed([Fault("error", LINE, text="!! Lost communication with MCU\nok")], build)
    assert isinstance(done.error, FirmwareError)
    assert "Lost communication with MCU" in str(done.error)
    assert b"G1 X" not in done.after(b"!! Lost")
    assert_exact(done, whole=False)
    assert_cold(done)


def test_scenario_30_actions_of_the_printer_are_heeded() -> None:
    def says(action: str) -> Fault:
        return Fault("garbage", LINE, text=f"//action:{action}\r\n")

    paused = printed([says("pause"), says("paused"), says("resume"), says("resumed")])
    assert_exact(paused)
    cancelled = printed([says("cancel")])
    assert cancelled.outcome is not None
    assert cancelled.outcome.cancelled
    assert "disconnect" in str(printed([says("disconnect")]).error)
    unknown = printed([says("dance wildly")]).outcome
    assert unknown is not None
    assert any("dance" in warning for warning in unknown.warnings)


def test_scenario_31_an_emergency_stop_is_sent_before_everything_else() -> None:
    control, asked = Control(), []

    def listen(now_s: float, way: str, data: bytes) -> None:
        if way == ">" and b"N%d " % LINE in data and not asked:
            asked.append(now_s)
            control.ask(Command.EMERGENCY_STOP)

    done = printed(listen=listen, control=control)
    assert isinstance(done.error, FirmwareError)
    stop_s = next(now_s for now_s, way, data in done.traffic if way == ">" and b"M112" in data)
    assert stop_s - asked[0] < 0.05
    assert b"G1 X" not in done.sent[done.sent.index(b"\nM112\n") :]
    assert done.printer.firmware.dead
    assert_cold(done)


def test_scenario_32_an_emergency_stop_of_a_printer_that_reads_nothing() -> None:
    control = Control()

    def listen(now_s: float, way: str, data: bytes) -> None:
        if way == ">" and b"N%d " % LINE in data:
            control.ask(Command.EMERGENCY_STOP)

    done = printed([Fault("block", LINE - 8)], listen=listen, control=control)
    assert "cut the power" in str(done.error) or "may still be on" in str(done.error)
    assert done.printer.now_s < 600


class Halving:
    """A wire that accepts half of one write, then fails once."""

    failed = False

    def __init__(self, line: Wire, first: list[bytes]) -> None:
        self._line, self._first, self.name = line, first, line.name
        self.read, self.discard, self.close = line.read, line.discard, line.close

    def write(self, data: bytes) -> None:
        if b"N%d " % LINE in data and not Halving.failed:
            Halving.failed = True
            self._line.write(data[: len(data) // 2])
            raise PortError("the printer has stopped reading")
        if Halving.failed and not self._first:
            self._first.append(data)
        self._line.write(data)


def test_scenario_33_a_half_written_line_is_refused_with_the_question_behind_it(monkeypatch: pytest.MonkeyPatch) -> None:
    first: list[bytes] = []
    monkeypatch.setattr(Halving, "failed", False)
    done = printed(wrap=lambda line: Halving(line, first))
    assert b" M105*" in first[0]
    assert b"checksum mismatch, Last Line: %d" % (LINE - 1) in done.heard
    assert_exact(done)


@pytest.mark.parametrize("baud", [115200, 250000])
def test_scenario_34_stalls_of_sixty_milliseconds_never_overflow_a_ring_of_128_bytes(baud: int) -> None:
    done = printed([Fault("block", chance=0.1, seconds=0.06)], BuildOptions(rx_ring=128), baud=baud)
    assert_exact(done)
    assert done.outcome is not None
    assert (done.record.lost_bytes, done.outcome.repeated) == (0, 0)


def test_scenario_35_short_segments_are_slowed_by_the_line_and_no_byte_is_lost() -> None:
    """The tests of the dry run cover that it predicts this, and how often the printer runs dry."""
    strokes = [f"G1 X{20 + k / 10:.1f} Y30 E0.{10000 + k} F3600" for k in range(300)]
    paced = [printed(build=BuildOptions(rx_ring=128), lines=[*HEAT, *strokes], baud=baud) for baud in (9600, 115200, 1_000_000)]
    assert [done.record.underruns > 20 for done in paced] == [True, False, False]
    assert paced[0].record.slowed > 10 < paced[1].record.slowed > paced[2].record.slowed
    for done in paced:
        assert_exact(done, strokes=strokes)


def test_scenario_36_two_waits_with_a_line_in_flight_find_the_lost_one() -> None:
    build = replace(PLAIN, waits=True, busy=False)
    done = printed(lost(LINE, build), build)
    assert_exact(done)
    assert done.heard.count(b"wait\n") == 2
    assert done.printer.now_s - clean(build).printer.now_s < 3.0


def test_scenario_37_the_c_axis_and_the_chamber_are_not_confused() -> None:
    position = read_event(b"X:1.00 Y:2.00 Z:3.00 A:-30.00 C:725.00 E:0.10 Count X:80 Y:160 Z:1200 A:-240 C:5800")
    assert position.position == {"X": 1.0, "Y": 2.0, "Z": 3.0, "A": -30.0, "C": 725.0, "E": 0.1}
    heat = read_event(b" T:210.10 /210.00 B:60.00 /60.00 C:35.20 /40.00 @:50 B@:20 C@:0")
    assert heat.temperature == Temperature(210.1, 210.0, 60.0, 60.0)
    other = read_event(b"X:1.00 Y:2.00 Z:3.00 B:30.00 C:5.00 E:0.00")
    assert (other.position, other.temperature) == ({"X": 1.0, "Y": 2.0, "Z": 3.0, "B": 30.0, "C": 5.0, "E": 0.0}, None)
    assert_exact(printed(lines=["M155 S1", "M154 S1", *HEAT, *STROKES[:70], "G92 E0", *STROKES[70:]], build=PLAIN))


@pytest.mark.parametrize("size", [1, 7, 10**6])
def test_scenario_38_odd_line_ends_blanks_and_rubbish_are_survived(size: int) -> None:
    text = b"  ok\r\n\rok T:20.0 /0.0\r\xf8\x80\x80\n" + b"z" * 5000 + b"\nok N3 P15 B3\r\n"
    connection = Connection()
    heard = [event for at in range(0, len(text), size) for event in connection.receive(text[at : at + size], 0.0)]
    assert [getattr(event, "text", "") for event in heard] == ["ok", "ok T:20.0 /0.0", "\ufffd\ufffd\ufffd", "ok N3 P15 B3"]
    assert_exact(printed([Fault("garbage", k, unit="answer", text="\x80" * 5000 + "\r\n") for k in range(30, 90, 7)]))


def test_scenario_39_a_pause_comes_back_to_tilt_turn_filament_and_feed() -> None:
    control, states = Control(), list[str]()

    def progress(moment: PrintStatus) -> None:
        if moment.state == "printing" and moment.acknowledged > 60 and "paused" not in states:
            control.ask(Command.PAUSE)
        if moment.state == "paused" and "paused" not in states:
            control.ask(Command.RESUME)
        states.append(moment.state)

    tilted = ["G1 Z60 F900", "G92 A0 C0", "G1 A30 C725 F6000", "G1 X20 Y30 F6000"]
    strokes = [line.replace("F6000", "").strip() for line in STROKES]
    jumps = [f"G0 X{20 + k}" if k % 10 == 9 else "G4 P0" for k in range(150)]
    body = [line for pair in zip(strokes, jumps, strict=True) for line in pair]
    done = printed(lines=[*HEAT, *tilted, *body], control=control, on_progress=progress)
    assert_exact(done, strokes=strokes)
    rows = done.record.end
    pushed = rows[:, 5] - done.record.start[:, 5] > 1e-9
    assert np.allclose(rows[pushed][:, 3:5], [30.0, 725.0])
    away = rows[:, 2] > 61.0
    assert away.any()
    assert np.allclose(rows[away, 3:5], [30.0, 725.0])


def journal_of(lines: Sequence[str], done_after: int, path: Path) -> tuple[int, int]:
    """The lines executed according to the journal, and those really executed, when the power fails at a line."""
    heading = JournalHeading("p.gcode", "0" * 64, "p", {})
    with Journal(path, heading) as journal:
        done = printed([Fault("reset", done_after)], lines=lines, journal=journal)
    story = read_journal(path)
    record = done.record
    strokes = int((record.end[:, 5] - record.start[:, 5] > 1e-9).sum())
    return story.last.executed, len(HEAT) + strokes


@pytest.mark.parametrize("line", range(10, 150, 9))
def test_scenario_40_after_a_power_cut_at_any_line_the_journal_is_never_ahead_of_the_printer(line: int, tmp_path: Path) -> None:
    journalled, executed = journal_of([*HEAT, *STROKES], line, tmp_path / "j")
    assert journalled <= executed
    assert executed - journalled <= 15 + 4 + 4


def test_scenario_41_a_torn_last_record_leaves_the_one_before(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(journal_module, "BOOT_ID", tmp_path / "of a computer that was cut off, too")
    journal_of([*HEAT, *STROKES], 120, tmp_path / "j")
    before = read_journal(tmp_path / "j")
    whole = (tmp_path / "j").read_bytes()
    newest = whole.index(b" [%d," % before.records)
    (tmp_path / "j").write_bytes(whole[:newest] + b"torn" + whole[newest + 4 :])
    after = read_journal(tmp_path / "j")
    assert after.torn == 1
    assert after.last.executed <= before.last.executed


def test_scenario_42_two_programs_open_the_same_port() -> None:
    with SimulatedPrinter(PROFILE.machine) as printer, open_port(printer.path, 115200), pytest.raises(PortError, match="busy"):
        open_port(printer.path, 115200)


@BOTH
def test_scenario_43_a_cancel_while_lines_are_being_repeated(build: BuildOptions) -> None:
    stop = threading.Event()

    def listen(now_s: float, way: str, data: bytes) -> None:
        if way == "<" and b"Resend" in data:
            stop.set()

    done = printed([Fault("drop", byte(LINE, 9, build))], build, listen=listen, control=Control(stop))
    assert done.outcome is not None
    assert (done.outcome.cancelled, done.outcome.heaters_off) == (True, True)
    again = print_lines(PROGRAM, PATH, medium=done.printer.medium)
    assert again.acknowledged == len(PROGRAM)


def test_scenario_44_a_soft_limit_is_refused_before_printing() -> None:
    findings = dry_run(["G21", "G90", "G28", "G0 A200"], PROFILE).findings
    assert {finding.line for finding in findings if finding.severity == "error"} == {4}
    assert any("A goes to 200 deg" in finding.message for finding in findings)


@pytest.mark.parametrize(("turned", "errors"), [("G0 A30", 2), ("G0 C90", 2), ("G0 A0 C0", 0)])
def test_scenario_45_the_tool_centre_point_switched_while_the_table_is_turned_is_refused(turned: str, errors: int) -> None:
    findings = dry_run(["G21", "G90", "G28", "G0 Z100", turned, "G43.4", "G49"], PROFILE).findings
    assert sum(finding.code == "following-switched" for finding in findings if finding.severity == "error") == errors


@pytest.mark.parametrize("surplus", [1, 2, 3])
def test_scenario_46_a_surplus_ok_just_before_the_end_does_not_end_the_print_early(surplus: int) -> None:
    last = answer(3 + len(PROGRAM) - 2, PLAIN)
    done = printed([Fault("double ok", last - k) for k in range(surplus)], PLAIN)
    assert_exact(done)
    assert max(done.record.begin_s + done.record.duration_s) <= done.printer.now_s


def test_scenario_47_the_idioms_of_other_senders_are_understood() -> None:
    firmware = SimulatedFirmware(PROFILE.machine, PLAIN)
    lines = ["N-1 M110*15", "N0 G1X1Y1", "M110 N0", "M110", "N1 M105"]
    said = []
    for line in lines:
        text = line if "*" in line or line[0] != "N" else framed_as(line)
        firmware.receive(f"{text}\n".encode())
        said.append(firmware.advance().decode())
    assert all(text.startswith("ok") for text in said), said
    assert firmware.record().end[-1][:2].tolist() == [1.0, 1.0]


def framed_as(line: str) -> str:
    number, _, command = line[1:].partition(" ")
    return frame(int(number), command).decode().strip()


BESIDES: dict[str, Callable[[BuildOptions], list[Fault]]] = {
    "the number becomes that of the line before": lambda build: [Fault("flip", byte(LINE + 1, 2, build), value=0)],
    "the checksum's star becomes a newline": lambda build: [
        Fault("flip", wire(build).index(b"*", byte(LINE, 0, build)), value=5)
    ],
    "a byte doubled": lambda build: [Fault("duplicate", byte(LINE, 7, build))],
    "bytes of answers lost": lambda build: [Fault("drop", 1500 + n, True) for n in (0, 71, 133, 280)],
    "bytes of answers flipped": lambda build: [Fault("flip", 1500 + n, True, n % 7) for n in (0, 71, 133, 280)],
    "the last oks lost": lambda build: [Fault("swallow ok", answer(LINE, build) + 85 + n) for n in range(3)],
    "a damaged greeting": lambda build: [Fault("drop", 3), Fault("flip", 20, value=2), Fault("drop", 30, True)],
}


@BOTH
@pytest.mark.parametrize("name", BESIDES)
def test_other_noise_is_corrected(build: BuildOptions, name: str) -> None:
    done = printed(BESIDES[name](build), build)
    assert_exact(done)
    assert (done.sent, done.heard) != (clean(build).sent, clean(build).heard)


def test_every_scenario_has_its_number() -> None:
    named = {int(name[14:16]) for name in globals() if name.startswith("test_scenario_")}
    assert named == set(range(1, 48))
