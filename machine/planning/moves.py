"""Moves: the machine program between the slicer and the G-code text, in machine coordinates, and its straight moves as arrays."""

from dataclasses import dataclass
from math import inf

import numpy as np
from numpy.typing import NDArray

from mdp.kernels.arrays import floats
from mdp.kernels.kernel import kernel
from mdp.mesh import Floats, Indices
from mdp.pose import Pose
from slicer.paths import Kind, Unsupported


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


Move = BeginPart | BeginLayer | Pause | Stroke | Travel | Wipe | Retract | Reorient


@dataclass(frozen=True, eq=False)
class MachineProgram:
    """All moves of a print in order, and the model's name for the file's head."""

    name: str
    moves: tuple[Move, ...]


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
    ways: list[Floats] = []
    pushed: list[Floats] = []
    speeds: list[float] = []
    indices: list[int] = []
    accelerations: list[float] = []
    tables = [(tilt_deg, turn_deg)]  # before each move, and after the last one
    tip = np.zeros(3)
    for index, move in enumerate(program.moves):
        table, acceleration = tables[-1], None
        if isinstance(move, Stroke):
            way, filament, acceleration = move.points_mm, move.filament_mm, move.acceleration_mm_s2
        elif isinstance(move, Travel):
            way, filament, acceleration = move.points_mm, np.zeros(len(move.points_mm) - 1), move.acceleration_mm_s2
        elif isinstance(move, Wipe):
            way, filament = move.points_mm, -move.filament_mm
        elif isinstance(move, Retract):
            way, filament = np.array([tip, tip]), np.array([-move.filament_mm])
        elif isinstance(move, Reorient):
            way, filament, table = np.array([tip, tip]), np.zeros(1), (move.pose.tilt_deg, move.pose.turn_deg)
        else:
            continue
        tip = way[-1]
        ways.append(way)
        pushed.append(filament)
        speeds.append(move.speed_deg_s if isinstance(move, Reorient) else move.speed_mm_s)
        indices.append(index)
        accelerations.append(inf if acceleration is None else acceleration)
        tables.append(table)
    if not ways:
        return Rows(np.zeros((0, 6)), np.zeros((0, 6)), np.zeros(0), np.zeros(0, dtype=np.int64), np.zeros(0))
    counts = np.array([len(filament) for filament in pushed])
    places, angles = np.concatenate(ways), np.array(tables)
    first = np.arange(counts.sum()) + np.repeat(np.arange(len(counts)), counts)  # a way has a point more than rows
    sums = _sums(np.concatenate(pushed), counts)
    return Rows(
        np.column_stack([places[first], np.repeat(angles[:-1], counts, axis=0), sums[:-1]]),
        np.column_stack([places[first + 1], np.repeat(angles[1:], counts, axis=0), sums[1:]]),
        np.repeat(speeds, counts),
        np.repeat(np.array(indices, dtype=np.int64), counts),
        np.repeat(accelerations, counts),
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
