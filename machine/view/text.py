"""Text: the G-code of a print as patterns of its lines, which the rows of the page fill in.

The rows contain everything but the form of a move's line: `G1 X12.500 Y3.250 E0.04214` is the pattern `G1 X. Y. E.` with holes
for numbers. Some thousand patterns and a pattern index per line reproduce the text exactly, in a hundredth of its compressed
size.

A hole is a character U+0001 to U+0006 in place of the number behind a capital letter. For X, Y and Z the number is `end` of the
line's last row, three decimals. For other letters it is filament, five decimals: with U+0001 to U+0003 the filament of this
line's rows, with U+0004 to U+0006 the sum at its end less the current zero. `zeros` holds pairs of a line and a zero from there,
in 0.00001 mm; before the first the zero is 0. U+0001 and U+0004 stand for all decimals, U+0002 and U+0005 for no trailing zeros
(nor point), U+0003 and U+0006 also for no zero before the point.
"""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from machine.view.encoding import Column, whole

MOST_LETTERS = 1_000_000  # letters in all patterns together; with more the page would grow by several hundred kilobytes
AXES, FILAMENT = "XYZ", "EUVW"
AXIS_DIGITS, FILAMENT_DIGITS = 3, 5  # digits after the point, as the page's rows are stored
# Holes: the full number; without trailing zeros; without the zero before the point.
STEPS, SUMS = "\x01\x02\x03", "\x04\x05\x06"
LONGEST = 15  # characters of a number: its digits fit into 64 bits
LINES_AT_ONCE = 100_000  # limits memory for the longest print
SPACE, BREAK, MINUS, POINT, ZERO = b" \n-.0"
NOTHING: tuple[None, dict[str, Column]] = (None, {"text": Column(np.zeros(0), "i32", delta=True)})

Wholes = NDArray[np.int64]
Mask = NDArray[np.bool_]


def line_patterns(lines: Sequence[str], rows: Mapping[str, Column]) -> tuple[dict[str, Any] | None, dict[str, Column]]:
    """Header entry with patterns and filament resets, and the column of each line's pattern index; None and an empty column if
    the lines are too different. rows: from machine.view.paths."""
    ends = np.searchsorted(rows["line"].values, np.arange(len(lines) + 1), side="right")
    first, last = ends[:-1], ends[1:]
    pushed = np.concatenate([[0], whole(rows["filament"])])
    zeros, zero = _zeros(lines, pushed[last])
    axes = np.concatenate([np.zeros((1, 3), dtype=np.int64), whole(rows["end"])[:, :3]])[last].T
    moves = np.vstack([last > first, axes, pushed[last] - pushed[first], pushed[last] - zero])
    places: dict[str, int] = {}
    numbers: list[int] = []
    for begin in range(0, len(lines), LINES_AT_ONCE):
        end = begin + LINES_AT_ONCE
        text = "\n".join(lines[begin:end])
        if any(hole in text for hole in STEPS + SUMS):
            return NOTHING
        numbers += [places.setdefault(line, len(places)) for line in _with_holes(text, moves[:, begin:end]).split("\n")]
        if sum(map(len, places)) > MOST_LETTERS:
            return NOTHING
    return {"patterns": list(places), "zeros": zeros}, {"text": Column(np.array(numbers), "i32", delta=True)}


def _zeros(lines: Sequence[str], pushed: Wholes) -> tuple[list[list[int]], Wholes]:
    """Pairs of a line (from 1) and the filament sum that counts as 0 after it, and that sum for each line."""
    begins = [k for k, line in enumerate(lines) if line.startswith("G92 ")]
    values = [0]
    for k in begins:
        values.append(_zero(lines[k], int(pushed[k]), values[-1]))
    zeros = [[k + 1, now] for k, before, now in zip(begins, values[:-1], values[1:], strict=True) if now != before]
    counts = np.repeat(np.array(values, dtype=np.int64), np.diff([0, *begins, len(lines)]))
    return zeros, counts


