"""Print job: the work and its destination, the user who attends it, and how it ended.

The terminal and the workbench's page both implement `Person`; all printing code is written against it.
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
    """Kind of work that a job does."""

    PRINT = "print"
    RESUME = "resume"  # the rest of an interrupted print
    FOLLOW = "follow"  # watch and control what a print server is printing
    HAND = "hand"  # manual control: the user heats and moves the machine


@dataclass(frozen=True, eq=False)
class PrintJob:
    """A job: its destination, its program and how it is recorded.

    load: makes the program; profile: known before loading, None: the program says it. starts: False: a print server only stores
    the file. force: ignore objections that --force can override. cut_off: journal of the interrupted print to finish. log: file
    for the traffic, journal: file for resuming; None: a new one in the state folder. key: identifies the slices that are printed.
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
    """How a job ended. sentence: for a user who has not followed it."""

    state: PrintState
    sentence: str = ""


DONE = End(PrintState.DONE, "the print is done")
NOT_BEGUN = End(PrintState.DECLINED, "nothing was printed")
NOT_MOVED = End(PrintState.DECLINED, "nothing was moved or heated")


Show = Callable[[PrintStatus | None], None]  # None: it begins, nothing is known yet


@dataclass(frozen=True, eq=False)
class Scene:
    """A job as displayed.

    beginning: its position while no part is known; server: name of the print server that continues without this program, "" for a
    print that ends with it; uploads: the server only stores the file.
    """

    title: str
    log: SerialLog
    journal: Journal | None = None
    messages: PrinterMessages = field(default_factory=PrinterMessages)
    beginning: str = "starting"
    server: str = ""
    uploads: bool = False


class Person(Protocol):
    """A user who attends a job; messages come as `machine.notices`.

    commands: requests to the job; its stop flag ends the job, heaters off.
    """

    commands: Control

    def passed(self, sentence: str) -> None:
        """Report that a check has passed."""

    def ask(self, question: str, choices: tuple[str, ...] = ()) -> int | None:
        """Wait for an answer: the number of a choice, 0 for yes, None for no. Raises JournalError when no user can answer."""

    def show(self, scene: Scene) -> AbstractContextManager[Show]:
        """Show the job's status and accept commands until the block ends."""

    def left(self) -> bool:
        """Whether the user has left a print that continues without this program."""

    def cancels(self) -> bool:
        """Whether the user has cancelled a print on a server before its start."""
