"""Moves: the machine program between the slicer and the G-code text, in machine coordinates, and its straight moves as arrays."""

from collections.abc import Iterable
from dataclasses import dataclass
from math import inf

import numpy as np
from numpy.typing import NDArray

from mdp.kernels.arrays import floats
from mdp.kernels.kernel import kernel
from mdp.mesh import Floats, Indices
from mdp.overhang import Mask
from mdp.pose import Pose
from slicer.paths import KINDS, NUMBER, Kind, Unsupported


@dataclass(frozen=True)
class BeginPart:
    """The moves after this print part `index` at `pose`; turn and tilt have been reached by a Reorient.

    unsupported: the places of it that no support could be given.
    """

    index: int
    pose: Pose
    layers: int
    unsupported: tuple[Unsupported, ...] = ()


@dataclass(frozen=True)
class BeginLayer:
    """The strokes after this lie in one layer; z_mm is measured from the part's base plane, nozzle_add_c from the material's."""

    part: int
    index: int
    z_mm: float
    height_mm: float
    fan: float
    nozzle_add_c: float = 0.0


@dataclass(frozen=True, eq=False)
class Stroke:
    """Extruding: points_mm (n, 3) machine coordinates, the first is where the tip already stands; filament_mm (n - 1,).

    fan: 0..1 where it differs from the layer's. acceleration_mm_s2: where it differs from what the axes allow.
    """

    kind: Kind
    points_mm: Floats
    filament_mm: Floats
    speed_mm_s: float
    width_mm: float
    fan: float | None = None
    acceleration_mm_s2: float | None = None


@dataclass(frozen=True, eq=False)
class Travel:
    """Moving without extruding through points_mm (n, 3), machine coordinates, the first is where the tip stands."""

    points_mm: Floats
    speed_mm_s: float
    acceleration_mm_s2: float | None = None


@dataclass(frozen=True, eq=False)
class Wipe:
    """Moving over what was just printed while filament is pulled back: points_mm (n, 3), filament_mm (n - 1,) above 0."""

    points_mm: Floats
    filament_mm: Floats
    speed_mm_s: float


@dataclass(frozen=True)
class Retract:
    """Pull filament back (positive) or push it forward again (negative): a prime."""

    filament_mm: float
    speed_mm_s: float


@dataclass(frozen=True)
class Reorient:
    """Turn the table to `pose` at the slowest axis's pace; the tip stands still at a safe place."""

    pose: Pose
    speed_deg_s: float


@dataclass(frozen=True)
class Pause:
    """Wait for a person before a layer, counted from 1; change: who puts in another filament. The tip stands aside."""

    part: int
    layer: int
    change: bool


Mark = BeginPart | BeginLayer | Pause | Reorient
Move = Mark | Stroke | Travel | Wipe | Retract
TRAVEL, WIPE, RETRACT, REORIENT, MARK = range(len(KINDS), len(KINDS) + 5)  # behind the numbers of strokes, those of KINDS


