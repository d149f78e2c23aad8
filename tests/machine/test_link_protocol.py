from collections.abc import Callable
from functools import reduce
from operator import xor

import pytest
from hypothesis import given
from hypothesis import strategies as st

from machine.link.events import (
    Busy,
    Capability,
    Echo,
    Event,
    FirmwareFault,
    LineError,
    Ok,
    Position,
    Resend,
    Start,
    Temperature,
    Unknown,
    Wait,
    read_event,
)
from machine.link.framing import LINE_LIMIT, checksum, command_of, frame
from machine.link.protocol import ASKED_LIMIT, HEARD_LIMIT, PROBES, SYNC_TRIES, Protocol, Timing
from machine.link.states import TABLE, Signal, State
from machine.link.window import RX_BYTES
from profiles.errors import FirmwareError, LocalProtocolError, RemoteProtocolError, SilenceError

LINES: list[tuple[bytes, Event]] = [
    (b"ok", Ok(text="ok")),
    (b"ok N12 P15 B3", Ok(12, 15, 3, None, "ok N12 P15 B3")),
    (b"ok P15 B3", Ok(None, 15, 3, None, "ok P15 B3")),
    (b"ok 7\r", Ok(7, text="ok 7")),
    (b"ok T:19.38 /0.00 @:0", Ok(temperature=Temperature(19.38, 0.0), text="ok T:19.38 /0.00 @:0")),
    (b"ok B:20.5 /0.0 T0:19.5 /0.0", Ok(
        temperature=Temperature(19.5, 0.0, 20.5, 0.0), text="ok B:20.5 /0.0 T0:19.5 /0.0")),
    (b" T:19.38 /0.00 B:20.00 /60.00 C:30.1 /0.0 @:0", Temperature(19.38, 0.0, 20.0, 60.0)),
    (b"T:210.00 E:0 B:60.0 W:?", Temperature(210.0, None, 60.0, None)),
    (b"Resend: 12", Resend(12)),
    (b"Resend:12\r", Resend(12)),
    (b"rs N12", Resend(12)),
    (b"echo:busy: processing", Busy("echo:busy: processing")),
    (b"busy: paused for user", Busy("busy: paused for user")),
    (b"X:1.00 Y:2.00 Z:3.00 A:-30.00 C:725.00 E:0.10 Count X:80 Y:160", Position((
        ("X", 1.0), ("Y", 2.0), ("Z", 3.0), ("A", -30.0), ("C", 725.0), ("E", 0.1)))),
    (b"Error:checksum mismatch, Last Line: 4", LineError("Error:checksum mismatch, Last Line: 4")),
    (b"Error:Line Number is not Last Line Number+1, Last Line: 4", LineError(
        "Error:Line Number is not Last Line Number+1, Last Line: 4")),
    (b"Error:Thermal Runaway, system stopped! Heater_ID: 0", FirmwareFault(
        "Error:Thermal Runaway, system stopped! Heater_ID: 0")),
    (b"!! Lost communication with MCU", FirmwareFault("!! Lost communication with MCU")),
    (b"fatal: heater", FirmwareFault("fatal: heater")),
    (b'echo:Unknown command: "5 G92"', Echo('Unknown command: "5 G92"')),
    (b"//action:pause\r", Echo("action:pause")),
    (b"Cap:EMERGENCY_PARSER:1", Capability("EMERGENCY_PARSER", True)),
    (b"start", Start()),
    (b"wait", Wait()),
    (b"\xff\xfeok", Unknown("\ufffd\ufffdok")),
    (b"o", Unknown("o")),
    (b"okay", Unknown("okay")),
]  # fmt: skip
PATIENT = Timing(stall_s=4.0, stall_mute_s=30.0, sync_s=3.0, drain_s=0.5, quiet_s=0.12)
HELLO = b"N1 M115*39\n"
ASK2 = b"N2 M105*37\n"
CHUNKS = pytest.mark.parametrize("size", [1, 3, 10**6])


