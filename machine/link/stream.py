"""Stream: send a program to a printer: checked first, fed as fast as the window allows, to a final barrier or a safe stop."""

from collections.abc import Callable, Iterable, Iterator
from contextlib import suppress
from dataclasses import dataclass

from machine.firmware import dialect_of
from machine.link.exchange import Exchange
from machine.link.feed import Feed
from machine.link.journal import Journal
from machine.link.medium import SERIAL, Medium, Wire, reopen
from machine.link.pending_commands import CancelledError, Control, EmergencyError, percents_undone
from machine.link.port import find_again, find_device, stable_name
from machine.link.print_state import PrintState, PrintStatus, last_known
from machine.link.protocol.connection import Connection
from machine.link.protocol.framing import LINE_LIMIT, command_of
from machine.link.resume import ResumePoint
from machine.link.shutdown import SETTLE_S, HeaterGuard, Heaters, lift_tip, reset_overrides
from machine.link.status import PrinterStatus, line_was_done, query_status
from profiles.errors import FirmwareError, PortError, PrinterError, SilenceError, add_words
from profiles.profile import Profile

# After an error the printer may not respond: the orders are given, but the proof is not awaited for long. A halted or restarted
# firmware has switched its heaters off by itself.
HEATERS_OFF_S: dict[type[PrinterError], float] = {FirmwareError: 1.0, SilenceError: 5.0, PortError: 2.0}


@dataclass(frozen=True)
class Outcome:
    """How a print ended."""

    cancelled: bool
    sent: int
    acknowledged: int
    repeated: int
    elapsed_s: float
    firmware: str
    warnings: tuple[str, ...]
    # After a cancel: whether the printer's report proves it. None: the program ended by itself, or nothing of it was sent.
    heaters_off: bool | None = None
    halted: str = ""  # after a halt: what makes the printer print again
    kept: str = ""  # after a cancel: the user's settings that outlast the print, in words


def print_lines(
    lines: Iterable[str],
    port: str,
    baud: int = 115200,
    *,
    on_progress: Callable[[PrintStatus], None] | None = None,
    control: Control | None = None,
    journal: Journal | None = None,
    profile: Profile | None = None,
    begin: Callable[[PrinterStatus], ResumePoint] | None = None,
    medium: Medium = SERIAL,
) -> Outcome:
    """Print a program: send every line's command and wait until the last one has ended.

    A sequence or GcodeFile is checked completely before the port is opened, an iterator line by line as it is consumed; a string
    is split into lines. control: the user's commands; journal: written for a later resume; profile: gives the firmware's line
    length, lets a pause lift, park and cool the nozzle, and limits temperatures; begin: decides where a resumed print continues.

    When the control's stop flag is set, the print ends: feeding and moves stop, heaters and fan go off, the tip is lifted,
    nothing homes or turns, and the Outcome is cancelled. KeyboardInterrupt does the same and is raised again. Raises
    LocalProtocolError for a line that cannot be sent, PortError, FirmwareError, SilenceError or PrinterError; the heaters are
    switched off first and the message says whether the printer confirmed it.
    """
    if isinstance(lines, str):
        lines = lines.splitlines()
    limit = LINE_LIMIT if profile is None else dialect_of(profile.machine).longest_line
    total = None
    if not isinstance(lines, Iterator):
        total = sum(1 for number, line in enumerate(lines, 1) if command_of(line, number, limit))
    feed = Feed(
        profile, limit, total, control=control or Control(), journal=journal, on_progress=on_progress, start_s=medium.now_s()
    )
    printing = _Print(feed, port, baud, medium, journal)
    try:
        return printing.run(lines, begin)
    finally:
        printing.exchange.wire.close()


