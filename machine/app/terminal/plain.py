"""Plain: text from files, names and printers as it may go to a terminal: nothing in it commands the terminal, none is endless."""

import re
import sys

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


def show(text: str) -> None:
    """A result on stdout."""
    sys.stdout.write(plain_lines(text))
    sys.stdout.flush()


def _escaped(text: str) -> str:
    return CONTROLS.sub(lambda control: control[0].encode("unicode_escape").decode("ascii"), text)


def _shortened(text: str, beginning: int, end: int) -> str:
    return f"{text[:beginning]} [{len(text) - beginning - end} characters left out] {text[-end:]}"
