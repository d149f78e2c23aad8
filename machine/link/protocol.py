"""The sender's side of Marlin's serial protocol without I/O: received bytes go in, events and bytes to send come out.

The caller owns port and clock: it writes what take() gives, hands what it reads to receive() and calls tick() now and then.
"""

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
from machine.link.framing import LINE_LIMIT
from machine.link.states import TABLE, Signal, State
from machine.link.window import Window
from profiles.errors import FirmwareError, LocalProtocolError, PrinterError, RemoteProtocolError, SilenceError

HEARD_LIMIT = 4096  # a line without end is thrown away beyond this; Marlin's longest answer has 300 characters
GREETING = 2  # M115 and M105 are lines 1 and 2; a later wish for one of them means that the printer restarted
NEAR = 8  # one acknowledgement too many or few is usual after noise; a wish further back is asked for twice
SYNC_TRIES = 6  # a board that resets on opening spends one or two of them in its boot loader
PROBES = 4  # M105 in a row without any answer before the printer counts as gone
ASKED_LIMIT = 10  # the same line asked for so often means that the cable is too noisy (OctoPrint's figure)
CLEAN_LINES = 8  # acknowledgements awaited one by one before the window opens
# After each error four times as many: when a line is refused the printer throws away what it has of the next one, and the rest of
# that one may be run without check. A window of one line cannot be torn so, and costs a tenth of the speed.
CAUTION_MOST = 8192
QUIET_MOST_S = 2.0  # a printer that chatters on its own must not hold up a repeat for ever


@dataclass(frozen=True)
class Timing:
    """How long the sender is patient, s."""

    stall_s: float = 4.0  # without acknowledgement from a printer known to say `busy:` every 2 s
    stall_mute_s: float = 30.0  # the same for a printer that never said it; one slow move may take this long
    sync_s: float = 3.0  # for an answer to M110, M115: a boot loader takes up to 2 s
    drain_s: float = 0.5  # of silence after opening
    quiet_s: float = 0.12  # of silence before a repeat: the lines still in the cable and the ring have been flushed then


