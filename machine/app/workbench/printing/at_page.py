"""At page: a person who attends a print at a page of the workbench, as a terminal's screen and keys would have it."""

from collections.abc import Iterator
from contextlib import contextmanager
from queue import SimpleQueue
from threading import Event as Flag
from typing import Any

from machine.app.printer.attendance import Observers
from machine.app.terminal.plain import plain_line
from machine.app.terminal.screen import Course, Words
from machine.app.workbench.printing.teller import Teller
from machine.link.pending_commands import Command, Control
from machine.link.progress import Progress
from machine.view.live import state_of

WORDS_KEPT = 50
COMMANDS = {
    "pause": Command.PAUSE,
    "resume": Command.RESUME,
    "cancel": Command.CANCEL,
    "emergency": Command.EMERGENCY_STOP,
    "feed": Command.FEED,
    "flow": Command.FLOW,
}


class AtPage:
    """hear() and leave() from the thread that listens to the server, all else from the one that prints."""

    def __init__(self, teller: Teller) -> None:
        self.control, self.stop, self.words = Control(), Flag(), Words(WORDS_KEPT)
        self._teller = teller
        self._answers: SimpleQueue[bool] = SimpleQueue()

    def hear(self, word: str, value: float = 100.0) -> None:
        """What the person wants: to begin, or one of COMMANDS."""
        if word in COMMANDS:
            self.control.ask(COMMANDS[word], value)
        self._answers.put(word == "begin")

    def leave(self) -> None:
        """The server is gone, and nobody can command any more: the print ends as if it had been cancelled."""
        self.stop.set()
        self._answers.put(False)

    def agrees(self) -> bool:
        """Wait for the person's word to begin."""
        return self._answers.get()

    @contextmanager
    def show(self, observers: Observers, course: Course) -> Iterator["_Shown"]:
        """The print as its state."""
        journal = "" if observers.journal is None else str(observers.journal.path)
        log = "" if observers.log.trouble else str(observers.log.file)
        self._teller.tell(phase="printing", log=log, journal=journal)
        yield _Shown(self._teller, course, self.words)


class _Shown:
    """A display whose screen is the state that the pages are told."""

    def __init__(self, teller: Teller, course: Course, words: Words) -> None:
        self._teller, self._course, self._words = teller, course, words

    def open(self) -> None:
        """The pages show it already."""

    def __call__(self, progress: Progress) -> None:
        self._words.add(progress.message)
        phase = "leaving" if progress.state == "cancelling" else "printing"
        words = tuple(plain_line(word) for word in self._words.last)
        self._teller.tell(phase=phase, progress=told(progress, self._course), words=words)


def told(progress: Progress, course: Course) -> dict[str, Any]:
    """A moment of a print for the page: what every page that watches is told, and what a terminal's screen adds."""
    return {
        **state_of(progress),
        "parts": progress.parts,
        "layers": course.layers(progress.part),
        "at": course.at(progress.file_line),
        "feed_percent": progress.feed_percent,
        "flow_percent": progress.flow_percent,
    }
