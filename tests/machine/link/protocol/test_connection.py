"""The connection to a printer, tested on a simulated clock with given answers and recorded bytes."""

import random
import re
from collections.abc import Callable
from dataclasses import replace

import pytest
from hypothesis import given
from hypothesis import strategies as st

from machine.firmware import FIRMWARES, Firmware
from machine.firmware.firmware import FRAME_CHARACTERS
from machine.firmware.klipper import KLIPPER
from machine.firmware.marlin import MARLIN, REPETIER, SMOOTHIEWARE
from machine.firmware.reprapfirmware import REPRAPFIRMWARE
from machine.link.protocol.answers import QUESTIONS_MOST
from machine.link.protocol.connection import Connection
from machine.link.protocol.decoder import LONGEST_LINE
from machine.link.protocol.events import Event, Kind
from machine.link.protocol.framing import LINE_LIMIT, command_of, frame
from machine.link.protocol.states import State
from machine.link.protocol.timeout import Timing
from machine.link.protocol.verdict import SYNC_TRIES
from machine.link.protocol.window import HISTORY
from profiles.errors import FirmwareError, PrinterError, SilenceError

PATIENT = Timing(stall_s=4.0, stall_mute_s=30.0, sync_s=3.0, drain_s=0.5, quiet_s=0.12)
HELLO = b"N1 M115*39\n"
ASK2 = b"N2 M105*37\n"
CHUNKS = pytest.mark.parametrize("size", [1, 3, 10**6])


class Table:
    """A protocol on a test bench: say() is the printer, wait() the clock, wire() the bytes sent since the last call."""

    def __init__(self, size: int = 10**6) -> None:
        self.now_s, self.size = 0.0, size
        self.connection = Connection(PATIENT, 0.0)

    def say(self, text: bytes) -> list[Event]:
        events = []
        for begin in range(0, len(text), self.size):
            events += self.connection.receive(text[begin : begin + self.size], self.now_s)
        return events

    def wait(self, seconds: float) -> None:
        self.now_s += seconds
        self.connection.tick(self.now_s)

    def wire(self) -> bytes:
        return self.connection.take()

    def send(self, *commands: str) -> bytes:
        for command in commands:
            assert self.connection.send(command, self.now_s), f"no room for {command}"
        return self.wire()


def opened(size: int = 10**6, advanced: bool = True) -> Table:
    """A greeted printer; its send window is fully open if it reports line numbers."""
    table = Table(size)
    table.wait(0.6)
    table.say(b"ok N0 P15 B3\n" if advanced else b"ok\n")
    table.say(b"FIRMWARE_NAME:M\nCap:EMERGENCY_PARSER:1\nok N1 P15 B3\n" if advanced else b"FIRMWARE_NAME:M\nok\n")
    table.say(b"ok T:20.00 /0.00 B:20.00 /0.00\n")
    assert table.connection.state is State.OPEN
    for number in range(3, 11):
        table.send("G4 P0" if number == 3 else f"G1 X{number}")
        table.say(b"ok N%d P15 B3\n" % number if advanced else b"ok\n")
    return table


@given(st.binary(max_size=300))
def test_any_bytes_are_survived_and_read_the_same_in_portions(data: bytes) -> None:
    whole, single = Table().say(data), Table(1).say(data)
    assert whole == single


def test_a_line_without_end_is_thrown_away_and_its_tail_is_no_answer() -> None:
    table = opened()
    table.send("G1 X1")
    for _ in range(3):
        assert table.say(b"x" * LONGEST_LINE) == []
    assert table.say(b"\nok N11 P15 B3\n") == [Event(Kind.OK, "ok N11 P15 B3", 11, 15, 3)]


@CHUNKS
def test_the_greeting_agrees_on_line_numbers_then_asks_for_the_firmware(size: int) -> None:
    table = Table(size)
    table.say(b"T:20 /0\nhalf a li")
    table.wait(0.4)
    assert table.wire() == b""
    table.wait(0.2)
    assert table.wire() == b"N0 M110 N0*125\n"
    table.say(b"ne\nok\n")
    assert table.wire() == HELLO
    table.say(b"FIRMWARE_NAME:Marlin\nCap:AUTOREPORT_TEMP:1\nok\n")
    assert table.wire() == ASK2
    table.say(b"ok T:20.00 /0.00\n")
    assert table.connection.state is State.OPEN
    assert table.connection.greeting.capabilities == {"AUTOREPORT_TEMP": True}


