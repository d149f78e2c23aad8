"""Text: the G-code of a print as patterns of its lines, which the rows of the page fill.

The rows tell of a move's line all but its form: `G1 X12.500 Y3.250 E0.04214` is the pattern `G1 X. Y. E.` with holes for numbers.
So some thousand patterns, and for each line its place among them, are the whole text, letter for letter, in a hundredth of
what it takes compressed by itself.
"""

import re
from collections.abc import Iterator, Mapping, Sequence
from functools import lru_cache
from itertools import pairwise
from typing import Any

import numpy as np

from machine.view.encoding import Column, whole

MOST_LETTERS = 1_000_000  # in all patterns: with more the page would grow by some hundred kilobytes, and the text is left out
AXES = "XYZ"
FILAMENT = "EUVW"
STEPS = "\x01\x02\x03"  # holes: the number in full; without its last zeros; also without the zero before its point
SUMS = "\x04\x05\x06"  # the same of filament since the last G92
NOTHING: tuple[None, dict[str, Column]] = (None, {"text": Column(np.zeros(0), "i32", delta=True)})


def line_patterns(lines: Sequence[str], rows: Mapping[str, Column]) -> tuple[dict[str, Any] | None, dict[str, Column]]:
    """For the header the patterns and where sums of filament begin anew, and the column of the lines' places among the patterns;
    None and an empty column where the lines are too unlike. rows: from machine.view.paths."""
    text = "\n".join(lines)
    if any(hole in text for hole in STEPS + SUMS):
        return NOTHING
    zeros: list[list[int]] = []
    places: dict[str, int] = {}
    numbers, letters = np.zeros(len(lines), dtype=np.int64), 0
    for k, pattern in enumerate(_patterns(lines, rows, zeros)):
        if pattern not in places:
            places[pattern] = len(places)
            letters += len(pattern)
            if letters > MOST_LETTERS:
                return NOTHING
        numbers[k] = places[pattern]
    return {"patterns": list(places), "zeros": zeros}, {"text": Column(numbers, "i32", delta=True)}


def _patterns(lines: Sequence[str], rows: Mapping[str, Column], zeros: list[list[int]]) -> Iterator[str]:
    """The pattern of each line. zeros: takes lines, from 1, and the sums of filament that count as 0 from there on."""
    ends = np.searchsorted(rows["line"].values, np.arange(len(lines) + 1), side="right").tolist()
    x, y, z = (whole(rows["end"])[:, :3].T / 1e3).tolist()
    pushed = [0, *whole(rows["filament"]).tolist()]
    pattern, fill, zero = "", "", 0
    for k, (line, (first, last)) in enumerate(zip(lines, pairwise(ends), strict=True)):
        if line.startswith("G92 "):
            zero = _zero(line, pushed[last], zero)
            if not zeros or zeros[-1][1] != zero:
                zeros.append([k + 1, zero])
        if first == last:
            yield line
            continue
        place_mm, step_mm = (x[last - 1], y[last - 1], z[last - 1]), (pushed[last] - pushed[first]) / 1e5
        if not fill or fill.format(*place_mm, step_mm) != line:  # most are of the pattern of the line before
            pattern = _pattern(line, place_mm, step_mm, (pushed[last] - zero) / 1e5)
            fill = _filled(pattern)
        yield pattern


def _pattern(line: str, place_mm: tuple[float, ...], step_mm: float, total_mm: float) -> str:
    return " ".join(_hole(word, place_mm, step_mm, total_mm) for word in line.split(" "))


@lru_cache(maxsize=256)
def _filled(pattern: str) -> str:
    """A pattern whose numbers are all in full as format() fills it with X, Y, Z and a step of filament; "" of another."""
    if any(hole in pattern for hole in STEPS[1:] + SUMS):
        return ""
    places = {letter: f"{{{place}:.3f}}" for place, letter in enumerate(AXES)} | dict.fromkeys(FILAMENT, "{3:.5f}")
    plain = pattern.replace("{", "{{").replace("}", "}}")
    return re.sub(f"([{AXES}{FILAMENT}]){STEPS[0]}", lambda match: match[1] + places[match[1]], plain)


def _hole(word: str, place_mm: tuple[float, ...], step_mm: float, total_mm: float) -> str:
    """A word with a hole instead of its number, where the rows tell it."""
    letter, number = word[:1], word[1:]
    if letter and letter in AXES:
        return letter + _form(number, f"{place_mm[AXES.index(letter)]:.3f}", STEPS)
    if letter and letter in FILAMENT:
        form = _form(number, f"{step_mm:.5f}", STEPS)
        return letter + (form if form != number else _form(number, f"{total_mm:.5f}", SUMS))
    return word


def _form(number: str, full: str, holes: str) -> str:
    """The hole that gives a number again from all its digits; the number where none does."""
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
            except (ValueError, OverflowError):
                return before
    return before
