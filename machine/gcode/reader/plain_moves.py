"""Plain moves: a kernel reads runs of ordinary lines at once, with the same result as the parser line by line.

G0 and G1 lines and the comments between them are 99 % of a program. A run ends at other lines, which the parser reads: letters
other than the machine's axes and F, a feed not above 0, a number with too many digits for exact division, comments of parts and
new line types.
"""

from itertools import islice
from math import inf
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from machine.gcode.lines import Bytes, Lines, Texts
from machine.gcode.modes import E_AXIS
from machine.gcode.reader.state import REMARK_COLUMNS, Columns, Reader
from mdp.kernels.kernel import kernel, no_nrt
from mdp.mesh import Floats

LONGEST = 200
MOST_DIGITS = 15  # integers below 2^53 are exact, as are the powers of ten to divide by: the quotient is rounded once
NONE, F = -1, 6  # meaning of a letter, besides the axes 0 to 5
MOST_TYPES = 64  # line types; slicers have about 15, a further one ends the run
WHOLE_DIGITS, DECIMALS = 9, 12  # digits of a width or height, as in machine.gcode.reader.parse
FIRST = (b"G0", b"G1", b";", b"\n")  # beginnings of lines that may be plain
# The reader's state as floats: the axes, F, then the comments' values as in a remark, and the number of layers.
PART, LAYER, TYPE, WIDTH, HEIGHT, LAYERS, STATE = range(7, 14)


# Beginnings of comments with a meaning; SINGLE stands alone.
WIDTH_IS, HEIGHT_IS, TYPE_IS, SINGLE = range(4)
WORDS = Texts.of([b"WIDTH:", b"HEIGHT:", b"TYPE:", b"LAYER_CHANGE", b"LAYER:", b"PART:", b"CONTENTS:", b"UNSUPPORTED:"])


class Meaning(NamedTuple):
    """Meaning of words during a run.

    letters: (256,) axis, F or NONE of each byte; words: WORDS; types: the known line types, by number. units, steps, offset: (6,)
    as in Modes. rapid: G0 is as fast as possible. accelerations: (2,) of moves with filament, and of others.
    """

    letters: NDArray[np.int8]
    words: Texts
    types: Texts
    units: Floats
    steps: NDArray[np.bool_]
    offset: Floats
    feed_share: float
    rapid: bool
    accelerations: Floats


def read_plain_moves(reader: Reader, lines: Lines, first: int) -> int:
    """Read rows of plain lines from line `first`, counted from 0; returns the first line that is not plain.

    Nothing is read while M221, M200 or G93 change the meaning of a move's words, or while a turn is pending.
    """
    modes = reader.modes
    begin = lines.content[lines.start[first] : lines.start[first] + 2].tobytes()
    if begin not in FIRST and begin[:1] not in FIRST:  # no preparation needed
        return first
    if reader.flow != 1.0 or reader.filament_mm2 or modes.inverse_time or reader.turning or reader.ended:
        return first
    kinds = [kind.encode("utf-8", "surrogatepass") for kind in islice(reader.types, MOST_TYPES)]
    letters = np.full(256, NONE, dtype=np.int8)
    for letter, axis in (*reader.letters.items(), ("F", F)):
        letters[ord(letter)] = axis
    meaning = Meaning(
        letters, WORDS, Texts.of(kinds), np.array(modes.units), np.array(modes.steps), np.array(modes.offset),
        reader.feed_share, bool(reader.dialect.rapid), np.array([reader.printing, reader.travelling]),
    )  # fmt: skip
    remark = (reader.part, reader.layer, reader.type, reader.width, reader.height)
    state, at = np.array([*reader.at, modes.feed, *remark, reader.layers]), first
    while True:
        reader.make_room(state.tolist(), len(lines) - at)
        counts = np.array([at, reader.rows, reader.remarks, -1])
        _read_run(Texts(lines.content, lines.start), meaning, reader.columns, state, counts)
        begun, at, reader.rows, reader.remarks, move = at, *(int(count) for count in counts)
        if move >= 0:
            reader.motion = lines[move][:2]
        if at == begun or reader.remarks < len(reader.columns.remark_rows):
            break
    if at > first:
        reader.number, reader.at[:], modes.feed = at, state[:F].tolist(), float(state[F])
        reader.layer, reader.type, reader.layers = (int(state[k]) for k in (LAYER, TYPE, LAYERS))
        reader.width, reader.height = float(state[WIDTH]), float(state[HEIGHT])
    return at


