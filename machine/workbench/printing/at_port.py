"""At port: a print on a printer at a port, or on the simulated one, with what `print` asks before anything moves; and the rest of
one that was cut off, with what `resume` tells and asks."""

from machine.cli.terminal.options import machine_profile
from machine.firmware.firmware import check_baud
from machine.link.identification import Answer
from machine.pipeline import compilers
from machine.pipeline.programs import LoadedProgram
from machine.pipeline.requests import SIMULATED
from machine.printing.compatibility import check_machine, check_port, describe_answer, ready_program
from machine.printing.resumption import NOTHING as REST_NOTHING
from machine.printing.resumption import STOPPED as REST_STOPPED
from machine.printing.resumption import print_rest, read_resumption
from machine.printing.stream import print_program
from machine.workbench.printing.at_page import AtPage
from machine.workbench.printing.checks import CLEAN, DONE, LEFT, STOPPED, Checks, figures, program_of
from machine.workbench.printing.order import PrintOrder, ResumeOrder, State
from profiles.errors import JournalError


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
    tell(figures=figures(program, profile.material))
    with checks.that(CLEAN):
        program = ready_program(answer, program, profile, name=order.name, printing=printing, force=order.force)
    tell(figures=figures(program, profile.material))  # with what the line's rate adds
    return LoadedProgram(order.name, program, profile)


def _answers(answer: Answer | None, order: PrintOrder) -> str:
    printing = order.printing
    if answer is None:
        assert printing.port == SIMULATED
        speed = f"{printing.sim_speed:g} times as fast as a real one" if printing.sim_speed else "as fast as it can"
        return f"a simulated {order.profile.machine.name}, {speed}"
    return f"{describe_answer(answer, printing.baud)}, answers at {printing.port} and is one for {order.profile.machine.name}"


def go_on(order: ResumeOrder, person: AtPage, checks: Checks) -> State:
    """Tell, ask the printer, ask the person, print the rest; how it ended. Raises UserError."""
    named = machine_profile(order.machine) if order.machine else None
    cut_off = read_resumption(order.journal, order.printing, named)
    checks.reporter.tell(name=cut_off.name, machine=cut_off.profile.machine.name)
    for sentence in cut_off.sentences():
        checks.add(sentence)
    compilers.wait_for(compilers.DRY_RUN)

    def agrees(question: str) -> bool:
        checks.reporter.tell(phase="ready", question=question)
        return person.agrees()

    def which(question: str, heights: tuple[float, ...]) -> float | None:
        del heights
        raise JournalError(f"{question}; which one is asked at a terminal only: tiltprint resume {order.journal}")

    ended = print_rest(cut_off, order.printing, agrees, which, person)
    nothing = {"end": "left", "sentence": "nothing was moved or heated", "journal": ""}
    return {REST_NOTHING: nothing, REST_STOPPED: STOPPED}.get(ended, DONE)
