"""Conversation: the states of a talk with a printer, what is said on entering each, and what silence means in it."""

from collections.abc import Callable
from math import inf

from machine.link import events as told
from machine.link import verdict
from machine.link.families import MARLIN, Family
from machine.link.framing import LINE_LIMIT, frame
from machine.link.hearing import Hearing
from machine.link.pace import Pace
from machine.link.patience import PROBES, QUESTION, Patience, Timing
from machine.link.resends import Resends
from machine.link.states import TABLE, Signal, State
from machine.link.window import FIRST_AGAIN, Window
from profiles.errors import LocalProtocolError, PrinterError


class Conversation:
    """One conversation. `fault` is the error that ended it, None while it lasts; `window` counts its lines.

    family: taken for firmwares of unknown name; rx_bytes: what the machine's receive buffer holds, None: as its family's;
    baud: for messages. `capabilities`, `identity` and `area` are the answer to M115.
    """

    def __init__(
        self,
        timing: Timing | None = None,
        now_s: float = 0.0,
        limit: int = LINE_LIMIT,
        family: Family = MARLIN,
        rx_bytes: int | None = None,
        baud: int | None = None,
    ) -> None:
        self.state = State.DRAIN
        self.fault: PrinterError | None = None
        self.family = family
        self.window = Window(limit, rx_bytes or family.rx_bytes)
        self.repeated = 0
        self.capabilities: dict[str, bool] = {}
        self.identity = ""
        self.area: told.Area | None = None
        self._rx_bytes, self._baud = rx_bytes, baud
        self._hearing, self._pace, self._resends = Hearing(), Pace(), Resends()
        self._timing = timing or Timing()
        self._patience = Patience(self._timing, now_s)
        self._out = bytearray()
        self._tries = self._probes = self._first_probe = self._waits = self._doubt = self._next_repeat = 0
        self._temperature_known = self._alone = self._unknown_echoed = self._worn = False
        self._swallow_until_s, self._complain_s, self._again_s = -inf, inf, inf

    @property
    def advanced(self) -> bool:
        """Whether the printer's answers name the line they belong to."""
        return self._pace.numbered

    def room(self, command: str) -> bool:
        """Whether this command may be sent now."""
        if self.state is not State.OPEN or self._worn or self._hearing.waits:
            return False
        return self.window.room(command, self._pace.lines(self.family, self.capabilities.get("EMERGENCY_PARSER", False)))

    def send(self, command: str, now_s: float) -> int:
        """Number a command, keep it for repeats and queue its bytes; returns its line number, counted from the greeting on."""
        if not self.room(command):
            raise LocalProtocolError(f"{command!r} was to be sent while the printer has no room for it")
        self._launch(command, now_s)
        self._worn = self.window.wire(self.window.sent) >= self.family.last_number
        return self.window.sent

    def take(self) -> bytes:
        """The bytes to write to the port now."""
        out = bytes(self._out)
        self._out.clear()
        return out

    def interrupted(self, now_s: float, done: bool | None = None) -> None:
        """The port was lost and is there again: the printer is asked what has arrived; one that restarted betrays itself.

        done: what is known otherwise of the lines on their way: they have been done, or are to be sent once more.
        """
        self._out[:] = b"\n"  # ends a half line
        self._hearing.cut()
        self._probes = 0
        if done:
            self.window.acknowledge(self.window.sent)
        elif done is False:
            unanswered = [line.number for line in self.window.flight if not line.asks_temperature]
            self.window.ground()
            for number in unanswered:
                self._out += self.window.repeat(number, now_s)
        self._turn(Signal.BROKEN, now_s)

    def _pass(self, now_s: float) -> None:
        """Let time pass: drains, pauses before a repeat, stalls."""
        state, patience = self.state, self._patience
        if state is State.DRAIN:
            if patience.drained(now_s):
                self._turn(Signal.HUSH, now_s)
        elif state is State.QUIET:
            if patience.quiet(now_s):
                self._turn(Signal.HUSH, now_s)
        elif state in (State.SYNC, State.HELLO):
            if patience.greeted_late(now_s):
                self._turn(Signal.STALL, now_s)
        elif self.window.flight or state is State.RENUMBER:
            late = patience.over(now_s, state, self.window, self.family, self._probes)
            if late or now_s >= min(self._complain_s, self._again_s):
                self._turn(Signal.STALL, now_s)
        elif self._worn:
            self._turn(Signal.WORN, now_s)

    def _launch(self, command: str, now_s: float) -> None:
        if not self.window.flight:
            self._patience.progress_s = now_s
        self._out += self.window.launch(command, now_s)

    def _turn(self, signal: Signal, now_s: float, error: PrinterError | None = None) -> None:
        """Follow the table, then do what belongs to entering the state."""
        state = TABLE[self.state].get(signal)
        if state is None:
            return
        self.state, self._patience.entered_s, self._patience.progress_s = state, now_s, now_s
        self._complain_s = self._again_s = inf
        if state in (State.HALTED, State.LOST):
            self.fault = error or verdict.silent(self._line(), self._probes)
            self._out.clear()
        elif act := _ENTER.get(state):
            act(self, now_s)

    def _enter_sync(self, now_s: float) -> None:
        error = verdict.ungreeted(self._hearing, self._tries, self._baud)
        if error is not None:
            self._turn(Signal.SILENT, now_s, error)
            return
        self._tries += 1
        self.window.reset()
        self._out += b"\n" + b"N0 M110 N0*125\n"  # the newline ends a half line of an earlier session

    def _enter_hello(self, now_s: float) -> None:
        self._launch("M115", now_s)

    def _enter_open(self, _now_s: float) -> None:
        self._probes = self._doubt = self._first_probe = 0

    def _enter_probing(self, now_s: float) -> None:
        """Ask with a NEW number: Marlin swallows a repeat of its last line without a word."""
        self._pace.doubt()
        if self._gave_up(now_s):
            return
        self._launch(QUESTION, now_s)
        self._first_probe = self._first_probe or self.window.sent

    def _enter_renumber(self, now_s: float) -> None:
        """M110 is not checked for sequence, so it may be given again; both N are read by one firmware or another."""
        if not self._gave_up(now_s):
            self._out += frame(FIRST_AGAIN, f"M110 N{FIRST_AGAIN}")

    def _gave_up(self, now_s: float) -> bool:
        self._probes += 1
        if self._probes <= PROBES:
            return False
        self._turn(Signal.SILENT, now_s, verdict.silent(self._line() + 1, PROBES))
        return True

    def _enter_quiet(self, _now_s: float) -> None:
        self._probes = self._doubt = self._first_probe = 0
        self._pace.stumble()
        self._alone = self.window.sent <= self._next_repeat
        self.window.ground()

    def _enter_repeat(self, now_s: float) -> None:
        self._swallow_until_s = -inf
        self._repeat_next(now_s)

    def _repeat_next(self, now_s: float) -> None:
        if self._next_repeat > self.window.sent:
            self._turn(Signal.CAUGHT_UP, now_s)
            return
        self._out += self.window.repeat(self._next_repeat, now_s)
        self._patience.progress_s = now_s
        self._next_repeat += 1
        self.repeated += 1

    def _line(self) -> int:
        """The last acknowledged line as the printer counts."""
        return self.window.wire(self.window.acknowledged)


_ENTER: dict[State, Callable[[Conversation, float], None]] = {
    State.SYNC: Conversation._enter_sync,
    State.HELLO: Conversation._enter_hello,
    State.OPEN: Conversation._enter_open,
    State.PROBING: Conversation._enter_probing,
    State.QUIET: Conversation._enter_quiet,
    State.REPEAT: Conversation._enter_repeat,
    State.RENUMBER: Conversation._enter_renumber,
}
