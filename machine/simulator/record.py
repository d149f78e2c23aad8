"""Record of a simulated print: every executed move, the heaters' events, and the plastic on the workpiece."""

from __future__ import annotations

from copy import deepcopy
from dataclasses import dataclass
from math import pi

import numpy as np

from machine.kinematics.table import workpiece_path
from machine.simulator.board import Board
from machine.simulator.planner import EXTRUDES_MM, ROW
from mdp.mesh import Floats
from profiles.machine import Machine


@dataclass(frozen=True, eq=False)
class Record:
    """Record of n executed moves in order, including those still planned; homing is an event, not a move."""

    machine: Machine
    start: Floats  # (n, 6) machine X Y Z mm, tilt turn deg, filament mm (running total)
    end: Floats  # (n, 6)
    feed_mm_s: Floats  # (n,) as programmed
    begin_s: Floats  # (n,) of the virtual clock
    duration_s: Floats  # (n,)
    first: int  # number of earlier moves that were not kept
    moves: int  # number of all moves,
    strokes: int  # number of all strokes,
    pushed_mm: float  # filament of the strokes,
    moving_s: float  # time of all moves
    events: tuple[tuple[float, str], ...]  # (virtual s, what)
    troubles: tuple[tuple[float, str], ...]  # events that no program causes
    nozzle_target_c: float  # at the end
    bed_target_c: float
    fan: float
    clamped: int  # coordinates outside the soft limits
    unknown: int  # unknown commands
    lines: int
    lost_bytes: int  # dropped by a full receive ring
    underruns: int  # how often the planner ran dry in mid-motion
    slowed: int  # moves slowed down because the host sent too few

    def deposited(self, filament_diameter_mm: float = 1.75) -> tuple[Floats, Floats]:
        """Strokes: (n, 2, 3) segments in the workpiece frame and (n,) volumes, mm³, of moves that push filament while moving."""
        pushed = self.end[:, 5] - self.start[:, 5]
        strokes = (pushed > EXTRUDES_MM) & (self.start[:, :5] != self.end[:, :5]).any(axis=1)
        begin, end = (workpiece_path(self.machine, points[strokes, :5]) for points in (self.start, self.end))
        volumes: Floats = pi / 4.0 * filament_diameter_mm**2 * pushed[strokes]
        return np.stack([begin, end], axis=1), volumes


def record_of(board: Board, lines: int, lost_bytes: int) -> Record:
    """The present record of a printer's board."""
    planner, moves = board.motion.planner, deepcopy(board.motion.executed)
    for block in planner.ahead():
        moves.add(block)
    table = np.array(moves.rows, dtype=np.float64).reshape(-1, ROW)
    return Record(
        machine=board.machine,
        start=table[:, :6],
        end=table[:, 6:12],
        feed_mm_s=table[:, 12],
        begin_s=table[:, 13],
        duration_s=table[:, 14],
        first=moves.moves - len(table),
        moves=moves.moves,
        strokes=moves.strokes,
        pushed_mm=moves.pushed_mm,
        moving_s=moves.moving_s,
        events=tuple(board.events),
        troubles=tuple(board.troubles),
        nozzle_target_c=board.nozzle.target_c,
        bed_target_c=board.bed.target_c,
        fan=board.fan,
        clamped=board.motion.clamped,
        unknown=board.unknown,
        lines=lines,
        lost_bytes=lost_bytes,
        underruns=planner.underruns,
        slowed=planner.slowed,
    )
