"""Paths: the rows of a dry run as columns of the page, one row per straight move, thinned for very long programs; and layers.

Arrays, n rows: end (n, 5), X Y Z (mm), tilt, turn (deg) at the end of the move, machine frame; jump_row (j,), jump_start (j, 5):
rows that begin elsewhere than the previous one ends, and where; time (s, waits included) and filament (mm) up to the end of the
move; line of the file, part, layer, from 1, 0: unknown; speed, as commanded, mm/s, deg/s for pure turns; kind: 0 travel, 1
extrude, 2 retract, 3 rotate, 4 wipe, 5 prime; type: index into the header's types; width, height of the bead, mm; fan, 0 to 1;
nozzle, bed: target temperatures, deg C. layer_...: a layer's part, number in it, first row, count of rows, height above the
part's base (mm), duration (s). machine.view.scene adds vertices (mm, workpiece frame), faces, and face_marks: bit 0, needs
support in its part; bit 1, in one piece. machine.view.text adds text.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from machine.dryrun.dryrun import DryRun
from machine.dryrun.strokes import beads_of
from machine.gcode.commands import BED, NOZZLE
from machine.gcode.reader.parsed import Indices32, MoveKind, ParsedProgram, fan_shares, temperatures
from machine.view.encoding import Column
from mdp.mesh import Floats
from profiles.profile import Profile

WIPE, PRIME = 4, 5  # kinds of moves on the page in addition to those of MoveKind
REACH = 1e6  # mm and deg; values beyond it are errors
STILL = 1e-9
MOST_ROWS = 1_500_000
FINEST_MM = 0.01
SAME_MM = 0.02  # strokes whose heights differ by less are in one layer
FEWEST = 4  # least number of strokes in which a helix rises by a layer; faster changes of height are not a helix
Mask = NDArray[np.bool_]


@dataclass(frozen=True, eq=False)
class Layers:
    """number: (n,) layer of each row of a program, 0 before the first. first, rows: (l,) first row and length of each layer.

    by: "comments", or "heights" for a text without layer comments.
    """

    number: NDArray[np.int64]
    first: NDArray[np.int64]
    rows: NDArray[np.int64]
    by: str


def end_times_s(run: DryRun) -> Floats:
    """(n,) end time of each row, s, including the waits before it."""
    waits = np.zeros(len(run.times_s) + 1)
    for line, seconds in run.waits:
        waits[np.searchsorted(run.program.line, line)] += seconds
    ends: Floats = np.cumsum(run.times_s + waits[:-1])
    return ends


def page_kinds(program: ParsedProgram) -> NDArray[np.int8]:
    """(n,) kinds of moves on the page: wipes and primes have their own, beads laid while the table turns count as beads."""
    kind = program.kind.copy()
    kind[turning_strokes(program)] = MoveKind.EXTRUDE
    kind[(kind == MoveKind.TRAVEL) & (program.e_mm < -STILL)] = WIPE
    kind[(kind == MoveKind.RETRACT) & (program.e_mm > 0)] = PRIME
    return kind


def turning_strokes(program: ParsedProgram) -> NDArray[np.bool_]:
    """(n,) moves that lay a bead while the table turns, as in programs of curved layers."""
    mask: NDArray[np.bool_] = (program.kind == MoveKind.ROTATE) & (program.e_mm > STILL)
    return mask


def columns(run: DryRun, profile: Profile, layers: Layers, ends_s: Floats, shown: NDArray[np.int64]) -> dict[str, Column]:
    """The page's arrays for the shown rows of a dry run. layers, ends_s (s): of all rows."""
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
    """(k,) positions in shown of rows that do not begin where the previous row ends, including the first row."""
    apart = np.abs(program.start[1:] - program.end[:-1]).max(axis=1, initial=0.0) > STILL
    begins: NDArray[np.bool_] = np.concatenate([[True], apart])[: len(program.line)]
    return np.flatnonzero(begins[shown])


def _bead_sizes(run: DryRun, profile: Profile) -> tuple[Floats, Floats]:
    """(n,) width and height of the beads, mm, from comments or from the filament; 0 for other moves."""
    program, width, height = run.program, np.zeros(len(run.times_s)), np.zeros(len(run.times_s))
    for beads in (run.deposited, beads_of(program, np.flatnonzero(turning_strokes(program)), profile)):
        width[beads.rows], height[beads.rows] = beads.width_mm, beads.height_mm
    return width, height


