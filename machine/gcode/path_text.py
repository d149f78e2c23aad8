"""Path text: the lines of many moves, set in digits by a kernel: of a program's lines nearly all are these."""

from math import ceil
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from machine.gcode.lines import Bytes, Texts
from machine.planning.moves import RICHER
from mdp.kernels.kernel import helper, kernel, no_nrt
from mdp.mesh import Floats, Indices
from slicer.strokes.travels import distance

Whole = NDArray[np.int64]

LONGEST = 128  # characters of a line: five words of 20 digits at most with sign and point, and the command
SPACE, MINUS, POINT, ZERO, LINE_END, FEED = 32, 45, 46, 48, 10, 70
COORDINATE_DIGITS, FILAMENT_DIGITS = 3, 5  # behind the point
PUSHING, TRAVELLING, STANDING = range(3)  # what a path does: strokes and wipes, travels, retractions
X, Y, Z, PUSHED, F = range(5)  # what the firmware knows
STEPS = 20  # a short stroke that must go slower does so by twentieths, or the speeds of its like would flicker


class Paths(NamedTuple):
    """Moves to write. points_mm: (n, 3) as the file calls them; filament_mm: (n,) pushed on the way to each; starts: (m + 1,)
    where the points of each path begin; does: (m,) PUSHING, TRAVELLING or STANDING; speed: (m,) units/s; most_mm_s: (m,) of
    filament as planned, RICHER times that is the most that the lines ask for."""

    points_mm: Floats
    filament_mm: Floats
    starts: Indices
    does: NDArray[np.int8]
    speed: Floats
    most_mm_s: Floats


class PathWords(NamedTuple):
    """The commands of strokes and travels, the letter of filament, and whether its word is a step."""

    stroke: Bytes
    travel: Bytes
    letter: int
    relative: bool


def path_text(paths: Paths, texts: Texts, words: PathWords, known: Whole, filament_mm: Floats) -> str:
    """The lines of paths, with their ends: the coordinates that change, then filament, then the F that changes.

    texts: m + 1 of lines between paths, one before each and one behind the last.
    known: (5,) X Y Z in thousandths of a mm, filament in 1e-5 mm and F in units/min that the firmware knows; filament_mm: (1,)
    pushed so far, not rounded. Both become those after the last line. A point where the tip is already gives no line, its
    filament goes to the next one.
    """
    points = int(paths.starts[-1] - paths.starts[0])
    text = np.empty(LONGEST * points + len(texts.content), dtype=np.uint8)
    size = _write(paths, texts, words, known, filament_mm, text)
    return text[:size].tobytes().decode("utf-8")


@kernel
def _write(paths: Paths, texts: Texts, words: PathWords, known: Whole, filament_mm: Floats, text: Bytes) -> int:
    """Fills in the text and returns its length."""
    at = 0
    for path in range(len(paths.starts) - 1):
        at = _copy(texts.content, texts.start[path], texts.start[path + 1], text, at)
        first, end = paths.starts[path], paths.starts[path + 1]
        if paths.does[path] == STANDING:
            filament_mm[0] += paths.filament_mm[first]
            at = _copy(words.stroke, 0, len(words.stroke), text, at)
            at = _filament(words, filament_mm[0], known, text, at)
            at = _feed(paths.speed[path], known, text, at)
            text[at] = LINE_END
            at += 1
            continue
        pushing = paths.does[path] == PUSHING
        more, densest = _stretch(paths.points_mm, paths.filament_mm, first, end) if pushing else (0.0, 0.0)
        too_fast = paths.speed[path] * densest / (paths.most_mm_s[path] * RICHER) if pushing else 0.0
        slower = ceil(too_fast * STEPS) / STEPS if too_fast > 1.0 else 1.0
        written, base, pushed = False, filament_mm[0], 0.0
        for k in range(first + 1, end):
            if pushing:
                pushed += _step_mm(paths.points_mm, paths.filament_mm, k, more)
                filament_mm[0] = base + pushed
            if _stands(paths.points_mm, k, known):
                continue
            command = words.stroke if pushing else words.travel
            at = _copy(command, 0, len(command), text, at)
            for axis in range(3):
                value = _thousandths(paths.points_mm[k, axis])
                if value != known[axis]:
                    known[axis] = value
                    at = _word(88 + axis, value, COORDINATE_DIGITS, text, at)
            if pushing:
                at = _filament(words, filament_mm[0], known, text, at)
            if not written:
                at, written = _feed(paths.speed[path] / slower, known, text, at), True
            text[at] = LINE_END
            at += 1
    return _copy(texts.content, texts.start[len(paths.starts) - 1], texts.start[len(paths.starts)], text, at)


