"""Paths: the rows of a dry run as the page's columns, one row a straight move; of a very long program as many as a browser
draws quickly."""

import numpy as np
from numpy.typing import NDArray

from machine.dryrun.dryrun import DryRun
from machine.dryrun.strokes import beads_of
from machine.gcode.commands import BED, NOZZLE
from machine.gcode.reader.parsed import MoveKind, ParsedProgram, fan_shares, temperatures
from machine.view.encoding import Column
from machine.view.layers import Layers
from mdp.mesh import Floats
from profiles.profile import Profile

WIPE, PRIME = 4, 5  # kinds of the page beside those of MoveKind
REACH = 1e6  # mm and deg: what lies beyond is no place of a machine
STILL = 1e-9
MOST_ROWS = 1_500_000
FINEST_MM = 0.01
Mask = NDArray[np.bool_]


def end_times_s(run: DryRun) -> Floats:
    """(n,) seconds from the start to the end of each row, the waits before it included."""
    waits = np.zeros(len(run.times_s) + 1)
    for line, seconds in run.waits:
        waits[np.searchsorted(run.program.line, line)] += seconds
    ends: Floats = np.cumsum(run.times_s + waits[:-1])
    return ends


def page_kinds(program: ParsedProgram) -> NDArray[np.int8]:
    """(n,) kinds of moves on the page: wipes and primes are kinds of their own, beads laid during turns count as beads."""
    kind = program.kind.copy()
    kind[turning_strokes(program)] = MoveKind.EXTRUDE
    kind[(kind == MoveKind.TRAVEL) & (program.e_mm < -STILL)] = WIPE
    kind[(kind == MoveKind.RETRACT) & (program.e_mm > 0)] = PRIME
    return kind


def turning_strokes(program: ParsedProgram) -> NDArray[np.bool_]:
    """(n,) moves that lay a bead while the table turns, as programs of curved layers do."""
    mask: NDArray[np.bool_] = (program.kind == MoveKind.ROTATE) & (program.e_mm > STILL)
    return mask


def columns(run: DryRun, profile: Profile, layers: Layers, ends_s: Floats, shown: NDArray[np.int64]) -> dict[str, Column]:
    """The page's arrays for the shown rows of a dry run. layers, ends_s (seconds): of all rows."""
    program = run.program
    jumps = _jumps(program, shown)
    width, height = _bead_sizes(run, profile)
    table = {
        "end": Column(np.clip(program.end, -REACH, REACH), "i32", 0.001, delta=True),
        "time": Column(ends_s, "f64", 0.001, delta=True),
        "filament": Column(program.filament_mm, "f64", 0.00001, delta=True),
        "line": Column(program.line, "i32", delta=True),
        "part": Column(program.part, "i32", delta=True),
        "layer": Column(layers.number, "i32", delta=True),
        "speed": Column(np.minimum(program.feed / 60.0, REACH), "i32", 0.001, delta=True),
        "kind": Column(page_kinds(program), "u8"),
        "type": Column(program.type, "u16"),
        "width": Column(width, "u16", 0.001),
        "height": Column(height, "u16", 0.001),
        "fan": Column(fan_shares(program, profile.machine), "u8", 1 / 255),
        "nozzle": Column(temperatures(program, *NOZZLE), "u16", 0.1),
        "bed": Column(temperatures(program, *BED), "u16", 0.1),
    }
    rows = {name: Column(column.values[shown], column.type, column.scale, column.delta) for name, column in table.items()}
    start = np.clip(program.start[shown[jumps]], -REACH, REACH)
    return rows | {"jump_row": Column(jumps, "i32"), "jump_start": Column(start, "i32", 0.001)}


def _jumps(program: ParsedProgram, shown: NDArray[np.int64]) -> NDArray[np.int64]:
    """Places in shown of the rows that do not begin where the row before ends, the first among them."""
    apart = np.abs(program.start[1:] - program.end[:-1]).max(axis=1, initial=0.0) > STILL
    begins: NDArray[np.bool_] = np.concatenate([[True], apart])[: len(program.line)]
    return np.flatnonzero(begins[shown])


def _bead_sizes(run: DryRun, profile: Profile) -> tuple[Floats, Floats]:
    """(n,) width and height of the beads, mm, from comments or from the filament; 0 where none is laid."""
    program, width, height = run.program, np.zeros(len(run.times_s)), np.zeros(len(run.times_s))
    for beads in (run.deposited, beads_of(program, np.flatnonzero(turning_strokes(program)), profile)):
        width[beads.rows], height[beads.rows] = beads.width_mm, beads.height_mm
    return width, height


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
