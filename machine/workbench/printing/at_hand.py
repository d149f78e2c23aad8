"""Manual control: a page heats and moves a printer while nothing prints.

Nothing is homed while the table is tilted or its position is unknown; the head moves only after homing in this session, within
the machine's limits and above the table; the heaters go off after half an hour without a command, and at the end unless the user
wants them on.
"""

from contextlib import ExitStack
from math import inf
from queue import Empty
from time import monotonic, time

import numpy as np

from machine.cli.terminal.interrupts import calling
from machine.firmware import Dialect, dialect_of
from machine.gcode.blocks import cold_block, filled_start
from machine.gcode.commands import homes
from machine.gcode.words import read_letters, split_command
from machine.kinematics.table import machine_points
from machine.link.pending_commands import Command
from machine.link.print_state import PrintState, PrintStatus
from machine.printing.checks import check_machine
from machine.printing.command_session import CommandSession, LeftError, StopError
from machine.printing.destination import Simulated, at_printer
from machine.printing.job import End, PrintJob
from machine.printing.ports import describe_answer, identify_printer, open_line, rate_of
from machine.workbench.printing.at_page import AtPage, HandCommand, HandDoes
from mdp.pose import level
from profiles.errors import MoveError, PrinterError, UserError
from profiles.machine import Machine
from profiles.profile import Profile

LOOK_S = 1.0  # between queries of temperatures and position
IDLE_S = 1800.0
LEVEL_DEG = 0.05  # M114 reports hundredths
MOST_JOG_MM = 100.0
JOG_MM_S = {"X": 50.0, "Y": 50.0, "Z": 10.0}
LET_GO = "disconnected; the heaters are off"


def by_hand(job: PrintJob, person: AtPage) -> End:
    """Execute the user's commands until the session ends; returns how it ended."""
    assert job.profile is not None
    at, machine = at_printer(job.destination), job.profile.machine
    with ExitStack() as stack:
        stack.enter_context(calling(person.leave))  # a termination request ends the session and switches the heaters off
        wire = stack.enter_context(open_line(at, machine))
        answer = identify_printer(wire, rate_of(at))
        check_machine(None if isinstance(at, Simulated) else answer, machine)
        person.passed(describe_answer(answer, rate_of(at)))
        session = CommandSession(wire, dialect_of(machine).longest_line)
        person.interrupt = lambda word: session.order(StopError if word == Command.EMERGENCY_STOP else LeftError)
        person.agreed = True  # it may now be heated and moved
        return Hand(job.profile, session, person).serve()


class Hand:
    """A session in which the user heats and moves a printer."""

    def __init__(self, profile: Profile, session: CommandSession, person: AtPage) -> None:
        self._profile, self._session, self._person = profile, session, person
        self._homed = False
        self._problem = ""
        self._began_s = self._asked_s = monotonic()
        self._looked_s = -inf

    def serve(self) -> End:
        """Greet the printer and execute commands until the user ends the session, or has been idle for IDLE_S.

        Switches the heaters off at the end unless the user wants them on. Raises UserError.
        """
        with self._session as session:
            try:
                session.greet()
                sentence = self._until_let_go()
            except LeftError:
                sentence = LET_GO if session.exchange.greeted else "disconnected; nothing was heated or moved"
            self._person.tell(state=PrintState.CANCELLING)
        return End(PrintState.DONE, sentence)

    def _until_let_go(self) -> str:
        """Execute commands; returns the sentence about the end."""
        while not self._person.releases():
            try:
                command = self._person.by_hand.get_nowait()
            except Empty:
                if monotonic() - self._asked_s > IDLE_S:
                    return "no command for half an hour; the heaters are off"
                self._session.listen()
                if monotonic() - self._looked_s > LOOK_S:
                    self._look()
                continue
            self._asked_s = monotonic()
            if command.does == HandDoes.LET_GO and command.keep_heat:
                heated = self._session.heated()
                self._session.keep_heat = True
                return f"disconnected; {heated} stays on" if heated else "disconnected; no heater is on"
            if command.does == HandDoes.LET_GO:
                break
            self._do(command)
        return LET_GO

    def _look(self) -> None:
        """Query and report temperatures and position."""
        for command in ("M105", "M114"):
            self._session.command(command)
        self._looked_s = monotonic()
        status = PrintStatus(
            PrintState.IN_HAND,
            monotonic() - self._began_s,
            self._session.heat,
            at={letter: place for letter, place in self._at().items() if letter != "E"},
            message=self._problem,
            homed=self._homed,
        )
        self._person.tell(status=status, live=True, told_s=time())

    def _at(self) -> dict[str, float]:
        return dict(self._session.position or {})

    def _do(self, command: HandCommand) -> None:
        """Execute a command; one that is impossible is reported, and nothing moves. Raises PrinterError."""
        try:
            lines = self._lines(command)
        except PrinterError:
            raise
        except UserError as error:  # also for a start block that cannot be filled in
            self._problem = f"{error}"
        else:
            self._problem = ""
            for line in lines:
                self._session.command(line)
            self._homed = self._homed or command.does == HandDoes.HOME
        self._look()

    def _lines(self, command: HandCommand) -> list[str]:
        material, machine = self._profile.material, self._profile.machine
        if command.does == HandDoes.HEAT:
            bed = [f"M140 S{material.bed_c:g}"] if machine.bed_limit_c > 0.0 else []
            return [*bed, f"M104 S{material.first_layer_nozzle_c:g}"]
        if command.does == HandDoes.COOL:
            return ["M104 S0", "M140 S0"]
        if command.does == HandDoes.JOG and not self._homed:
            raise MoveError("the head moves only after homing here: home it first")
        self._session.command("M114")
        check_level(machine, self._at(), homing=command.does == HandDoes.HOME)
        if command.does == HandDoes.HOME:
            return homing_lines(filled_start(self._profile), dialect_of(machine))
        target_mm = jog_target_mm(machine, self._at(), command.axis, command.by_mm)
        return ["G21", "G90", f"G1 {command.axis}{target_mm:.3f} F{JOG_MM_S[command.axis] * 60.0:g}"]