class Protocol:
    """One conversation. `fault` is the error that ended it, None while it lasts; `window` counts its lines."""

    def __init__(self, timing: Timing | None = None, now_s: float = 0.0, limit: int = LINE_LIMIT) -> None:
        self.state = State.DRAIN
        self.fault: PrinterError | None = None
        self.window = Window(limit)
        self.repeated = 0
        self.strays = 0
        self.advanced = False
        self.capabilities: dict[str, bool] = {}
        self._timing = timing or Timing()
        self._out = bytearray()
        self._heard, self._overflow = b"", False
        self._tries = self._probes = self._first_probe = self._waits = self._doubt = 0
        self._next_repeat = self._asked = self._asked_times = 0
        self._clean, self._caution, self._places = 0, CLEAN_LINES, 1
        self._busy_known = self._temperature_known = False
        self._swallow = self._alone = self._unknown_echoed = False
        self._heard_s = self._progress_s = self._entered_s = now_s

    def room(self, command: str) -> bool:
        """Whether this command may be sent now."""
        return self.state is State.OPEN and self.window.room(command, self._lines())

    def send(self, command: str, now_s: float) -> int:
        """Number a command, keep it for repeats and queue its bytes; returns its line number."""
        if not self.room(command):
            raise LocalProtocolError(f"{command!r} was to be sent while the printer has no room for it")
        self._launch(command, now_s)
        return self.window.sent

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
        elif self.window.flight and now_s - self._progress_s >= self._patience_s():
            self._turn(Signal.STALL, now_s)

    def _patience_s(self) -> float:
        if self.state is State.PROBING and self.window.flight[0].budget_s:
            return self.window.flight[0].budget_s
        return self._timing.stall_s if self._busy_known else self._timing.stall_mute_s

    def _lines(self) -> int:
        """Lines in flight: one until the printer tells numbers; one place stays free so that it sees an M112 at once."""
        if not self.advanced or self._clean < self._caution:
            return 1
        return max(1, self._places if self.capabilities.get("EMERGENCY_PARSER") else self._places - 1)

    def _launch(self, command: str, now_s: float) -> None:
        if not self.window.flight:
            self._progress_s = now_s
        self._out += self.window.launch(command)

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
        self.window.reset()
        self._out += b"\n" + b"N0 M110 N0*125\n"  # the newline ends a half line of an earlier session

    def _enter_hello(self, now_s: float) -> None:
        self._launch("M115", now_s)

    def _enter_open(self, _now_s: float) -> None:
        self._probes = self._doubt = self._first_probe = 0

    def _enter_probing(self, now_s: float) -> None:
        """Ask with a NEW number: Marlin swallows a repeat of its last line without a word."""
        self._probes += 1
        self._clean = 0
        if self._probes > PROBES:
            text = (
                f"the printer has been silent: line {self.window.acknowledged + 1} and {PROBES} questions remained without answer"
            )
            self._turn(Signal.SILENT, now_s, SilenceError(text))
            return
        self._launch("M105", now_s)
        self._first_probe = self._first_probe or self.window.sent

    def _enter_quiet(self, _now_s: float) -> None:
        self._clean = self._probes = self._doubt = self._first_probe = 0
        self._caution = min(4 * self._caution, CAUTION_MOST)
        self._alone = self.window.sent <= self._next_repeat
        self.window.ground()

    def _enter_repeat(self, now_s: float) -> None:
        self._swallow = False
        self._repeat_next(now_s)

    def _repeat_next(self, now_s: float) -> None:
        if self._next_repeat > self.window.sent:
            self._turn(Signal.CAUGHT_UP, now_s)
            return
        self._out += self.window.repeat(self._next_repeat)
        self._progress_s = now_s
        self._next_repeat += 1
        self.repeated += 1

    def _on_ok(self, ok: Ok, now_s: float) -> None:
        unknown, self._unknown_echoed = self._unknown_echoed, False
        if ok.line is not None:
            self._learn(ok)
        elif ok.planner_free is not None and self.advanced and not unknown:
            text = f"the printer ran part of a torn line after line {self.window.acknowledged}: what it did is not known"
            self._turn(Signal.UNCHECKED, now_s, RemoteProtocolError(text))
            return
        if self.state is State.SYNC:
            self._turn(Signal.SYNCED, now_s)
        elif self.state is State.QUIET:
            if self._alone and ok.line is None and ok.temperature is None:
                self._turn(Signal.HUSH, now_s)  # the ok that belongs to the Resend, and nothing else is on its way
        elif ok.temperature is not None:
            self._temperature_known = True
            self._acknowledge(self._answered_question(), now_s)
        elif self.advanced:
            self._acknowledge(ok.line, now_s)
        elif self._swallow:
            self._swallow = False
        else:
            self._acknowledge_oldest(now_s)

    def _answered_question(self) -> int | None:
        """The line that an `ok T:` acknowledges: the oldest question; nothing but questions follows the first probe."""
        number = self.window.question()
        probing = self.state is State.PROBING and number is not None and number >= self._first_probe
        return self.window.sent if probing else number

    def _learn(self, ok: Ok) -> None:
        self.advanced = True
        if ok.rx_free is not None:
            self._places = max(self._places, min(ok.rx_free + 1, 16))  # B counts the line itself as still there

    def _acknowledge_oldest(self, now_s: float) -> None:
        flight = self.window.flight
        oldest = flight[0] if flight else None
        if oldest is not None and oldest.asks_temperature and self._temperature_known:
            oldest = None  # its answer would have begun with `ok T:`
        self._acknowledge(None if oldest is None else oldest.number, now_s)

    def _acknowledge(self, number: int | None, now_s: float) -> None:
        """This line and all before it have arrived; a line that is not in flight makes the answer a stray."""
        count = self.window.acknowledge(number)
        if number is None or not count:
            self.strays += 1
            return
        self._clean += count
        self._progress_s = now_s
        self._waits = self._probes = 0
        if self._asked and number > self._asked:
            self._asked = 0
        if self.state is not State.OPEN:
            self._go_on(number, now_s)

    def _go_on(self, number: int, now_s: float) -> None:
        if self.state is State.HELLO:
            if number < GREETING:
                self._launch("M105", now_s)
            else:
                self._turn(Signal.GREETED, now_s)
        elif self.state is State.PROBING and number >= self._first_probe:
            self._turn(Signal.ANSWERED, now_s)
        elif self.state is State.REPEAT and not self.window.flight:
            self._repeat_next(now_s)

    def _on_resend(self, resend: Resend, now_s: float) -> None:
        number = resend.line
        if self.state is State.SYNC:
            return
        self._swallow = True
        plausible = GREETING < number <= self.window.sent + 1 and number > self.window.acknowledged - NEAR
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
        self.window.acknowledged = number - 1
        self._turn(Signal.RESEND, now_s)

    def _absurd(self, number: int) -> PrinterError:
        if number <= GREETING:
            return FirmwareError(f"the printer restarted without a word after line {self.window.acknowledged}: {RESTARTED}")
        return RemoteProtocolError(
            f"the printer asks for line {number}, although line {self.window.sent} is the last one sent "
            f"and {self.window.acknowledged} are acknowledged"
        )

    def _on_busy(self, _busy: Busy, now_s: float) -> None:
        self._busy_known = True
        self._progress_s = now_s

    def _on_start(self, _start: Start, now_s: float) -> None:
        text = f"the printer restarted in the middle of the print, after line {self.window.acknowledged}: {RESTARTED}"
        self._turn(Signal.START, now_s, FirmwareError(text))

    def _on_fault(self, fault: FirmwareFault, now_s: float) -> None:
        self._turn(Signal.FAULT, now_s, FirmwareError(f"the printer reported: {fault.text}"))

    def _on_wait(self, _wait: Wait, now_s: float) -> None:
        self._waits += 1
        if self._waits >= 2 and self.window.flight:  # nothing to do twice in a row: our line was lost
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