class Table:
    """A protocol on a bench: say() is the printer, wait() the clock, wire() what the sender wrote since the last look."""

    def __init__(self, size: int = 10**6) -> None:
        self.now_s, self.size = 0.0, size
        self.protocol = Protocol(PATIENT, 0.0)

    def say(self, text: bytes) -> list[Event]:
        events = []
        for begin in range(0, len(text), self.size):
            events += self.protocol.receive(text[begin : begin + self.size], self.now_s)
        return events

    def wait(self, seconds: float) -> None:
        self.now_s += seconds
        self.protocol.tick(self.now_s)

    def wire(self) -> bytes:
        return self.protocol.take()

    def send(self, *commands: str) -> bytes:
        for command in commands:
            self.protocol.send(command, self.now_s)
        return self.wire()


def opened(size: int = 10**6, advanced: bool = True) -> Table:
    """A greeted printer; the window is open where it tells numbers."""
    table = Table(size)
    table.wait(0.6)
    table.say(b"ok N0 P15 B3\n" if advanced else b"ok\n")
    table.say(b"FIRMWARE_NAME:M\nCap:EMERGENCY_PARSER:1\nok N1 P15 B3\n" if advanced else b"FIRMWARE_NAME:M\nok\n")
    table.say(b"ok T:20.00 /0.00 B:20.00 /0.00\n")
    assert table.protocol.state is State.OPEN
    for number in range(3, 11):
        table.send("G4 P0" if number == 3 else f"G1 X{number}")
        table.say(b"ok N%d P15 B3\n" % number if advanced else b"ok\n")
    return table


@pytest.mark.parametrize(("line", "event"), LINES)
def test_a_line_is_read_as_its_event(line: bytes, event: Event) -> None:
    assert read_event(line) == event


@CHUNKS
def test_the_events_do_not_depend_on_how_the_bytes_were_cut(size: int) -> None:
    whole = b"".join(line + b"\n" for line, _ in LINES)
    assert Table(size).say(whole) == [event for _, event in LINES]


@given(st.binary(max_size=300))
def test_any_bytes_are_survived_and_read_the_same_in_portions(data: bytes) -> None:
    whole, single = Table().say(data), Table(1).say(data)
    assert whole == single


def test_a_line_without_end_is_thrown_away_and_its_tail_is_no_answer() -> None:
    table = opened()
    table.send("G1 X1")
    for _ in range(3):
        assert table.say(b"x" * HEARD_LIMIT) == []
    assert table.say(b"\nok N11 P15 B3\n") == [Ok(11, 15, 3, None, "ok N11 P15 B3")]


@given(st.binary(max_size=128))
def test_the_folded_checksum_is_the_xor_of_all_bytes(body: bytes) -> None:
    assert checksum(body) == reduce(xor, body, 0)


@pytest.mark.parametrize(("number", "command", "line"), [
    (0, "M110 N0", b"N0 M110 N0*125\n"),
    (3, "T0", b"N3 T0*57\n"),
    (4, "G92 E0", b"N4 G92 E0*67\n"),
    (5, "G28", b"N5 G28*22\n"),
    (6, "G1 F1500.0", b"N6 G1 F1500.0*82\n"),
    (7, "G1 X2.0 Y2.0 F3000.0", b"N7 G1 X2.0 Y2.0 F3000.0*85\n"),
])  # fmt: skip
def test_framing_gives_the_lines_of_the_reprap_wiki(number: int, command: str, line: bytes) -> None:
    assert frame(number, command) == line


def test_the_longest_framed_line_is_what_marlin_keeps() -> None:
    assert max(len(frame(1, "M117 " + "x" * n)) - 1 for n in range(80, 84)) <= LINE_LIMIT
    with pytest.raises(LocalProtocolError, match="at most 95"):
        frame(1, "M117 " + "x" * 90)


