"""Strokes: a program's rows as the replay takes them: beads with their places and sizes, what each move may touch and span."""

from dataclasses import dataclass
from math import pi
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from machine.reader.parsed import MoveKind, ParsedProgram
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


@dataclass(frozen=True, eq=False)
class Beads:
    """What was deposited: (m, 2, 3) segments in the workpiece frame, (m,) their rows, widths, heights and lengths."""

    segments_mm: Floats
    rows: NDArray[np.int64]
    width_mm: Floats
    height_mm: Floats
    length_mm: Floats


class Strokes(NamedTuple):
    """(n,) of each row: half its bead's width and its height (0: no bead), the path it belongs to, how far along all moves it
    ends, and whether it is support, which stands off by a gap.
    """

    half: Floats
    height: Floats
    path: NDArray[np.int32]
    way: Floats
    stands_off: NDArray[np.bool_]


class Moves(NamedTuple):
    """(n, 5) start and end of each row; (n,) how deep the head may dip during it, by how much lower it is tried too, and how far
    its bead may span over what is sparse below it.

    Apart from Strokes, which the innermost functions take: each array more there slows all of it down.
    """

    start: Floats
    end: Floats
    slack: Floats
    lower: Floats
    span: Floats


def beads_of(program: ParsedProgram, segments: Floats, rows: NDArray[np.int64], profile: Profile) -> Beads:
    """Widths and heights as the program's comments tell, else by its layers or the profile's, and the filament pushed."""
    height_mm = program.height_mm[rows]
    first_mm, layer_mm = _layers_mm(segments[:, :, 2], bool((height_mm > 0).any()), profile)
    usual = np.where(np.maximum(segments[:, 0, 2], segments[:, 1, 2]) <= first_mm + 1e-3, first_mm, layer_mm)
    height = np.where(height_mm > 0, height_mm, usual)
    length = np.linalg.norm(segments[:, 1] - segments[:, 0], axis=1)
    area = program.e_mm[rows] * pi * profile.material.diameter_mm**2 / 4.0 / np.maximum(length, 1e-9)
    by_flow = np.clip(area / height + height * (1.0 - pi / 4.0), profile.machine.head.nozzle_mm, 4.0 * height + 2.0)
    width = np.where(program.width_mm[rows] > 0, program.width_mm[rows], by_flow)
    return Beads(segments, rows, width, height, length)


def _layers_mm(z_mm: Floats, has_heights: bool, profile: Profile) -> tuple[float, float]:
    """Heights of the first layer and of others for beads that tell none: the profile's, and in a file that tells none at all
    those of its own level beads; z_mm: (m, 2) of the beads' ends.
    """
    process, most = profile.process, profile.machine.head.nozzle_mm  # a higher step is no layer's
    first, usual = process.first_layer_height_mm, process.layer_height_mm
    levels = np.unique(np.round(z_mm[z_mm[:, 0] == z_mm[:, 1], 1], 3))
    if has_heights or len(levels) < FEWEST_LEVELS:
        return first, usual
    step = float(np.median(np.diff(levels)))
    return (float(levels[0]) if 0.0 < levels[0] <= most else first), (step if step <= most else usual)


def strokes_of(program: ParsedProgram, deposited: Beads, extruded: NDArray[np.bool_]) -> Strokes:
    """The strokes of a program."""
    half, height = np.zeros(len(extruded)), np.zeros(len(extruded))
    half[deposited.rows], height[deposited.rows] = 0.5 * deposited.width_mm, deposited.height_mm
    begins = np.ones(len(extruded), dtype=np.bool_)
    begins[1:] = ~(np.all(program.start[1:] == program.end[:-1], axis=1) & extruded[1:] & extruded[:-1])
    path = np.cumsum(begins).astype(np.int32)
    way = np.cumsum(np.linalg.norm((program.end - program.start)[:, :3], axis=1))
    stands_off = np.array([name in STANDS_OFF for name in program.types], dtype=np.bool_)[program.type]
    return Strokes(half, height, path, way, stands_off)


def moves_of(program: ParsedProgram, extruded: NDArray[np.bool_], half: Floats, profile: Profile) -> Moves:
    """The moves of a program; half: (n,) of its strokes."""
    across = np.hypot(*(program.end - program.start)[:, :2].T)
    slack, lower = _slacks(program, extruded, half, across), _ways_to_turns(program, extruded, across)
    return Moves(program.start, program.end, slack, lower, _spans(program, profile))


def _spans(program: ParsedProgram, profile: Profile) -> Floats:
    """(n,) how far each bead may span: what fills, over sparse infill's cells; support, over its own lines; any, its width."""
    process = profile.process
    infill_mm, support_mm = infill_cell_mm(process), support_cell_mm(process)
    of_type = {**dict.fromkeys(FILLING, infill_mm), Kind.INFILL.value: ZIGZAG * infill_mm, **dict.fromkeys(SUPPORT, support_mm)}
    spans: Floats = np.array([of_type.get(name, 0.0) for name in program.types])[program.type]
    return np.maximum(spans, program.width_mm)  # walls too: they bridge slots and teeth narrower than themselves


def _slacks(program: ParsedProgram, extruded: NDArray[np.bool_], half: Floats, across: Floats) -> Floats:
    """(n,) how deep the head may dip: a stroke by its bead's width, a travel below the last bead of its pose next to nothing."""
    rows = np.flatnonzero(~extruded & (across > ACROSS_MM))
    last = np.maximum.accumulate(np.where(extruded, np.arange(len(extruded)), -1))[rows]
    height = np.maximum(program.start[last, 2], program.end[last, 2])
    same_pose = (last >= 0) & (program.end[rows, 3] == program.end[last, 3]) & (program.end[rows, 4] == program.end[last, 4])
    low = same_pose & (np.minimum(program.start[rows, 2], program.end[rows, 2]) < height - LEVEL_SLACK_MM)
    slack = np.where(extruded, 2.0 * half, SLACK_MM)
    slack[rows[low]] = LEVEL_SLACK_MM
    return slack


def _ways_to_turns(program: ParsedProgram, extruded: NDArray[np.bool_], across: Floats) -> Floats:
    """(n,) CROSSING_MM for travels between the last bead before a turn of the table and the first one after it, else 0."""
    lower, strokes = np.zeros(len(extruded)), np.flatnonzero(extruded)
    if not (program.kind == MoveKind.ROTATE).any():
        return lower
    turns = np.cumsum(program.kind == MoveKind.ROTATE)
    rows = np.flatnonzero((program.kind == MoveKind.TRAVEL) & (program.e_mm >= 0.0) & (across > WAY_MM))
    after = np.searchsorted(strokes, rows)
    within = (after > 0) & (after < len(strokes))
    rows, after = rows[within], after[within]
    lower[rows[turns[strokes[after]] > turns[strokes[after - 1]]]] = CROSSING_MM
    return lower
