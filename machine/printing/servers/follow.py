"""Follower: watches a print on a server to its end and passes on pause, cancel and emergency stop.

The server prints without this program and may answer late: polls and orders have threads of their own, so that the emergency stop
never waits for them.
"""

import threading
import time
from collections import deque
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass, replace
from functools import partial
from math import inf

from machine.link.pending_commands import (
    FEED_PERCENT,
    FLOW_PERCENT,
    KEEPS_OFFSET,
    Command,
    Control,
    PendingCommand,
    kept_settings,
    offset_refusal,
    offset_undone,
    percent_refusal,
    percents_undone,
)
from machine.link.print_state import PrintState, PrintStatus, last_known
from machine.link.protocol.events import Temperature
from machine.printing.servers.server import PrintServer
from profiles.errors import NoAnswerError, ServerError, add_words

POLL_S, TURN_S = 1.0, 0.05
SHOW_S = 0.25  # refresh interval; a question to the user appears beside the display
JOIN_S = 0.5  # an order that still waits for its answer then is left to the server
BEGIN_S = 15.0  # a server that has accepted a start shows it within this time
QUIET_S = 15.0  # silence after which it is reported
LOST_S = 120.0  # silence after which the state of the print counts as unknown
UNKNOWN = "whether the print continues there is unknown"
UNCONFIRMED = "emergency stop: {server} did not confirm it: cut the power ({error})"
UNHEARD_SHIFT = (
    "sent {command}, but {server} does not say whether the firmware knows it (Marlin needs BABYSTEPPING): see that the tip moves"
)
OnStatus = Callable[[PrintStatus, str], None]  # with a message for the user, "" for none


