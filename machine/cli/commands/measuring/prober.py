"""Prober: a printer at the other end of a command session that is told to move, and to seek contact along Z."""

import re

from machine.cli.commands.measuring.mover import PrinterMover
from machine.firmware.probing import ProbingRules
from machine.gcode.pen import Pen
from machine.link.medium import SERIAL, Medium, Wire
from machine.link.protocol.events import Echo, Event, Unknown
from machine.link.protocol.framing import LINE_LIMIT
from machine.printing.command_session import CommandSession
from profiles.errors import FirmwareError, PrinterError

SEEK_MM_S = 3.0
TOLD_MM = 0.006  # what M114 rounds to hundredths of a mm


class ProbingSession(CommandSession):
    """A command session that keeps what the printer says beside its ok."""

    def __init__(self, wire: Wire, limit: int = LINE_LIMIT, medium: Medium = SERIAL) -> None:
        self.heard: list[str] = []
        super().__init__(wire, limit, medium)

    def nozzle_c(self) -> float:
        """How hot the nozzle is; 0 where that is not reported."""
        self.command("M105")
        return self.heat.nozzle_c or 0.0

    def _heard(self, event: Event) -> None:
        super()._heard(event)
        if isinstance(event, Echo | Unknown):
            self.heard.append(event.text)


class PrinterProber(PrinterMover):
    """Implements machine.setup.calibration.probing.measure.Prober. offset_z_mm: from the nozzle's tip to what touches."""

    def __init__(self, session: ProbingSession, pen: Pen, rules: ProbingRules, offset_z_mm: float = 0.0) -> None:
        super().__init__(session, pen)
        self._probing, self._rules, self._offset_z_mm = session, rules, offset_z_mm

    def seek(self, low_mm: float) -> float | None:
        """The tip's Z at contact on the way down to a height; None: there was none."""
        session, rules = self._probing, self._rules
        session.heard.clear()
        began, self.z_mm = self.z_mm, low_mm if rules.limited else self._pen.machine.z.limits_mm[0]
        try:
            session.command(rules.command.format(low=low_mm, speed=SEEK_MM_S, feed=60.0 * SEEK_MM_S))
        except FirmwareError as error:
            return self._said_by(error, began)
        if session.unknown:
            raise PrinterError(f"the printer does not know {session.unknown[0]!r}: {rules.needs} is needed")
        self.z_mm = self._answered() if rules.contact else self._stopped()
        return None if rules.limited and self.z_mm <= low_mm + TOLD_MM else self.z_mm

    def _said_by(self, error: FirmwareError, began_mm: float) -> float | None:
        """What an error of the firmware's own means for the contact."""
        if self._rules.silent and self._rules.silent in str(error):
            return None
        if self._rules.early and self._rules.early in str(error):
            self.z_mm = began_mm
            return began_mm
        raise error

    def _stopped(self) -> float:
        position = self._session.exchange.ask_position()
        if position is None:
            raise PrinterError("the printer does not report where it has stopped: an answer to M114 is needed")
        return dict(position.axes)["Z"]

    def _answered(self) -> float:
        """The tip's Z that the firmware has answered."""
        text = "\n".join(self._probing.heard)
        if corrected := re.search(self._rules.corrected, text):
            return float(corrected[1]) - self._offset_z_mm
        if contact := re.search(self._rules.contact, text):
            return float(contact[1])
        raise PrinterError(f"the printer does not report where it has met something: {text[:80]!r} is not understood")
