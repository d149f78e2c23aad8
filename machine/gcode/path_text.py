"""Path text: the lines of a path's moves, set in digits by a kernel: of a program's lines nearly all are these."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from mdp.kernels.kernel import borrower, kernel

Bytes = NDArray[np.uint8]
Whole = NDArray[np.int64]

LONGEST = 96  # characters of a line: four words of 20 digits at most, the command beside them
SPACE, MINUS, POINT, ZERO, LINE_END = 32, 45, 46, 48, 10
COORDINATE_DIGITS, FILAMENT_DIGITS = 3, 5  # behind the point


class PathWords(NamedTuple):
    """What all lines of a path share: the command, the letter of filament, whether its word is a step, the first line's F."""

    stroke: Bytes
    letter: int
    relative: bool
    ending: Bytes


def as_bytes(text: str) -> Bytes:
    """Text for the kernel."""
    return np.frombuffer(text.encode("ascii"), dtype=np.uint8)


def path_text(points: Whole, pushed: Whole, words: PathWords, known: Whole) -> str:
    """A line, with its end, for each of (n, 3) points in thousandths of a mm: the coordinates that change, then filament.

    pushed: (n,) filament up to each, 1e-5 mm. known: X Y Z, filament where the tip is, which become those of the last line. A
    point where the tip is already gives no line, its filament goes to the next one.
    """
    text = np.empty(LONGEST * len(points) + len(words.ending), dtype=np.uint8)
    size = _write(points, pushed, words, known, text)
    return text[:size].tobytes().decode("ascii")


@kernel
def _write(points: Whole, pushed: Whole, words: PathWords, known: Whole, text: Bytes) -> int:
    """Fills in the text and returns its length."""
    at, first = 0, True
    for k in range(len(points)):
        if points[k, 0] == known[0] and points[k, 1] == known[1] and points[k, 2] == known[2]:
            continue
        at = _copy(words.stroke, text, at)
        for axis in range(3):
            if points[k, axis] != known[axis]:
                known[axis] = points[k, axis]
                at = _word(88 + axis, known[axis], COORDINATE_DIGITS, text, at)
        at = _word(words.letter, pushed[k] - known[3] if words.relative else pushed[k], FILAMENT_DIGITS, text, at)
        known[3] = pushed[k]
        if first:
            at, first = _copy(words.ending, text, at), False
        text[at] = LINE_END
        at += 1
    return at


@borrower
def _copy(what: Bytes, text: Bytes, at: int) -> int:
    for k in range(len(what)):
        text[at + k] = what[k]
    return at + len(what)


@borrower
def _word(letter: int, value: int, digits: int, text: Bytes, at: int) -> int:
    """A blank, a letter and a whole number with a point before its last digits; returns where the text goes on."""
    text[at], text[at + 1] = SPACE, letter
    at += 2
    if value < 0:
        text[at] = MINUS
        at, value = at + 1, -value
    count, rest = digits + 1, value
    for _ in range(digits + 1):
        rest //= 10
    while rest > 0:
        rest //= 10
        count += 1
    end = at + count + 1
    for k in range(count):
        if k == digits:
            end -= 1
            text[end] = POINT
        end -= 1
        text[end] = ZERO + value % 10
        value //= 10
    return at + count + 1
