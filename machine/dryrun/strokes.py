"""Strokes: a program's rows as the replay takes them: beads with their places and sizes, what each move may touch and span."""

from math import pi
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from machine.reader.parsed import Indices32, MoveKind, ParsedProgram, pieces
from mdp.mesh import Floats
from profiles.profile import Profile
from slicer.fill.infill import infill_cell_mm
from slicer.paths import Kind
from slicer.support.beads import support_cell_mm

SLACK_MM = 0.4  # the head may dip so deep without a finding: beads are round, their places rounded
LEVEL_SLACK_MM = 0.05  # a travel below the bead that was just laid; what lies there was laid at the same pose
CROSSING_MM = 0.2  # on the way to a turn of the table, or from it to the next bead, the tip keeps so far above the print
ACROSS_MM, WAY_MM = 0.5, 3.0  # a shorter way next to a bead is a wipe
FEWEST_LEVELS = 3  # of beads, for a file's layers to be known by them
SUPPORT = (Kind.SUPPORT.value, Kind.SUPPORT_INTERFACE.value)
STANDS_OFF = (*SUPPORT, Kind.SKIRT.value)
FILLING = (Kind.SKIN.value, Kind.TOP_SKIN.value, Kind.GAP.value)
ZIGZAG = 3.0  # spans: infill that turns at a wall may have a line's end, the joint and the next line's end beyond what it crosses


class Beads(NamedTuple):
    """What was deposited: (m, 2, 3) segments in the workpiece frame, (m,) their rows, widths, heights and lengths."""

    segments_mm: Floats
    rows: NDArray[np.int64]
    width_mm: Floats
    height_mm: Floats
    length_mm: Floats


class Strokes(NamedTuple):
    """(n,) of each row: the path it belongs to, how far along all moves it ends, and whether it is support, which stands off by a
    gap.
    """

    path: NDArray[np.int32]
    way: Floats
    stands_off: NDArray[np.bool_]


class Moves(NamedTuple):
    """(n, 5) start and end of each row; (n,) whether it lies below the bead that was just laid, and whether it leads to or from a
    turn of the table, its remarks. spans: of each of those, how far beads may span over what is sparse below them.

    rows, width, height: (m,) of the beads. Apart from Strokes, which the innermost functions take: each array more there slows
    all of it down.
    """

    start: Floats
    end: Floats
    low: NDArray[np.bool_]
    crossing: NDArray[np.bool_]
    remark: Indices32
    spans: Floats
    rows: NDArray[np.int64]
    width: Floats
    height: Floats


def beads_of(program: ParsedProgram, segments: Floats, rows: NDArray[np.int64], profile: Profile) -> Beads:
    """Widths and heights as the program's comments tell, else by its layers or the profile's, and the filament pushed."""
    first_mm, layer_mm = _layers_mm(segments, bool((program.height_mm[rows] > 0).any()), profile)
    width_mm, height_mm, length_mm = np.empty((3, len(rows)))
    for some in pieces(len(rows)):
        ends, remark = segments[some], program.remark[rows[some]]
        remark_height_mm, remark_width_mm = program.remarks.height_mm[remark], program.remarks.width_mm[remark]
        usual = np.where(np.maximum(ends[:, 0, 2], ends[:, 1, 2]) <= first_mm + 1e-3, first_mm, layer_mm)
        height = np.where(remark_height_mm > 0, remark_height_mm, usual)
        length = np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1)
        area = program.e_mm[rows[some]] * pi * profile.material.diameter_mm**2 / 4.0 / np.maximum(length, 1e-9)
        by_flow = np.clip(area / height + height * (1.0 - pi / 4.0), profile.machine.head.nozzle_mm, 4.0 * height + 2.0)
        width_mm[some], height_mm[some], length_mm[some] = np.where(remark_width_mm > 0, remark_width_mm, by_flow), height, length
    return Beads(segments, rows, width_mm, height_mm, length_mm)


