"""Plain: text from files, names and printers as it may go to a terminal: nothing in it commands the terminal, none is endless."""

import re
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import TextIO

# C0 and C1 controls, DEL, what turns the direction of writing around (CVE-2021-42574), line separators, halves of characters that
# stand for bytes of a file name.
CONTROLS = re.compile(r"[\x00-\x1f\x7f-\x9f\u061c\u200e\u200f\u2028\u2029\u202a-\u202e\u2066-\u2069\ufeff\ud800-\udfff]")
WORD = re.compile(r"\S{301,}")  # longer than most paths; its beginning and its end say which it is
WORD_BEGINNING, WORD_END = 120, 60
MOST_LENGTH = 1500  # characters of a message, so too
END_LENGTH = 300


def plain_line(text: str) -> str:
    """One line: controls, newlines too, as backslash escapes; the middle of what is long is left out and its length told."""
    words = WORD.sub(lambda word: _shortened(word[0], WORD_BEGINNING, WORD_END), text)
    return _escaped(words if len(words) <= MOST_LENGTH else _shortened(words, MOST_LENGTH - END_LENGTH, END_LENGTH))


def plain_lines(text: str) -> str:
    """The same for a text of several lines, tables too: newlines stay."""
    return "\n".join(_escaped(line) for line in text.split("\n"))


Listener = Callable[[str, bool], None]  # given what is said, and whether it is what --force goes past
_listener: Listener | None = None


@contextmanager
def said_to(listener: Listener) -> Iterator[None]:
    """Meanwhile all that the program says, in whatever thread, goes to a listener in place of stdout and stderr."""
    global _listener
    _listener = listener
    try:
        yield
    finally:
        _listener = None


def show(text: str) -> None:
    """A result on stdout."""
    put(text, sys.stdout)


def put(text: str, stream: TextIO, forced: bool = False) -> None:
    """Text for a person, on a stream or to the listener. forced: it is what --force goes past."""
    if _listener is not None:
        _listener(plain_lines(text).rstrip("\n"), forced)
        return
    stream.write(plain_lines(f"{text.rstrip()}; going on because of --force\n" if forced else text))
    stream.flush()


def _escaped(text: str) -> str:
    return CONTROLS.sub(lambda control: control[0].encode("unicode_escape").decode("ascii"), text)


def _shortened(text: str, beginning: int, end: int) -> str:
    return f"{text[:beginning]} [{len(text) - beginning - end} characters left out] {text[-end:]}"
