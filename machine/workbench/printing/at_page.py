"""At page: a person who attends a print at a page of the workbench, as a terminal's screen and keys would have it."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from queue import SimpleQueue
from threading import Event as Flag
from time import time
from typing import Any

from machine.cli.terminal.printer_messages import PrinterMessages
from machine.dryrun.timeline import Timeline
from machine.link.pending_commands import Command, Control
from machine.link.progress import Progress
from machine.notices import Report, plain_line
from machine.printing.attendance import Observers
from machine.printing.serial_log import SerialLog
from machine.view.serving.watch_page import state_of
from machine.workbench.printing.order import HandCommand
from machine.workbench.printing.reporter import StateReporter

WORDS_KEPT = 50
BEGIN, LEAVE = "begin", "leave"  # LEAVE: a print on a server goes on without this program
ANSWERS = (BEGIN, LEAVE, Command.CANCEL, Command.EMERGENCY_STOP)  # to the question whether to begin


class AtPage:
    """hear() and leave() from the thread that listens to the server, all else from the one that prints."""

    def __init__(self, reporter: StateReporter) -> None:
        self.control, self.stop, self.words = Control(), Flag(), PrinterMessages(WORDS_KEPT)
        self.agreed = False  # to what was found: from then on something may move
        self._reporter = reporter
        self._answers: SimpleQueue[bool] = SimpleQueue()
        self._gives_up, self._halts = Flag(), Flag()
        self.by_hand: SimpleQueue[HandCommand] = SimpleQueue()  # what is to be done at a printer that is in hand
        self.interrupt: Callable[[Command | str], None] = lambda word: None  # called with what ends it at once

    def hear(self, word: Command | HandCommand | str, value: float = 100.0) -> None:
        """What the person wants: a command of a print or by hand, BEGIN or LEAVE."""
        if isinstance(word, HandCommand):
            self.by_hand.put(word)
            return
        if isinstance(word, Command):
            self.control.ask(word, value)
        if word in (Command.CANCEL, LEAVE):
            self._gives_up.set()
        if word == LEAVE:
            self.stop.set()
        if word == Command.EMERGENCY_STOP:
            self._halts.set()
        if word in ANSWERS:
            self._answers.put(word == BEGIN)
        if word in (Command.CANCEL, Command.EMERGENCY_STOP):
            self.interrupt(word)

    def leave(self) -> None:
        """The server is gone, and nobody can command any more: the print ends as if it had been cancelled, but one on a print
        server goes on there."""
        self.stop.set()
        self._answers.put(False)
        self.interrupt(LEAVE)

    def lets_go(self) -> bool:
        """Whether a printer in hand is let go of, its heaters off."""
        return self.stop.is_set() or self._gives_up.is_set()

    def agrees(self) -> bool:
        """Wait for the person's word to begin."""
        self.agreed = self._answers.get()
        return self.agreed

    @contextmanager
    def uploading(self) -> Iterator[Report]:
        """How far the file has been handed over, as its state."""
        yield lambda text, share=None: self._reporter.tell(phase="uploading", upload=(text, share))

    def gives_up(self) -> bool:
        """Whether there is to be no print on a server, as long as none has begun; an emergency stop is given to the printer."""
        return (self._gives_up.is_set() or self.stop.is_set()) and not self._halts.is_set()

    def has_stopped(self) -> bool:
        """Whether the print has been stopped at once, at its end: the order was heard and is not waiting any more."""
        waiting = iter(self.control.take, None)
        return self._halts.is_set() and all(request.command != Command.EMERGENCY_STOP for request in waiting)

    def gone(self) -> bool:
        """Whether a print on a server is left."""
        return self.stop.is_set()

    @contextmanager
    def show(self, observers: Observers, timeline: Timeline) -> Iterator["_Shown"]:
        """The print as its state."""
        journal = "" if observers.journal is None else str(observers.journal.path)
        self._reporter.tell(log=log_path(observers.log), journal=journal)
        yield _Shown(self._reporter, timeline, self.words)


def log_path(log: SerialLog) -> str:
    """The file of a log for the pages; "" for one that is not written."""
    return "" if log.trouble else str(log.file)


class _Shown:
    """A display whose screen is the state that the pages are told. Moments are counted: a print of which nothing changes, as a
    paused one on a print server, is heard of all the same."""

    def __init__(self, reporter: StateReporter, timeline: Timeline, words: PrinterMessages) -> None:
        self._reporter, self._timeline, self._words = reporter, timeline, words
        self._opened = False  # before, a person is asked
        self._moments = 0

    def open(self) -> None:
        """The pages show it from now on."""
        self._opened = True
        self._reporter.tell(phase="printing", upload=None)

    def __call__(self, progress: Progress) -> None:
        if not self._opened:
            return
        self._words.add(progress.message)
        phase = "leaving" if progress.state == "cancelling" else "printing"
        words = tuple(plain_line(word) for word in self._words.last)
        self._moments += 1
        moment = moment_of(progress, self._timeline) | {"moment": self._moments}
        self._reporter.tell(phase=phase, progress=moment, words=words, **({"journal": ""} if progress.warning else {}))


def moment_of(progress: Progress, timeline: Timeline) -> dict[str, Any]:
    """A moment of a print for the page: what every page that watches is told, and what a terminal's screen adds. heat_s: since
    when the temperatures are known, seconds since 1970, for the page goes on counting when nothing more comes."""
    return {
        **state_of(progress),
        "parts": progress.parts,
        "layers": timeline.layers(progress.part),
        "at": timeline.at(progress.file_line),
        "feed_percent": progress.feed_percent,
        "flow_percent": progress.flow_percent,
        "heat_s": time() - progress.heat_age_s,
    }
