"""Ready: a program that may go to a printer at a port: made for it, inside its limits, without errors of the dry run."""

from dataclasses import replace

from machine.app.pipeline.programs import refuse_errors
from machine.app.printer.compatibility import check_program, is_rate_limited
from machine.app.requests import PrintRequest
from machine.dryrun.starvation import find_starvation
from machine.link.identification import Answer
from machine.program import Program
from profiles.profile import Profile


def ready_program(
    answer: Answer | None, program: Program, profile: Profile, name: str, printing: PrintRequest, force: bool
) -> Program:
    """The program with what the dry run finds of this line's rate. Raises PrinterError, MoveError; force: only says so."""
    check_program(answer, program, profile, name, force)
    refuse_errors(program, force)
    if not is_rate_limited(printing.port):
        return program
    return replace(program, run=find_starvation(program.run, program.lines, profile.machine, printing.baud))
