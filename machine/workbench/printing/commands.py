"""Commands: all that a page may ask of the prints, by name: whose each is, and what does it."""

from collections.abc import Awaitable, Callable, Coroutine
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any, Protocol, TypeVar

from machine.cli.terminal.options import machine_profile
from machine.link.pending_commands import Command as LinkCommand
from machine.link.print_state import PrintState
from machine.pipeline.programs import refuse_errors
from machine.pipeline.requests import BAUD
from machine.printing.checks import check_destination
from machine.printing.destination import Destination, parse_destination, parse_server_address
from machine.printing.job import Does, PrintJob
from machine.workbench.bench.values import Asked, is_number
from machine.workbench.printing.at_page import HandCommand, HandDoes
from machine.workbench.printing.job_state import Slices
from machine.workbench.printing.prints import Prints
from machine.workbench.printing.running_print import RunningPrint
from machine.workbench.session.commands import Need, check_need
from machine.workbench.session.session import Session
from profiles.errors import JournalError, PlanError, PrinterError

LONGEST_PORT = 300  # letters


Work = Coroutine[Any, Any, None]
T = TypeVar("T")


class OnBench(Protocol):
    """Calls a function in the event loop of the benches."""

    def __call__(self, function: Callable[[], T]) -> Awaitable[T]: ...


@dataclass(frozen=True)
class PageOfPrints:
    """A page that asks: its name, its bench, the prints, and the way to ask the bench.

    The prints have an event loop of their own, so the session is read by on_bench alone: what is read at two moments from here
    may be of two benches.
    """

    name: str
    session: Session
    prints: Prints
    on_bench: OnBench


# Returns work that is still to be awaited where the bench must be asked; raises UserError for what cannot be done, as that does.
Command = Callable[[PageOfPrints, Asked], Work | None]


def _begin(job: Callable[[Asked], PrintJob]) -> Command:
    return lambda page, asked: page.prints.begin(page.name, job(asked))


def _begin_from_bench(job: Callable[[Session, Asked], PrintJob]) -> Command:
    async def command(page: PageOfPrints, asked: Asked) -> None:
        page.prints.begin(page.name, await page.on_bench(partial(job, page.session, asked)))
        page.prints.notify()

    return command


def _of_print(act: Callable[[RunningPrint, Asked], None], on_server: bool = False, over: bool = False) -> Command:
    """One of a print that only the page that commands it may ask for. on_server: only there; over: only when nothing goes on."""

    def command(page: PageOfPrints, asked: Asked) -> None:
        meant = page.prints.numbered(asked.get("print"))
        if meant.holder != page.name:
            raise PrinterError("another page commands this print: take the command over first")
        if (on_server and not meant.state.server) or (over and not meant.over):
            raise PrinterError("what the page has sent is no command of a print")
        act(meant, asked)

    return command


def _passed_on(command: LinkCommand) -> Command:
    return _of_print(lambda meant, asked: meant.say((command, float(_whole(asked, "percent", 100)))))


def _take(page: PageOfPrints, asked: Asked) -> None:
    page.prints.numbered(asked.get("print")).holder = page.name


def _forget(page: PageOfPrints, asked: Asked) -> None:
    _of_print(lambda meant, asked: page.prints.prints.remove(meant), over=True)(page, asked)


def _slices(session: Session, asked: Asked) -> PrintJob:
    """What lies on the page's bench."""
    sends_only = asked.get("send_only") is True
    destination = _server(asked) if sends_only else _destination(asked)
    return job_of(session, destination, asked.get("force") is True, not sends_only)


def job_of(session: Session, destination: Destination, force: bool, starts: bool = True) -> PrintJob:
    """Make a job of the slices on a bench. Called in the session's event loop, so that all of it is of one moment. What is known
    before a printer is asked is refused here.

    force: go past errors of the dry run. Raises PlanError where there are no slices of what lies there now, PrinterError for a
    machine that cannot print there, MoveError where the dry run found errors.
    """
    if session.closed:
        raise PlanError("this bench is not open any more: print from another one")
    check_need(session, Need.MODEL)
    slices = session.slicing.needed()
    bench, sliced = slices.bench, slices.sliced
    assert bench.model is not None
    name, known = bench.model.name, sliced.known
    check_destination(destination, known.profile.machine)
    if not force:  # what that goes past the print itself says
        refuse_errors(sliced.errors, force=False)
    load = Slices(name, sliced.gcode, known.profile, known)
    return PrintJob(destination, Does.PRINT, name, load, known.profile, starts, force, key=sliced.key)