@dataclass(eq=False)
class Follower:
    """Starts a file on a server and follows its print to the end: call run() once.

    size: of the file, bytes, 0: unknown; left(): whether the user has left. running: active status of a print that is already
    running and is not to be started. babystep: its firmware's command for {} mm, "": not known.
    """

    server: PrintServer
    file: str
    size: int
    on_status: OnStatus
    control: Control
    left: Callable[[], bool]
    running: PrintStatus | None = None
    babystep: str = ""

    def __post_init__(self) -> None:
        # Status, error of a later request, and time of the newest answer: the polling thread replaces them together.
        self._heard: tuple[PrintStatus | None, ServerError | None, float] = (None, None, time.monotonic())
        self._over = threading.Event()
        self._orders: deque[Callable[[], str | None]] = deque()  # they return a message for the user
        self._message = ""
        self._last_active: PrintState | None = self.running.state if self.running else None
        self._read, self._heat = 0, Temperature()
        self._cancels = False  # the server has or may have the order
        self._cancelled_s = inf  # when the server had carried it out
        self._began_s: float | None = None  # when the server was ordered to start
        self._failed: Exception | None = None  # by the start, or by a thread
        self._shown: tuple[PrintStatus | None, str] = (None, "")
        self._shown_s = 0.0
        self._percents: dict[Command, float] = {}  # ordered values: not every server reports them
        # Z offsets in total: ordered, even if the order still waits for a slow server; refused by the server; executed.
        self._asked_mm = self._refused_mm = self._offset_mm = 0.0

    def run(self) -> PrintState:
        """Follow the print to DONE, CANCELLED, LEFT, or FAILED after an emergency stop.

        A stop requested before the start prevents it; one requested at the end is still sent. Raises ServerError when the print
        is refused, fails or is lost, or when the server stopped printing without an order from here.
        """
        if self._take_requests():
            return PrintState.FAILED
        try:
            end = self._followed()
        except ServerError as error:
            if self._take_requests():
                return PrintState.FAILED
            if self.kept:
                add_words(error, self.kept)
            raise
        if end is not PrintState.FAILED and self._take_requests():
            return PrintState.FAILED
        if end in (PrintState.DONE, PrintState.CANCELLED):  # a print that is left still needs its settings
            self._undo_settings()
        return end

    @property
    def kept(self) -> str:
        """A sentence on the user's settings that the firmware keeps for the next print; "" for none."""
        return kept_settings(*self._feed_and_flow, self._offset_mm, self.babystep)

    def _undo_settings(self) -> None:
        """Take back the settings that the firmware would keep for the next print, as far as the server accepts it."""
        if self._offset_mm and self.babystep.endswith(KEEPS_OFFSET):
            with suppress(ServerError):
                self.server.command(offset_undone(self._offset_mm, self.babystep))
                self._offset_mm = 0.0
        for command in percents_undone(*self._feed_and_flow):
            with suppress(ServerError):
                self.server.command(command)
                self._percents.pop(Command.FEED if command.startswith("M220") else Command.FLOW)

    @property
    def _feed_and_flow(self) -> tuple[float, float]:
        """Feed and flow as ordered here, per cent."""
        return self._percents.get(Command.FEED, 100.0), self._percents.get(Command.FLOW, 100.0)

    def _followed(self) -> PrintState:
        works = (self._poll, self._carry_out)
        threads = [threading.Thread(target=self._guard, args=(work,), name="print server", daemon=True) for work in works]
        for thread in threads:
            thread.start()
        try:
            while True:
                if self._take_requests():
                    return PrintState.FAILED
                if self.left():
                    return PrintState.LEFT
                end = self._look()
                if end is not None:
                    return end
                time.sleep(TURN_S)
        finally:
            self._over.set()
            for thread in threads:
                thread.join(JOIN_S)

    def _guard(self, work: Callable[[], None]) -> None:
        """Keep a thread's error, so that run() raises it."""
        try:
            work()
        except Exception as error:  # noqa: BLE001 - raised again by _look()
            self._failed = error

    def _look(self) -> PrintState | None:
        """Show the newest status; returns how the print has ended, None while it continues."""
        if self._failed is not None:
            raise self._failed
        status, error, answered_s = self._heard
        silent_s = time.monotonic() - answered_s
        if silent_s > LOST_S:
            where = error or self.server.name
            heat = last_known(self._heat, silent_s)
            raise ServerError(f"{where}; no answer for {silent_s:.0f} s: the print may continue: look at the printer{heat}")
        if status is None:
            return None
        quiet = error is not None or silent_s > QUIET_S
        message = self._message or (f"no answer for {silent_s:.0f} s: {UNKNOWN}" if quiet else "")
        if status is not self._shown[0] or message != self._shown[1] or time.monotonic() > self._shown_s + SHOW_S:
            self._shown, self._shown_s = (status, message), time.monotonic()
            self.on_status(status, message)
        return None if quiet else self._end_of(status)  # the last report may be outdated

    def _end_of(self, status: PrintStatus) -> PrintState | None:
        if self._began_s is None:
            return None
        heat = status.temperature
        self._heat = heat if heat.words else self._heat
        if status.state.is_printing:
            if self._last_active is not None and status.file not in ("", self.file):
                raise ServerError(f"{self.server.name} prints {status.file} now: what happened to {self.file} is unknown")
            self._last_active, self._read = status.state, max(self._read, status.bytes_read or 0)
            return None
        if status.state is PrintState.OFFLINE or (status.state is PrintState.FAILED and self._last_active is not None):
            where = f" at {self._reached}" if self._reached else ""
            raise ServerError(f"{self.server.name}: the print has failed{where}: {status.message or status.state}")
        if self._last_active is None:
            return self._end_unseen(status, time.monotonic() - self._began_s)
        if status.state is not PrintState.DONE and not self._cancels:
            raise ServerError(self._ended_there(status))
        return PrintState.DONE if status.state is PrintState.DONE else PrintState.CANCELLED

    @property
    def _reached(self) -> str:
        """How far the server has read, in words; "" if unknown."""
        return f"{100 * self._read / self.size:.0f} %" if self._read and self.size else ""

    def _ended_there(self, status: PrintStatus) -> str:
        """Sentence for a print that ended without an order from here, after a server crash or another client's cancel: heaters
        may be on."""
        known = ", ".join(filter(None, (f"{self._reached} read" if self._reached else "", self._heat.words)))
        return (
            f"{self.server.name} no longer prints {self.file or 'its file'} ({status.message or status.state})"
            f"{f'; last known: {known}' if known else ''}: look at the printer"
        )

    def _end_unseen(self, status: PrintStatus, waited_s: float) -> PrintState | None:
        """End of a print that was never seen running: the status may still be of an earlier print, or it ended before the first
        poll."""
        if self._heard[2] > self._cancelled_s:
            return PrintState.CANCELLED
        if waited_s < BEGIN_S:
            return None
        if status.state is PrintState.DONE and status.file in ("", self.file):
            return PrintState.DONE
        raise ServerError(
            f"{self.server.name} has not begun to print within {BEGIN_S:g} s: {status.message or 'no reason given'}"
        )

    def _poll(self) -> None:
        while not self._over.is_set():
            status, _, answered_s = self._heard
            try:
                self._heard = (self._with_percents(self.server.status()), None, time.monotonic())
            except ServerError as error:
                self._heard = (status, error, answered_s)
            self._over.wait(POLL_S)

    def _take_requests(self) -> bool:
        """Pass on the user's requests; True after an emergency stop."""
        while (request := self.control.take()) is not None:
            if request.command is Command.EMERGENCY_STOP:
                try:
                    self.server.order(Command.EMERGENCY_STOP)
                except ServerError as error:
                    raise ServerError(UNCONFIRMED.format(server=self.server.name, error=error)) from None
                return True
            if order := self._order(request):
                self._orders.append(order)
        return False

    def _order(self, request: PendingCommand) -> Callable[[], str | None] | None:
        command, value = request.command, request.value
        if command in (Command.FEED, Command.FLOW):
            self._message = percent_refusal(value, FEED_PERCENT if command is Command.FEED else FLOW_PERCENT) or ""
            return None if self._message else partial(self._set_percent, command, value)
        if command is Command.BABYSTEP:
            by_mm = round(value, 3)
            wanted_mm = round(self._asked_mm - self._refused_mm + by_mm, 3)
            self._message = offset_refusal(wanted_mm, self.babystep) or ""
            if self._message:
                return None
            self._asked_mm += by_mm
            return partial(self._shift, by_mm)
        if command is Command.CANCEL:
            return self._cancel
        return partial(self.server.order, command) if command in (Command.PAUSE, Command.RESUME) else None

    def _cancel(self) -> None:
        """Cancel; the print's end then counts as cancelled here, unless the order is refused."""
        self._cancels = True
        try:
            self.server.order(Command.CANCEL)
        except NoAnswerError:
            raise
        except ServerError:
            self._cancels = False
            raise
        self._cancelled_s = time.monotonic()

    def _set_percent(self, command: Command, value: float) -> None:
        """Set feed or flow. An order without an answer may have been executed."""
        try:
            self.server.command(f"{'M220' if command is Command.FEED else 'M221'} S{value:g}")
        except NoAnswerError:
            self._percents[command] = value
            raise
        self._percents[command] = value

    def _shift(self, by_mm: float) -> str:
        """Shift Z; returns a message if the server does not say whether the firmware has done it. A refused order does not count,
        one without an answer may have been executed."""
        command = self.babystep.format(f"{by_mm:.3f}")
        try:
            self.server.command(command)
        except NoAnswerError:
            self._offset_mm = round(self._offset_mm + by_mm, 3)
            raise
        except ServerError:
            self._refused_mm += by_mm
            raise
        self._offset_mm = round(self._offset_mm + by_mm, 3)
        return UNHEARD_SHIFT.format(command=command, server=self.server.name) if self.server.hides_answers else ""

    def _with_percents(self, status: PrintStatus) -> PrintStatus:
        status = replace(status, z_offset_mm=self._offset_mm)
        if self.server.tells_percents:
            return status
        feed, flow = self._feed_and_flow
        return replace(status, feed_percent=feed, flow_percent=flow)

    def _carry_out(self) -> None:
        """Start the print, then give the orders in turn; a refusal becomes a message.

        A start without an answer may have been accepted: the status will show it.
        """
        if self.running is None:
            with suppress(NoAnswerError):
                self.server.start(self.file)
        self._began_s = time.monotonic()
        while not self._over.wait(TURN_S):
            while self._orders:
                order = self._orders.popleft()
                try:
                    self._message = order() or ""
                except ServerError as error:
                    self._message = f"{error}"