def test_a_board_that_restarts_on_opening_is_greeted_again() -> None:
    table = Table()
    table.wait(0.6)
    table.wire()
    table.wait(1.0)
    table.say(b"start\necho: Last Updated\nok P15 B3\n")
    assert table.wire() == b""
    table.wait(0.6)
    assert table.wire() == b"N0 M110 N0*125\n"
    table.say(b"ok P15 B3\n")
    assert table.connection.state is State.SYNC
    table.say(b"ok\n")
    table.say(b"start\n")
    assert table.connection.state is State.DRAIN
    assert table.connection.fault is None


def test_a_mute_printer_is_given_up_after_some_greetings() -> None:
    table = Table()
    for _ in range(SYNC_TRIES + 2):
        table.wait(3.1)
    assert isinstance(table.connection.fault, SilenceError)
    assert table.now_s < 30


def test_complaints_about_what_came_before_the_greeting_are_no_answers_to_it() -> None:
    table = Table()
    table.wait(0.6)
    table.say(b"Error: Missing checksum\nok\nFIRMWARE_NAME:Marlin\nok\nok T:20 /0\n")
    assert table.connection.state is State.OPEN


def test_a_printer_that_rejects_the_greeting_is_reported_with_its_last_answer() -> None:
    table = Table()
    for _ in range(SYNC_TRIES + 2):
        table.say(b"Error: Missing checksum\n")
        table.wait(3.1)
    assert str(table.connection.fault) == (
        "the printer did not accept 6 greetings: its last answer was 'Error: Missing checksum'"
    )


class Counting:
    """A firmware that counts lines from `last` and answers M110 with `m110`."""

    def __init__(self, last: int, m110: bytes, takes_numbers: bool = True) -> None:
        self.last, self.m110, self.takes_numbers = last, m110, takes_numbers

    def answer(self, line: bytes) -> bytes:
        numbered = re.match(rb"N(\d+) (.*)\*\d+$", line)
        command = numbered[2] if numbered else line
        if command.startswith(b"M110"):
            return self.m110
        if numbered and not self.takes_numbers:
            return b""
        if numbered and int(numbered[1]) != self.last + 1:
            return b"Error:Line Number is not Last Line Number+1, Last Line: %d\nResend: %d\nok\n" % (self.last, self.last + 1)
        self.last += numbered is not None
        return {b"M115": b"FIRMWARE_NAME:Own\nok\n", b"M105": b"ok T:20.0 /0.0\n"}.get(command, b"ok\n")


def converse(printer: Counting, seconds: float = 40.0) -> Table:
    """Run a connection with a printer until it is open or has failed."""
    table = Table()
    while table.now_s < seconds and table.connection.fault is None and table.connection.state is not State.OPEN:
        table.wait(0.1)
        for line in table.wire().splitlines():
            table.say(printer.answer(line) if line else b"")
    return table


@pytest.mark.parametrize("m110", [
    b"",  # unknown, and not answered at all
    b"ok\n",  # acknowledged without effect: prusa3d/Prusa-Firmware#232
    b"Error:Line Number is not Last Line Number+1, Last Line: 57\nResend: 58\nok\n",
    b"Resend: 58\n",
    b'echo:Unknown command: "M110 N0"\nok\n',
])  # fmt: skip
@pytest.mark.parametrize("last", [0, 57])
def test_a_printer_that_does_not_heed_m110_is_given_the_numbers_it_asks_for(m110: bytes, last: int) -> None:
    printer = Counting(last, m110.replace(b"57", b"%d" % last).replace(b"58", b"%d" % (last + 1)))
    table = converse(printer)
    assert table.connection.fault is None
    assert printer.last == last + 2
    assert table.send("G1 X1") == frame(last + 3, "G1 X1")


def test_a_printer_that_keeps_its_own_line_numbers_is_never_asked_to_reset_them() -> None:
    printer = Counting(99_897, b"ok\n")
    table = converse(printer)
    table.send("G1 X1")
    table.say(b"ok\n")
    table.wait(0.1)
    assert table.send("G1 X2") == frame(99_901, "G1 X2")