@pytest.mark.parametrize(("line", "command"), [
    ("G1 X1 ; out\n", "G1 X1"), ("  G28  ", "G28"), (";only", ""), ("\n", ""), ("G1\tX1", "G1 X1"), ("M117 ö;", None),
    ("M117 a*b", None), ("M112", None), ("m110 N5", None), ("M1080", "M1080"), ("M117 " + "x" * 90, None),
])  # fmt: skip
def test_a_line_of_a_program_becomes_a_command_or_is_refused(line: str, command: str | None) -> None:
    if command is not None:
        assert command_of(line, 7) == command
        return
    with pytest.raises(LocalProtocolError, match="line 7"):
        command_of(line, 7)


def test_the_table_leads_from_everywhere_to_an_end_and_nowhere_from_there() -> None:
    assert set(TABLE) == set(State)
    assert TABLE[State.HALTED] == TABLE[State.LOST] == {}
    for state in set(State) - {State.DRAIN, State.HALTED, State.LOST}:
        assert TABLE[state][Signal.FAULT] is State.HALTED


@CHUNKS
def test_the_greeting_agrees_on_numbers_then_asks_who_is_there(size: int) -> None:
    table = Table(size)
    table.say(b"T:20 /0\nhalf a li")
    table.wait(0.4)
    assert table.wire() == b""
    table.wait(0.2)
    assert table.wire() == b"\nN0 M110 N0*125\n"
    table.say(b"ne\nok\n")
    assert table.wire() == HELLO
    table.say(b"FIRMWARE_NAME:Marlin\nCap:AUTOREPORT_TEMP:1\nok\n")
    assert table.wire() == ASK2
    table.say(b"ok T:20.00 /0.00\n")
    assert table.protocol.state is State.OPEN
    assert table.protocol.capabilities == {"AUTOREPORT_TEMP": True}


def test_a_board_that_restarts_on_opening_is_greeted_again() -> None:
    table = Table()
    table.wait(0.6)
    table.wire()
    table.wait(1.0)
    table.say(b"start\necho: Last Updated\n")
    assert table.wire() == b"\nN0 M110 N0*125\n"
    table.say(b"ok\n")
    table.say(b"start\n")
    assert table.protocol.state is State.SYNC
    assert table.protocol.fault is None


def test_a_mute_printer_is_given_up_after_some_greetings() -> None:
    table = Table()
    for _ in range(SYNC_TRIES + 2):
        table.wait(3.1)
    assert isinstance(table.protocol.fault, SilenceError)
    assert table.now_s < 30


def test_a_plain_printer_gets_one_line_at_a_time() -> None:
    table = opened(advanced=False)
    table.send("G1 X1")
    assert not table.protocol.room("G1 X2")
    table.say(b"ok\n")
    assert table.protocol.room("G1 X2")


def test_a_printer_that_tells_numbers_gets_what_its_ring_holds() -> None:
    table, command = opened(), "G1 X100.123 Y100.123 E1.12345"
    written = b""
    while table.protocol.room(command):
        written += table.send(command)
    assert written.count(b"\n") == 3
    assert len(written) <= RX_BYTES
    short = opened()
    assert sum(len(short.send("G1 X1")) > 0 for _ in range(9) if short.protocol.room("G1 X1")) == 4


def test_a_numbered_ok_acknowledges_all_lines_before_it_too() -> None:
    table = opened()
    table.send("G1 X1", "G1 X2", "G1 X3")
    table.say(b"ok N12 P15 B3\n")
    assert table.protocol.window.acknowledged == 12


def test_slow_commands_travel_alone() -> None:
    table = opened()
    table.send("G1 X1")
    assert not table.protocol.room("M109 S200")
    table.say(b"ok N11 P15 B3\n")
    table.send("M109 S200")
    assert not table.protocol.room("G1 X1")


