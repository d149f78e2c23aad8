"""Rows: a machine program as one array row per straight move, for the checks and the clock."""

from dataclasses import dataclass
from math import inf

import numpy as np
from numpy.typing import NDArray

from machine.moves import MachineProgram, Move, Reorient, Retract, Stroke, Travel, Wipe
from mdp.mesh import Floats


@dataclass(frozen=True, eq=False)
class Rows:
    """start, end: (n, 6) X Y Z tilt turn E of each straight move (mm, deg, mm); speed: (n,) mm/s, deg/s for pure turns.

    move: (n,) place in program.moves of the Move a row belongs to. acceleration: (n,) mm/s2, inf where the axes decide.
    """

    start: Floats
    end: Floats
    speed: Floats
    move: NDArray[np.int64]
    acceleration: Floats


def rows(program: MachineProgram, tilt_deg: float, turn_deg: float) -> Rows:
    """All straight moves of a program that begins with the table at (tilt_deg, turn_deg)."""
    blocks: list[Floats] = []
    speeds: list[float] = []
    places: list[int] = []
    accelerations: list[float] = []
    at = np.array([0.0, 0.0, 0.0, tilt_deg, turn_deg])
    filament = 0.0
    for place, move in enumerate(program.moves):
        if isinstance(move, Stroke | Travel | Wipe):
            block = np.empty((len(move.points_mm), 6))
            block[:, :3], block[:, 3:5], block[:, 5] = move.points_mm, at[3:], filament
            if not isinstance(move, Travel):
                block[1:, 5] += np.cumsum(move.filament_mm if isinstance(move, Stroke) else -move.filament_mm)
                filament = float(block[-1, 5])
            at[:3] = move.points_mm[-1]
            speed = move.speed_mm_s
        elif isinstance(move, Retract):
            block = np.array([[*at, filament], [*at, filament - move.filament_mm]])
            filament -= move.filament_mm
            speed = move.speed_mm_s
        elif isinstance(move, Reorient):
            before = [*at, filament]
            at[3:] = move.pose.tilt_deg, move.pose.turn_deg
            block = np.array([before, [*at, filament]])
            speed = move.speed_deg_s
        else:
            continue
        blocks.append(block)
        speeds.append(speed)
        places.append(place)
        accelerations.append(_acceleration(move))
    if not blocks:
        return Rows(np.zeros((0, 6)), np.zeros((0, 6)), np.zeros(0), np.zeros(0, dtype=np.int64), np.zeros(0))
    counts = [len(block) - 1 for block in blocks]
    return Rows(
        np.concatenate([block[:-1] for block in blocks]),
        np.concatenate([block[1:] for block in blocks]),
        np.repeat(speeds, counts),
        np.repeat(np.array(places, dtype=np.int64), counts),
        np.repeat(accelerations, counts),
    )


def _acceleration(move: Move) -> float:
    told = move.acceleration_mm_s2 if isinstance(move, Stroke | Travel) else None
    return inf if told is None else told
