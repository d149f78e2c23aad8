"""Printers: what a job is printed by, and the one list of what is asked before anything moves.

The printer is greeted, held against the machine, and then against the program, which is loaded when the printer fits.
"""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import replace

from machine.pipeline.programs import LoadedProgram
from machine.printing.destination import Server
from machine.printing.job import Does, Person, Printer, PrintJob
from machine.printing.serial_print import SerialPrinter
from machine.printing.server_print import ServerPrinter, server_session


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
    """The printer behind a print server, for as long as the session with it lasts. Raises ServerError, ProfileError."""
    title = f"what {at.name} prints" if job.does is Does.FOLLOW else f"{job.name} to {at.name}"
    with server_session(at, title, "print" if job.starts else "send", job.log) as (server, log):
        yield ServerPrinter(job, at, server, log, person)


def check_print(job: PrintJob, printer: Printer, tell: Callable[[LoadedProgram], object] | None = None) -> LoadedProgram:
    """The program of a job, when nothing speaks against printing it there. The printer is asked before any work is done.

    tell: told the program as soon as it is there, and again with what is found of it. Raises UserError.
    """
    assert job.load is not None
    tell = tell or (lambda loaded: None)
    printer.greet()
    if job.profile is not None:
        printer.fit(job.profile.machine)
    loaded = job.load()
    tell(loaded)
    if job.profile is None:
        printer.fit(loaded.profile.machine)
    loaded = replace(loaded, program=printer.ready(loaded))
    tell(loaded)
    return loaded
