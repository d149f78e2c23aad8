"""The heaters go off however a printer is left: an error is raised at every step of every loop that commands one."""

import io
import signal
import sys
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass, field, replace
from functools import partial
from pathlib import Path
from typing import Any, Self

import pytest

from machine.cli.commands import console as console_module
from machine.cli.commands.console import console
from machine.cli.commands.measuring import at_port
from machine.cli.commands.measuring.at_port import PrinterMover, ProbingSession, begin_cold, cold_session, tip_raised_after
from machine.cli.terminal.requests import ConsoleRequest
from machine.link.medium import Medium, Wire
from machine.link.stream import print_lines
from machine.printing import ports
from machine.printing.command_session import CommandSession, LeftError, StopError
from machine.printing.destination import SerialPort
from machine.printing.job import Does, End, PrintJob
from machine.setup.calibration.program import calibration_pen
from machine.workbench.printing import at_hand
from machine.workbench.printing.at_hand import by_hand
from machine.workbench.printing.at_page import AtPage, HandCommand, HandDoes
from mdp.pose import Pose
from profiles.errors import FirmwareError, MoveError, PortError, PrinterError
from profiles.profile import load
from tests.machine.peers import happened
from tests.machine.virtual_printer import PATH, VirtualPrinter

# Fast axes make a run short; every run has its own printer.
PROFILE = load(settings=["machine.x.speed_mm_s=500", "machine.y.speed_mm_s=500", "machine.z.speed_mm_s=100"])
ERRORS = (RuntimeError, KeyboardInterrupt, MoveError, OSError, PortError)
HEAT, HOME, JOG = HandCommand(HandDoes.HEAT), HandCommand(HandDoes.HOME), HandCommand(HandDoes.JOG, "X", 5.0)
MonkeyPatch = pytest.MonkeyPatch


@dataclass
class Steps:
    """Counts the steps of a run, from 1, and raises an error at some of them. last: the newest values reported."""

    error: BaseException = field(default_factory=RuntimeError)
    raise_at: tuple[int, ...] = ()
    count: int = 0
    last: dict[str, Any] = field(default_factory=dict)

    def take(self, *ignored: object, **told: object) -> None:
        self.count += 1
        self.last |= told
        if self.count in self.raise_at:
            raise self.error

    def on_wire(self, medium: Medium) -> Medium:
        """The medium, with every wire counting steps."""
        return replace(medium, open=lambda name, baud: SteppedWire(medium.open(name, baud), self))


class SteppedWire:
    """A step before and after every write, and after every read that has returned bytes."""

    def __init__(self, wire: Wire, steps: Steps) -> None:
        self.name, self.discard, self.close = wire.name, wire.discard, wire.close
        self._wire, self._steps = wire, steps

    def write(self, data: bytes) -> None:
        self._steps.take()
        self._wire.write(data)
        self._steps.take()

    def read(self) -> bytes:
        if data := self._wire.read():
            self._steps.take()
        return data

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *error: object) -> None:
        self.close()


Loop = Callable[[Steps, VirtualPrinter, MonkeyPatch], None]


def in_hand(steps: Steps, printer: VirtualPrinter, monkeypatch: MonkeyPatch, *commands: HandCommand) -> End:
    """Manual commands of the user, and how the control ended."""
    medium = steps.on_wire(printer.medium)
    monkeypatch.setattr(ports, "open_port", medium.open)
    monkeypatch.setattr(at_hand, "CommandSession", partial(CommandSession, medium=medium))
    person = AtPage(type("Reporter", (), {"tell": steps.take})())
    for command in commands:
        person.by_hand.put(command)
    return by_hand(PrintJob(SerialPort(PATH), Does.HAND, profile=PROFILE), person)


def hand(steps: Steps, printer: VirtualPrinter, monkeypatch: MonkeyPatch) -> None:
    in_hand(steps, printer, monkeypatch, HEAT, HOME, JOG, HandCommand(HandDoes.LET_GO))


def console_of_a_pipe(steps: Steps, printer: VirtualPrinter, monkeypatch: MonkeyPatch) -> None:
    medium = steps.on_wire(printer.medium)
    monkeypatch.setattr(ports, "open_port", medium.open)
    monkeypatch.setattr(console_module, "CommandSession", partial(CommandSession, medium=medium))
    monkeypatch.setattr(sys, "stdin", io.StringIO("M104 S200\nM140 S60\nG28\nG1 X5 F6000\nM400\n"))
    console(ConsoleRequest(port=PATH), PROFILE.machine)