class _Print:
    """A print at a port: finds the port again when it is lost, and ends safely in every way."""

    def __init__(self, feed: Feed, port: str, baud: int, medium: Medium, journal: Journal | None) -> None:
        self._name, self._baud = stable_name(port), baud
        self._device = find_device(port, medium.devices())
        self._path = "" if self._device is None else self._device.path
        profile = feed.profile
        # a ring buffer holds one byte less than its size
        rx_bytes = None if profile is None else profile.machine.receive_bytes - 1
        wire = medium.open(port, baud)
        connection = Connection(medium.timing, medium.now_s(), limit=feed.limit, rx_bytes=rx_bytes, baud=baud)
        self.exchange = Exchange(
            wire, medium, connection, on_event=feed.handle_event, on_turn=feed.handle_turn, on_lost=self._reconnect
        )
        feed.exchange = self.exchange
        self.feed, self.medium, self.journal = feed, medium, journal
        self._guard = HeaterGuard(self.exchange, lambda: feed.started, feed.pending.heed_emergency)

    def _find(self) -> str | None:
        """Current name of the printer's port. A device without USB identification is only sought under its own name."""
        if self._device is None or not self._device.model:
            return self._name
        device = find_again(self._device, self.medium.devices())
        if device is None:
            return None
        self._path = device.path
        return device.name

    def _reconnect(self, error: PortError) -> tuple[Wire, bool | None]:
        """Wait for a lost port; a firmware without line numbers reports its position instead."""
        feed, before = self.feed, self._path
        wire, done = self._reopen(error)
        if self._path != before:
            feed.set_state(feed.state, f"the printer has come back at {self._path}")
        return wire, done

    def _reopen(self, error: PortError) -> tuple[Wire, bool | None]:
        feed, medium = self.feed, self.medium
        self.exchange.wire.close()
        end_s = medium.now_s() + medium.lost_s
        with feed.in_state(PrintState.RECONNECTING, f"{error}; waiting {medium.lost_s:.0f} s for it to come back"):
            while (wire := reopen(self._find, self._baud, medium, feed.poll, end_s)) is not None:
                if self.exchange.connection.greeting.firmware.line.resends:
                    return wire, None
                self.exchange.wire = wire  # a cancel from now needs it to switch the heaters off
                try:
                    return wire, self._line_was_done(query_status(wire, medium, feed.poll))
                except PortError:  # a loose plug, or a printer that has stopped reading
                    wire.close()
        raise PortError(f"{error}; it did not come back within {medium.lost_s:.0f} s")

    def _line_was_done(self, status: PrinterStatus) -> bool | None:
        """Whether the program's one line in flight was executed, judging by the printer's position; None: unknown."""
        window, history = self.exchange.connection.window, self.feed.history
        step, waiting = history.only_unanswered, [line.number for line in window.flight if not line.asks_temperature]
        if step is None or waiting != [step.number]:
            return None
        return line_was_done(window.command(step.number), history.pose, self.feed.modal, status)

    def run(self, lines: Iterable[str], begin: Callable[[PrinterStatus], ResumePoint] | None) -> Outcome:
        start_s = self.medium.now_s()
        try:
            with self._guard:
                return self._outcome(start_s, self._run(lines, begin))
        except EmergencyError:  # requested while the guard was switching the heaters off
            raise FirmwareError(self._stop()) from None

    def _run(self, lines: Iterable[str], begin: Callable[[PrinterStatus], ResumePoint] | None) -> Heaters | None:
        """Print; returns the state of the heaters, None when the program ended by itself or had not begun."""
        try:
            resume_point = None
            if begin is not None:
                resume_point = begin(query_status(self.exchange.wire, self.medium, self.feed.poll))
            self.exchange.greet()
            self.feed.run(lines, resume_point)
        except CancelledError:
            return self._cancel()
        except EmergencyError:
            raise FirmwareError(self._stop()) from None
        except PrinterError as error:
            if self.feed.started:
                add_words(error, f"{self._leave(error)}{self._hint()}")
                self._add_kept(error)
            raise
        except BaseException as error:
            if self.feed.started:
                add_words(error, self._shut_down(SETTLE_S).value)
                self._add_kept(error)
            raise
        self._guard.release()
        return None

    def _cancel(self) -> Heaters | None:
        if not self.feed.started:
            return None
        waits = "waiting for the printer: its homing or dwell must not be interrupted" if self.exchange.waits else ""
        self.feed.set_state(PrintState.CANCELLING, waits)
        return self._shut_down(SETTLE_S)

    def _stop(self) -> str:
        """Make an emergency stop; returns the result in words."""
        heat = self._last_known()
        words = self._guard.stop()
        if self._guard.heaters is Heaters.HALTED:
            self.feed.reports.note_off()
        self.feed.set_state(PrintState.CANCELLING)
        return f"{words}{heat}"

    def _leave(self, error: PrinterError) -> str:
        """Switch the heaters off before an error is raised; returns whether that was proved, else their last temperature."""
        heat = self._last_known()
        timeout_s = HEATERS_OFF_S.get(type(error), SETTLE_S)
        alive = not isinstance(error, FirmwareError | PortError)
        waits = alive and not isinstance(error, SilenceError)  # its homing was awaited already
        heaters = self._shut_down(timeout_s, alive, waits)
        words = f"{heaters.value}: {self._guard.revival}" if heaters is Heaters.HALTED else heaters.value
        return words if heaters is Heaters.OFF else f"{words}{heat}"

    def _last_known(self) -> str:
        reports = self.feed.reports
        return last_known(reports.temperature, self.medium.now_s() - reports.temperature_s)

    def _shut_down(self, timeout_s: float, alive: bool = True, waits: bool = True) -> Heaters:
        """Switch the heaters off and lift the tip if the printer responds and knows its position; waits: for homing to end."""
        try:
            heaters = self._guard.switch_off(timeout_s, waits)
            if heaters is not Heaters.UNPROVED:
                self.feed.reports.note_off()
                self.feed.show(self.medium.now_s())
            if heaters is Heaters.OFF and alive:
                with suppress(PortError):
                    self._settle()
        except EmergencyError:
            raise FirmwareError(self._stop()) from None
        return heaters

    def _settle(self) -> None:
        """Lift the tip, and reset feed and flow. A resumed print still needs its Z offset. Raises PortError, EmergencyError."""
        wire, feed = self.exchange.wire, self.feed
        if (move := feed.lift_move()) is not None:
            feed.record_lift(lift_tip(wire, self.medium, *move, feed.pending.heed_emergency))
        undone = percents_undone(feed.pending.feed_percent, feed.pending.flow_percent)
        if undone and reset_overrides(wire, self.medium, undone, feed.pending.heed_emergency):
            feed.pending.feed_percent = feed.pending.flow_percent = 100.0

    @property
    def _kept(self) -> str:
        """A sentence on the settings that the printer keeps; "" after a halt, which ends by a restart."""
        return "" if self.feed.finished or self._guard.heaters is Heaters.HALTED else self.feed.pending.kept

    def _add_kept(self, error: BaseException) -> None:
        if self._kept:
            add_words(error, self._kept)

    def _hint(self) -> str:
        """Advice on how to resume an interrupted print, or why that is impossible; closes the journal to be sure."""
        if self.journal is None:
            return ""
        self.journal.close()
        if self.journal.trouble:
            return f"; {self.journal.warning}"
        if not self.feed.history.executed:
            return ""
        return f"; tiltprint resume {self.journal.path} continues it"

    def _outcome(self, start_s: float, heaters: Heaters | None) -> Outcome:
        feed = self.feed
        return Outcome(
            cancelled=not feed.finished,
            sent=feed.sent,
            acknowledged=feed.history.commands,
            repeated=self.exchange.connection.resends.repeated,
            elapsed_s=self.medium.now_s() - start_s,
            firmware=feed.reports.firmware,
            warnings=tuple(feed.reports.warnings),
            heaters_off=None if heaters is None else heaters is not Heaters.UNPROVED,
            halted=self._guard.revival if heaters is Heaters.HALTED else "",
            kept=self._kept,
        )