def _rest(asked: Asked) -> PrintJob:
    """The rest of a print that was cut off."""
    journal, machine = (str(asked.get(key) or "").strip() for key in ("journal", "machine"))
    if not journal:
        raise JournalError("no journal is chosen: choose the print that is to go on, or name the journal's file")
    for name in (journal, machine):
        if "\0" in name:
            raise JournalError(f"{name!r:.100} is no file's name: it has a character that no name has")
    profile = machine_profile(machine) if machine else None
    return PrintJob(_destination(asked), Does.RESUME, profile=profile, cut_off=Path(journal).absolute())


def _hand(session: Session, asked: Asked) -> PrintJob:
    """The printer by hand, as the machine and the material of the page's bench are."""
    return PrintJob(_destination(asked), Does.HAND, profile=session.bench.profile.of_all_parts)


def _by_hand(meant: RunningPrint, asked: Asked) -> None:
    does, axis, by_mm = str(asked.get("does")), str(asked.get("axis") or ""), asked.get("by_mm", 0.0)
    if does not in set(HandDoes) or meant.state.state is not PrintState.IN_HAND or not is_number(by_mm):
        raise PrinterError("this cannot be done by hand now")
    meant.say((HandCommand(HandDoes(does), axis[:1], float(by_mm), asked.get("keep_heat") is True),))


def _server(asked: Asked) -> Destination:
    return parse_server_address(_destination(asked).name)


def _destination(asked: Asked) -> Destination:
    """Where to print, as the options --port, --baud and --sim-speed say. Raises PrinterError.

    A server's address is read here, for all pages are told of a print's port: a password in it must not come so far."""
    port = str(asked.get("port") or "").strip()
    if not port or len(port) > LONGEST_PORT:
        raise PrinterError("no printer is chosen: choose a port, or sim for the simulated one")
    baud, speed = asked.get("baud", BAUD), asked.get("sim_speed", 0.0)
    if not is_number(baud) or not is_number(speed) or baud != int(baud):
        raise PrinterError(f"baud {str(baud)[:40]}, sim_speed {str(speed)[:40]}: numbers are expected, a whole one for the rate")
    return parse_destination(port, int(baud), float(speed))


def _whole(asked: Asked, key: str, otherwise: int) -> int:
    value = asked.get(key, otherwise)
    if not is_number(value) or value != int(value):
        raise PrinterError(f"{key} is {str(value)[:40]!r}: a whole number is expected")
    return int(value)


COMMANDS: dict[str, Command] = {
    "ports": lambda page, asked: page.prints.look_for_ports(_whole(asked, "baud", BAUD)),
    "journals": lambda page, asked: page.prints.look_for_journals(),
    "check": _begin_from_bench(_slices),
    "go_on": _begin(_rest),
    "follow": _begin(lambda asked: PrintJob(_server(asked), Does.FOLLOW)),
    "hand": _begin_from_bench(_hand),
    "by_hand": _of_print(_by_hand),
    "emergency": lambda page, asked: page.prints.stop_at_once(asked.get("print")),
    "take": _take,
    "begin": _of_print(lambda meant, asked: meant.begin()),
    "cancel": _of_print(lambda meant, asked: meant.cancel()),
    "leave": _of_print(lambda meant, asked: meant.leave(), on_server=True),
    "pause": _passed_on(LinkCommand.PAUSE),
    "resume": _passed_on(LinkCommand.RESUME),
    "feed": _passed_on(LinkCommand.FEED),
    "flow": _passed_on(LinkCommand.FLOW),
    "forget": _forget,
}


def obey(page: PageOfPrints, asked: Asked) -> Work | None:
    """Do what a page asks for, `{"do": NAME, ...}`. Returns the work that is left where its bench must be asked first. Raises
    UserError for what cannot be done, as that work does."""
    name = asked.get("do")
    command = COMMANDS.get(name) if isinstance(name, str) else None
    if command is None:
        raise PrinterError("what the page has sent is no command of a print")
    work = command(page, asked)
    page.prints.notify()
    return work
