"""Print job: what is to be done at which printer, the person who attends it, and how it ended.

The terminal and a page of the workbench are two persons; what prints is written once, against `Person`.
"""

from collections.abc import Callable
from contextlib import AbstractContextManager
from dataclasses import dataclass, field
from enum import StrEnum
from pathlib import Path
from typing import Protocol

from machine.link.journal import Journal
from machine.link.pending_commands import Control
from machine.link.print_state import PrintState, PrintStatus
from machine.pipeline.programs import LoadedProgram
from machine.printing.destination import Destination
from machine.printing.serial_log import PrinterMessages, SerialLog
from profiles.profile import Profile


class Does(StrEnum):
    """Kind of work that a job does at its printer."""

    PRINT = "print"
    RESUME = "resume"  # the rest of a print that was cut off
    FOLLOW = "follow"  # what a print server prints already is watched and commanded
    HAND = "hand"  # nothing is printed: a person heats and moves the machine


@dataclass(frozen=True, eq=False)
class PrintJob:
    """A job: its printer, its program and how it is recorded.

    load: makes the program; profile: what is known of the machine before that, None: the program itself says it. starts: False: a
    print server only gets the file and keeps it. force: go past what --force goes past. cut_off: the journal of the print whose
    rest it is. log: file for what is sent and received, journal: for what a resume needs; None: a new one in the state folder.
    key: of the slices that are printed.
    """

    destination: Destination
    does: Does = Does.PRINT
    name: str = ""
    load: Callable[[], LoadedProgram] | None = None
    profile: Profile | None = None
    starts: bool = True
    force: bool = False
    cut_off: Path | None = None
    log: Path | None = None
    journal: Path | None = None
    key: str = ""


@dataclass(frozen=True)
class End:
    """How a job ended. sentence: for a person who has not followed it."""

    state: PrintState
    sentence: str = ""


DONE = End(PrintState.DONE, "the print is done")
CANCELLED = End(PrintState.CANCELLED, "the print was stopped")
NOT_BEGUN = End(PrintState.DECLINED, "nothing was printed")
NOT_MOVED = End(PrintState.DECLINED, "nothing was moved or heated")


Show = Callable[[PrintStatus | None], None]  # None: it begins, nothing is known of it yet


@dataclass(frozen=True, eq=False)
class Scene:
    """A job as it is shown.

    beginning: shown as its position as long as no part is known; server: the name of the print server that goes on without this
    program, "" for a print that ends with it; uploads: the server only gets the file.
    """

    title: str
    log: SerialLog
    journal: Journal | None = None
    messages: PrinterMessages = field(default_factory=PrinterMessages)
    beginning: str = "starting"
    server: str = ""
    uploads: bool = False


class Person(Protocol):
    """A person who attends a job; what is said meanwhile comes as `machine.notices`.

    commands: what the person asks of it; its stop flag is set when the job is to end, heaters off.
    """

    commands: Control

    def passed(self, sentence: str) -> None:
        """Take note of what a check has found to be as it must be."""

    def ask(self, question: str, choices: tuple[str, ...] = ()) -> int | None:
        """Wait for an answer: the number of a choice, 0 for a plain yes, None for no. Raises JournalError where nobody can
        answer."""

    def show(self, scene: Scene) -> AbstractContextManager[Show]:
        """Show each moment of the job and take commands for it until the block ends."""

    def left(self) -> bool:
        """Whether the person has left what goes on without this program."""

    def gives_up(self) -> bool:
        """Whether there is to be no print on a server, as long as none has begun."""