def _layers_mm(segments: Floats, has_heights: bool, profile: Profile) -> tuple[float, float]:
    """Heights of the first layer and of others for beads that tell none: the profile's, and in a file that tells none at all
    those of its own level beads.
    """
    process, most = profile.process, profile.machine.head.nozzle_mm  # a higher step is no layer's
    first, usual = process.first_layer_height_mm, process.layer_height_mm
    if has_heights:
        return first, usual
    levels = np.unique(np.round(segments[segments[:, 0, 2] == segments[:, 1, 2], 1, 2], 3))
    if len(levels) < FEWEST_LEVELS:
        return first, usual
    step = float(np.median(np.diff(levels)))
    return (float(levels[0]) if 0.0 < levels[0] <= most else first), (step if step <= most else usual)


def strokes_of(program: ParsedProgram, extruded: NDArray[np.bool_]) -> Strokes:
    """The strokes of a program."""
    begins = np.ones(len(extruded), dtype=np.bool_)
    begins[1:] = ~(np.all(program.start[1:] == program.end[:-1], axis=1) & extruded[1:] & extruded[:-1])
    path, way = np.cumsum(begins, dtype=np.int32), program.way_mm
    stands_off = np.array([name in STANDS_OFF for name in program.types], dtype=np.bool_)[program.remarks.type][program.remark]
    return Strokes(path, np.cumsum(way, out=way), stands_off)


def moves_of(program: ParsedProgram, deposited: Beads, profile: Profile) -> Moves:
    """The moves of a program."""
    others = np.flatnonzero(program.kind != MoveKind.EXTRUDE)
    across = np.hypot(*(program.end[others] - program.start[others])[:, :2].T)
    low, crossing = np.zeros((2, len(program.line)), dtype=np.bool_)
    low[_below_last_bead(program, others[across > ACROSS_MM], deposited.rows)] = True
    crossing[_ways_to_turns(program, others[across > WAY_MM], deposited.rows)] = True
    spans, beads = _spans(program, profile), (deposited.rows, deposited.width_mm, deposited.height_mm)
    return Moves(program.start, program.end, low, crossing, program.remark, spans, *beads)


def _spans(program: ParsedProgram, profile: Profile) -> Floats:
    """How far a bead may span that some remarks are of: what fills, over sparse infill's cells; support, over its own lines; any,
    its width: walls, too, bridge slots and teeth narrower than themselves.
    """
    process = profile.process
    infill_mm, support_mm = infill_cell_mm(process), support_cell_mm(process)
    of_type = {**dict.fromkeys(FILLING, infill_mm), Kind.INFILL.value: ZIGZAG * infill_mm, **dict.fromkeys(SUPPORT, support_mm)}
    of_types = np.array([of_type.get(name, 0.0) for name in program.types])
    spans: Floats = np.maximum(of_types[program.remarks.type], program.remarks.width_mm)
    return spans


def _below_last_bead(program: ParsedProgram, rows: NDArray[np.int64], beads: NDArray[np.int64]) -> NDArray[np.int64]:
    """Those of some travels that go below the last bead, laid at their own pose."""
    after = np.searchsorted(beads, rows)
    rows, last = rows[after > 0], beads[after[after > 0] - 1]
    height = np.maximum(program.start[last, 2], program.end[last, 2])
    same_pose = (program.end[rows, 3] == program.end[last, 3]) & (program.end[rows, 4] == program.end[last, 4])
    below: NDArray[np.int64] = rows[
        same_pose & (np.minimum(program.start[rows, 2], program.end[rows, 2]) < height - LEVEL_SLACK_MM)
    ]
    return below


def _ways_to_turns(program: ParsedProgram, rows: NDArray[np.int64], beads: NDArray[np.int64]) -> NDArray[np.int64]:
    """Those of some rows that travel between the last bead before a turn of the table and the first one after it."""
    turns = np.flatnonzero(program.kind == MoveKind.ROTATE)
    rows = rows[(program.kind[rows] == MoveKind.TRAVEL) & (program.e_mm[rows] >= 0.0)]
    after = np.searchsorted(beads, rows)
    within = (after > 0) & (after < len(beads))
    rows, after = rows[within], after[within]
    next_turn, last_turn = (np.searchsorted(turns, beads[at]) for at in (after, after - 1))
    return rows[next_turn > last_turn]
