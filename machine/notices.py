"""Notices: what the program tells a person while it works, as values; the front end shows them in its own way.

Any code may call `say`, `show` and `reporting`. A front end takes what they tell with `notices_to`; without one, notices go to
stderr, progress too, and results to stdout. Text from files, names and printers is made plain on the way: nothing
in it commands the terminal, and none is endless.
"""

import re
import sys
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, contextmanager
from dataclasses import dataclass
from time import monotonic
from typing import Protocol

from profiles.messages import terminal_words

# C0 and C1 controls, DEL, what turns the direction of writing around (CVE-2021-42574), line separators, halves of characters that
# stand for bytes of a file name.
CONTROLS = re.compile(r"[\x00-\x1f\x7f-\x9f\u061c\u200e\u200f\u2028\u2029\u202a-\u202e\u2066-\u2069\ufeff\ud800-\udfff]")
WORD = re.compile(r"\S{301,}")  # longer than most paths; its beginning and its end say which it is
WORD_BEGINNING, WORD_END = 120, 60
MOST_LENGTH = 1500  # characters of a message, so too
END_LENGTH = 300
PLAIN_EVERY_S = 5.0
PLAIN_AGAIN_S = 60.0  # what has not changed is said again: still alive


def plain_line(text: str) -> str:
    """One line for a terminal: controls, newlines too, as backslash escapes; of a long one the middle is left out."""
    return marked_line(terminal_words(text))


def marked_line(text: str) -> str:
    """The same line with its marks of keys and options, unless it is too long and shortened."""
    shown = terminal_words(text)
    if len(shown) > MOST_LENGTH or WORD.search(shown):  # a mark must not be cut through
        text = shown
    words = WORD.sub(lambda word: _shortened(word[0], WORD_BEGINNING, WORD_END), text)
    return _escaped(
        words if len(terminal_words(words)) <= MOST_LENGTH else _shortened(words, MOST_LENGTH - END_LENGTH, END_LENGTH)
    )


def plain_lines(text: str) -> str:
    """Several lines for a terminal, tables too: newlines stay."""
    return _lines(terminal_words(text))


class Report(Protocol):
    """Shows what work is under way, and the share of it that is done where that is known."""

    def __call__(self, text: str, share: float | None = None) -> None: ...


@dataclass(frozen=True)
class Notice:
    """Text for a person, with marks (see profiles/messages.py). forced: an error that --force goes past; is_result: what a
    command was asked for."""

    text: str
    forced: bool = False
    is_result: bool = False


class PlainLines:
    """A status that changes often, as lines at a bearable rate."""

    def __init__(self) -> None:
        self._shown, self._shown_at_s = "", monotonic()

    def show(self, text: str, at_once: bool = False) -> None:
        """Say the text when enough time has passed since the one before, or at once."""
        now_s = monotonic()
        wait_s = PLAIN_AGAIN_S if text == self._shown else PLAIN_EVERY_S
        if at_once or now_s - self._shown_at_s >= wait_s:
            self._shown, self._shown_at_s = text, now_s
            say(text)


@contextmanager
def as_notices() -> Iterator[Report]:
    """Progress as a notice now and then."""
    lines = PlainLines()
    yield lambda text, share=None: lines.show(text)


@dataclass(frozen=True)
class FrontEnd:
    """Receives each notice, and the progress of work while that lasts."""

    note: Callable[[Notice], None]
    progress: Callable[[], AbstractContextManager[Report]] = as_notices


def to_streams(notice: Notice) -> None:
    """A result on stdout, all else on stderr."""
    stream = sys.stdout if notice.is_result else sys.stderr
    text = terminal_words(notice.text)
    stream.write(f"{text.rstrip()}; going on because of --force\n" if notice.forced else text)
    stream.flush()


_front_end = FrontEnd(to_streams)


@contextmanager
def notices_to(front_end: FrontEnd) -> Iterator[None]:
    """Send all notices, from any thread, to this front end until the block ends."""
    global _front_end
    before, _front_end = _front_end, front_end
    try:
        yield
    finally:
        _front_end = before


def say(text: str, *, forced: bool = False) -> None:
    """A notice of one line. forced: it is what --force goes past."""
    _front_end.note(Notice(f"{marked_line(text)}\n", forced))


def say_lines(text: str) -> None:
    """A notice of several lines."""
    _front_end.note(Notice(f"{_lines(text)}\n"))


def show(text: str) -> None:
    """A result."""
    _front_end.note(Notice(_lines(text), is_result=True))


def reporting() -> AbstractContextManager[Report]:
    """What shows the progress of the work inside."""
    return _front_end.progress()


def _lines(text: str) -> str:
    return "\n".join(_escaped(line) for line in text.split("\n"))


def _escaped(text: str) -> str:
    return CONTROLS.sub(lambda control: control[0].encode("unicode_escape").decode("ascii"), text)


def _shortened(text: str, beginning: int, end: int) -> str:
    return f"{text[:beginning]} [{len(text) - beginning - end} characters left out] {text[-end:]}"