def check_level(machine: Machine, at: dict[str, float], *, homing: bool) -> None:
    """Raise MoveError if the table is tilted, or its position is unknown. A printer that has just been switched on reports its
    firmware's initial position: it may be homed, because the page asks whether the table is level."""
    if not machine.tilts or (homing and _has_just_begun(machine, at)):
        return
    tilt = at.get(machine.tilt.letter)
    if tilt is None:
        raise MoveError("the printer does not report the table's position, so nothing is moved: level it at the machine")
    if abs(tilt - machine.tilt.zero_deg) > LEVEL_DEG:
        raise MoveError(f"the table is tilted, at {machine.tilt.letter}{tilt:.2f}: nothing is homed or moved before it is level")


def _has_just_begun(machine: Machine, at: dict[str, float]) -> bool:
    believed = zip(("X", "Y", "Z", machine.tilt.letter, machine.turn.letter), machine.home, strict=True)
    return all(letter in at and abs(at[letter] - home) < LEVEL_DEG for letter, home in believed)


def homing_lines(start: list[str], dialect: Dialect) -> list[str]:
    """Homing lines of a start block: up to the last that homes, without heating, and the following G92 that define the level
    table. Raises MoveError if it does not home, or not without lines that may heat."""
    last = max((index for index, line in enumerate(start) if homes(line, dialect)), default=-1)
    if last < 0:
        raise MoveError("the start block of this machine homes nothing (G28): home it at the machine")
    for line in start[last + 1 :]:
        name, rest = split_command(line.upper())
        if name != "G92" or "E" in read_letters(rest):
            break
        last += 1
    return cold_block(start[: last + 1], dialect)[0]


def jog_target_mm(machine: Machine, at: dict[str, float], axis: str, by_mm: float) -> float:
    """Target of a jog. Raises MoveError outside the limits, or below the table."""
    axes = {"X": machine.x, "Y": machine.y, "Z": machine.z}
    if axis not in axes or axis not in at or not abs(by_mm) <= MOST_JOG_MM:
        raise MoveError(f"X, Y and Z are moved by up to {MOST_JOG_MM:g} mm at a time")
    target_mm, (least_mm, most_mm) = at[axis] + by_mm, axes[axis].limits_mm
    if axis == "Z":
        least_mm = max(least_mm, float(machine_points(machine, level(machine), np.zeros((1, 3)))[0, 2]))
    if not least_mm <= target_mm <= most_mm:
        raise MoveError(f"{axis} would be {target_mm:.2f} mm: {least_mm:g} to {most_mm:g} are allowed")
    return target_mm