def _zero(line: str, pushed: int, before: int) -> int:
    """The filament sum that counts as 0 after a G92."""
    for word in line.split(";")[0].split():
        if word[0] in FILAMENT:
            try:
                return pushed - round(float(word[1:]) * 1e5)
            except (ValueError, OverflowError):
                return before
    return before


def _with_holes(text: str, moves: Wholes) -> str:
    """The lines with a hole in place of each number that the page's rows contain.

    moves: (6, m) per line: 1 if it has a row, X Y Z, then the step and the sum of filament."""
    letters = np.frombuffer(text.encode(), dtype=np.uint8)
    breaks = np.flatnonzero((letters == SPACE) | (letters == BREAK))
    start, end = np.concatenate([[0], breaks + 1]), np.concatenate([breaks, [len(letters)]])
    line = np.concatenate([[0], np.cumsum(letters[breaks] == BREAK)])
    axes, filament = (np.isin(np.append(letters, 0)[start], list(names.encode())) for names in (AXES, FILAMENT))
    chosen = (axes | filament) & (moves[0, line] > 0) & (end - start > 1) & (end - start <= LONGEST)
    start, end, line, filament = start[chosen], end[chosen], line[chosen], filament[chosen]
    number = _numbers(letters, start + 1, end)
    axis = np.searchsorted(list(AXES.encode()), letters[start]) % len(AXES)
    step = _form(number, moves[4, line], FILAMENT_DIGITS)
    total = _form(number, moves[5, line], FILAMENT_DIGITS)
    by_sum = np.where(total > 0, total + len(STEPS), 0)
    hole = np.where(filament, np.where(step > 0, step, by_sum), _form(number, moves[1 + axis, line], AXIS_DIGITS))
    filled, start, end = hole[hole > 0], start[hole > 0], end[hole > 0]
    covered = np.zeros(len(letters) + 1, dtype=np.int8)
    covered[start + 2] += 1
    covered[end] -= 1
    holed = letters.copy()
    holed[start + 1] = filled
    left: NDArray[np.uint8] = holed[np.cumsum(covered[:-1], dtype=np.int8) == 0]
    return str(left.tobytes(), "utf-8")


def _numbers(letters: NDArray[np.uint8], start: Wholes, end: Wholes) -> tuple[Wholes, Wholes, list[Mask]]:
    """(n,) numbers as written: signed digits as an integer, count of digits after the point, and masks of the possible forms."""
    minus = letters[start] == MINUS
    first, count = start + minus, len(start)
    digits, behind, points = (np.zeros(count, dtype=np.int64) for _ in range(3))
    sound = np.ones(count, dtype=np.bool_)
    for k in range(LONGEST):
        inside = first + k < end
        letter = letters[np.minimum(first + k, len(letters) - 1)].astype(np.int64)
        point, figure = inside & (letter == POINT), inside & (letter >= ZERO) & (letter <= ZERO + 9)
        digits = np.where(figure, 10 * digits + letter - ZERO, digits)
        behind += figure & (points > 0)
        points += point
        sound &= point | figure | ~inside
    before = end - first - behind - points
    leading = letters[np.minimum(first, len(letters) - 1)] == ZERO
    sound &= (points == (behind > 0)) & (before + behind > 0) & ~(minus & (digits == 0))
    trimmed = (behind == 0) | (letters[end - 1] != ZERO)
    plain = (before == 1) | ((before > 1) & ~leading)  # no unnecessary leading zeros
    return np.where(minus, -digits, digits), behind, [sound & plain, sound & trimmed & plain, sound & trimmed & (before == 0)]


def _form(number: tuple[Wholes, Wholes, list[Mask]], value: Wholes, digits: int) -> Wholes:
    """The form, from 1, in which numbers are integer values with `digits` digits after the point; 0: none of the three."""
    written, behind, (full, short, bare) = number
    same = (behind <= digits) & (written * 10 ** np.maximum(digits - behind, 0) == value)
    return np.select([same & full & (behind == digits), same & short, same & bare], [1, 2, 3], 0)