def measuring(steps: Steps, printer: VirtualPrinter, monkeypatch: MonkeyPatch) -> None:
    medium = steps.on_wire(printer.medium)
    monkeypatch.setattr(ports, "open_port", medium.open)
    monkeypatch.setattr(at_port, "ProbingSession", partial(ProbingSession, medium=medium))
    with cold_session(SerialPort(PATH), PROFILE.machine) as session:
        mover = PrinterMover(session, calibration_pen(PROFILE))
        with tip_raised_after(mover):
            begin_cold(session, mover, PROFILE.machine)
            session.command("M104 S200")  # as a macro of the machine could do
            mover.turn(Pose(10.0, 0.0))
            mover.cross(5.0, 5.0)
            mover.arrive()


def streamed(steps: Steps, printer: VirtualPrinter, monkeypatch: MonkeyPatch) -> None:
    del monkeypatch
    program = ["M104 S200", "M140 S60", "G28 X Y Z", "G92 A0 C0", "G1 X5 F6000", "G1 Z20", "M104 S0", "M140 S0"]
    print_lines(program, PATH, on_progress=steps.take, medium=steps.on_wire(printer.medium), profile=PROFILE)


LOOPS = pytest.mark.parametrize("loop", [hand, console_of_a_pipe, measuring, streamed])


@pytest.fixture(autouse=True)
def _folders(tmp_path: Path, monkeypatch: MonkeyPatch) -> None:
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path))


def targets_c(printer: VirtualPrinter) -> tuple[float, float]:
    """The targets of nozzle and bed once all sent commands have been executed."""
    printer.firmware.advance()
    return printer.record.nozzle_target_c, printer.record.bed_target_c


@LOOPS
def test_an_error_at_any_step_leaves_the_heaters_off(loop: Loop, monkeypatch: MonkeyPatch) -> None:
    whole, printer = Steps(), VirtualPrinter(PROFILE.machine)
    loop(whole, printer, monkeypatch)
    assert happened(printer.record, "nozzle 2")
    assert targets_c(printer) == (0.0, 0.0)
    hot = []
    for step in range(1, whole.count + 1):
        again = (step, step + 1)  # the second one while the heaters are being switched off
        for error, at in ((ERRORS[step % len(ERRORS)](), (step,)), (KeyboardInterrupt(), again)):
            printer = VirtualPrinter(PROFILE.machine)
            with suppress(type(error), PrinterError):
                loop(Steps(error, at), printer, monkeypatch)
            if targets_c(printer) != (0.0, 0.0):
                hot.append((at, type(error).__name__))
    assert hot == []


def test_heaters_that_are_to_stay_on_go_off_when_letting_go_fails(monkeypatch: MonkeyPatch) -> None:
    whole, printer, keeping = Steps(), VirtualPrinter(PROFILE.machine), HandCommand(HandDoes.LET_GO, keep_heat=True)
    ended = in_hand(whole, printer, monkeypatch, HEAT, keeping)
    assert targets_c(printer) == (215.0, 60.0)
    assert ended.sentence == "disconnected; nozzle set to 215 °C and bed set to 60 °C stays on"
    for step in range(1, whole.count + 1):
        printer = VirtualPrinter(PROFILE.machine)
        with pytest.raises(RuntimeError):
            in_hand(Steps(RuntimeError(), (step,)), printer, monkeypatch, HEAT, keeping)
        assert targets_c(printer) == (0.0, 0.0)


