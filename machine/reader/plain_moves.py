"""Plain moves: a run of usual G0 and G1 lines read at once by a kernel, as `Modes.move` and `straight` would one by one.

With the comments between them that tell a stroke's width, or a kind that has already occurred, they are 99 lines in a hundred of
a program. What is not usual ends the run, and the reader takes that line: other letters than the machine's axes and F, a feed
that is not above 0, a number of more digits than one division reads exactly, other comments.
"""

from itertools import islice
from math import inf
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from machine.gcode.modes import E_AXIS
from machine.reader.state import ACCELERATION, AFTER, BEFORE, FEED, LINE, ROW, TYPE, WIDTH, Reader
from mdp.kernels.kernel import borrower, kernel
from mdp.mesh import Floats

Bytes = NDArray[np.uint8]

LONGEST = 200
MOST_DIGITS = 15  # below 2^53 whole numbers are exact, and so are the powers of ten to divide by: the quotient is rounded once
NONE, F = -1, 6  # what a letter stands for, besides the axes 0 to 5
MOST_AT_ONCE = 4096  # lines
MOST_TYPES = 64  # kinds of line; slicers have about 15, a further one ends the run
WIDTH_IS, TYPE_IS = (np.frombuffer(key, dtype=np.uint8) for key in (b";WIDTH:", b";TYPE:"))
WHOLE_DIGITS, DECIMALS = 9, 12  # of a width, as machine.reader.remarks reads it


class Text(NamedTuple):
    """Lines as bytes; line k is text[start[k]:start[k + 1]], with its end."""

    text: Bytes
    start: NDArray[np.int64]


class Meaning(NamedTuple):
    """What words mean during a run. letters: (256,) axis, F or NONE of each byte; types: the kinds that are known, by number.

    units, steps, offset: (6,) as those of Modes; row: (ROW,) a row with what the comments said. rapid: G0 is as fast as can be.
    """

    letters: NDArray[np.int8]
    types: Text
    units: Floats
    steps: NDArray[np.bool_]
    offset: Floats
    row: Floats
    feed_share: float
    rapid: bool
    travelling: float


def letters_of(reader: Reader) -> NDArray[np.int8]:
    """(256,) what each letter stands for in a move."""
    letters = np.full(256, NONE, dtype=np.int8)
    letters[ord("F")] = F
    for letter, axis in reader.letters.items():
        letters[ord(letter)] = axis
    return letters


def read_plain_moves(reader: Reader, text: Text, letters: NDArray[np.int8], first: int) -> int:
    """Rows of the plain moves from line `first`, counted from 0; returns the first line that is not a plain move, or that was not
    reached.

    Nothing is read where M221, M200 or G93 change what a move's words mean, nor before a turn under way has become a row.
    """
    modes = reader.modes
    if reader.flow != 1.0 or reader.filament_mm2 or modes.inverse_time or reader.turning or reader.ended:
        return first
    row = np.array([0.0, *reader.at, *reader.at, 0.0, *reader.remarks(reader.printing)])
    meaning = Meaning(
        letters, _types(reader), np.array(modes.units), np.array(modes.steps), np.array(modes.offset), row,
        reader.feed_share, bool(reader.dialect.rapid), reader.travelling,
    )  # fmt: skip
    rows = np.empty((min(MOST_AT_ONCE, len(text.start) - 1 - first), ROW))
    state = np.array([*reader.at, modes.feed])
    last, count, move = _read_run(text, meaning, first, state, rows)
    if last > first:
        begin = int(text.start[move])
        reader.type, reader.width = int(row[TYPE]), float(row[WIDTH])
        reader.number, reader.motion = last, text.text[begin : begin + 2].tobytes().decode("ascii")
        reader.at[:], modes.feed = state[:6].tolist(), float(state[6])
        reader.rows.frombytes(rows[:count].tobytes())
    return last


def _types(reader: Reader) -> Text:
    """The first MOST_TYPES kinds of line seen so far, in the order of their numbers."""
    kinds = [kind.encode("utf-8", "surrogatepass") for kind in islice(reader.types, MOST_TYPES)]
    return Text(np.frombuffer(b"".join(kinds) or b" ", dtype=np.uint8), np.cumsum([0, *map(len, kinds)]))