@CHUNKS
@pytest.mark.parametrize("advanced", [True, False])
def test_a_resend_repeats_the_line_once_and_its_ok_acknowledges_nothing(size: int, advanced: bool) -> None:
    table = opened(size, advanced)
    first = table.send("G1 X1")
    table.say(b"Error:checksum mismatch, Last Line: 10\nResend: 11\nok\n")
    assert table.wire() == first
    assert table.protocol.window.acknowledged == 10
    table.say(b"ok N11 P15 B3\n" if advanced else b"ok\n")
    assert table.protocol.window.acknowledged == 11
    assert table.protocol.state is State.OPEN


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
    assert table.protocol.state is State.OPEN


def test_a_resend_without_its_ok_goes_on_after_a_pause() -> None:
    table = opened(advanced=False)
    line = table.send("G1 X1")
    table.say(b"Resend: 11\n")
    table.wait(0.13)
    assert table.wire() == line
    table.say(b"ok\n")
    assert table.protocol.window.acknowledged == 11


@pytest.mark.parametrize("advanced", [True, False])
def test_a_lost_ok_is_cleared_up_by_a_new_question_never_by_a_repeat(advanced: bool) -> None:
    table = opened(advanced=advanced)
    table.send("G1 X1")
    table.wait(29.0)
    assert table.wire() == b""
    table.wait(1.1)
    assert table.wire() == frame(12, "M105")
    table.say(b"ok T:20.00 /0.00\n")
    assert (table.protocol.state, table.protocol.window.acknowledged) == (State.OPEN, 12)


def test_a_question_answered_by_resend_shows_which_line_was_lost() -> None:
    table = opened(advanced=False)
    line = table.send("G1 X1")
    table.wait(30.1)
    table.wire()
    table.say(b"Error:Line Number is not Last Line Number+1, Last Line: 10\nResend: 11\nok\n")
    table.wait(0.13)
    assert table.wire() == line
    table.say(b"ok\n")
    assert table.wire() == frame(12, "M105")


def test_busy_shortens_patience_and_restarts_it() -> None:
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
    assert table.protocol.state is State.PROBING


def test_heating_may_take_its_time_after_one_question() -> None:
    table = opened()
    table.send("M109 S200")
    for _ in range(600):
        table.wait(1.0)
        table.say(b"T:100.00 /200.00 W:?\n")
    assert table.wire() == frame(12, "M105")
    assert table.protocol.fault is None
    table.say(b"ok N11 P15 B3\nok T:200 /200\n")
    assert table.protocol.state is State.OPEN


def test_a_dead_printer_is_given_up_in_bounded_time() -> None:
    table = opened()
    table.send("G1 X1")
    while table.protocol.fault is None and table.now_s < 1000:
        table.wait(0.5)
    assert isinstance(table.protocol.fault, SilenceError)
    assert table.now_s < 30.0 * (PROBES + 2)


def test_two_waits_with_a_line_in_flight_ask_at_once() -> None:
    table = opened()
    table.send("G1 X1")
    table.say(b"wait\nwait\n")
    assert table.wire() == frame(12, "M105")


@pytest.mark.parametrize("surplus", [b"ok\n", b"ok\nok\nok\n", b"ok N99 P15 B3\n", b"ok N4 P15 B3\n"])
def test_surplus_oks_are_never_credited_forward(surplus: bytes) -> None:
    table = opened()
    table.say(surplus)
    table.send("G1 X1", "G1 X2")
    table.say(surplus)
    assert table.protocol.window.acknowledged == 10


def test_a_plain_ok_does_not_answer_the_question_for_the_temperature() -> None:
    table = opened(advanced=False)
    table.send("M105")
    table.say(b"ok\n")
    assert table.protocol.window.acknowledged == 10
    table.say(b"ok T:20.00 /0.00\n")
    assert table.protocol.window.acknowledged == 11


def test_a_resend_of_a_handshake_line_twice_is_a_restart() -> None:
    table = opened()
    table.send("G1 X1")
    table.say(b"Resend: 1\nok\n")
    assert table.wire() == frame(12, "M105")
    assert table.protocol.fault is None
    table.say(b"Resend: 1\nok\n")
    assert isinstance(table.protocol.fault, FirmwareError)
    assert "restarted" in str(table.protocol.fault)