def test_a_printer_that_answers_only_unnumbered_lines_is_distinguished_from_one_that_is_off() -> None:
    table = converse(Counting(0, b"", takes_numbers=False))
    assert str(table.connection.fault) == (
        "the printer answers M115, but neither M110 nor any line with a number and a checksum: this program sends no other "
        "lines, because a damaged one could not be detected"
    )


def test_a_command_that_is_refused_for_ever_is_named_with_the_printers_words() -> None:
    """OctoPrint/OctoPrint#1468: a Marlin whose display command consumes part of its line."""
    table = opened()
    table.send("M117 Printing...")
    for _ in range(11):
        table.say(b"Error:checksum mismatch, Last Line: 10\nResend: 11\nok\n")
        table.wait(0.2)
    assert str(table.connection.fault) == (
        "the printer has refused line 11 (M117 Printing...) 10 times: 'Error:checksum mismatch, Last Line: 10'; lines before it "
        "passed, so its firmware does not take this command as it is, or the cable has just become too noisy"
    )


def test_a_plain_printer_gets_one_line_at_a_time() -> None:
    table = opened(advanced=False)
    table.send("G1 X1")
    assert not table.connection.can_send("G1 X2")
    table.say(b"ok\n")
    assert table.connection.can_send("G1 X2")


def test_a_printer_that_reports_line_numbers_is_sent_as_much_as_its_buffer_holds() -> None:
    table, command = opened(), "G1 X100.123 Y100.123 E1.12345"
    written = b""
    while table.connection.can_send(command):
        written += table.send(command)
    assert written.count(b"\n") == 3
    assert len(written) <= MARLIN.line.rx_bytes
    short = opened()
    assert sum(len(short.send("G1 X1")) > 0 for _ in range(9) if short.connection.can_send("G1 X1")) == 4


def test_a_numbered_ok_acknowledges_all_lines_before_it_too() -> None:
    table = opened()
    table.send("G1 X1", "G1 X2", "G1 X3")
    table.say(b"ok N12 P15 B3\n")
    assert table.connection.window.acknowledged == 12


def test_slow_commands_travel_alone() -> None:
    table = opened()
    table.send("G1 X1")
    assert not table.connection.can_send("M109 S200")
    table.say(b"ok N11 P15 B3\n")
    table.send("M109 S200")
    assert not table.connection.can_send("G1 X1")


@CHUNKS
@pytest.mark.parametrize("advanced", [True, False])
def test_a_resend_repeats_the_line_once_and_its_ok_acknowledges_nothing(size: int, advanced: bool) -> None:
    table = opened(size, advanced)
    first = table.send("G1 X1")
    table.say(b"Error:checksum mismatch, Last Line: 10\nResend: 11\nok\n")
    assert table.wire() == first
    assert table.connection.window.acknowledged == 10
    table.say(b"ok N11 P15 B3\n" if advanced else b"ok\n")
    assert table.connection.window.acknowledged == 11
    assert table.connection.state is State.OPEN


def test_many_resends_for_lines_in_flight_cause_one_repetition_one_by_one() -> None:
    table = opened()
    lines = table.send("G1 X1", "G1 X2", "G1 X3").splitlines(keepends=True)
    table.say(b"Error:checksum mismatch, Last Line: 10\nResend: 11\nok\n" * 3)
    assert table.wire() == b""
    table.wait(0.13)
    assert table.wire() == lines[0]
    table.say(b"ok N11 P15 B3\n")
    assert table.wire() == lines[1]
    table.say(b"ok N12 P15 B3\n")
    assert table.wire() == lines[2]
    table.say(b"ok N13 P15 B3\n")
    assert table.connection.state is State.OPEN


@pytest.mark.parametrize("advanced", [True, False])
def test_a_lost_ok_is_cleared_up_by_a_new_question_never_by_a_repeat(advanced: bool) -> None:
    table = opened(advanced=advanced)
    table.send("G1 X1")
    table.wait(3.9)
    assert table.wire() == b""
    table.wait(0.2)
    assert table.wire() == frame(12, "M105")
    table.say(b"ok T:20.00 /0.00\n")
    assert (table.connection.state, table.connection.window.acknowledged) == (State.OPEN, 12)


