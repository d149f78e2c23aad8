"""The record of a simulated print: every executed move, what the heaters did, and the plastic laid on the workpiece."""

from __future__ import annotations

from array import array
from dataclasses import dataclass
from math import pi

import numpy as np

from machine.kinematics.table import workpiece_path
from machine.link.motion import ROW
from mdp.mesh import Floats
from profiles.machine import Machine

EXTRUDES_MM = 1e-9  # differences of running filament totals below this are rounding


@dataclass(frozen=True, eq=False)
class Record:
    """n executed moves in order; homing is an event, no move.

    start, end: (n, 6) machine X Y Z mm, tilt turn deg, filament mm (running total); feed (n,) mm/s as programmed;
    begin_s, duration_s (n,) of the virtual clock; events (virtual s, what); targets and fan at the end; clamped: coordinates
    outside the soft limits; unknown: commands not understood; lost_bytes: what a full receive ring dropped.
    """

    machine: Machine
    start: Floats
    end: Floats
    feed_mm_s: Floats
    begin_s: Floats
    duration_s: Floats
    events: tuple[tuple[float, str], ...]
    nozzle_target_c: float
    bed_target_c: float
    fan: float
    clamped: int
    unknown: int
    lines: int
    lost_bytes: int

    def happened(self, what: str) -> bool:
        """Whether an event that begins so is on record."""
        return any(text.startswith(what) for _, text in self.events)

    def deposited(self, filament_diameter_mm: float = 1.75) -> tuple[Floats, Floats]:
        """Strokes: (n, 2, 3) segments in the workpiece frame and (n,) volumes mm3, of moves that push filament while moving."""
        pushed = self.end[:, 5] - self.start[:, 5]
        strokes = (pushed > EXTRUDES_MM) & (self.start[:, :5] != self.end[:, :5]).any(axis=1)
        begin, end = (workpiece_path(self.machine, points[strokes, :5]) for points in (self.start, self.end))
        volumes: Floats = pi / 4.0 * filament_diameter_mm**2 * pushed[strokes]
        return np.stack([begin, end], axis=1), volumes


def moves_of(rows: array[float]) -> tuple[Floats, Floats, Floats, Floats, Floats]:
    """Start, end, feed, begin and duration of the rows that Motion wrote."""
    table = np.array(rows, dtype=np.float64).reshape(-1, ROW)
    return table[:, :6], table[:, 6:12], table[:, 12], table[:, 13], table[:, 14]
