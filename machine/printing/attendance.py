"""Attendance: who stands at a print, sees where it is and commands it: a person at the terminal, or at a page."""

from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, contextmanager
from dataclasses import dataclass
from threading import Event as Flag
from typing import Protocol

from machine.cli.terminal.interrupts import calling
from machine.cli.terminal.keys import Keyboard
from machine.cli.terminal.print_display import PrintDisplay
from machine.cli.terminal.printer_messages import PrinterMessages
from machine.cli.terminal.server_keys import ServerKeyboard
from machine.dryrun.timeline import Timeline
from machine.link.journal import Journal
from machine.link.pending_commands import Control
from machine.link.progress import Progress
from machine.notices import Report, reporting
from machine.printing.serial_log import SerialLog


@dataclass(frozen=True, eq=False)
class Observers:
    """Who is told of a print besides the person at it: the serial log, the journal, the page that follows it."""

    log: SerialLog
    journal: Journal | None = None
    follow: Callable[[Progress], None] | None = None


class Display(Protocol):
    """Shows progress from open() on: before, a person may be asked something."""

    def open(self) -> None:
        """Begin to show what comes."""

    def __call__(self, progress: Progress) -> None:
        """Show where the print stands; in the thread of the stream, which must not wait for it."""


class Attendance(Protocol):
    """control, stop: what is asked of the print, and that it is to end; words: what the printer says is kept there."""

    control: Control
    stop: Flag
    words: PrinterMessages

    def show(self, observers: Observers, timeline: Timeline) -> AbstractContextManager[Display]:
        """What shows the print while it runs."""


class AtTerminal:
    """A screen with keys on a terminal, plain lines elsewhere."""

    def __init__(self) -> None:
        self.control, self.stop, self.words = Control(), Flag(), PrinterMessages()

    def show(self, observers: Observers, timeline: Timeline) -> PrintDisplay:
        """The screen."""
        return PrintDisplay(observers.log.title, timeline, Keyboard(self.control), self.words)


class ServerAttendance(Protocol):
    """The same of a print on a server, which prints without this program: a person may leave it printing."""

    control: Control

    def uploading(self) -> AbstractContextManager[Report]:
        """What shows how far the file has been handed over."""

    def gives_up(self) -> bool:
        """Whether there is to be no print, as long as none has begun."""

    def gone(self) -> bool:
        """Whether the person has left while the print goes on."""

    def show(self, observers: Observers, timeline: Timeline) -> AbstractContextManager[Display]:
        """What shows the print while it is followed."""


class AtServerTerminal:
    """A screen with the keys of a print on a server; Ctrl-C asks first. An upload is broken off by it."""

    def __init__(self, server: str) -> None:
        self.control = Control()
        self._board = ServerKeyboard(self.control, server)

    def uploading(self) -> AbstractContextManager[Report]:
        """A line on stderr."""
        return reporting()

    def gives_up(self) -> bool:
        """Never: a KeyboardInterrupt says so."""
        return False

    def gone(self) -> bool:
        """By the key l, or by an interrupt whose question nobody has answered."""
        return self._board.gone()

    @contextmanager
    def show(self, observers: Observers, timeline: Timeline) -> Iterator[Display]:
        """The screen."""
        shown = PrintDisplay(observers.log.title, timeline, self._board, PrinterMessages())
        with shown as display, calling(self._board.interrupt):
            yield display