@pytest.mark.parametrize("number", [10**6, 14, 3])
def test_a_wish_for_an_impossible_line_is_an_error_when_it_is_repeated(number: int) -> None:
    table = opened()
    for _ in range(20):
        table.say(b"ok N%d P15 B3\n" % table.protocol.send("G1 X1", table.now_s))
    asked = number + (20 if number == 14 else 0)
    table.say(b"Resend: %d\nok\n" % asked)
    assert table.protocol.fault is None
    table.say(b"Resend: %d\nok\n" % asked)
    assert isinstance(table.protocol.fault, RemoteProtocolError)


def test_a_single_damaged_resend_number_does_no_harm() -> None:
    table = opened()
    line = table.send("G1 X1")
    table.say(b"Resend: 91\nok\n")
    table.say(b"Resend: 11\nok\n")
    table.wait(0.2)
    table.wire()
    table.say(b"ok N11 P15 B3\n")
    assert table.protocol.fault is None
    assert line == frame(11, "G1 X1")


def test_the_same_line_asked_for_again_and_again_ends_the_print() -> None:
    table = opened()
    table.send("G1 X1")
    for asked in range(ASKED_LIMIT + 1):
        assert table.protocol.fault is None, asked
        table.say(b"Resend: 11\nok\n")
    assert isinstance(table.protocol.fault, RemoteProtocolError)


@CHUNKS
@pytest.mark.parametrize(("said", "state", "error"), [
    (b"start\n", State.LOST, FirmwareError),
    (b"Error:Thermal Runaway, system stopped! Heater_ID: 0\nok\n", State.HALTED, FirmwareError),
    (b"!! Lost communication with MCU\nok\n", State.HALTED, FirmwareError),
    (b"ok P15 B3\n", State.LOST, RemoteProtocolError),
])  # fmt: skip
def test_fatal_words_end_the_conversation(size: int, said: bytes, state: State, error: type[Exception]) -> None:
    table = opened(size)
    table.protocol.send("G1 X1", table.now_s)
    table.say(said)
    assert table.protocol.state is state
    assert isinstance(table.protocol.fault, error)
    assert table.wire() == b""
    with pytest.raises(LocalProtocolError):
        table.send("G1 X2")


def test_a_torn_line_that_the_printer_did_not_understand_does_no_harm() -> None:
    table = opened()
    table.send("G1 X1")
    table.say(b'echo:Unknown command: "11 G1 X1*97"\nok P15 B3\n')
    assert table.protocol.fault is None
    assert table.protocol.window.acknowledged == 10


ACTS: dict[str, Callable[[Table, int], object]] = {
    "ok": lambda table, n: table.say(b"ok N%d P15 B3\n" % n),
    "bare": lambda table, n: table.say(b"ok\n"),
    "resend": lambda table, n: table.say(b"Resend: %d\nok\n" % n),
    "wait": lambda table, n: table.wait(n / 3),
    "busy": lambda table, n: table.say(b"echo:busy: processing\n"),
    "heat": lambda table, n: table.say(b"ok T:20 /0\n"),
    "send": lambda table, n: table.protocol.room("G1 X1") and table.send("G1 X1"),
    "half": lambda table, n: table.say(b"ok N"),
}


@given(st.lists(st.tuples(st.sampled_from(sorted(ACTS)), st.integers(1, 40)), max_size=60))
def test_no_conversation_breaks_the_counts(acts: list[tuple[str, int]]) -> None:
    table = opened()
    for name, number in acts:
        ACTS[name](table, number)
        protocol = table.protocol
        assert 0 <= protocol.window.acknowledged <= protocol.window.sent
        assert (protocol.fault is None) == (protocol.state not in (State.HALTED, State.LOST))