def test_busy_shortens_the_timeout_and_restarts_it() -> None:
    table = opened()
    table.send("G1 X1")
    for _ in range(100):
        table.say(b"echo:busy: processing\n")
        table.wait(2.0)
    assert table.wire() == b""
    table.wait(2.1)
    assert table.wire() == frame(12, "M105")


def test_reports_are_no_progress() -> None:
    table = opened()
    table.send("G1 X1")
    for _ in range(16):
        table.wait(2.0)
        table.say(b" T:20.00 /0.00 B:20.00 /0.00\n")
    assert table.connection.state is State.PROBING


def test_heating_may_take_long_and_is_queried_at_growing_intervals() -> None:
    table = opened()
    table.send("M109 S200")
    asked = []
    for second in range(3600):
        table.wait(1.0)
        table.say(b"T:100.00 /200.00 W:?\n")
        asked += [second + 1] * table.wire().count(b"M105")
    assert asked == [5, 35, 155, 635]
    assert table.connection.fault is None
    table.say(b"ok N11 P15 B3\nok T:200 /200\n")
    assert table.connection.state is State.OPEN


def test_a_question_that_would_overflow_the_buffer_of_a_printer_in_a_long_move_waits_longer() -> None:
    table = opened()
    table.send(*["G1 X100.123 Y100.123 E1.12345"] * 2, "G1 X100.123 Y100.123 E1.12345 F1800.5")
    table.wait(29.0)
    assert table.wire() == b""
    table.wait(1.1)
    assert table.wire() == frame(14, "M105")


@pytest.mark.parametrize("surplus", [b"ok\n", b"ok\nok\nok\n", b"ok N99 P15 B3\n", b"ok N4 P15 B3\n"])
def test_surplus_oks_are_never_credited_forward(surplus: bytes) -> None:
    table = opened()
    table.say(surplus)
    table.send("G1 X1", "G1 X2")
    table.say(surplus)
    assert table.connection.window.acknowledged == 10


def test_a_plain_ok_does_not_answer_the_question_for_the_temperature() -> None:
    table = opened(advanced=False)
    table.send("M105")
    table.say(b"ok\n")
    assert table.connection.window.acknowledged == 10
    table.say(b"ok T:20.00 /0.00\n")
    assert table.connection.window.acknowledged == 11


def test_a_resend_of_a_handshake_line_twice_is_a_restart() -> None:
    table = opened()
    table.send("G1 X1")
    table.say(b"Resend: 1\nok\n")
    assert table.wire() == frame(12, "M105")
    assert table.connection.fault is None
    table.say(b"Resend: 1\nok\n")
    assert isinstance(table.connection.fault, FirmwareError)
    assert "restarted" in str(table.connection.fault)


@pytest.mark.parametrize("number", [10**6, 14, 3])
def test_a_resend_of_an_impossible_line_is_an_error_when_it_is_repeated(number: int) -> None:
    table = opened()
    for _ in range(20):
        table.say(b"ok N%d P15 B3\n" % table.connection.send("G1 X1", table.now_s))
    asked = number + (20 if number == 14 else 0)
    table.say(b"Resend: %d\nok\n" % asked)
    assert table.connection.fault is None
    table.say(b"Resend: %d\nok\n" % asked)
    assert isinstance(table.connection.fault, PrinterError)


def test_a_single_damaged_resend_number_does_no_harm() -> None:
    table = opened()
    line = table.send("G1 X1")
    table.say(b"Resend: 91\nok\n")
    table.say(b"Resend: 11\nok\n")
    table.wait(0.2)
    table.wire()
    table.say(b"ok N11 P15 B3\n")
    assert table.connection.fault is None
    assert line == frame(11, "G1 X1")


@CHUNKS
@pytest.mark.parametrize(("said", "state", "error"), [
    (b"start\n", State.LOST, FirmwareError),
    (b"Error:Thermal Runaway, system stopped! Heater_ID: 0\nok\n", State.HALTED, FirmwareError),
    (b"!! Lost communication with MCU\nok\n", State.HALTED, FirmwareError),
    (b"ok P15 B3\n", State.LOST, PrinterError),
])  # fmt: skip
def test_fatal_words_end_the_conversation(size: int, said: bytes, state: State, error: type[Exception]) -> None:
    table = opened(size)
    table.connection.send("G1 X1", table.now_s)
    table.say(said)
    assert table.connection.state is state
    assert isinstance(table.connection.fault, error)
    assert table.wire() == b""
    assert table.connection.send("G1 X2", table.now_s) == 0


