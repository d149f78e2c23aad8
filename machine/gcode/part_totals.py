"""Part totals: a comment that tells what a part's beads come to, so that a program that was changed later gives itself away."""

import re
from dataclasses import dataclass

import numpy as np

from mdp.mesh import Floats

KEY = "CONTENTS"
NUMBER = r"(-?[0-9]{1,6}\.[0-9]{3})"
FORM = re.compile(rf"X{NUMBER} {NUMBER} Y{NUMBER} {NUMBER} Z{NUMBER} {NUMBER} E{NUMBER} layers ([0-9]{{1,6}})")


@dataclass(frozen=True, eq=False)
class PartTotals:
    """What a part's beads come to: (2, 3) least and greatest axis positions X Y Z, filament, the layers that have any.

    line: of the comment.
    """

    line: int
    part: int
    bounds_mm: Floats
    filament_mm: float
    layers: int


def totals_comment(points_mm: Floats, filament_mm: float, layers: int) -> str:
    """The comment that sums up a part, whose strokes pass through (n, 3) points; empty where it has no strokes."""
    if not len(points_mm):
        return ""
    low, high = points_mm.min(axis=0).tolist(), points_mm.max(axis=0).tolist()
    sides = " ".join(f"{letter}{least:.3f} {most:.3f}" for letter, least, most in zip("XYZ", low, high, strict=True))
    return f";{KEY}:{sides} E{filament_mm:.3f} layers {layers}"


def read_totals(text: str, line: int, part: int) -> PartTotals | None:
    """What the comment's text behind its colon tells of a part; None where it is no such text."""
    match = FORM.fullmatch(text.strip())
    if match is None:
        return None
    figures = [float(value) for value in match.groups()[:7]]
    return PartTotals(line, part, np.array(figures[:6]).reshape(3, 2).T, figures[6], int(match[8]))
