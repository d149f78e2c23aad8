"""At port: a print on a printer at a port, or on the simulated one, with what `print` asks before anything moves."""

from machine.app.pipeline.programs import LoadedProgram
from machine.app.printer.compatibility import check_machine, check_port, describe_answer, ready_program
from machine.app.printer.stream import print_program
from machine.app.requests import SIMULATED
from machine.app.workbench.printing.at_page import AtPage
from machine.app.workbench.printing.checks import CLEAN, DONE, LEFT, STOPPED, Checks, figures, program_of
from machine.app.workbench.printing.order import PrintOrder, State
from machine.firmware.line import check_baud
from machine.link.identification import Answer


def print_at_port(order: PrintOrder, person: AtPage, checks: Checks) -> State:
    """Check, ask, print; how it ended. Raises UserError."""
    job = _checked(order, checks)
    checks.reporter.tell(phase="ready")
    if not person.agrees():
        return LEFT
    return STOPPED if print_program(job, order.printing, attendance=person) else DONE


def _checked(order: PrintOrder, checks: Checks) -> LoadedProgram:
    """The job, when nothing speaks against it."""
    printing, profile, tell = order.printing, order.profile, checks.reporter.tell
    check_baud(printing.baud)
    answer = check_port(printing.port, printing.baud, printing.sim_speed)
    with checks.that(_answers(answer, order)):
        check_machine(answer, profile.machine, order.force)
    program = program_of(order)
    tell(figures=figures(program))
    with checks.that(CLEAN):
        program = ready_program(answer, program, profile, name=order.name, printing=printing, force=order.force)
    tell(figures=figures(program))  # with what the line's rate adds
    return LoadedProgram(order.name, program, profile)


def _answers(answer: Answer | None, order: PrintOrder) -> str:
    printing = order.printing
    if answer is None:
        assert printing.port == SIMULATED
        speed = f"{printing.sim_speed:g} times as fast as a real one" if printing.sim_speed else "as fast as it can"
        return f"a simulated {order.profile.machine.name}, {speed}"
    return f"{describe_answer(answer, printing.baud)}, answers at {printing.port} and is one for {order.profile.machine.name}"
