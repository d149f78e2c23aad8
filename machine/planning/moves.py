"""Moves: the machine program between slicer and G-code, a row for each move, in machine coordinates."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from mdp.kernels.arrays import floats
from mdp.kernels.kernel import kernel, no_nrt
from mdp.mesh import Floats, Indices
from mdp.overhang import Mask
from mdp.pose import Pose
from slicer.paths import KINDS, Unsupported

RICHER = 1.004  # greatest ratio of a short stroke's filament to the planned, due to rounding of its ends


@dataclass(frozen=True)
class BeginPart:
    """Start of part `index` at `pose`; an earlier Reorient has turned the table.

    unsupported: places of it without possible support.
    """

    index: int
    pose: Pose
    layers: int
    unsupported: tuple[Unsupported, ...] = ()


@dataclass(frozen=True)
class BeginLayer:
    """Start of a layer; z_mm is relative to the part's base plane, or to the build plate below its raft, nozzle_add_c to the
    material's."""

    part: int
    index: int
    z_mm: float
    height_mm: float
    fan: float
    nozzle_add_c: float = 0.0


@dataclass(frozen=True)
class Reorient:
    """Turn the table to `pose` at the slowest axis's speed; the tip waits at a safe position."""

    pose: Pose
    speed_deg_s: float


@dataclass(frozen=True)
class Pause:
    """Wait for the user before a layer, counted from 1; change: to change the filament. The tip is aside."""

    part: int
    layer: int
    change: bool


Mark = BeginPart | BeginLayer | Pause | Reorient
TRAVEL, WIPE, RETRACT, REORIENT, MARK = range(len(KINDS), len(KINDS) + 5)  # after the numbers of strokes, those of KINDS
POINTS, SPEED = 1, 2  # columns of Moves.rows


class Moves(NamedTuple):
    """Consecutive moves. ways (n, 4): X Y Z of their points and the filament pushed on the way to each, 0 at the first point of a
    path. rows (m, 6): kind, number of points, speed, width, fan, acceleration, as in MachineProgram."""

    ways: Floats
    rows: Floats


@dataclass(frozen=True, eq=False)
class MachineProgram:
    """All moves of a print in order, one row each, and the model's name for the file's head.

    points_mm: (n, 3) machine coordinates; starts: (m + 1,) first point of each move; filament_mm: (n,) pushed on the way to each
    point, 0 at the first one of a path, where the tip already is. Wipes and retractions push less than 0. Retractions and turns
    have one point, the position of the tip; other marks have none. Columns, (m,) each: what: index in KINDS of a stroke, else one
    of TRAVEL ... MARK; speed: mm/s, deg/s of turns; width_mm; fan: 0..1, NaN for the layer's; acceleration_mm_s2: inf if the axes
    decide. marks: values of the rows that are turns or marks, in order.
    """

    name: str
    points_mm: Floats
    starts: Indices
    filament_mm: Floats
    what: NDArray[np.int8]
    speed: Floats
    width_mm: Floats
    fan: Floats
    acceleration_mm_s2: Floats
    marks: tuple[Mark, ...]

    @classmethod
    def of(cls, name: str, pieces: Sequence[Moves], marks: Sequence[Mark]) -> "MachineProgram":
        """The program of consecutive pieces of moves."""
        ways = np.concatenate([np.zeros((0, 4)), *(piece.ways for piece in pieces)])
        rows = np.concatenate([np.zeros((0, 6)), *(piece.rows for piece in pieces)])
        what, points, speed, width_mm, fan, acceleration = np.ascontiguousarray(rows.T)
        starts = np.concatenate([[0], np.cumsum(points.astype(np.int64))])
        points_mm, filament_mm = np.ascontiguousarray(ways[:, :3]), np.ascontiguousarray(ways[:, 3])
        return cls(name, points_mm, starts, filament_mm, what.astype(np.int8), speed, width_mm, fan, acceleration, tuple(marks))

    def __len__(self) -> int:
        return len(self.what)

    @property
    def is_stroke(self) -> Mask:
        """(m,) mask of the strokes."""
        return self.what < len(KINDS)

    @property
    def mark_rows(self) -> Indices:
        """Rows of the marks."""
        return np.flatnonzero(self.what >= REORIENT)

    def marked(self) -> Iterator[tuple[int, Mark]]:
        """Row and value of each mark."""
        return zip(self.mark_rows.tolist(), self.marks, strict=True)


def straight_moves(program: MachineProgram, start: Pose) -> tuple[Floats, Floats, Indices]:
    """(n, 6) beginning and end of each straight move, X Y Z tilt turn E, and (n,) its row of the program.

    start: pose before the first one.
    """
    counts = np.diff(program.starts)
    move = np.repeat(np.arange(len(program)), counts)
    ends = np.ones(len(move), np.bool_)
    ends[program.starts[:-1][(counts > 0) & (program.what <= WIPE)]] = False  # a path has one more point than steps
    at = np.flatnonzero(ends)
    move = move[at]
    places = program.points_mm[np.where(program.what[move] > WIPE, at, at - 1)]
    poses = [start, *(mark.pose for mark in program.marks if isinstance(mark, Reorient))]
    angles = np.array([(pose.tilt_deg, pose.turn_deg) for pose in poses])
    turns = program.what == REORIENT
    after = np.cumsum(turns)[move]
    sums = _sums(program.filament_mm[at], np.bincount(move, minlength=len(program)))
    return (
        np.column_stack([places, angles[after - turns[move]], sums[:-1]]),
        np.column_stack([program.points_mm[at], angles[after], sums[1:]]),
        move,
    )


@kernel
def _sums(pushed_mm: Floats, counts: Indices) -> Floats:
    """(n + 1,) filament before each row and after the last one, summed move by move."""
    sums = floats(len(pushed_mm) + 1, 0.0)
    row = 0
    for count in counts:
        before, within = sums[row], 0.0
        for _ in range(count):
            within += pushed_mm[row]
            row += 1
            sums[row] = before + within
    return sums


@no_nrt
def add_point(out: Moves, done: Indices, x: float, y: float, z: float, pushed_mm: float) -> None:
    """Write the next point. done (2,): numbers of points and rows written."""
    out.ways[done[0], 0], out.ways[done[0], 1], out.ways[done[0], 2], out.ways[done[0], 3] = x, y, z, pushed_mm
    done[0] += 1


@no_nrt
def add_row(out: Moves, done: Indices, what: int, points: int, speed: float, acceleration_mm_s2: float) -> None:
    """Write the next row, a move of the last points, without width or fan."""
    row = out.rows[done[1]]
    row[0], row[1], row[2], row[3], row[4], row[5] = what, points, speed, np.nan, np.nan, acceleration_mm_s2
    done[1] += 1
