"""The sender's side of Marlin's serial protocol without I/O: received bytes go in, events and bytes to send come out.

The caller owns port and clock: it writes what take() gives, hands what it reads to receive() and calls tick() now and then.
"""

from collections import deque
from collections.abc import Callable
from dataclasses import dataclass

from machine.link.events import (
    Busy,
    Capability,
    Echo,
    Event,
    FirmwareFault,
    Ok,
    Resend,
    Start,
    Wait,
    read_event,
)
from machine.link.framing import frame, name_of
from machine.link.states import TABLE, Signal, State
from profiles.errors import FirmwareError, LocalProtocolError, PrinterError, RemoteProtocolError, SilenceError

RX_BYTES = 127  # an AVR's 128-byte receive ring holds one byte less; a fuller one loses bytes without a word
HEARD_LIMIT = 4096  # a line without end is thrown away beyond this; Marlin's longest answer has 300 characters
HISTORY = 512  # lines kept for a repeat: far more than any printer's buffers hold
GREETING = 2  # M115 and M105 are lines 1 and 2; a later wish for one of them means that the printer restarted
NEAR = 8  # one acknowledgement too many or few is usual after noise; a wish further back is asked for twice
SYNC_TRIES = 6  # a board that resets on opening spends one or two of them in its boot loader
PROBES = 4  # M105 in a row without any answer before the printer counts as gone
ASKED_LIMIT = 10  # the same line asked for so often means that the cable is too noisy (OctoPrint's figure)
CLEAN_LINES = 8  # after an error so many acknowledgements are awaited one by one before the window opens again
QUIET_MOST_S = 2.0  # a printer that chatters on its own must not hold up a repeat for ever

# Commands whose `ok` takes its time, with the most it may take, s. They are sent alone.
BUDGET_S = {
    "G4": 3600.0,
    "G28": 600.0,
    "G29": 1800.0,
    "M109": 3600.0,
    "M190": 3600.0,
    "M191": 3600.0,
    "M303": 3600.0,
    "M400": 3600.0,
    "M600": 86400.0,
}


@dataclass(frozen=True)
class Timing:
    """How long the sender is patient, s."""

    stall_s: float = 4.0  # without acknowledgement from a printer known to say `busy:` every 2 s
    stall_mute_s: float = 30.0  # the same for a printer that never said it; one slow move may take this long
    sync_s: float = 3.0  # for an answer to M110, M115: a boot loader takes up to 2 s
    drain_s: float = 0.5  # of silence after opening
    quiet_s: float = 0.12  # of silence before a repeat: the lines still in the cable and the ring have been flushed then


@dataclass(frozen=True, slots=True)
class Sent:
    """A line in flight."""

    number: int
    size: int
    asks_temperature: bool
    budget_s: float