@kernel
def _read_run(text: Text, meaning: Meaning, first: int, state: Floats, rows: Floats) -> tuple[int, int, int]:
    """The line after the run, how many rows it has, and the line of its last move.

    state: (7,) axes and feed; updated in place, as are the kind and the width in meaning.row.
    """
    words = np.empty((32, 2))
    count, line, move = 0, first, first
    while line < len(text.start) - 1 and line - first < len(rows):
        begin, end = text.start[line], text.start[line + 1]
        if text.text[begin] == 59:
            if not _read_remark(text.text, begin, end, meaning):
                break
            line += 1
            continue
        word_count = _read_words(text.text, begin, end, meaning.letters, words)
        if word_count < 0:
            break
        for k in range(ROW):
            rows[count, k] = meaning.row[k]
        for k in range(6):
            rows[count, BEFORE + k] = state[k]
        moved = False
        for k in range(word_count):
            axis, value = int(words[k, 0]), words[k, 1]
            if axis == F:
                state[F] = value * meaning.units[0]
                continue
            moved = True
            value *= meaning.units[axis]
            state[axis] = state[axis] + value if meaning.steps[axis] else value - meaning.offset[axis]
        if moved:
            rows[count, LINE] = line + 1
            for k in range(6):
                rows[count, AFTER + k] = state[k]
            quick = meaning.rapid and text.text[begin + 1] == 48
            rows[count, FEED] = inf if quick else state[F] * meaning.feed_share
            if rows[count, BEFORE + E_AXIS] == rows[count, AFTER + E_AXIS]:
                rows[count, ACCELERATION] = meaning.travelling
            count += 1
        move = line
        line += 1
    return line, count, move


@borrower
def _read_remark(text: Bytes, begin: int, end: int, meaning: Meaning) -> bool:
    """Whether a comment tells a width, or a kind that is known; it goes into the row then."""
    while end > begin and (text[end - 1] == 32 or 9 <= text[end - 1] <= 13):
        end -= 1
    if _begins(text, begin, end, WIDTH_IS):
        at, whole, digits, behind = begin + len(WIDTH_IS), 0, 0, -1
        while at < end:
            if text[at] == 46 and behind < 0 and digits > 0:
                behind = 0
            elif 48 <= text[at] <= 57:
                whole, digits = 10 * whole + (text[at] - 48), digits + 1
                behind += behind >= 0
            else:
                return False
            at += 1
        decimals = max(behind, 0)
        if digits == 0 or behind == 0 or digits > MOST_DIGITS or digits - decimals > WHOLE_DIGITS or decimals > DECIMALS:
            return False
        divisor = 1.0
        for _ in range(decimals):
            divisor *= 10.0
        meaning.row[WIDTH] = whole / divisor
        return True
    if not _begins(text, begin, end, TYPE_IS):
        return False
    begin += len(TYPE_IS)
    for kind in range(len(meaning.types.start) - 1):
        known = meaning.types.text[meaning.types.start[kind] : meaning.types.start[kind + 1]]
        if end - begin == len(known) and _begins(text, begin, end, known):
            meaning.row[TYPE] = kind
            return True
    return False


@borrower
def _begins(text: Bytes, begin: int, end: int, word: Bytes) -> bool:
    """Whether a line begins with a word."""
    alike = end - begin >= len(word)
    for k in range(len(word) if alike else 0):
        alike = alike and text[begin + k] == word[k]
    return alike


@borrower
def _read_words(text: Bytes, begin: int, end: int, letters: NDArray[np.int8], words: Floats) -> int:
    """How many words a plain move has, each what it stands for and its value; -1: the line is none."""
    while end > begin and (text[end - 1] == 32 or 9 <= text[end - 1] <= 13):
        end -= 1
    if end - begin < 5 or end - begin >= LONGEST or text[begin] != 71 or (text[begin + 1] != 48 and text[begin + 1] != 49):
        return -1
    at, count, named = begin + 2, 0, 0
    while at < end:
        if count == len(words) or at + 2 >= end or text[at] != 32:
            return -1
        axis = letters[text[at + 1]]
        at += 2
        negative = text[at] == 45
        if negative or text[at] == 43:
            at += 1
        whole, digits, behind, dotted = 0, 0, 0, False
        while at < end and text[at] != 32:
            if text[at] == 46 and not dotted:
                dotted = True
            elif 48 <= text[at] <= 57:
                whole = 10 * whole + (text[at] - 48)
                digits += 1
                behind += dotted
            else:
                return -1
            at += 1
            if digits > MOST_DIGITS:
                return -1
        if axis == NONE or digits == 0 or digits - behind > 12:
            return -1
        divisor = 1.0
        for _ in range(behind):
            divisor *= 10.0
        value = whole / divisor
        if (axis == F and (negative or value <= 0.0)) or named >> axis & 1:  # firmwares do not agree on a word given twice
            return -1
        named |= 1 << axis
        words[count, 0], words[count, 1] = axis, -value if negative else value
        count += 1
    return count
