"""Notices: messages and progress for the user, as values; the front end decides how to show them.

Any code may call `say`, `show` and `reporting`; a front end receives them through `notices_to`. By default notices and progress
go to stderr and results to stdout. In text from files, names and printers control characters are escaped, and its length is
limited.
"""

import re
import sys
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, contextmanager
from dataclasses import dataclass
from time import monotonic
from typing import Protocol

from profiles.messages import is_phrase, terminal_words

# C0 and C1 controls, DEL, bidirectional overrides (CVE-2021-42574), line separators, and surrogates, which stand for undecodable
# bytes of file names.
CONTROLS = re.compile(r"[\x00-\x1f\x7f-\x9f\u061c\u200e\u200f\u2028\u2029\u202a-\u202e\u2066-\u2069\ufeff\ud800-\udfff]")
WORD = re.compile(r"\S{301,}")  # longer than most paths, which their beginning and end identify
WORD_BEGINNING, WORD_END = 120, 60
MOST_LENGTH = 1500  # characters of a message
END_LENGTH = 300
PLAIN_EVERY_S = 5.0
PLAIN_AGAIN_S = 60.0  # an unchanged status is repeated as a sign of life


def plain_line(text: str) -> str:
    """One line for a terminal: control characters (also newlines) escaped; the middle of a long line is left out."""
    return marked_line(terminal_words(text))


def marked_line(text: str) -> str:
    """One line for a terminal that keeps its marks of keys and options, unless it is too long and shortened."""
    shown = terminal_words(text)
    if len(shown) > MOST_LENGTH or WORD.search(shown):  # a mark must not be split
        text = shown
    words = WORD.sub(lambda word: _shortened(word[0], WORD_BEGINNING, WORD_END), text)
    return _escaped(
        words if len(terminal_words(words)) <= MOST_LENGTH else _shortened(words, MOST_LENGTH - END_LENGTH, END_LENGTH)
    )


def plain_lines(text: str) -> str:
    """Several lines for a terminal: control characters except newlines are escaped."""
    return _lines(terminal_words(text))


class Report(Protocol):
    """Shows the current work, and its completed share if known."""

    def __call__(self, text: str, share: float | None = None) -> None: ...


@dataclass(frozen=True)
class Notice:
    """Text for the user, with marks (see profiles/messages.py). forced: an error that --force ignores; is_result: a result."""

    text: str
    forced: bool = False
    is_result: bool = False


class PlainLines:
    """Prints a status that changes often at a readable rate."""

    def __init__(self) -> None:
        self._shown, self._shown_at_s = "", monotonic()

    def show(self, text: str, at_once: bool = False) -> None:
        """Print the text if enough time has passed since the previous line, or at once."""
        now_s = monotonic()
        wait_s = PLAIN_AGAIN_S if text == self._shown else PLAIN_EVERY_S
        if at_once or now_s - self._shown_at_s >= wait_s:
            self._shown, self._shown_at_s = text, now_s
            say(text)


@contextmanager
def as_notices() -> Iterator[Report]:
    """Report progress as occasional notices; counted kernels only move a live line, since their beginning is a notice."""
    lines = PlainLines()
    yield lambda text, share=None: None if is_phrase("compiled", text) else lines.show(text)


@dataclass(frozen=True)
class FrontEnd:
    """Receives each notice, and the progress of running work."""

    note: Callable[[Notice], None]
    progress: Callable[[], AbstractContextManager[Report]] = as_notices


def to_streams(notice: Notice) -> None:
    """Write results to stdout, all else to stderr."""
    stream = sys.stdout if notice.is_result else sys.stderr
    text = terminal_words(notice.text)
    stream.write(f"{text.rstrip()}; continuing because of --force\n" if notice.forced else text)
    stream.flush()


_front_end = FrontEnd(to_streams)


@contextmanager
def notices_to(front_end: FrontEnd) -> Iterator[None]:
    """Send the notices of all threads to this front end until the block ends."""
    global _front_end
    before, _front_end = _front_end, front_end
    try:
        yield
    finally:
        _front_end = before


def say(text: str, *, forced: bool = False) -> None:
    """Send a one-line notice. forced: an error that --force ignores."""
    _front_end.note(Notice(f"{marked_line(text)}\n", forced))


def say_lines(text: str) -> None:
    """Send a notice of several lines."""
    _front_end.note(Notice(f"{_lines(text)}\n"))


def show(text: str) -> None:
    """Send a result."""
    _front_end.note(Notice(_lines(text), is_result=True))


def reporting() -> AbstractContextManager[Report]:
    """Show the progress of the block."""
    return _front_end.progress()


def _lines(text: str) -> str:
    return "\n".join(_escaped(line) for line in text.split("\n"))


def _escaped(text: str) -> str:
    return CONTROLS.sub(lambda control: control[0].encode("unicode_escape").decode("ascii"), text)


def _shortened(text: str, beginning: int, end: int) -> str:
    return f"{text[:beginning]} [{len(text) - beginning - end} characters left out] {text[-end:]}"
