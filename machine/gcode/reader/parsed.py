"""Parsed program: moves, events and comments of a G-code text as arrays with one row per move."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from enum import IntEnum
from functools import cached_property
from itertools import pairwise
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from machine.firmware import dialect_of
from machine.gcode.settings import PartTotals
from mdp.kernels.kernel import kernel
from mdp.mesh import Floats, Indices
from mdp.pose import Pose
from profiles.machine import Machine
from slicer.paths import Unsupported

AT_ONCE = 8_192  # rows
Indices32 = NDArray[np.int32]
OWN = "macro"  # code of an Event for a macro defined by the machine, whose name is in letters


class MoveKind(IntEnum):
    """Kind of a straight move; RETRACT: filament alone, either way; ROTATE: the table turns."""

    TRAVEL = 0
    EXTRUDE = 1
    RETRACT = 2
    ROTATE = 3


@dataclass(frozen=True)
class Event:
    """A command that is not a move: code as written ("M104"), its S (or P) value, its letters; before row `row`."""

    line: int
    code: str
    value: float
    letters: str
    row: int


class Remarks(NamedTuple):
    """State of the following rows set by comments and M204, (k,) each: part, layer, type, width and height of a bead,
    acceleration in mm/s², inf for the axes' limits."""

    part: Indices32
    layer: Indices32
    type: Indices32
    width_mm: Floats
    height_mm: Floats
    acceleration: Floats


@dataclass(frozen=True, eq=False)
class ParsedProgram:
    """A G-code text as arrays with one row per move (n rows).

    line: number in the text, from 1. start, end: (n, 5) X Y Z tilt turn, absolute, mm and deg; start differs from the end of the
    row before after G28 or G92. e_mm: filament pushed by the move. feed: F in units per minute. remark: index of the row's
    remark. types: the ;TYPE: names. layers: number of layer changes. parts: their numbers in order. replaced: line number and
    command of every text with characters that a serial line does not carry. announced: number of parts announced by `;PART:1 of
    3`, 0 without such a comment; part_totals: from ;CONTENTS: comments; unsupported: line, part and area of each ;UNSUPPORTED:
    comment, with layer 0 and an empty reason if not given.
    """

    line: Indices32
    start: Floats
    end: Floats
    e_mm: Floats
    feed: Floats
    kind: NDArray[np.int8]
    remark: Indices32
    remarks: Remarks
    types: tuple[str, ...]
    events: tuple[Event, ...]
    ignored: dict[str, tuple[int, int]]
    replaced: tuple[tuple[int, str], ...]
    layers: int
    parts: tuple[int, ...]
    unsupported: tuple[tuple[int, int, Unsupported], ...]
    announced: int
    part_totals: tuple[PartTotals, ...]

    @property
    def part(self) -> Indices32:
        """(n,) from ;PART: comments, 0 before the first."""
        return self.remarks.part[self.remark]

    @property
    def layer(self) -> Indices32:
        """(n,) from ;LAYER_CHANGE comments, counted in each part, 0 before the first."""
        return self.remarks.layer[self.remark]

    def part_and_layer(self, row: int) -> tuple[int, int]:
        """Part and layer of one row."""
        remark = self.remark[row]
        return int(self.remarks.part[remark]), int(self.remarks.layer[remark])

    @property
    def type(self) -> Indices32:
        """(n,) index into types."""
        return self.remarks.type[self.remark]

    @property
    def width_mm(self) -> Floats:
        """(n,) from ;WIDTH:, 0 without one."""
        return self.remarks.width_mm[self.remark]

    @property
    def height_mm(self) -> Floats:
        """(n,) from ;HEIGHT:, 0 without one."""
        return self.remarks.height_mm[self.remark]

    @property
    def filament_mm(self) -> Floats:
        """(n,) running sum of e_mm."""
        pushed: Floats = np.cumsum(self.e_mm)
        return pushed

    @cached_property
    def bounds(self) -> Floats:
        """(2, 5) least and greatest position of each axis at the ends of moves; infinite without moves."""
        return np.transpose([(axis.min(initial=np.inf), axis.max(initial=-np.inf)) for axis in self.end.T])

    def ways_mm(self, rows: Indices | slice = slice(None)) -> Floats:
        """(m,) path lengths in X Y Z of some moves."""
        return _ways(self.start[rows], self.end[rows])

    def changes(self, rows: Indices | slice = slice(None)) -> Floats:
        """(m, 6) changes of X Y Z tilt turn E in some rows."""
        return np.column_stack([self.end[rows] - self.start[rows], self.e_mm[rows]])

    def turned_between(self, rows: NDArray[np.int64]) -> NDArray[np.bool_]:
        """(m - 1,) whether the table's pose changes between neighbours among (m,) rows."""
        tilt_deg, turn_deg = self.end[rows, 3], self.end[rows, 4]
        turned: NDArray[np.bool_] = (tilt_deg[1:] != tilt_deg[:-1]) | (turn_deg[1:] != turn_deg[:-1])
        return turned

    def layer_keys(self, rows: NDArray[np.int64] | slice = slice(None)) -> NDArray[np.int64]:
        """(m,) number of the layer of each row, unique over all parts."""
        keys: NDArray[np.int64] = self._remark_keys[self.remark[rows]]
        return keys

    @property
    def layer_key_count(self) -> int:
        """Exclusive upper bound of the layer_keys."""
        return int(self._remark_keys.max(initial=-1)) + 1

    @cached_property
    def _remark_keys(self) -> NDArray[np.int64]:
        """(k,) layer_keys of the remarks."""
        layer = self.remarks.layer
        return self.remarks.part.astype(np.int64) * (int(layer.max(initial=0)) + 1) + layer

    def rows_of_types(self, *names: str) -> NDArray[np.bool_]:
        """(n,) mask of the rows with these ;TYPE: names."""
        marked: NDArray[np.bool_] = np.array([name in names for name in self.types], dtype=np.bool_)[self.remarks.type]
        return marked[self.remark]