ACTS: dict[str, Callable[[Table, int], object]] = {
    "ok": lambda table, n: table.say(b"ok N%d P15 B3\n" % n),
    "bare": lambda table, n: table.say(b"ok\n"),
    "resend": lambda table, n: table.say(b"Resend: %d\nok\n" % n),
    "wait": lambda table, n: table.wait(n / 3),
    "busy": lambda table, n: table.say(b"echo:busy: processing\n"),
    "heat": lambda table, n: table.say(b"ok T:20 /0\n"),
    "send": lambda table, n: table.connection.can_send("G1 X1") and table.send("G1 X1"),
    "half": lambda table, n: table.say(b"ok N"),
}


@given(st.lists(st.tuples(st.sampled_from(sorted(ACTS)), st.integers(1, 40)), max_size=60))
def test_no_conversation_breaks_the_counts(acts: list[tuple[str, int]]) -> None:
    table = opened()
    for name, number in acts:
        ACTS[name](table, number)
        connection = table.connection
        assert 0 <= connection.window.acknowledged <= connection.window.sent
        assert (connection.fault is None) == (connection.state not in (State.HALTED, State.LOST))


def greeted_by(name: str, size: int = 10**6) -> Table:
    """A greeted printer that answers with plain oks and reports its name."""
    table = Table(size)
    table.wait(0.6)
    table.say(b"ok\nFIRMWARE_NAME:" + name.encode() + b"\nok\nok T:20.00 /0.00 B:20.00 /0.00\n")
    assert table.connection.state is State.OPEN
    table.wire()
    return table


@pytest.mark.parametrize(("name", "firmware"), [
    ("Marlin 2.1.2 (Jun 1 2024) SOURCE_CODE_URL:github.com/MarlinFirmware/Marlin", MARLIN),
    ("Prusa-Firmware 3.13.3 based on Marlin", MARLIN),
    ("Something nobody knows", MARLIN),
    ("Repetier_1.0.4 FIRMWARE_URL:https://github.com/repetier/Repetier-Firmware/", REPETIER),
    ("Smoothieware, FIRMWARE_URL:http%3A//smoothieware.org", SMOOTHIEWARE),
    (" RepRapFirmware for Duet 2 WiFi/Ethernet FIRMWARE_VERSION: 3.5.1", REPRAPFIRMWARE),
    ("Klipper FIRMWARE_VERSION:v0.12.0-100", KLIPPER),
])  # fmt: skip
def test_the_firmware_s_name_selects_its_rules(name: str, firmware: Firmware) -> None:
    assert greeted_by(name).connection.greeting.firmware is firmware


@pytest.mark.parametrize("name", ["RepRapFirmware for Duet", "Klipper"])
def test_an_unanswered_line_is_never_repeated_to_a_firmware_that_requests_no_resends(name: str) -> None:
    table = greeted_by(name)
    table.send("G1 X7")
    table.wait(4.1)
    assert table.wire() == frame(4, "M105")
    table.say(b"ok T:20.00 /0.00\n")
    assert isinstance(table.connection.fault, PrinterError)
    assert "line 3 (G1 X7) was not answered" in str(table.connection.fault)


def test_a_late_answer_of_a_firmware_without_resends_is_accepted() -> None:
    table = greeted_by("RepRapFirmware for Duet")
    table.send("G1 X7")
    table.wait(4.1)
    table.say(b"ok\nok T:20.00 /0.00\n")
    assert (table.connection.state, table.connection.window.acknowledged) == (State.OPEN, 4)


def test_klipper_s_macros_may_work_for_minutes_without_a_word() -> None:
    table = greeted_by("Klipper FIRMWARE_VERSION:v0.12.0")
    table.send("PRINT_START BED=60")
    table.wait(4.1)
    table.wait(500.0)
    assert table.wire() == frame(4, "M105")
    assert table.connection.fault is None


def test_smoothie_gives_no_ok_after_its_resend() -> None:
    table = greeted_by("Smoothieware")
    line = table.send("G1 X1")
    table.say(b"rs N3\r\n")
    table.wait(0.13)
    assert table.wire() == line
    table.say(b"ok\r\n")
    assert table.connection.window.acknowledged == 3