@LOOPS
def test_an_error_says_what_became_of_the_heaters(loop: Loop, monkeypatch: MonkeyPatch) -> None:
    whole = Steps()
    loop(whole, VirtualPrinter(PROFILE.machine), monkeypatch)
    refused, bug = MoveError("cannot be moved"), RuntimeError("a bug")
    for error in (refused, bug):
        with pytest.raises(type(error)):
            loop(Steps(error, (whole.count // 2,)), VirtualPrinter(PROFILE.machine), monkeypatch)
    assert str(refused).endswith("; the printer reports its heaters off")
    assert bug.__notes__[-1] == "the printer reports its heaters off"


def test_a_start_block_that_cannot_be_filled_in_is_refused_and_nothing_moves(monkeypatch: MonkeyPatch) -> None:
    gcode = PROFILE.machine.gcode.model_copy(update={"start": "M104 S{warmth}\nG28"})
    broken = PROFILE.model_copy(update={"machine": PROFILE.machine.model_copy(update={"gcode": gcode})})
    monkeypatch.setattr(f"{__name__}.PROFILE", broken)
    steps, printer = Steps(), VirtualPrinter(PROFILE.machine)
    ended = in_hand(steps, printer, monkeypatch, HEAT, HOME, HandCommand(HandDoes.LET_GO))
    assert "{warmth}" in steps.last["status"].message
    assert (ended.sentence, targets_c(printer)) == ("disconnected; the heaters are off", (0.0, 0.0))
    assert not happened(printer.record, "homed XYZAC")


@pytest.mark.parametrize("heat", ["M109 S210", "m109s210", "M0109 S210", "M104 I1\nM190 R60", "M141 S40\nM191 S40"])
def test_manual_homing_neither_heats_nor_waits(heat: str, monkeypatch: MonkeyPatch) -> None:
    gcode = PROFILE.machine.gcode.model_copy(update={"start": f"{heat}\nG28"})
    heated = PROFILE.model_copy(update={"machine": PROFILE.machine.model_copy(update={"gcode": gcode})})
    monkeypatch.setattr(f"{__name__}.PROFILE", heated)
    printer = VirtualPrinter(PROFILE.machine)
    ended = in_hand(Steps(), printer, monkeypatch, HOME, HandCommand(HandDoes.LET_GO, keep_heat=True))
    assert (ended.sentence, targets_c(printer)) == ("disconnected; no heater is on", (0.0, 0.0))
    assert happened(printer.record, "homed XYZAC")
    assert printer.record.unknown == 0


def test_a_termination_signal_releases_a_printer_under_manual_control(monkeypatch: MonkeyPatch) -> None:
    class Terminated(Steps):
        def take(self, *ignored: object, **told: object) -> None:
            super().take(**told)
            status = self.last.get("status")
            if status is not None and status.temperature.nozzle_target_c == 215.0 and not self.raise_at:
                self.raise_at = (-1,)
                signal.raise_signal(signal.SIGTERM)

    def not_heard(number: int, frame: object) -> None:
        raise AssertionError("the process would have ended here")

    printer, before = VirtualPrinter(PROFILE.machine), signal.signal(signal.SIGTERM, not_heard)
    try:
        ended = in_hand(Terminated(), printer, monkeypatch, HEAT)
    finally:
        signal.signal(signal.SIGTERM, before)
    assert (ended.sentence, targets_c(printer)) == ("disconnected; the heaters are off", (0.0, 0.0))


def test_an_emergency_stop_counts_while_the_heaters_are_switched_off() -> None:
    printer = VirtualPrinter(PROFILE.machine)
    session = session_at(printer)
    session.greet()
    session.order(StopError)
    with pytest.raises(FirmwareError, match="emergency stop: the printer has halted"), session:
        pass
    assert happened(printer.record, "M112")


def test_leaving_twice_ends_a_session_once() -> None:
    printer = VirtualPrinter(PROFILE.machine)
    with session_at(printer) as session:
        session.greet()
        session.command("M104 S200")
        session.order(LeftError)  # noticed when the heaters are queried, so it has already left
    assert targets_c(printer) == (0.0, 0.0)


def test_measuring_does_not_begin_at_heaters_that_the_printer_does_not_confirm_to_be_off() -> None:
    class Stubborn(ProbingSession):
        def switch_off(self) -> bool:
            return False

    printer = VirtualPrinter(PROFILE.machine)
    session = Stubborn(printer.medium.open(PATH, 0), medium=printer.medium)
    session.greet()
    session.command("M104 S200")
    with pytest.raises(PrinterError, match="did not confirm that its heaters are off: measuring is done cold"):
        begin_cold(session, PrinterMover(session, calibration_pen(PROFILE)), PROFILE.machine)
    assert not happened(printer.record, "homed XYZAC")


def session_at(printer: VirtualPrinter) -> CommandSession:
    return CommandSession(printer.medium.open(PATH, 0), medium=printer.medium)
