"""The sender's side of the serial protocol without I/O: received bytes go in, events and bytes to send come out.

The caller owns port and clock: it writes what take() gives, hands what it reads to receive() and calls tick() now and then.
"""

from collections.abc import Callable
from math import inf

from machine.link import events as told
from machine.link import verdict
from machine.link.conversation import Conversation
from machine.link.families import family_of
from machine.link.patience import QUESTION, Timing
from machine.link.states import Signal, State
from machine.link.window import FIRST_AGAIN
from profiles.errors import PrinterError

__all__ = ["Protocol", "Timing"]

GREETING = 2  # M115 and M105 are lines 1 and 2; a later wish for one of them means that the printer restarted
NEAR = 8  # one acknowledgement too many or few is usual after noise; a wish further back is asked for twice


class Protocol(Conversation):
    """What the printer's words mean. Look at `fault` after receive() and tick(): it is the error that ended the conversation."""

    def receive(self, data: bytes, now_s: float) -> list[told.Event]:
        """The events of received bytes, in any portions."""
        self._patience.heard_s = now_s
        events = self._hearing.receive(data, now_s)
        for event in events:
            self._act(event, now_s)
        return events

    def tick(self, now_s: float) -> None:
        """Let time pass: drains, pauses before a repeat, stalls."""
        for event in self._hearing.flush(now_s):
            self._act(event, now_s)
        self._pass(now_s)

    def _act(self, event: told.Event, now_s: float) -> None:
        if act := _ACTS.get(type(event)):
            act(self, event, now_s)

    def _on_ok(self, ok: told.Ok, now_s: float) -> None:
        unknown, self._unknown_echoed = self._unknown_echoed, False
        if ok.line is not None:
            self._pace.learn(ok.rx_free)
        elif ok.planner_free is not None and self.advanced and not unknown:
            self._turn(Signal.UNCHECKED, now_s, verdict.torn(self._line()))
            return
        if self.state is State.SYNC:
            if ok.line is not None or ok.planner_free is None:  # else it belongs to the rest of a line torn by a restart
                self._turn(Signal.SYNCED, now_s)
        elif self.state is State.QUIET:
            if self._alone and ok.line is None and ok.temperature is None:
                self._turn(Signal.HUSH, now_s)  # the ok that belongs to the Resend, and nothing else is on its way
        elif self.state is State.RENUMBER:
            self._renumbered(ok, unknown, now_s)
        elif ok.temperature is not None:
            self._temperature_known = True
            self._answered(now_s)
        elif self.advanced:
            self._acknowledge(None if ok.line is None else self.window.line(ok.line), now_s)
        elif not self._swallowed(now_s):
            self._acknowledge_oldest(now_s)

    def _swallowed(self, now_s: float) -> bool:
        """Whether this is the ok that belongs to a Resend; some firmwares omit it, so it is not waited for long."""
        until_s, self._swallow_until_s = self._swallow_until_s, -inf
        return now_s < until_s

    def _renumbered(self, ok: told.Ok, unknown: bool, now_s: float) -> None:
        mine = ok.line == FIRST_AGAIN if self.advanced else not (unknown or ok.temperature or self._swallowed(now_s))
        if mine:
            self.window.begin_anew()
            self._worn = False
            self._turn(Signal.SYNCED, now_s)

    def _answered(self, now_s: float) -> None:
        """`ok T:` acknowledges the oldest question; nothing but questions follows the first probe."""
        number, flight = self.window.question(), self.window.flight
        probing = self.state is State.PROBING and number is not None and number >= self._first_probe
        if probing and not self.family.resends and not flight[0].asks_temperature:
            line = flight[0].number
            error = verdict.unanswered(self.window.wire(line), self.window.command(line), self.family.name)
            self._turn(Signal.UNCHECKED, now_s, error)
            return
        self._acknowledge(self.window.sent if probing else number, now_s)

    def _acknowledge_oldest(self, now_s: float) -> None:
        flight = self.window.flight
        oldest = flight[0] if flight else None
        if oldest is not None and oldest.asks_temperature and self._temperature_known:
            oldest = None  # its answer would have begun with `ok T:`
        self._acknowledge(None if oldest is None else oldest.number, now_s)

    def _acknowledge(self, number: int | None, now_s: float) -> None:
        """This line and all before it have arrived; a line that is not in flight makes the answer a stray."""
        flight = self.window.flight
        oldest = flight[0] if flight else None
        count = self.window.acknowledge(number)
        if number is None or oldest is None or not count:
            return
        self._pace.passed(count)
        self._resends.passed(number)
        self._patience.progress_s = now_s
        if not oldest.budget_s:
            self._patience.took(now_s - oldest.sent_s)
        self._waits = self._probes = 0
        self._complain_s = inf
        if self.state is not State.OPEN:
            self._go_on(number, now_s)

    def _go_on(self, number: int, now_s: float) -> None:
        if self.state is State.HELLO:
            if number < GREETING:
                self._launch(QUESTION, now_s)
            else:
                self._turn(Signal.GREETED, now_s)
        elif self.state is State.PROBING and number >= self._first_probe:
            self._turn(Signal.ANSWERED, now_s)
        elif self.state is State.REPEAT and not self.window.flight:
            self._repeat_next(now_s)

    def _on_resend(self, resend: told.Resend, now_s: float) -> None:
        if self.state is State.SYNC:
            return
        if self.family.resend_ok:
            self._swallow_until_s = now_s + self._timing.complaint_s
        self._complain_s = inf
        if self.state is State.RENUMBER:
            self._again_s = now_s + self._timing.quiet_s
            return
        number, window = self.window.line(resend.line), self.window
        known = window.keeps(number) or number == window.sent + 1
        plausible = known and resend.line > GREETING and number > window.acknowledged - NEAR
        if self.state is State.HELLO or (plausible and self.state is not State.QUIET):
            self._wanted(number, now_s)
        elif plausible:
            self._next_repeat = number
        elif self.state is State.PROBING and self._doubt == number:
            self._turn(Signal.IMPOSSIBLE, now_s, self._absurd(resend.line))
        else:
            self._doubt = number
            self._turn(Signal.DOUBT, now_s)

    def _wanted(self, number: int, now_s: float) -> None:
        if too_much := self._resends.ask(number):
            self._turn(Signal.IMPOSSIBLE, now_s, verdict.noisy(self.window.wire(number), too_much))
            return
        self._next_repeat = number
        self.window.acknowledged = number - 1
        self._turn(Signal.RESEND, now_s)

    def _absurd(self, wire: int) -> PrinterError:
        if wire <= GREETING:
            return verdict.restarted(self._line(), "without a word")
        return verdict.absurd(wire, self.window.wire(self.window.sent), self._line())

    def _on_line_error(self, _error: told.LineError, now_s: float) -> None:
        """A Resend and an ok follow at once; where the Resend is lost or the firmware gives none, a question is due."""
        self._complain_s = now_s + self._timing.complaint_s
        self._swallow_until_s = self._complain_s

    def _on_busy(self, _busy: told.Busy, now_s: float) -> None:
        self._patience.busy_known = True
        self._patience.progress_s = now_s

    def _on_start(self, _start: told.Start, now_s: float) -> None:
        self._turn(Signal.START, now_s, verdict.restarted(self._line()))

    def _on_banner(self, _banner: told.Banner, now_s: float) -> None:
        if self.state not in (State.DRAIN, State.SYNC, State.HELLO):  # there it follows a `start` that was heeded
            self._on_start(told.Start(), now_s)

    def _on_fault(self, fault: told.FirmwareFault, now_s: float) -> None:
        self._turn(Signal.FAULT, now_s, verdict.reported(fault.text))

    def _on_wait(self, _wait: told.Wait, now_s: float) -> None:
        self._waits += 1
        if self._waits >= 2 and self.window.flight:  # nothing to do twice in a row: our line was lost
            self._waits = 0
            self._turn(Signal.STALL, now_s)

    def _on_echo(self, echo: told.Echo, _now_s: float) -> None:
        if "nknown command" in echo.text:
            self._unknown_echoed = True

    def _on_capability(self, capability: told.Capability, _now_s: float) -> None:
        self.capabilities[capability.name] = capability.present

    def _on_identity(self, identity: told.Identity, _now_s: float) -> None:
        self.identity = identity.text
        self.family = family_of(identity.text, self.family)
        self.window.rx_bytes = self._rx_bytes or self.family.rx_bytes

    def _on_area(self, area: told.Area, _now_s: float) -> None:
        self.area = area


_ACTS: dict[type[told.Event], Callable[..., None]] = {
    told.Ok: Protocol._on_ok,
    told.Resend: Protocol._on_resend,
    told.LineError: Protocol._on_line_error,
    told.Busy: Protocol._on_busy,
    told.Start: Protocol._on_start,
    told.Banner: Protocol._on_banner,
    told.FirmwareFault: Protocol._on_fault,
    told.Wait: Protocol._on_wait,
    told.Echo: Protocol._on_echo,
    told.Capability: Protocol._on_capability,
    told.Identity: Protocol._on_identity,
    told.Area: Protocol._on_area,
}
