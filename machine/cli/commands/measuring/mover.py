"""Mover: a printer whose cold head is taken from place to place over a command session, while its axes are measured."""

from contextlib import suppress

from machine.gcode.pen import Pen
from machine.link.shutdown import lift_tip
from machine.notices import say
from machine.printing.command_session import CommandSession
from machine.setup.calibration.program import cold_start, turn_lines
from mdp.pose import Pose
from profiles.errors import PrinterError

CROSS_MM_S = 100.0


class PrinterMover:
    """z_mm: where the tip is, as it was sent."""

    def __init__(self, session: CommandSession, pen: Pen) -> None:
        self._session, self._pen = session, pen
        self._up = 60.0 * pen.machine.z.speed_mm_s
        self._across = 60.0 * min(pen.machine.x.speed_mm_s, pen.machine.y.speed_mm_s, CROSS_MM_S)
        self.z_mm = 0.0
        self._top: float | None = None  # the greatest height it has been sent to; None: it has not been homed

    def start(self) -> None:
        """Home as the profile's start block does, without heat; what is left out for that is said. Raises UserError."""
        for line in list(cold_start(self._pen)):
            if line.startswith("; left out"):
                say(f"start block: {line.removeprefix('; ')}")
            self._session.command(line)

    def turn(self, pose: Pose) -> None:
        """Turn the table, the head standing still."""
        for line in turn_lines(pose, self._pen):
            self._session.command(line)

    def rise(self, z_mm: float) -> None:
        """Bring the tip to a height."""
        self._session.command(f"G1 Z{z_mm:.3f} F{self._up:.0f}")
        self.z_mm, self._top = z_mm, z_mm if self._top is None else max(self._top, z_mm)

    def cross(self, x_mm: float, y_mm: float) -> None:
        """Bring the tip over a place."""
        self._session.command(f"G1 X{x_mm:.3f} Y{y_mm:.3f} F{self._across:.0f}")

    def arrive(self) -> None:
        """Wait until all moves are made."""
        self._session.exchange.drain()

    @property
    def raised(self) -> str:
        """What retreat() has done, as words before others."""
        return "" if self._top is None else "the tip is raised, "

    def retreat(self) -> None:
        """After an error: the tip up to the greatest height it has been at, whatever the printer is able to hear."""
        if self._top is None:
            return
        try:
            self.rise(self._top)
            self._session.exchange.drain()
        except PrinterError:
            exchange = self._session.exchange
            with suppress(PrinterError):
                lift_tip(exchange.wire, exchange.medium, f"Z{self._top - self.z_mm:.3f}", self._up, lambda: None)
