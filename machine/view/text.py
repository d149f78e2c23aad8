"""Text: the G-code of a print as patterns of its lines, which the rows of the page fill.

The rows tell of a move's line all but its form: `G1 X12.500 Y3.250 E0.04214` is the pattern `G1 X. Y. E.` with holes for numbers.
So some thousand patterns, and for each line its place among them, are the whole text, letter for letter, in a hundredth of
what it takes compressed by itself.
"""

from collections.abc import Mapping, Sequence
from itertools import pairwise
from typing import Any

import numpy as np

from machine.view.encoding import Column, whole

MOST_LETTERS = (
    1_000_000  # in all patterns together; with more the text is left out, or the page would grow by some hundred kilobytes
)
AXES = "XYZ"
FILAMENT = "EUVW"
STEPS, SUMS = (
    "\x01\x02\x03",
    "\x04\x05\x06",
)  # holes: the number in full; without its last zeros; without the zero before its point
NOTHING: tuple[None, dict[str, Column]] = (None, {"text": Column(np.zeros(0), "i32", delta=True)})


def line_patterns(lines: Sequence[str], rows: Mapping[str, Column]) -> tuple[dict[str, Any] | None, dict[str, Column]]:
    """For the header the patterns and where sums of filament begin anew, and the column of the lines' places among the patterns;
    None and an empty column where the lines are too unlike. rows: from machine.view.paths."""
    text = "\n".join(lines)
    if any(hole in text for hole in STEPS + SUMS):
        return NOTHING
    ends = np.searchsorted(rows["line"].values, np.arange(len(lines) + 1), side="right").tolist()
    axes = whole(rows["end"])[:, :3].T.tolist()
    pushed = [0, *whole(rows["filament"]).tolist()]
    places: dict[str, int] = {}
    zeros: list[list[int]] = []  # [line, sum of filament that counts as 0 from there on]
    letters, zero = 0, 0
    numbers = np.zeros(len(lines), dtype=np.int64)
    for k, (line, (first, last)) in enumerate(zip(lines, pairwise(ends), strict=True)):
        if line.startswith("G92 "):
            zero = _zero(line, pushed[last], zero)
            if zero != (zeros[-1][1] if zeros else 0):
                zeros.append([k + 1, zero])
        pattern = line
        if last > first:
            step, total = pushed[last] - pushed[first], pushed[last] - zero
            pattern = " ".join(_hole(word, axes, last - 1, step, total) for word in line.split(" "))
        if pattern not in places:
            places[pattern] = len(places)
            letters += len(pattern)
            if letters > MOST_LETTERS:
                return NOTHING
        numbers[k] = places[pattern]
    return {"patterns": list(places), "zeros": zeros}, {"text": Column(numbers, "i32", delta=True)}


def _hole(word: str, axes: list[list[int]], row: int, step: int, total: int) -> str:
    """A word with a hole instead of its number, where the rows tell it."""
    letter, number = word[:1], word[1:]
    if letter and letter in AXES:
        return letter + _form(number, axes[AXES.index(letter)][row], 3, STEPS)
    if letter and letter in FILAMENT:
        form = _form(number, step, 5, STEPS)
        return letter + (form if form != number else _form(number, total, 5, SUMS))
    return word


def _form(number: str, value: int, digits: int, holes: str) -> str:
    """The hole that gives a number again from a whole value with so many digits behind the point; the number where none does."""
    full = f"{value / 10**digits:.{digits}f}"
    if number == full:
        return holes[0]
    short = full.rstrip("0").rstrip(".")
    if number == short:
        return holes[1]
    return holes[2] if number == short.replace("0.", ".", 1) and short.lstrip("-").startswith("0.") else number


def _zero(line: str, pushed: int, before: int) -> int:
    """What counts as 0 of the filament after a G92."""
    for word in line.split(";")[0].split():
        if word[0] in FILAMENT:
            try:
                return pushed - round(float(word[1:]) * 1e5)
            except ValueError:
                return before
    return before
