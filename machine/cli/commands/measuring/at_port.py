"""A cold machine at a port while its axes are measured: conversation, homing, moves and a safe end with the tip raised."""

import re
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager, suppress
from pathlib import Path

from machine.cli.terminal.interrupts import interrupting
from machine.firmware import dialect_of
from machine.firmware.firmware import ProbingRules
from machine.gcode.pen import Pen
from machine.link.medium import SERIAL, Medium, Wire
from machine.link.protocol.events import Event, Kind
from machine.link.protocol.framing import LINE_LIMIT
from machine.link.shutdown import lift_tip
from machine.notices import say
from machine.printing.checks import check_machine
from machine.printing.command_session import CommandSession
from machine.printing.destination import AtPrinter
from machine.printing.ports import describe_answer, identify_printer, open_line, rate_of
from machine.printing.serial_log import TappedWire, new_log
from machine.setup.calibration.program import cold_start, turn_lines
from machine.simulator.contact import ProbedTable
from mdp.pose import Pose
from profiles.errors import FirmwareError, PrinterError, add_words
from profiles.machine import Machine

HOT_C = 50.0  # above it plastic may hang from the nozzle
CROSS_MM_S = 100.0
SEEK_MM_S = 3.0
ROUNDING_MM = 0.006  # rounding of M114, which reports hundredths of a mm


class PrinterMover:
    """Moves a printer for a measurement. z_mm: the commanded height of the tip."""

    def __init__(self, session: CommandSession, pen: Pen) -> None:
        self._session, self._pen = session, pen
        self._up = 60.0 * pen.machine.z.speed_mm_s
        self._across = 60.0 * min(pen.machine.x.speed_mm_s, pen.machine.y.speed_mm_s, CROSS_MM_S)
        self.z_mm = 0.0
        self._top: float | None = None  # the greatest commanded height; None before homing

    def start(self) -> None:
        """Home by the profile's start block without heat, and report the lines left out. Raises UserError."""
        for line in list(cold_start(self._pen)):
            if line.startswith("; left out"):
                say(f"start block: {line.removeprefix('; ')}")
            self._session.command(line)

    def turn(self, pose: Pose) -> None:
        """Turn the table; the head does not move."""
        for line in turn_lines(pose, self._pen):
            self._session.command(line)

    def rise(self, z_mm: float) -> None:
        """Move the tip to a height."""
        self._session.command(f"G1 Z{z_mm:.3f} F{self._up:.0f}")
        self.z_mm, self._top = z_mm, z_mm if self._top is None else max(self._top, z_mm)

    def cross(self, x_mm: float, y_mm: float) -> None:
        """Move the tip horizontally."""
        self._session.command(f"G1 X{x_mm:.3f} Y{y_mm:.3f} F{self._across:.0f}")

    def arrive(self) -> None:
        """Wait until all moves have ended."""
        self._session.exchange.drain()

    @property
    def raised(self) -> str:
        """Phrase that reports what retreat() has done, to be followed by others."""
        return "" if self._top is None else "the tip is raised, "

    def retreat(self) -> None:
        """Raise the tip to its greatest height so far after an error, even if the printer no longer answers."""
        if self._top is None:
            return
        try:
            self.rise(self._top)
            self._session.exchange.drain()
        except PrinterError:
            exchange = self._session.exchange
            with suppress(PrinterError):
                lift_tip(exchange.wire, exchange.medium, f"Z{self._top - self.z_mm:.3f}", self._up, lambda: None)


class ProbingSession(CommandSession):
    """A command session that records what the printer sends besides ok."""

    def __init__(self, wire: Wire, limit: int = LINE_LIMIT, medium: Medium = SERIAL) -> None:
        self.heard: list[str] = []
        super().__init__(wire, limit, medium)

    def nozzle_c(self) -> float:
        """Nozzle temperature, °C; 0 if not reported."""
        self.command("M105")
        return self.heat.nozzle_c or 0.0

    def _heard(self, event: Event) -> None:
        super()._heard(event)
        if event.kind in (Kind.ECHO, Kind.UNKNOWN):
            self.heard.append(event.text)


class PrinterProber(PrinterMover):
    """Implements machine.setup.calibration.probing.Prober. offset_z_mm: from the nozzle's tip to the probe's contact point."""

    def __init__(self, session: ProbingSession, pen: Pen, rules: ProbingRules, offset_z_mm: float = 0.0) -> None:
        super().__init__(session, pen)
        self._probing, self._rules, self._offset_z_mm = session, rules, offset_z_mm

    def seek(self, low_mm: float) -> float | None:
        """Move down to a height and return the tip's Z at contact, or None without contact."""
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
        return None if rules.limited and self.z_mm <= low_mm + ROUNDING_MM else self.z_mm

    def _said_by(self, error: FirmwareError, began_mm: float) -> float | None:
        """The contact's Z that a firmware error implies, None without contact; raises any other error."""
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
        return position["Z"]

    def _answered(self) -> float:
        """The tip's Z that the firmware reported."""
        text = "\n".join(self._probing.heard)
        if corrected := re.search(self._rules.corrected, text):
            return float(corrected[1]) - self._offset_z_mm
        if contact := re.search(self._rules.contact, text):
            return float(contact[1])
        raise PrinterError(f"the printer does not report where it touched something: {text[:80]!r} is not understood")


@contextmanager
def cold_session(
    at: AtPrinter, machine: Machine, log_file: Path | None = None, table: ProbedTable | None = None
) -> Iterator[ProbingSession]:
    """Open a session with a real or simulated printer; switches the heaters off at the end.

    table: what the simulated printer's probe touches. log_file: record of the conversation; None: a new file in the state folder.
    """
    with ExitStack() as stack:
        log = stack.enter_context(new_log("calibrate", f"calibrate at {at.name}", log_file))
        wire = stack.enter_context(open_line(at, machine, table))
        log.say_trouble()
        stack.enter_context(interrupting())
        answer = identify_printer(wire, rate_of(at))
        say(describe_answer(answer, rate_of(at)))
        check_machine(answer, machine)
        session = stack.enter_context(ProbingSession(TappedWire(wire, log.note), dialect_of(machine).longest_line))
        session.greet()
        yield session


def begin_cold(session: ProbingSession, mover: PrinterMover, machine: Machine) -> None:
    """Switch the heaters off, home, and raise the tip to the top."""
    if hot := session.heated():
        say(f"{hot}: switched off, measuring is done cold")
        if not session.switch_off():
            raise PrinterError("the printer did not confirm that its heaters are off: measuring is done cold")
    if (nozzle_c := session.nozzle_c()) > HOT_C:
        say(f"the nozzle is {nozzle_c:.0f} °C hot: plastic that hangs from it spoils every contact")
    mover.start()
    mover.rise(machine.z.limits_mm[1])


@contextmanager
def tip_raised_after(mover: PrinterMover) -> Iterator[None]:
    """Raise the tip after any error, and report it."""
    try:
        yield
    except BaseException as error:
        mover.retreat()
        if isinstance(error, KeyboardInterrupt):
            say(f"interrupted: {mover.raised}nothing is saved, the table stands as it stood")
        else:
            add_words(error, f"{mover.raised}nothing is saved")
        raise