@kernel
def _read_run(lines: Texts, meaning: Meaning, columns: Columns, state: Floats, counts: NDArray[np.int64]) -> None:
    """Kernel of read_plain_moves; updates the state and counts: the line after the run, rows, remarks, and the line of the last
    move."""
    text, words = lines.content, np.empty((32, 2))
    line, row, remarks = counts[0], counts[1], counts[2]
    while line < len(lines.start) - 1 and remarks < len(columns.remark_rows):
        begin, end = lines.start[line], lines.start[line + 1]
        while end > begin and _is_blank(text[end - 1]):
            end -= 1
        if end == begin or text[begin] == 59:
            if end > begin and not _read_remark(text, begin + 1, end, meaning, state):
                break
            line += 1
            continue
        count = _read_words(text, begin, end, meaning.letters, words)
        if count < 0:
            break
        if len(columns.starts):
            for k in range(E_AXIS):
                columns.starts[row, k] = state[k]
        moved, filament_mm = False, state[E_AXIS]
        for k in range(count):
            axis, value = int(words[k, 0]), words[k, 1]
            if axis == F:
                state[F] = value * meaning.units[0]
                continue
            moved = True
            value *= meaning.units[axis]
            state[axis] = state[axis] + value if meaning.steps[axis] else value - meaning.offset[axis]
        line += 1
        counts[3] = line - 1
        if not moved:
            continue
        columns.line[row] = line
        for k in range(E_AXIS):
            columns.places[row + 1, k] = state[k]
        columns.e_mm[row] = state[E_AXIS] - filament_mm
        columns.feed[row] = inf if meaning.rapid and text[begin + 1] == 48 else state[F] * meaning.feed_share
        remarks = _remark(state, meaning.accelerations[0 if state[E_AXIS] != filament_mm else 1], columns.remark_rows, remarks)
        columns.remark[row] = remarks - 1
        row += 1
    counts[0], counts[1], counts[2] = line, row, remarks


@no_nrt
def _remark(state: Floats, acceleration: float, remark_rows: Floats, remarks: int) -> int:
    """Add a row's remark unless it equals the last one; returns the number of remarks."""
    last = REMARK_COLUMNS - 1
    same = remarks > 0 and remark_rows[remarks - 1, last] == acceleration
    for k in range(last):
        same = same and remark_rows[remarks - 1, k] == state[PART + k]
    if same:
        return remarks
    for k in range(last):
        remark_rows[remarks, k] = state[PART + k]
    remark_rows[remarks, last] = acceleration
    return remarks + 1


@no_nrt
def _is_blank(byte: int) -> bool:
    return byte == 32 or 9 <= byte <= 13


@no_nrt
def _read_remark(text: Bytes, begin: int, end: int, meaning: Meaning, state: Floats) -> bool:
    """Whether a comment is plain; if so, apply it to the state. The sign and following blanks are skipped."""
    while begin < end and _is_blank(text[begin]):
        begin += 1
    if begin == end:
        return True
    if text[begin] < 32 or text[begin] > 126 or text[end - 1] < 32 or text[end - 1] > 126:  # possibly another kind of blank
        return False
    for k in range(len(meaning.words.start) - 1):
        word = meaning.words.content[meaning.words.start[k] : meaning.words.start[k + 1]]
        if not _begins(text, begin, end, word):
            continue
        begin += len(word)
        if k in (WIDTH_IS, HEIGHT_IS):
            after, value, digits, decimals = _read_number(text, begin, end)
            if after < end or not 0 < digits <= WHOLE_DIGITS or decimals == 0 or decimals > DECIMALS:
                return False
            state[WIDTH + k] = value
            return True
        if k == SINGLE and begin == end:
            state[LAYER] += 1.0
            state[LAYERS] += 1.0
            return True
        if k != TYPE_IS:
            return k == SINGLE
        for kind in range(len(meaning.types.start) - 1):
            known = meaning.types.content[meaning.types.start[kind] : meaning.types.start[kind + 1]]
            if end - begin == len(known) and _begins(text, begin, end, known):
                state[TYPE] = kind
                return True
        return False
    return True


@no_nrt
def _read_number(text: Bytes, at: int, end: int) -> tuple[int, float, int, int]:
    """Parse an unsigned number up to a blank or the end: its end, value, digits before the point and after it, -1 without a
    point. An end of -1: not a number, or too many digits for an exact value."""
    whole, digits, decimals = 0, 0, -1
    while at < end and text[at] != 32:
        if text[at] == 46 and decimals < 0:
            decimals = 0
        elif 48 <= text[at] <= 57 and digits < MOST_DIGITS:
            whole, digits = 10 * whole + (text[at] - 48), digits + 1
            decimals += decimals >= 0
        else:
            return -1, 0.0, 0, 0
        at += 1
    power = 1.0
    for _ in range(decimals):
        power *= 10.0
    return at if digits > 0 else -1, whole / power, digits - max(decimals, 0), decimals


@no_nrt
def _begins(text: Bytes, begin: int, end: int, word: Bytes) -> bool:
    """Whether a line begins with a word."""
    alike = end - begin >= len(word)
    for k in range(len(word) if alike else 0):
        alike = alike and text[begin + k] == word[k]
    return alike


@no_nrt
def _read_words(text: Bytes, begin: int, end: int, letters: NDArray[np.int8], words: Floats) -> int:
    """Number of words of a plain move, with the axis and value of each; -1: the line is not a plain move."""
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
        at, value, digits, _ = _read_number(text, at, end)
        if at < 0 or axis == NONE or digits > 12:
            return -1
        if (axis == F and (negative or value <= 0.0)) or named >> axis & 1:  # firmwares disagree about a repeated word
            return -1
        named |= 1 << axis
        words[count, 0], words[count, 1] = axis, -value if negative else value
        count += 1
    return count
