"""Command session: single commands to a printer over the same protocol as a print, and a safe end of it."""

from machine.link.exchange import Exchange, Reconnection
from machine.link.medium import SERIAL, Medium, Wire
from machine.link.protocol.events import Event, Ok, Position, Temperature, position_in, unknown_command
from machine.link.protocol.framing import LINE_LIMIT, command_of, name_of
from machine.link.protocol.timeout import Timing
from machine.link.shutdown import Heaters, emergency_stop, heaters_off
from profiles.errors import FirmwareError, PortError

# Klipper's: heaters go off and the conversation ends.
RESTARTS = frozenset({"RESTART", "FIRMWARE_RESTART"})
FAULT_S = 2.0  # how long a printer that has just failed is asked whether its heaters are off


class LeftError(Exception):
    """The person has left while a command was under way."""


class StopError(Exception):
    """The person has asked for the emergency stop."""


class CommandSession:
    """greet(), then command() after command, then leave(). One thread at a time; order() may be called from any other.

    unknown: commands that the printer did not know; heat, position: as it has told them last.
    """

    def __init__(self, wire: Wire, limit: int = LINE_LIMIT, medium: Medium = SERIAL) -> None:
        self.unknown: list[str] = []
        self._limit = limit
        self._ordered: type[Exception] | None = None
        self.heat = Temperature()
        self.position: Position | None = None
        self._command = ""
        self.exchange = Exchange(
            wire, medium, timing=Timing(), on_event=self._heard, on_turn=self._turned, on_lost=self._lost, limit=limit
        )

    def greet(self) -> None:
        """Agree on line numbers; raises PrinterError."""
        self.exchange.greet()

    def command(self, line: str) -> None:
        """Send a command and wait for its answer; a comment is none. Raises PrinterError."""
        command = command_of(line, "the line", self._limit)
        if command:
            self._command = command
            self.exchange.send(command)
            self.exchange.settle()

    @property
    def restarts(self) -> bool:
        """Whether the newest command restarts the printer."""
        return bool(self._command) and name_of(self._command) in RESTARTS and self._command not in self.unknown

    def listen(self) -> None:
        """One short turn without sending anything."""
        self.exchange.pump()

    def order(self, what: type[Exception]) -> None:
        """Raise LeftError or StopError in the thread that talks, whatever it waits for."""
        self._ordered = what

    def stop(self) -> FirmwareError:
        """The emergency stop; returns what became of it as an error to raise."""
        if emergency_stop(self.exchange.wire, self.exchange.medium):
            revival = self.exchange.connection.greeting.firmware.line.revival
            return FirmwareError(f"emergency stop: the printer has halted; {revival} before the next print")
        return FirmwareError("emergency stop: the printer did not confirm M112: cut the power")

    def heated(self) -> str:
        """Which heaters are on, as words; "" when none is. A command under way may have switched them on a moment ago."""
        if not self._idle():
            return "heaters, for a command was under way"
        self.command("M105")
        targets = (("nozzle", self.heat.nozzle_target_c), ("bed", self.heat.bed_target_c))
        return " and ".join(f"{name} set to {target_c:.0f} deg C" for name, target_c in targets if target_c)

    def switch_off(self) -> bool:
        """Heaters off; True when the printer's own report shows it. A command under way is broken off."""
        if self._idle():
            for command in ("M104 S0", "M140 S0"):
                self.command(command)
            return not self.heated()
        return heaters_off(self.exchange.wire, self.exchange.medium, homing=self.exchange.waits) is not Heaters.UNPROVED

    def give_up(self) -> bool:
        """The same after an error: order it without the protocol, for the printer may not follow it any more."""
        try:
            heaters = (
                heaters_off(self.exchange.wire, self.exchange.medium, FAULT_S) if self.exchange.greeted else Heaters.UNPROVED
            )
        except PortError:
            return False
        return heaters is not Heaters.UNPROVED or self.exchange.connection.halted

    def _idle(self) -> bool:
        window = self.exchange.connection.window
        return self.exchange.greeted and self.exchange.connection.fault is None and window.acknowledged == window.sent

    def _heard(self, event: Event) -> None:
        self.position = position_in(event) or self.position
        if isinstance(event, Ok):
            self.heat = event.temperature or self.heat
        elif isinstance(event, Temperature):
            self.heat = event
        elif unknown_command(event) and self.exchange.greeted:
            self.unknown.append(self._command)

    def _turned(self, now_s: float) -> None:
        del now_s
        ordered, self._ordered = self._ordered, None
        if ordered is not None:
            raise ordered

    def _lost(self, error: PortError) -> Reconnection:
        raise error