class Protocol:
    """One conversation. `fault` is the error that ended it, None while it lasts."""

    def __init__(self, timing: Timing | None = None, now_s: float = 0.0) -> None:
        self.state = State.DRAIN
        self.fault: PrinterError | None = None
        self.sent = 0
        self.acknowledged = 0
        self.repeated = 0
        self.strays = 0
        self.advanced = False
        self.capabilities: dict[str, bool] = {}
        self._timing = timing or Timing()
        self._out = bytearray()
        self._heard = b""
        self._overflow = False
        self._history: dict[int, bytes] = {}
        self._flight: deque[Sent] = deque()
        self._flight_bytes = 0
        self._tries = 0
        self._probes = 0
        self._probe = 0
        self._waits = 0
        self._doubt = 0
        self._next_repeat = 1
        self._asked = 0
        self._asked_times = 0
        self._clean = 0
        self._places = 1
        self._busy_known = False
        self._temperature_known = False
        self._swallow = False
        self._alone = False
        self._unknown_echoed = False
        self._heard_s = self._progress_s = self._entered_s = now_s

    def room(self, command: str) -> bool:
        """Whether this command may be sent now."""
        if self.state is not State.OPEN:
            return False
        flight = self._flight
        if not flight:
            return True
        if self._clean < CLEAN_LINES or len(flight) >= self._window() or flight[-1].budget_s:
            return False
        return self._flight_bytes + len(command) + 16 <= RX_BYTES and not _budget_s(command)

    def send(self, command: str, now_s: float) -> int:
        """Number a command, keep it for repeats and queue its bytes; returns its line number."""
        if not self.room(command):
            raise LocalProtocolError(f"{command!r} was to be sent while the printer has no room for it")
        return self._transmit(command, now_s)

    def take(self) -> bytes:
        """The bytes to write to the port now."""
        out = bytes(self._out)
        self._out.clear()
        return out

    def receive(self, data: bytes, now_s: float) -> list[Event]:
        """The events of received bytes, in any portions; look at `fault` afterwards."""
        self._heard_s = now_s
        *lines, self._heard = (self._heard + data).split(b"\n")
        if lines and self._overflow:
            self._overflow = False
            del lines[0]
        if len(self._heard) > HEARD_LIMIT or self._overflow:
            self._heard, self._overflow = b"", True
        events = [read_event(line) for line in lines if line]
        for event in events:
            if act := _ACTS.get(type(event)):
                act(self, event, now_s)
        return events

    def tick(self, now_s: float) -> None:
        """Let time pass: drains, pauses before a repeat, stalls; look at `fault` afterwards."""
        state, timing = self.state, self._timing
        if state is State.DRAIN:
            if now_s - self._heard_s >= timing.drain_s or now_s - self._entered_s >= timing.sync_s:
                self._turn(Signal.HUSH, now_s)
        elif state is State.QUIET:
            if now_s - self._heard_s >= timing.quiet_s or now_s - self._entered_s >= QUIET_MOST_S:
                self._turn(Signal.HUSH, now_s)
        elif state in (State.SYNC, State.HELLO):
            if now_s - self._progress_s >= timing.sync_s:
                self._turn(Signal.STALL, now_s)
        elif self._flight and now_s - self._progress_s >= self._patience_s():
            self._turn(Signal.STALL, now_s)

    def _patience_s(self) -> float:
        if self.state is State.PROBING and self._flight[0].budget_s:
            return self._flight[0].budget_s
        return self._timing.stall_s if self._busy_known else self._timing.stall_mute_s

    def _window(self) -> int:
        """Lines in flight: one until the printer tells numbers; one place stays free so that it sees an M112 at once."""
        if not self.advanced:
            return 1
        return max(1, self._places if self.capabilities.get("EMERGENCY_PARSER") else self._places - 1)

    def _transmit(self, command: str, now_s: float) -> int:
        number = self.sent + 1
        framed = frame(number, command)
        self.sent = number
        self._history[number] = framed
        self._history.pop(number - HISTORY, None)
        self._launch(number, framed, command, now_s)
        return number

    def _launch(self, number: int, framed: bytes, command: str, now_s: float) -> None:
        if not self._flight:
            self._progress_s = now_s
        self._flight.append(Sent(number, len(framed), command == "M105", _budget_s(command)))
        self._flight_bytes += len(framed)
        self._out += framed

    def _turn(self, signal: Signal, now_s: float, error: PrinterError | None = None) -> None:
        """Follow the table, then do what belongs to entering the state."""
        state = TABLE[self.state].get(signal)
        if state is None:
            return
        self.state, self._entered_s, self._progress_s = state, now_s, now_s
        if state in (State.HALTED, State.LOST):
            self.fault = error or SilenceError("the printer does not answer")
            self._out.clear()
        elif act := _ENTER.get(state):
            act(self, now_s)

    def _enter_sync(self, now_s: float) -> None:
        self._tries += 1
        if self._tries > SYNC_TRIES:
            text = f"the printer did not answer {SYNC_TRIES} greetings: it may be off, or speak at another baud rate"
            self._turn(Signal.SILENT, now_s, SilenceError(text))
            return
        self.sent = self.acknowledged = 0
        self._ground()
        self._history.clear()
        self._out += b"\n" + b"N0 M110 N0*125\n"  # the newline ends a half line of an earlier session

    def _enter_hello(self, now_s: float) -> None:
        self._transmit("M115", now_s)

    def _enter_open(self, _now_s: float) -> None:
        self._probes = self._doubt = self._probe = 0

    def _enter_probing(self, now_s: float) -> None:
        """Ask with a NEW number: Marlin swallows a repeat of its last line without a word."""
        self._probes += 1
        self._clean = 0
        if self._probes > PROBES:
            text = f"the printer has been silent: line {self.acknowledged + 1} and {PROBES} questions remained without answer"
            self._turn(Signal.SILENT, now_s, SilenceError(text))
            return
        number = self._transmit("M105", now_s)
        self._probe = self._probe or number

    def _enter_quiet(self, _now_s: float) -> None:
        self._clean = self._probes = self._doubt = self._probe = 0
        self._alone = self.sent <= self._next_repeat
        self._ground()

    def _enter_repeat(self, now_s: float) -> None:
        self._swallow = False
        self._repeat_next(now_s)

    def _repeat_next(self, now_s: float) -> None:
        if self._next_repeat > self.sent:
            self._turn(Signal.CAUGHT_UP, now_s)
            return
        number = self._next_repeat
        framed = self._history[number]
        self._next_repeat += 1
        self.repeated += 1
        command = framed[framed.index(b" ") + 1 : framed.rindex(b"*")].decode("ascii")
        self._launch(number, framed, command, now_s)

    def _ground(self) -> None:
        """Nothing is in flight any more."""
        self._flight.clear()
        self._flight_bytes = 0

    def _on_ok(self, ok: Ok, now_s: float) -> None:
        unknown, self._unknown_echoed = self._unknown_echoed, False
        if ok.line is not None:
            self._learn(ok)
        if self.state is State.SYNC:
            self._turn(Signal.SYNCED, now_s)
        elif self.state is State.QUIET:
            if self._alone and ok.line is None and ok.temperature is None:
                self._turn(Signal.HUSH, now_s)  # the ok that belongs to the Resend, and nothing else is on its way
        elif ok.temperature is not None:
            self._temperature_known = True
            self._acknowledge(self._answered_question(), now_s)
        elif self.advanced:
            if ok.line is None and ok.planner_free is not None and not unknown:
                text = f"the printer ran part of a torn line after line {self.acknowledged}: what it did is not known"
                self._turn(Signal.UNCHECKED, now_s, RemoteProtocolError(text))
            else:
                self._acknowledge(ok.line, now_s)
        elif self._swallow:
            self._swallow = False
        else:
            self._acknowledge_oldest(now_s)

    def _answered_question(self) -> int | None:
        """The line that an `ok T:` acknowledges: the oldest question; nothing but questions follows the first probe."""
        number = next((s.number for s in self._flight if s.asks_temperature), None)
        probing = self.state is State.PROBING and number is not None and number >= self._probe
        return self.sent if probing else number

    def _learn(self, ok: Ok) -> None:
        self.advanced = True
        if ok.rx_free is not None:
            self._places = max(self._places, min(ok.rx_free + 1, 16))  # B counts the line itself as still there

    def _acknowledge_oldest(self, now_s: float) -> None:
        oldest = self._flight[0] if self._flight else None
        if oldest is not None and oldest.asks_temperature and self._temperature_known:
            oldest = None  # its answer would have begun with `ok T:`
        self._acknowledge(None if oldest is None else oldest.number, now_s)

    def _acknowledge(self, number: int | None, now_s: float) -> None:
        """This line and all before it have arrived."""
        flight = self._flight
        if number is None or not flight or not flight[0].number <= number <= flight[-1].number:
            self.strays += 1
            return
        while flight and flight[0].number <= number:
            self._flight_bytes -= flight.popleft().size
            self._clean += 1
        self.acknowledged = max(self.acknowledged, number)
        self._progress_s = now_s
        self._waits = self._probes = 0
        if self._asked and number > self._asked:
            self._asked = 0
        if self.state is not State.OPEN:
            self._go_on(number, now_s)

    def _go_on(self, number: int, now_s: float) -> None:
        if self.state is State.HELLO:
            if number < GREETING:
                self._transmit("M105", now_s)
            else:
                self._turn(Signal.GREETED, now_s)
        elif self.state is State.PROBING and number >= self._probe:
            self._turn(Signal.ANSWERED, now_s)
        elif self.state is State.REPEAT and not self._flight:
            self._repeat_next(now_s)

    def _on_resend(self, resend: Resend, now_s: float) -> None:
        number = resend.line
        if self.state is State.SYNC:
            return
        self._swallow = True
        plausible = GREETING < number <= self.sent + 1 and number > self.acknowledged - NEAR
        if self.state is State.HELLO or (plausible and self.state is not State.QUIET):
            self._wanted(number, now_s)
        elif plausible:
            self._next_repeat = number
        elif self.state is State.PROBING and self._doubt == number:
            self._turn(Signal.IMPOSSIBLE, now_s, self._absurd(number))
        else:
            self._doubt = number
            self._turn(Signal.DOUBT, now_s)

    def _wanted(self, number: int, now_s: float) -> None:
        self._asked_times = self._asked_times + 1 if number == self._asked else 1
        self._asked = number
        if self._asked_times > ASKED_LIMIT:
            text = f"the printer asked for line {number} {ASKED_LIMIT} times: the cable or the adapter is too noisy"
            self._turn(Signal.IMPOSSIBLE, now_s, RemoteProtocolError(text))
            return
        self._next_repeat = number
        self.acknowledged = number - 1
        self._turn(Signal.RESEND, now_s)

    def _absurd(self, number: int) -> PrinterError:
        if number <= GREETING:
            return FirmwareError(f"the printer restarted without a word after line {self.acknowledged}: {RESTARTED}")
        return RemoteProtocolError(
            f"the printer asks for line {number}, although line {self.sent} is the last one sent "
            f"and {self.acknowledged} are acknowledged"
        )

    def _on_busy(self, _busy: Busy, now_s: float) -> None:
        self._busy_known = True
        self._progress_s = now_s

    def _on_start(self, _start: Start, now_s: float) -> None:
        text = f"the printer restarted in the middle of the print, after line {self.acknowledged}: {RESTARTED}"
        self._turn(Signal.START, now_s, FirmwareError(text))

    def _on_fault(self, fault: FirmwareFault, now_s: float) -> None:
        self._turn(Signal.FAULT, now_s, FirmwareError(f"the printer reported: {fault.text}"))

    def _on_wait(self, _wait: Wait, now_s: float) -> None:
        self._waits += 1
        if self._waits >= 2 and self._flight:  # nothing to do twice in a row: our line was lost
            self._waits = 0
            self._turn(Signal.STALL, now_s)

    def _on_echo(self, echo: Echo, _now_s: float) -> None:
        if "nknown command" in echo.text:
            self._unknown_echoed = True

    def _on_capability(self, capability: Capability, _now_s: float) -> None:
        self.capabilities[capability.name] = capability.present


RESTARTED = "position and temperatures are lost, the print cannot go on"

_ENTER: dict[State, Callable[[Protocol, float], None]] = {
    State.SYNC: Protocol._enter_sync,
    State.HELLO: Protocol._enter_hello,
    State.OPEN: Protocol._enter_open,
    State.PROBING: Protocol._enter_probing,
    State.QUIET: Protocol._enter_quiet,
    State.REPEAT: Protocol._enter_repeat,
}
_ACTS: dict[type[Event], Callable[..., None]] = {
    Ok: Protocol._on_ok,
    Resend: Protocol._on_resend,
    Busy: Protocol._on_busy,
    Start: Protocol._on_start,
    FirmwareFault: Protocol._on_fault,
    Wait: Protocol._on_wait,
    Echo: Protocol._on_echo,
    Capability: Protocol._on_capability,
}


def _budget_s(command: str) -> float:
    """The time budget of a slow command, 0 for a quick one."""
    second = command[1] if len(command) > 1 else ""
    if command[0] == "G" and second in "01":  # most lines of a program; none of these is slow
        return 0.0
    return BUDGET_S.get(name_of(command), 0.0)
