"""At hand: a printer that a person heats and moves from a page, with nothing printed.

The rules: nothing is homed while the table is tilted or nobody knows how it stands; the head is moved only after it was homed
here, inside the machine's limits and above the table; heaters that nobody has asked anything of for half an hour go off, and so
do all at the end unless the person says otherwise.
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

LOOK_S = 1.0  # between questions after temperatures and place
IDLE_S = 1800.0
LEVEL_DEG = 0.05  # M114 reports hundredths
MOST_JOG_MM = 100.0
JOG_MM_S = {"X": 50.0, "Y": 50.0, "Z": 10.0}
LET_GO = "let go of; the heaters are off"


def by_hand(job: PrintJob, person: AtPage) -> End:
    """Do what the person asks for until it is let go of; how it ended."""
    assert job.profile is not None
    at, machine = at_printer(job.destination), job.profile.machine
    with ExitStack() as stack:
        stack.enter_context(calling(person.leave))  # a termination request lets go of the printer, its heaters off
        wire = stack.enter_context(open_line(at, machine))
        answer = identify_printer(wire, rate_of(at))
        check_machine(None if isinstance(at, Simulated) else answer, machine)
        person.passed(describe_answer(answer, rate_of(at)))
        session = CommandSession(wire, dialect_of(machine).longest_line)
        person.interrupt = lambda word: session.order(StopError if word == Command.EMERGENCY_STOP else LeftError)
        person.agreed = True  # from now on it may be heated and moved
        return Hand(job.profile, session, person).serve()


class Hand:
    """A session at a printer that a person heats and moves."""

    def __init__(self, profile: Profile, session: CommandSession, person: AtPage) -> None:
        self._profile, self._session, self._person = profile, session, person
        self._homed = False
        self._problem = ""
        self._began_s = self._asked_s = monotonic()
        self._looked_s = -inf

    def serve(self) -> End:
        """Greet the printer and do what the person asks for until he lets go or has asked for nothing for IDLE_S; how it ended.

        However it ends, the heaters go off unless he let go and wants them on. Raises UserError.
        """
        with self._session as session:
            try:
                session.greet()
                sentence = self._until_let_go()
            except LeftError:
                sentence = LET_GO if session.exchange.greeted else "let go of; nothing was heated or moved"
            self._person.tell(state=PrintState.CANCELLING)
        return End(PrintState.DONE, sentence)

    def _until_let_go(self) -> str:
        """Command after command; the sentence of the end."""
        while not self._person.lets_go():
            try:
                command = self._person.by_hand.get_nowait()
            except Empty:
                if monotonic() - self._asked_s > IDLE_S:
                    return "nothing was asked for half an hour; the heaters are off"
                self._session.listen()
                if monotonic() - self._looked_s > LOOK_S:
                    self._look()
                continue
            self._asked_s = monotonic()
            if command.does == HandDoes.LET_GO and command.keep_heat:
                heated = self._session.heated()
                self._session.keep_heat = True
                return f"let go of; {heated} stays on" if heated else "let go of; no heater is on"
            if command.does == HandDoes.LET_GO:
                break
            self._do(command)
        return LET_GO

    def _look(self) -> None:
        """Ask after temperatures and place, and tell them."""
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
        """One command; what cannot be done is told, and nothing moves. Raises PrinterError."""
        try:
            lines = self._lines(command)
        except PrinterError:
            raise
        except UserError as error:  # a start block that cannot be filled in, too
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
            raise MoveError("the head is moved only once it was homed here: home it first")
        self._session.command("M114")
        check_level(machine, self._at(), homing=command.does == HandDoes.HOME)
        if command.does == HandDoes.HOME:
            return homing_lines(filled_start(self._profile), dialect_of(machine))
        target_mm = jog_target_mm(machine, self._at(), command.axis, command.by_mm)
        return ["G21", "G90", f"G1 {command.axis}{target_mm:.3f} F{JOG_MM_S[command.axis] * 60.0:g}"]


def check_level(machine: Machine, at: dict[str, float], *, homing: bool) -> None:
    """Raises MoveError where the table is tilted, or the printer does not tell how it stands. One that has just been switched on
    tells where its firmware believes itself then: it may be homed, for the page has asked whether the table is level."""
    if not machine.tilts or (homing and _has_just_begun(machine, at)):
        return
    tilt = at.get(machine.tilt.letter)
    if tilt is None:
        raise MoveError("the printer does not tell how the table stands, so nothing is moved: level it at the machine")
    if abs(tilt - machine.tilt.zero_deg) > LEVEL_DEG:
        raise MoveError(f"the table is tilted, at {machine.tilt.letter}{tilt:.2f}: nothing is homed or moved before it is level")


def _has_just_begun(machine: Machine, at: dict[str, float]) -> bool:
    believed = zip(("X", "Y", "Z", machine.tilt.letter, machine.turn.letter), machine.home, strict=True)
    return all(letter in at and abs(at[letter] - home) < LEVEL_DEG for letter, home in believed)


def homing_lines(start: list[str], dialect: Dialect) -> list[str]:
    """How a start block homes: its lines up to the last that does, without those that heat, and what calls the table level right
    after it. Raises MoveError where it homes nothing, or not without what may heat."""
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
    """Where a jog ends. Raises MoveError outside the limits, or below the table."""
    axes = {"X": machine.x, "Y": machine.y, "Z": machine.z}
    if axis not in axes or axis not in at or not abs(by_mm) <= MOST_JOG_MM:
        raise MoveError(f"X, Y and Z are moved by up to {MOST_JOG_MM:g} mm at a time")
    target_mm, (least_mm, most_mm) = at[axis] + by_mm, axes[axis].limits_mm
    if axis == "Z":
        least_mm = max(least_mm, float(machine_points(machine, level(machine), np.zeros((1, 3)))[0, 2]))
    if not least_mm <= target_mm <= most_mm:
        raise MoveError(f"{axis} would be {target_mm:.2f} mm: {least_mm:g} to {most_mm:g} are allowed")
    return target_mm