def shown_rows(program: ParsedProgram, most: int = MOST_ROWS) -> NDArray[np.int64]:
    """(k,) indices of the rows to show; all if there are at most `most`.

    Points inside strokes are dropped over the whole print, those nearest to the line between their neighbours first. The ends of
    strokes, turns, layers and parts stay, and so do all other kinds of rows, however many there are.
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
    """(n,) rows that do not end a stroke: the next row continues the same bead."""
    extruding = program.kind == MoveKind.EXTRUDE
    goes_on = np.zeros(len(extruding), dtype=np.bool_)
    goes_on[:-1] = extruding[1:] & extruding[:-1] & np.all(program.start[1:] == program.end[:-1], axis=1)
    for column in (program.part, program.layer, program.type, program.width_mm, program.height_mm, program.feed):
        goes_on[:-1] &= column[1:] == column[:-1]
    return goes_on


def _off_the_chord_mm(points: Floats) -> Floats:
    """(n,) distance of each point from the line through its neighbours, mm; 0 at both ends."""
    off = np.zeros(len(points))
    chord, arm = points[2:] - points[:-2], points[1:-1] - points[:-2]
    length2 = np.maximum((chord * chord).sum(axis=1), 1e-12)
    along = np.clip((arm * chord).sum(axis=1) / length2, 0.0, 1.0)
    off[1:-1] = np.linalg.norm(arm - along[:, None] * chord, axis=1)
    return off


def _alternate(marked: Mask) -> Mask:
    """Every second one of adjacent marks, so that no two neighbours are left."""
    places = np.arange(len(marked))
    begun = np.maximum.accumulate(np.where(marked & ~np.append(False, marked[:-1]), places, -1))
    alternate: Mask = marked & ((places - begun) % 2 == 0)
    return alternate


def layers_of(program: ParsedProgram, layer_height_mm: float) -> Layers:
    """The layers of a program. layer_height_mm: rise after which a helix begins a new layer."""
    commented = program.layers > 0
    number = program.layer.astype(np.int64) if commented else _by_heights(program, layer_height_mm)
    changes = np.ones(len(number), dtype=np.bool_)
    changes[1:] = (np.diff(number) != 0) | (np.diff(program.part) != 0)
    begins = np.flatnonzero(changes)
    rows = np.diff(np.append(begins, len(number)))
    layer = number[begins] > 0
    return Layers(number, begins[layer], rows[layer], "comments" if commented else "heights")


def _by_heights(program: ParsedProgram, layer_height_mm: float) -> NDArray[np.int64]:
    """(n,) layer numbers: a new layer begins at a level stroke at another height, or after a helix has risen by a layer height.

    Beads laid while the table turns have no height of their own: they form one layer, or continue the previous one.
    """
    number = np.zeros(len(program.line), dtype=np.int64)
    number[np.flatnonzero((program.kind == MoveKind.ROTATE) & (program.e_mm > 0.0))[:1]] = 1
    strokes = np.flatnonzero(program.kind == MoveKind.EXTRUDE)
    if not len(strokes):
        return np.cumsum(number)
    before, z = program.start[strokes, 2], program.end[strokes, 2]
    level = np.abs(z - before) < SAME_MM / 10.0
    steps = np.ones(len(strokes), dtype=np.bool_)
    steps[1:] = level[1:] & (np.abs(np.diff(z)) > SAME_MM) | np.any(np.diff(program.end[strokes, 3:], axis=0) != 0.0, axis=1)
    run = np.cumsum(steps) - 1
    risen = np.ceil((z - before[steps][run]) / layer_height_mm - 1e-6)
    rises = np.diff(risen) != 0
    if rises.sum() * FEWEST < len(strokes):
        steps[1:] |= rises
    number[strokes[steps]] = 1
    return np.cumsum(number)


def sums_of_parts(program: ParsedProgram, layers: Layers, ends_s: Floats) -> list[dict[str, Any]]:
    """Layers, time and filament of each part; without ;PART: comments all rows are part 0. ends_s: (n,) end time of each row."""
    seconds, sums = np.diff(ends_s, prepend=0.0), []
    for index in program.parts or (0,):
        rows = np.flatnonzero(program.part == index)
        sums.append(
            {
                "index": index,
                "layers": int((program.part[layers.first] == index).sum()),
                "time_s": float(seconds[rows].sum()),
                "filament_mm": float(program.e_mm[rows].sum()),
            }
        )
    return sums


def layer_columns(
    program: ParsedProgram, layers: Layers, ends_s: Floats, height_mm: Floats, shown: NDArray[np.int64]
) -> dict[str, Column]:
    """The table of layers. ends_s, height_mm: (n,) of all rows; layer_first and layer_rows count shown rows."""
    first, last = layers.first, layers.first + layers.rows
    part = program.part[first]
    seconds = np.concatenate([[0.0], ends_s])
    height = np.append(np.where(program.kind == MoveKind.EXTRUDE, program.end[:, 2], -np.inf), -np.inf)
    top = np.maximum.reduceat(height, np.stack([first, last], axis=1).ravel())[::2] if len(first) else np.zeros(0)
    top = np.where(np.isfinite(top), top, program.end[last - 1, 2])
    begin = np.searchsorted(shown, first)
    return {
        "layer_part": Column(part, "i32"),
        "layer_number": Column(layers.number[first], "i32"),
        "layer_first": Column(begin, "i32"),
        "layer_rows": Column(np.searchsorted(shown, last) - begin, "i32"),
        "layer_z": Column(top - _ground(part, top, height_mm, layers), "f32"),
        "layer_time": Column(seconds[last] - seconds[first], "f32"),
    }


def _ground(part: Indices32, top: Floats, height_mm: Floats, layers: Layers) -> Floats:
    """(l,) machine Z at which the part of each layer begins: the top of its first layer minus the bead height."""
    parts, places, back = np.unique(part, return_index=True, return_inverse=True)
    thick = np.array(
        [height_mm[a : a + n].max(initial=0.0) for a, n in zip(layers.first[places], layers.rows[places], strict=True)]
    )
    ground: Floats = (top[places] - thick)[back] if len(parts) else np.zeros(0)
    return ground
