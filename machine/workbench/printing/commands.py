"""Commands: all that a page may ask of the prints, by name: who may ask it, and what does it.

A page sends `{"do": NAME, ...}`; the keyword-only parameters of the function of that name are what else it sends.
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

LONGEST_PORT = 300  # letters
Work = Coroutine[Any, Any, None]


class OfPrint(Arguments):
    """print: the number of the print that is meant."""

    print: int


@dataclass(frozen=True)
class PageOfPrints:
    """A page that asks: its name, its bench, the prints, and the event loop of the benches.

    The prints have an event loop of their own, so the session is read in that of the benches alone: what is read at two moments
    from here may be of two benches.
    """

    name: str
    session: Session
    prints: Prints
    benches: asyncio.AbstractEventLoop

    def commanded(self, number: int) -> RunningPrint:
        """The print of a number, which this page commands. Raises PrinterError where another page does, or it is not there."""
        running = self.prints.numbered(number)
        if running.holder != self.name:
            raise PrinterError("another page commands this print: take the command over first")
        return running


def ports(page: PageOfPrints, *, baud: int = BAUD) -> None:
    """Look for printers."""
    page.prints.look_for_ports(baud)


def journals(page: PageOfPrints) -> None:
    """Look for prints that were cut off."""
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
        raise PlanError("this bench is not open any more: print from another one")
    if gcode:
        if session.gcode is None or session.gcode.key != gcode:
            raise PlanError("this G-code file is not open any more: open it again")
        sliced = session.gcode
        name = sliced.cost.name
    else:
        check_need(session, Need.MODEL)
        slices = session.slicing.needed()
        assert slices.bench.model is not None
        name, sliced = slices.bench.model.name, slices.sliced
    known = sliced.known
    check_destination(destination, known.profile.machine)
    if not force:  # what that goes past the print itself says
        refuse_errors(sliced.errors, force=False)
    load = Slices(name, sliced.gcode, known.profile, known)
    return PrintJob(destination, Does.PRINT, name, load, known.profile, starts, force, key=sliced.key)


def go_on(
    page: PageOfPrints, *, journal: str = "", machine: str = "", port: str = "", baud: int = BAUD, sim_speed: float = 0.0
) -> None:
    """Ask the printer where it stands, to print the rest of a print that was cut off."""
    journal, machine = journal.strip(), machine.strip()
    if not journal:
        raise JournalError("no journal is chosen: choose the print that is to go on, or name the journal's file")
    for name in (journal, machine):
        if "\0" in name:
            raise JournalError(f"{name!r:.100} is no file's name: it has a character that no name has")
    profile = machine_profile(machine) if machine else None
    destination = _destination(port, baud, sim_speed)
    page.prints.begin(page.name, PrintJob(destination, Does.RESUME, profile=profile, cut_off=Path(journal).absolute()))


def follow(page: PageOfPrints, *, port: str = "") -> None:
    """Follow what a print server prints already."""
    page.prints.begin(page.name, PrintJob(parse_server_address(_destination(port).name), Does.FOLLOW))


async def hand(page: PageOfPrints, *, port: str = "", baud: int = BAUD, sim_speed: float = 0.0) -> None:
    """Take a printer in hand, as the machine and the material of the page's bench are."""

    async def job() -> PrintJob:
        return PrintJob(_destination(port, baud, sim_speed), Does.HAND, profile=page.session.bench.profile.of_all_parts)

    page.prints.begin(page.name, await in_loop(page.benches, job()))


def emergency(page: PageOfPrints, *, print: Any = None) -> None:
    """Stop a print at once, or without a number all; every page may."""
    page.prints.stop_at_once(print)


def take(page: PageOfPrints, *, print: int) -> None:
    """Take the command of a print over."""
    page.prints.numbered(print).holder = page.name


def forget(page: PageOfPrints, *, print: int) -> None:
    """Take a print that is over off the list."""
    running = page.commanded(print)
    if not running.over:
        raise PrinterError(f"print {print} is not over: only one that is over leaves the list")
    page.prints.prints.remove(running)


FUNCTIONS: dict[str, Callable[..., Work | None]] = {
    "ports": ports,
    "journals": journals,
    "check": check,
    "go_on": go_on,
    "follow": follow,
    "hand": hand,
    "emergency": emergency,
    "take": take,
    "forget": forget,
}
# Those of a print, which only the page that commands it may ask for.
OF_PRINT: dict[str, Callable[..., None]] = {
    "begin": RunningPrint.begin,
    "cancel": RunningPrint.cancel,
    "leave": RunningPrint.leave,
    "pause": RunningPrint.pause,
    "resume": RunningPrint.resume,
    "feed": RunningPrint.feed,
    "flow": RunningPrint.flow,
    "babystep": RunningPrint.babystep,
    "by_hand": RunningPrint.by_hand,
}
COMMANDS = {name: arguments_of(function) for name, function in FUNCTIONS.items()} | {
    name: arguments_of(function, OfPrint) for name, function in OF_PRINT.items()
}


def obey(page: PageOfPrints, asked: Asked) -> Work | None:
    """Do what a page asks for, `{"do": NAME, ...}`. Returns the work that is left where its bench must be asked first. Raises
    UserError for what cannot be done, as that work does."""
    name, arguments = read_command(asked, COMMANDS)
    given, work = dict(arguments), None
    if name in OF_PRINT:
        OF_PRINT[name](page.commanded(given.pop("print")), **given)
    else:
        work = FUNCTIONS[name](page, **given)
    page.prints.notify()
    return work


def _destination(port: str, baud: int = BAUD, sim_speed: float = 0.0) -> Destination:
    """Where to print, as the options --port, --baud and --sim-speed say. Raises PrinterError.

    A server's address is read here, for all pages are told of a print's port: a password in it must not come so far."""
    port = port.strip()
    if not port or len(port) > LONGEST_PORT:
        raise PrinterError("no printer is chosen: choose a port, or sim for the simulated one")
    return parse_destination(port, baud, sim_speed)