def test_repetier_gets_as_many_characters_as_its_buffer_holds() -> None:
    table = greeted_by("Repetier_1.0.4")
    for number in range(3, 11):
        table.send("G1 X1")
        table.say(b"ok %d\n" % number)
    written = b""
    while table.connection.can_send("G1 X100.5"):
        written += table.send("G1 X100.5")
    assert written.count(b"\n") == 127 // len(frame(11, "G1 X100.5"))


@pytest.mark.parametrize(("rx_bytes", "lines"), [(63, 1), (127, 3), (1023, 4)])
def test_the_window_is_limited_by_the_machine_s_buffer_and_the_printer_s_free_places(rx_bytes: int, lines: int) -> None:
    table = Table()
    table.connection = Connection(PATIENT, 0.0, rx_bytes=rx_bytes)
    table.wait(0.6)
    table.say(b"ok N0 P15 B3\nFIRMWARE_NAME:Marlin\nCap:EMERGENCY_PARSER:1\nok N1 P15 B3\nok T:20.00 /0.00\n")
    for _ in range(3, 11):
        table.say(b"ok N%d P15 B3\n" % table.connection.send("G1 X1", 0.0))
    table.wire()
    written = b""
    while table.connection.can_send("G1 X100.123 Y100.123 E1.123"):
        written += table.send("G1 X100.123 Y100.123 E1.123")
    assert written.count(b"\n") == lines


def test_two_lines_of_sixty_three_bytes_fill_the_ring_of_an_avr() -> None:
    table, command = opened(), "G1 X100.12345 Y100.12345 Z10.12345 E1.1234 F3600.12345"
    written = table.send(command)
    assert table.connection.can_send(command)
    written += table.send(command)
    assert (len(command), len(written)) == (54, 126)
    assert not table.connection.can_send("T0")


def numbered_to(last: int, advanced: bool = True) -> Table:
    """A greeted printer whose line numbers restart after `last`."""
    table = Table()
    table.connection = Connection(PATIENT, 0.0)
    table.connection.greeting.firmware = replace(MARLIN, line=replace(MARLIN.line, last_number=last))
    table.wait(0.6)
    table.say(b"ok N0 P15 B3\nok N1 P15 B3\nok T:20.00 /0.00\n" if advanced else b"ok\nok\nok T:20.00 /0.00\n")
    table.wire()
    return table


@pytest.mark.parametrize("advanced", [True, False])
def test_line_numbers_are_reset_before_they_grow_too_long(advanced: bool) -> None:
    table = numbered_to(4, advanced)
    for number in (3, 4):
        table.send("G1 X1")
        table.say(b"ok N%d P15 B3\n" % number if advanced else b"ok\n")
    assert not table.connection.can_send("G1 X1")
    table.wait(0.01)
    assert table.wire() == frame(1000, "M110 N1000")
    table.say(b"ok N1000 P15 B3\n" if advanced else b"ok\n")
    assert table.send("G1 X5") == frame(1001, "G1 X5")
    table.say(b"Error:checksum mismatch, Last Line: 1000\nResend: 1001\nok\n")
    assert table.wire() == frame(1001, "G1 X5")
    table.say(b"ok N1001 P15 B3\n" if advanced else b"ok\n")
    assert (table.connection.state, table.connection.window.acknowledged) == (State.OPEN, 5)


def test_a_damaged_new_beginning_of_the_numbers_is_given_again() -> None:
    table = numbered_to(3)
    table.send("G1 X1")
    table.say(b"ok N3 P15 B3\n")
    table.wait(0.01)
    first = table.wire()
    table.say(b"Error:checksum mismatch, Last Line: 3\nResend: 4\nok\n")
    table.wait(0.13)
    assert table.wire() == first
    table.say(b"ok N1000 P15 B3\n")
    assert table.connection.can_send("G1 X1")


def test_a_new_beginning_without_answer_ends_the_print() -> None:
    table = numbered_to(3)
    table.send("G1 X1")
    table.say(b"ok N3 P15 B3\n")
    for _ in range(600):
        table.wait(0.5)
    assert isinstance(table.connection.fault, SilenceError)


