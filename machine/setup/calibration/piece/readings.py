"""Readings: what a person reads off the pads of a calibration piece: which marks are in line, and how high a pad stands.

`right` and `up` are marks counted from the long one in the middle, a tenth of a mm each, positive to the right and upwards;
halves may be told, and what lies beyond the scale is told by eye. `height` is how far the pad's top is over its roof, mm.
"""

from math import isnan

import numpy as np

from machine.setup.calibration.piece.pads import PADS, WAYS
from mdp.mesh import Floats
from profiles.errors import ProfileError

MARK_MM = 0.1
HEIGHT_MM = 1.2  # of a pad that lies where it should
MOST_MARKS = 30.0
MOST_HEIGHT_MM = 4.0
NOT_READ = "-"
EXPECTED = f"two marks and a height are expected, as 2,-1,1.25, {NOT_READ} for what was not read"


def parse_readings(text: str) -> Floats:
    """(pads, 3) mm aside, up and too high, nan for what was not read, of a text as `2,-1,1.25 0,0.5,- -,-,- 1,0,1.2`.

    Raises ProfileError for one that is no such text, or has numbers that nobody can have read.

    >>> parse_readings("2,-1,1.25 0,0.5,- -,-,- 1,0,1.2")[0].round(6).tolist()
    [0.2, -0.1, 0.05]
    """
    pads = text.split()
    if len(pads) != PADS:
        raise ProfileError(f"--readings {text!r} tells of {len(pads)} pads: {PADS} are expected, with a space between them")
    return np.array([parse_pad(pad, number) for number, pad in enumerate(pads, start=1)])


def parse_pad(text: str, number: int) -> list[float]:
    """The three readings of a pad in mm, nan for what was not read. Raises ProfileError naming the pad."""
    words = text.replace(",", " ").split()
    if len(words) not in (2, 3):
        raise ProfileError(f"pad {number}: {text!r} cannot be read: {EXPECTED}")
    values = [_number(word, text, number) for word in words] + [float("nan")] * (3 - len(words))
    for way, value, most in zip(WAYS, values, (MOST_MARKS, MOST_MARKS, MOST_HEIGHT_MM), strict=True):
        least = 0.0 if way == "height" else -most
        if not isnan(value) and not least <= value <= most:
            raise ProfileError(f"pad {number}: {way} {value:g} cannot be: {least:g} to {most:g} is allowed")
    return [MARK_MM * values[0], MARK_MM * values[1], values[2] - HEIGHT_MM]


def readings_text(readings_mm: Floats) -> str:
    """The text that `parse_readings` makes these of."""
    told = (readings_mm + np.array([0.0, 0.0, HEIGHT_MM])) / np.array([MARK_MM, MARK_MM, 1.0])
    words = [[NOT_READ if isnan(value) else f"{round(value, 3) + 0.0:g}" for value in pad] for pad in told.tolist()]
    return " ".join(map(",".join, words))


def _number(word: str, text: str, number: int) -> float:
    try:
        return float("nan") if word == NOT_READ else float(word)
    except ValueError:
        raise ProfileError(f"pad {number}: {text!r} cannot be read: {EXPECTED}") from None