@dataclass(frozen=True, eq=False)
class MachineProgram:
    """All moves of a print in order, one row each, and the model's name for the file's head.

    points_mm: (n, 3) machine coordinates; starts: (m + 1,) where the points of each move begin; filament_mm: (n,) pushed on the
    way to each point, 0 at the first one of a path. A retraction and a turn of the table have one point, where the tip stands;
    other marks have none. Columns, (m,) each: what: index in KINDS of a stroke, else one of TRAVEL ... MARK; speed: mm/s, deg/s
    of turns; width_mm, fan: NaN where a move has none; acceleration_mm_s2: inf where the axes decide. marks: the values of the
    rows that are turns and marks, in order.
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
    def of(cls, name: str, moves: Iterable[Move]) -> "MachineProgram":
        """The table of moves."""
        points: list[Floats] = [np.zeros((0, 3))]
        filament: list[Floats] = [np.zeros(0)]
        counts: list[int] = []
        rows: list[tuple[int, float, float | None, float | None, float | None]] = []
        marks: list[Mark] = []
        tip, still = np.zeros((1, 3)), np.zeros(1)
        for move in moves:
            pushed: tuple[Floats, ...]
            if isinstance(move, Stroke):
                way, pushed = move.points_mm, (still, move.filament_mm)
                rows.append((NUMBER[move.kind], move.speed_mm_s, move.width_mm, move.fan, move.acceleration_mm_s2))
            elif isinstance(move, Travel):
                way, pushed = move.points_mm, (np.zeros(len(move.points_mm)),)
                rows.append((TRAVEL, move.speed_mm_s, None, None, move.acceleration_mm_s2))
            elif isinstance(move, Wipe):
                way, pushed = move.points_mm, (still, -move.filament_mm)
                rows.append((WIPE, move.speed_mm_s, None, None, None))
            elif isinstance(move, Retract):
                way, pushed = tip, (np.array([-move.filament_mm]),)
                rows.append((RETRACT, move.speed_mm_s, None, None, None))
            elif isinstance(move, Reorient):
                way, pushed = tip, (still,)
                rows.append((REORIENT, move.speed_deg_s, None, None, None))
                marks.append(move)
            else:
                way, pushed = tip[:0], ()
                rows.append((MARK, 0.0, None, None, None))
                marks.append(move)
            points.append(way)
            filament.extend(pushed)
            counts.append(len(way))
            tip = way[-1:] if len(way) else tip
        what, speed, width_mm, fan, acceleration = zip(*rows, strict=True) if rows else ((),) * 5
        return cls(
            name=name,
            points_mm=np.concatenate(points),
            starts=np.cumsum([0, *counts]),
            filament_mm=np.concatenate(filament),
            what=np.array(what, dtype=np.int8),
            speed=np.array(speed, dtype=np.float64),
            width_mm=np.array(width_mm, dtype=np.float64),
            fan=np.array(fan, dtype=np.float64),
            acceleration_mm_s2=np.array([inf if value is None else value for value in acceleration]),
            marks=tuple(marks),
        )

    def __len__(self) -> int:
        return len(self.what)

    @property
    def is_stroke(self) -> Mask:
        """(m,) which moves are strokes."""
        return self.what < len(KINDS)

    @property
    def mark_rows(self) -> Indices:
        """Where the marks stand among the moves."""
        return np.flatnonzero(self.what >= REORIENT)


@dataclass(frozen=True, eq=False)
class Rows:
    """start, end: (n, 6) X Y Z tilt turn E of each straight move (mm, deg, mm); speed: (n,) mm/s, deg/s for pure turns.

    move: (n,) the row of the program that it belongs to. acceleration: (n,) mm/s2, inf where the axes decide.
    """

    start: Floats
    end: Floats
    speed: Floats
    move: Indices
    acceleration: Floats


def rows(program: MachineProgram, tilt_deg: float, turn_deg: float) -> Rows:
    """All straight moves of a program that begins with the table at (tilt_deg, turn_deg)."""
    counts = np.diff(program.starts)
    move = np.repeat(np.arange(len(program)), counts)
    ends = np.ones(len(move), np.bool_)
    ends[program.starts[:-1][(counts > 0) & (program.what <= WIPE)]] = False  # a path has one more point than it has steps
    at = np.flatnonzero(ends)
    stands = program.what[move[at]] > WIPE
    places = program.points_mm[np.where(stands, at, at - 1)]
    angles = [
        (tilt_deg, turn_deg),
        *((mark.pose.tilt_deg, mark.pose.turn_deg) for mark in program.marks if isinstance(mark, Reorient)),
    ]
    turns = np.cumsum(program.what == REORIENT)[move[at]]
    before = turns - (program.what[move[at]] == REORIENT)
    table = np.array(angles)
    sums = _sums(program.filament_mm[at], np.bincount(move[at], minlength=len(program)))
    return Rows(
        np.column_stack([places, table[before], sums[:-1]]),
        np.column_stack([program.points_mm[at], table[turns], sums[1:]]),
        program.speed[move[at]],
        move[at],
        program.acceleration_mm_s2[move[at]],
    )


@kernel
def _sums(pushed_mm: Floats, counts: Indices) -> Floats:
    """(n + 1,) filament before each row and after the last one, added up move by move."""
    sums = floats(len(pushed_mm) + 1, 0.0)
    row = 0
    for count in counts:
        before, within = sums[row], 0.0
        for _ in range(count):
            within += pushed_mm[row]
            row += 1
            sums[row] = before + within
    return sums