def test_a_banner_after_the_start_was_handled_does_not_restart_the_greeting() -> None:
    table = Table()
    table.wait(0.6)
    assert table.connection.state is State.SYNC
    table.say(b"Marlin 2.1.2\necho: Last Updated: 2024-09-29\n")
    assert table.connection.state is State.SYNC
    table.say(b"ok\nMarlin 2.1.2\n")
    assert table.connection.state is State.HELLO


def test_no_number_is_longer_than_a_checked_line_has_room_for() -> None:
    longest = "M117 " + "x" * (LINE_LIMIT - FRAME_CHARACTERS - 5)
    assert command_of(longest, 1) == longest
    assert all(len(frame(row.line.last_number + QUESTIONS_MOST, longest)) - 1 <= LINE_LIMIT for row in FIRMWARES)


def test_a_two_line_error_is_reported_whole_and_nothing_is_sent_meanwhile() -> None:
    table = opened()
    table.say(b"Error:0\n")
    assert (table.connection.fault, table.connection.can_send("G1 X1")) == (None, False)
    table.say(b": Extruder switched off. MAXTEMP triggered !\n")
    assert "Error:0: Extruder switched off. MAXTEMP triggered !" in str(table.connection.fault)


def test_an_error_without_its_second_line_is_still_an_error() -> None:
    table = opened()
    table.say(b"Error:0\n")
    table.wait(0.3)
    assert isinstance(table.connection.fault, FirmwareError)


def test_a_resend_request_for_every_tenth_line_is_too_much_noise() -> None:
    table = opened()
    for number in range(11, 300):
        table.send("G1 X1")
        if number % 5 == 0:
            table.say(b"Resend: %d\nok\n" % number)
        table.say(b"ok N%d P15 B3\n" % number)
        if table.connection.fault is not None:
            break
    assert "20 of the last 200 lines" in str(table.connection.fault)


RUBBISH = bytes(random.Random(5).choices([0, 0x80, 0xF8, 0xFE, 0x1C, 0xE6, 0x66, 0x06], k=60)) + b"\xfe"


def test_rubbish_of_a_wrong_baud_rate_is_recognised_and_other_rates_are_named() -> None:
    table = Table()
    table.connection = Connection(PATIENT, 0.0, baud=115200)
    for _ in range(4):
        table.say(RUBBISH)
        table.wait(3.1)
    assert str(table.connection.fault) == (
        "the bytes received at 115200 baud are garbled: the printer speaks at another rate, "
        "try --baud 250000, 230400, 500000, 1000000, 57600"
    )
    assert table.now_s < 13


def test_rubbish_of_a_boot_loader_before_the_banner_is_forgiven() -> None:
    table = Table()
    table.say(RUBBISH + b"start\nMarlin 2.1.2\n")
    table.wait(0.6)
    table.say(b"ok\nok\nok T:20 /0\n")
    assert table.connection.state is State.OPEN


def test_a_device_that_is_not_a_printer_is_reported_with_its_output() -> None:
    table = Table()
    while table.connection.fault is None and table.now_s < 100:
        table.say(b"$GPGGA,123519,4807.038,N\r\n")
        table.wait(1.0)
    assert "not a known printer: to 6 greetings it sent '$GPGGA,123519,4807.038,N'" in str(table.connection.fault)


@pytest.mark.parametrize("said", [b"\x00\xf8start\n", b"echo: Last Updated: 2024-09-29 | Author: (none)\n", b"Grbl 1.1h\n",
                                  b"RepRapFirmware for Duet 3 is up and running.\n", b"// Klipper state: Ready\n"])  # fmt: skip
def test_a_restart_is_heard_behind_rubbish_and_by_its_other_words(said: bytes) -> None:
    table = opened()
    table.send("G1 X1")
    table.say(said)
    assert "restarted in the middle of the print" in str(table.connection.fault)


def test_words_of_the_card_reader_do_not_stop_a_print() -> None:
    table = opened()
    table.say(b"Error:volume.init failed\necho:No media\n")
    assert table.connection.fault is None


def test_the_history_stays_bounded() -> None:
    table = opened()
    for _ in range(2000):
        table.say(b"ok N%d P15 B3\n" % table.connection.send("G1 X1", 0.0))
    assert len(table.connection.window._history) == HISTORY
