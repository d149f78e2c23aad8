"""At a port: the cold machine whose axes are measured, spoken to, homed, and left with its tip raised."""

from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from math import inf

from machine.cli.commands.measuring.mover import PrinterMover
from machine.cli.commands.measuring.prober import ProbingSession
from machine.cli.terminal.interrupts import interrupting
from machine.cli.terminal.progress import say
from machine.firmware import dialect_of
from machine.link.port import open_port
from machine.pipeline.requests import SIMULATED, PortRequest
from machine.printing.compatibility import check_machine, describe_answer, identify_printer
from machine.printing.serial_log import TappedWire, new_log
from machine.simulator.contact import ProbedTable
from machine.simulator.simulator import SimulatedPrinter
from profiles.errors import PrinterError, add_words
from profiles.machine import Machine

HOT_C = 50.0  # a nozzle from which plastic may hang


@contextmanager
def cold_session(port: PortRequest, machine: Machine, table: ProbedTable | None = None) -> Iterator[ProbingSession]:
    """A conversation with the machine at the port, or with the simulated one, whose table may be sensed; its heaters off at the
    end."""
    with ExitStack() as stack:
        path = port.port
        if path == SIMULATED:
            path = stack.enter_context(SimulatedPrinter(machine, inf, table=table)).path
        log = stack.enter_context(new_log("calibrate", f"calibrate at {port.port}", port.log))
        wire = stack.enter_context(open_port(path, port.baud))
        if log.trouble:
            say(f"the traffic is not logged: {log.file}: {log.trouble}")
        stack.enter_context(interrupting())
        answer = identify_printer(wire, port.baud)
        say(describe_answer(answer, port.baud))
        check_machine(answer, machine, False)
        session = stack.enter_context(ProbingSession(TappedWire(wire, log.note), dialect_of(machine).longest_line))
        session.greet()
        yield session


def begin_cold(session: ProbingSession, mover: PrinterMover, machine: Machine) -> None:
    """Heaters off, homed, the tip at the top."""
    if hot := session.heated():
        say(f"{hot}: switched off, measuring is done cold")
        if not session.switch_off():
            raise PrinterError("the printer did not confirm that its heaters are off: measuring is done cold")
    if (nozzle_c := session.nozzle_c()) > HOT_C:
        say(f"the nozzle is {nozzle_c:.0f} deg C hot: plastic that hangs from it falsifies every contact")
    mover.start()
    mover.rise(machine.z.limits_mm[1])


@contextmanager
def tip_raised_after(mover: PrinterMover) -> Iterator[None]:
    """Raise the tip whatever has gone wrong, and say so."""
    try:
        yield
    except BaseException as error:
        mover.retreat()
        if isinstance(error, KeyboardInterrupt):
            say(f"interrupted: {mover.raised}nothing is saved, the table stands as it stood")
        else:
            add_words(error, f"{mover.raised}nothing is saved")
        raise