@helper
def _stretch(points_mm: Floats, filament_mm: Floats, first: int, end: int) -> tuple[float, float]:
    """Factor that scales the filament of each step, in proportion to its written length, so that the sum stays; and the most
    filament for a millimetre as written. A factor of 0: nothing is redistributed.

    Else a step of a few thousandths, which rounding makes shorter by half, would ask the extruder for double its speed.
    """
    whole = shared = densest = 0.0
    for k in range(first + 1, end):
        whole += filament_mm[k]
        shared += _step_mm(points_mm, filament_mm, k, 1.0)
        exact_mm = distance(points_mm, k - 1, k)
        densest = max(densest, abs(filament_mm[k]) / exact_mm) if exact_mm > 1e-9 else densest
    if shared == 0.0:
        return 0.0, 0.0
    return whole / shared, densest * whole / shared


@no_nrt
def _step_mm(points_mm: Floats, filament_mm: Floats, k: int, more: float) -> float:
    """Filament of the step to point k as it is written; more: factor on the shared filament; 0: each step keeps its own."""
    if more == 0.0:
        return float(filament_mm[k])
    written = 0.0
    for axis in range(3):
        written += ((np.rint(points_mm[k, axis] * 1000.0) - np.rint(points_mm[k - 1, axis] * 1000.0)) / 1000.0) ** 2
    return float(filament_mm[k] * np.sqrt(written) / max(distance(points_mm, k - 1, k), 1e-12) * more)


@no_nrt
def _thousandths(value_mm: float) -> int:
    return int(np.rint(value_mm * 1000.0))


@no_nrt
def _stands(points_mm: Floats, k: int, known: Whole) -> bool:
    """Whether the tip is at point k already, as it is written."""
    x, y, z = _thousandths(points_mm[k, 0]), _thousandths(points_mm[k, 1]), _thousandths(points_mm[k, 2])
    return bool(x == known[X] and y == known[Y] and z == known[Z])


@no_nrt
def _filament(words: PathWords, filament_mm: float, known: Whole, text: Bytes, at: int) -> int:
    """The word of filament up to what has been pushed: a step, or the sum where the firmware knows no steps."""
    pushed = int(np.rint(filament_mm * 1e5))
    value = pushed - known[PUSHED] if words.relative else pushed
    known[PUSHED] = pushed
    return _word(words.letter, value, FILAMENT_DIGITS, text, at)


@no_nrt
def _feed(units_s: float, known: Whole, text: Bytes, at: int) -> int:
    """The F word where it changes."""
    feed = max(int(np.rint(60.0 * units_s)), 1)
    if feed == known[F]:
        return at
    known[F] = feed
    return _word(FEED, feed, 0, text, at)


@no_nrt
def _copy(what: Bytes, first: int, end: int, text: Bytes, at: int) -> int:
    for k in range(first, end):
        text[at] = what[k]
        at += 1
    return at


@no_nrt
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
    end = at + count + (1 if digits > 0 else 0)
    after = end
    for k in range(count):
        if k == digits and digits > 0:
            end -= 1
            text[end] = POINT
        end -= 1
        text[end] = ZERO + value % 10
        value //= 10
    return after
