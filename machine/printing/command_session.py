"""Command session: single commands to a printer over the protocol of a print, with a safe end."""

from types import TracebackType
from typing import NoReturn, Self

from machine.gcode.words import split_command
from machine.link.exchange import Exchange
from machine.link.medium import SERIAL, Medium, Wire
from machine.link.protocol.connection import Connection
from machine.link.protocol.events import Event, Temperature
from machine.link.protocol.framing import LINE_LIMIT, command_of
from machine.link.shutdown import HeaterGuard, Heaters, shows_off
from profiles.errors import FirmwareError, PortError, PrinterError

RESTARTS = frozenset({"RESTART", "FIRMWARE_RESTART"})  # Klipper's: they switch the heaters off and end the session


class LeftError(Exception):
    """The user left while a command was running."""


class StopError(Exception):
    """The user requested the emergency stop."""


class CommandSession:
    """`with session:` greet(), then command() repeatedly. One thread at a time; only order() may be called from another.

    However the block ends, the heaters are switched off, unless keep_heat is set: HeaterGuard does it after an error and adds its
    result to the message; after a normal end PrinterError is raised if the printer does not confirm it. StopError causes the
    emergency stop. Nothing that heats is sent before the greeting.

    unknown: commands that the printer did not know; heat, position: its newest reports.
    """

    def __init__(self, wire: Wire, limit: int = LINE_LIMIT, medium: Medium = SERIAL) -> None:
        self.unknown: list[str] = []
        self.keep_heat = self._leaving = False
        self._limit = limit
        self._ordered: type[LeftError | StopError] | None = None
        self.heat = Temperature()
        self.position: dict[str, float] | None = None
        self._command = ""
        connection = Connection(medium.timing, medium.now_s(), limit=limit)
        self.exchange = Exchange(wire, medium, connection, on_event=self._heard, on_turn=self._turned, on_lost=self._lost)

    def __enter__(self) -> Self:
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None) -> None:
        self._leaving = True
        guard = HeaterGuard(self.exchange, lambda: self.exchange.greeted, self._check_stop)
        try:
            if isinstance(error, StopError):
                raise error
            if error is not None:
                guard.leave(error)
                return
            with guard:
                if self.keep_heat or not self.exchange.greeted or self.switch_off():
                    guard.release()
        except StopError:
            with guard:
                raise FirmwareError(guard.stop()) from None
        if guard.heaters is Heaters.UNPROVED:
            raise PrinterError("the printer did not confirm that its heaters are off: look at it")

    def greet(self) -> None:
        """Agree on line numbers. Raises PrinterError."""
        self.exchange.greet()

    def command(self, line: str) -> None:
        """Send a command and wait for its answer; a line with only a comment sends nothing. Raises PrinterError."""
        command = command_of(line, "the line", self._limit)
        if command:
            self._command = command
            self.exchange.send(command)
            self.exchange.settle()

    @property
    def restarts(self) -> bool:
        """Whether the newest command restarts the printer."""
        return bool(self._command) and split_command(self._command.upper())[0] in RESTARTS and self._command not in self.unknown

    def listen(self) -> None:
        """Listen for one short turn without sending anything."""
        self.exchange.pump()

    def order(self, what: type[LeftError | StopError]) -> None:
        """Raise LeftError or StopError in the talking thread, whatever it waits for."""
        self._ordered = what

    def heated(self) -> str:
        """Which heaters are on, in words; "" when none is. A running command counts because it may just have switched one on."""
        if not self._idle():
            return "heaters, because a command was running"
        self.command("M105")
        targets = (("nozzle", self.heat.nozzle_target_c), ("bed", self.heat.bed_target_c))
        return " and ".join(f"{name} set to {target_c:.0f} °C" for name, target_c in targets if target_c)

    def switch_off(self) -> bool:
        """Switch the heaters off, aborting a running command; True when the printer's own report confirms it."""
        if not self._idle():
            return HeaterGuard(self.exchange, lambda: True, self._check_stop).switch_off() is not Heaters.UNPROVED
        self.heat = Temperature()  # an older report proves nothing
        self.command("M105")
        if not shows_off(self.heat):
            for command in ("M104 S0", "M140 S0", "M105"):
                self.command(command)
        return shows_off(self.heat)

    def _idle(self) -> bool:
        window = self.exchange.connection.window
        return self.exchange.greeted and self.exchange.connection.fault is None and window.acknowledged == window.sent

    def _heard(self, event: Event) -> None:
        self.position = event.position or self.position
        self.heat = event.temperature or self.heat
        if event.unknown_command and self.exchange.greeted:
            self.unknown.append(self._command)

    def _turned(self, now_s: float) -> None:
        del now_s
        if self._ordered is LeftError and not self._leaving:
            self._ordered = None
            raise LeftError
        self._check_stop()

    def _check_stop(self) -> None:
        """Raise StopError if it was ordered, which may also happen during the safe end."""
        if self._ordered is StopError:
            self._ordered = None
            raise StopError

    def _lost(self, error: PortError) -> NoReturn:
        raise error
