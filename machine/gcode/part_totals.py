"""Part totals: a comment that tells what a part's beads come to, so that a program that was changed later gives itself away."""

import re
from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from machine.planning.moves import Stroke
from mdp.mesh import Floats
from slicer.paths import Kind

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


def totals_comment(strokes: Iterable[Stroke], layers: int) -> str:
    """The comment of a part with these strokes in so many layers; a purge is no part's. Empty where it has no strokes."""
    own = [stroke for stroke in strokes if stroke.kind is not Kind.PURGE]
    if not own:
        return ""
    points = np.vstack([stroke.points_mm for stroke in own])
    sides = " ".join(
        f"{letter}{low:.3f} {high:.3f}" for letter, low, high in zip("XYZ", points.min(axis=0), points.max(axis=0), strict=True)
    )
    return f";{KEY}:{sides} E{sum(float(stroke.filament_mm.sum()) for stroke in own):.3f} layers {layers}"


def read_totals(text: str, line: int, part: int) -> PartTotals | None:
    """What the comment's text behind its colon tells of a part; None where it is no such text."""
    match = FORM.fullmatch(text.strip())
    if match is None:
        return None
    figures = [float(value) for value in match.groups()[:7]]
    return PartTotals(line, part, np.array(figures[:6]).reshape(3, 2).T, figures[6], int(match[8]))
