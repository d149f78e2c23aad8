"""Thinning: which rows of a very long program the page shows, so that a browser stays quick."""

import numpy as np
from numpy.typing import NDArray

from machine.reader.parsed import MoveKind, ParsedProgram
from mdp.mesh import Floats

MOST_ROWS = 1_500_000
FINEST_MM = 0.01
Mask = NDArray[np.bool_]


def shown_rows(program: ParsedProgram, most: int = MOST_ROWS) -> NDArray[np.int64]:
    """(k,) places of the rows to show: all when there are no more than `most`.

    Points inside strokes go, in all of the print alike, those first that lie nearest to the line between their neighbours. What
    begins or ends a stroke, a turn, a layer or a part stays, and so does every row of another kind, however many there are.
    """
    shown = np.arange(len(program.line))
    if len(shown) <= most:
        return shown
    inner = _inside_strokes(program)
    tolerance_mm = FINEST_MM
    while len(shown) > most and inner.any():
        goes = _alternate(inner & (_off_the_chord_mm(program.end[shown, :3]) <= tolerance_mm))
        shown, inner = shown[~goes], inner[~goes]
        if goes.sum() * 20 < len(goes):
            tolerance_mm *= 2.0
    return shown


def _inside_strokes(program: ParsedProgram) -> Mask:
    """(n,) rows whose end is no end of a stroke: the next row goes on with the same bead."""
    extruding = program.kind == MoveKind.EXTRUDE
    goes_on = np.zeros(len(extruding), dtype=np.bool_)
    goes_on[:-1] = extruding[1:] & extruding[:-1] & np.all(program.start[1:] == program.end[:-1], axis=1)
    for column in (program.part, program.layer, program.type, program.width_mm, program.height_mm, program.feed):
        goes_on[:-1] &= column[1:] == column[:-1]
    return goes_on


def _off_the_chord_mm(points: Floats) -> Floats:
    """(n,) how far each point lies from the line through its neighbours; 0 at both ends."""
    off = np.zeros(len(points))
    chord, arm = points[2:] - points[:-2], points[1:-1] - points[:-2]
    length2 = np.maximum((chord * chord).sum(axis=1), 1e-12)
    along = np.clip((arm * chord).sum(axis=1) / length2, 0.0, 1.0)
    off[1:-1] = np.linalg.norm(arm - along[:, None] * chord, axis=1)
    return off


def _alternate(marked: Mask) -> Mask:
    """Every second of marks that follow each other, so that no two neighbours are left."""
    places = np.arange(len(marked))
    begun = np.maximum.accumulate(np.where(marked & ~np.append(False, marked[:-1]), places, -1))
    alternate: Mask = marked & ((places - begun) % 2 == 0)
    return alternate
