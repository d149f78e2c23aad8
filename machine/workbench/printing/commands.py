"""Commands for prints, by name: who may give them, and the functions that execute them.

A page sends `{"do": NAME, ...}`; the other fields are the keyword-only parameters of the function.
"""

import asyncio
from collections.abc import Callable, Coroutine
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from machine.cli.terminal.options import machine_profile
from machine.pipeline.programs import refuse_errors
from machine.pipeline.requests import BAUD
from machine.printing.checks import check_destination
from machine.printing.destination import Destination, parse_destination, parse_server_address
from machine.printing.job import Does, PrintJob
from machine.workbench.bench.values import Arguments, Asked, arguments_of, read_command
from machine.workbench.printing.at_page import Slices
from machine.workbench.printing.prints import Prints
from machine.workbench.printing.running_print import RunningPrint
from machine.workbench.session.base import in_loop
from machine.workbench.session.commands import Need, check_need
from machine.workbench.session.session import Session
from profiles.errors import JournalError, PlanError, PrinterError

LONGEST_PORT = 300  # characters
Work = Coroutine[Any, Any, None]


class OfPrint(Arguments):
    """print: number of the print."""

    print: int


@dataclass(frozen=True)
class PageOfPrints:
    """A page that gives a command: its name, its bench, the prints, and the event loop of the benches.

    The prints have an event loop of their own. The session must be read in that of the benches, and in one step: two reads from
    here could see two different benches.
    """

    name: str
    session: Session
    prints: Prints
    benches: asyncio.AbstractEventLoop

    def commanded(self, number: int) -> RunningPrint:
        """The print with this number. Raises PrinterError if it does not exist, or another page controls it."""
        running = self.prints.numbered(number)
        if running.holder != self.name:
            raise PrinterError("another page controls this print: take control first")
        return running


def ports(page: PageOfPrints, *, baud: int = BAUD) -> None:
    page.prints.look_for_ports(baud)


def journals(page: PageOfPrints) -> None:
    page.prints.look_for_journals()


async def check(
    page: PageOfPrints,
    *,
    port: str = "",
    baud: int = BAUD,
    sim_speed: float = 0.0,
    force: bool = False,
    send_only: bool = False,
    gcode: str = "",
) -> None:
    """Check and prepare a print of the slices on the page's bench. send_only: a print server is only to keep the file; gcode: the
    key of the G-code file that is open there, to be printed in their place."""
    destination = _destination(port, baud, sim_speed)
    if send_only:
        destination = parse_server_address(destination.name)
    page.prints.begin(page.name, await in_loop(page.benches, job_of(page.session, destination, force, not send_only, gcode)))


async def job_of(session: Session, destination: Destination, force: bool, starts: bool = True, gcode: str = "") -> PrintJob:
    """Make a job of the slices on a bench, or of the G-code file open there that has a key. Runs in the sessions' event loop
    without a pause, so that all of it is of one moment. What is known before a printer is asked is refused here.

    force: go past errors of the dry run. Raises PlanError where there are no slices of what lies there now, PrinterError for a
    machine that cannot print there, MoveError where the dry run found errors.
    """
    if session.closed:
        raise PlanError("this bench is no longer open: print from another one")
    if gcode:
        if session.gcode is None or session.gcode.key != gcode:
            raise PlanError("this G-code file is no longer open: open it again")
        sliced = session.gcode
        name = sliced.cost.name
    else:
        check_need(session, Need.MODEL)
        slices = session.slicing.needed()
        assert slices.bench.model is not None
        name, sliced = slices.bench.model.name, slices.sliced
    known = sliced.known
    check_destination(destination, known.profile.machine)
    if not force:  # the print itself reports errors that force overrides
        refuse_errors(sliced.errors, force=False)
    load = Slices(name, sliced.gcode, known.profile, known)
    return PrintJob(destination, Does.PRINT, name, load, known.profile, starts, force, key=sliced.key)


def go_on(
    page: PageOfPrints, *, journal: str = "", machine: str = "", port: str = "", baud: int = BAUD, sim_speed: float = 0.0
) -> None:
    """Query the printer's position, to print the rest of an interrupted print."""
    journal, machine = journal.strip(), machine.strip()
    if not journal:
        raise JournalError("no journal is chosen: choose the print to resume, or name the journal's file")
    for name in (journal, machine):
        if "\0" in name:
            raise JournalError(f"{name!r:.100} is not a file name: it has a character that no name may have")
    profile = machine_profile(machine) if machine else None
    destination = _destination(port, baud, sim_speed)
    page.prints.begin(page.name, PrintJob(destination, Does.RESUME, profile=profile, cut_off=Path(journal).absolute()))


def follow(page: PageOfPrints, *, port: str = "") -> None:
    page.prints.begin(page.name, PrintJob(parse_server_address(_destination(port).name), Does.FOLLOW))


async def hand(page: PageOfPrints, *, port: str = "", baud: int = BAUD, sim_speed: float = 0.0) -> None:
    """Begin manual control of a printer, with the machine and the material of the bench."""

    async def job() -> PrintJob:
        return PrintJob(_destination(port, baud, sim_speed), Does.HAND, profile=page.session.bench.profile.of_all_parts)

    page.prints.begin(page.name, await in_loop(page.benches, job()))


def emergency(page: PageOfPrints, *, print: Any = None) -> None:
    """Stop a print at once, or all prints without a number; every page may."""
    page.prints.stop_at_once(print)


def take(page: PageOfPrints, *, print: int) -> None:
    page.prints.numbered(print).holder = page.name


def forget(page: PageOfPrints, *, print: int) -> None:
    """Remove a finished print from the list."""
    running = page.commanded(print)
    if not running.over:
        raise PrinterError(f"print {print} is not over: only one that is over leaves the list")
    page.prints.prints.remove(running)


FUNCTIONS: dict[str, Callable[..., Work | None]] = {
    function.__name__: function for function in (ports, journals, check, go_on, follow, hand, emergency, take, forget)
}
# Commands for one print, which only the page that controls it may give.
OF_PRINT: dict[str, Callable[..., None]] = {
    function.__name__: function
    for function in (
        *(RunningPrint.begin, RunningPrint.cancel, RunningPrint.leave, RunningPrint.pause, RunningPrint.resume),
        *(RunningPrint.feed, RunningPrint.flow, RunningPrint.babystep, RunningPrint.by_hand),
    )
}
COMMANDS = {name: arguments_of(function) for name, function in FUNCTIONS.items()} | {
    name: arguments_of(function, OfPrint) for name, function in OF_PRINT.items()
}


def obey(page: PageOfPrints, asked: Asked) -> Work | None:
    """Execute a page's command `{"do": NAME, ...}`. Returns the remaining work if it needs the bench. Both raise UserError."""
    name, arguments = read_command(asked, COMMANDS)
    given, work = dict(arguments), None
    if name in OF_PRINT:
        OF_PRINT[name](page.commanded(given.pop("print")), **given)
    else:
        work = FUNCTIONS[name](page, **given)
    page.prints.notify()
    return work


def _destination(port: str, baud: int = BAUD, sim_speed: float = 0.0) -> Destination:
    """Parse the destination given by --port, --baud and --sim-speed. Raises PrinterError. This keeps a password in a server's
    address from all pages, which receive a print's port."""
    port = port.strip()
    if not port or len(port) > LONGEST_PORT:
        raise PrinterError("no printer is chosen: choose a port, or sim for the simulated one")
    return parse_destination(port, baud, sim_speed)