@kernel
def _ways(start: Floats, end: Floats) -> Floats:
    ways_mm = np.empty(len(start))
    for k in range(len(start)):
        x, y, z = end[k, 0] - start[k, 0], end[k, 1] - start[k, 1], end[k, 2] - start[k, 2]
        ways_mm[k] = np.sqrt(x * x + y * y + z * z)
    return ways_mm


def pieces(count: int) -> Iterator[slice]:
    """Slices that cover `count` rows, at most AT_ONCE each, for work with temporaries far larger than its result."""
    return (slice(begin, min(begin + AT_ONCE, count)) for begin in range(0, count, AT_ONCE))


def pose_runs(program: ParsedProgram) -> Iterator[tuple[slice, Pose]]:
    """Rows from the first straight move after a turn of the table up to the next turn, with their pose."""
    turns, before = [np.zeros(1, dtype=np.int64)], program.start[:1, 3:]
    for some in pieces(len(program.line)):
        poses = np.concatenate([before, program.end[some, 3:]])
        turns.append(some.start + np.flatnonzero((poses[1:] != poses[:-1]).any(axis=1)))
        before = poses[-1:]
    for begin, end in pairwise([*np.concatenate(turns).tolist(), len(program.line)]):
        straight = program.kind[begin:end] != MoveKind.ROTATE
        if straight.any():
            yield slice(begin + int(straight.argmax()), end), Pose(*program.end[begin, 3:].tolist())


def temperatures(program: ParsedProgram, *codes: str) -> Floats:
    """(n,) target set by the last event with one of these codes before each row, deg C; 0 before the first."""
    return _levels(program, [(event, event.value) for event in program.events if event.code in codes])


def fan_shares(program: ParsedProgram, machine: Machine) -> Floats:
    """(n,) fan speed 0..1; M106 without a value means full, and 255 is full also for firmwares that accept 0 to 1."""
    dialect = dialect_of(machine)
    shares = []
    for event in program.events:
        if event.code == "M106":
            value = event.value if dialect.value_word in event.letters else dialect.fan_full
            shares.append((event, min(1.0, value / (dialect.fan_full if value <= dialect.fan_full else 255))))
        elif event.code == "M107":
            shares.append((event, 0.0))
    return _levels(program, shares)


def _levels(program: ParsedProgram, set_by: Sequence[tuple[Event, float]]) -> Floats:
    rows, values = [event.row for event, _ in set_by], [0.0, *(value for _, value in set_by)]
    return np.repeat(values, np.diff([0, *rows, len(program.line)]))
