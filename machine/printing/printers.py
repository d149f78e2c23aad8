"""Printers of a job, and the checks before anything moves.

The printer is greeted and compared with the machine, then with the program, which is loaded only if the printer fits.
"""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import replace

from machine.pipeline.programs import LoadedProgram
from machine.printing.checks import (
    CLEAN,
    check,
    check_destination,
    machine_sentences,
    program_sentences,
    with_starvation,
)
from machine.printing.destination import Server
from machine.printing.job import Does, Person, PrintJob
from machine.printing.serial_log import new_log
from machine.printing.serial_print import SerialPrinter
from machine.printing.server_print import LIMITS, ServerPrinter
from machine.printing.servers.servers import open_server
from profiles.machine import Machine

Printer = SerialPrinter | ServerPrinter


@contextmanager
def open_printer(job: PrintJob, person: Person) -> Iterator[Printer]:
    """The printer of a job. Raises ServerError, ProfileError."""
    if isinstance(job.destination, Server):
        with open_server_printer(job, job.destination, person) as printer:
            yield printer
    else:
        yield SerialPrinter(job, job.destination, person)


@contextmanager
def open_server_printer(job: PrintJob, at: Server, person: Person) -> Iterator[ServerPrinter]:
    """The printer behind a print server, while the session lasts. Raises ServerError, ProfileError."""
    title = f"what {at.name} prints" if job.does is Does.FOLLOW else f"{job.name} to {at.name}"
    with new_log("print" if job.starts else "send", title, job.log) as log:
        log.say_trouble("what is asked and answered")
        with open_server(at, log.note) as server:
            yield ServerPrinter(job, server, log, person)


def check_print(job: PrintJob, printer: Printer, tell: Callable[[LoadedProgram], object] | None = None) -> LoadedProgram:
    """The program of a job, once all checks have passed; the printer is greeted before any work is done. Raises UserError.

    tell: called with the program when it is loaded, and again with its findings.
    """
    assert job.load is not None
    printer.greet()
    if job.profile is not None:
        _check_machine(job, printer, job.profile.machine)
    loaded = job.load()
    if tell is not None:
        tell(loaded)
    if job.profile is None:
        _check_machine(job, printer, loaded.profile.machine)
    if check(program_sentences(printer.identity, loaded, job.force), job.force):
        printer.person.passed(CLEAN)
    if isinstance(job.destination, Server) and job.starts:
        printer.person.passed(LIMITS)
    loaded = replace(loaded, program=with_starvation(job.destination, loaded.program, loaded.profile))
    if tell is not None:
        tell(loaded)
    return loaded


def _check_machine(job: PrintJob, printer: Printer, machine: Machine) -> None:
    check_destination(job.destination, machine)
    if check(machine_sentences(printer.identity, machine), job.force):
        printer.person.passed(printer.fits(machine))
