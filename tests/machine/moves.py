"""Reading and writing the moves of a program one by one."""

from collections.abc import Iterable, Iterator
from dataclasses import dataclass

import numpy as np

from machine.planning.moves import MARK, REORIENT, RETRACT, TRAVEL, WIPE, MachineProgram, Mark, Moves, Reorient
from mdp.mesh import Floats
from slicer.paths import KINDS, NUMBER, Kind


@dataclass(frozen=True, eq=False)
class Stroke:
    """Extruding along points_mm (n, 3), which begin at the tip's present position; filament_mm: (n - 1,)."""

    kind: Kind
    points_mm: Floats
    filament_mm: Floats
    speed_mm_s: float
    width_mm: float
    fan: float | None = None
    acceleration_mm_s2: float | None = None


@dataclass(frozen=True, eq=False)
class Travel:
    """Moving without extruding."""

    points_mm: Floats
    speed_mm_s: float
    acceleration_mm_s2: float | None = None


@dataclass(frozen=True, eq=False)
class Wipe:
    """Moving while filament is retracted: filament_mm (n - 1,) above 0."""

    points_mm: Floats
    filament_mm: Floats
    speed_mm_s: float


@dataclass(frozen=True)
class Retract:
    """Filament retracted (positive) or pushed forward again (negative) at standstill."""

    filament_mm: float
    speed_mm_s: float


Move = Mark | Stroke | Travel | Wipe | Retract


def program_of(name: str, moves: Iterable[Move]) -> MachineProgram:
    """The table of moves."""
    pieces: list[Moves] = []
    marks: list[Mark] = []
    tip = np.zeros(3)
    for move in moves:
        way, pushed, row = np.zeros((0, 3)), np.zeros(0), [float(MARK), 0.0, 0.0, np.nan, np.nan, np.inf]
        if isinstance(move, Stroke | Travel | Wipe):
            way, row[2] = move.points_mm, move.speed_mm_s
            pushed = np.zeros(len(way))
        if isinstance(move, Stroke):
            pushed[1:] = move.filament_mm
            row[0], row[3] = NUMBER[move.kind], move.width_mm
            row[4] = np.nan if move.fan is None else move.fan
        elif isinstance(move, Travel):
            row[0] = TRAVEL
        elif isinstance(move, Wipe):
            pushed[1:] = -move.filament_mm
            row[0] = WIPE
        elif isinstance(move, Retract):
            way, pushed = tip[None], np.array([-move.filament_mm])
            row[0], row[2] = RETRACT, move.speed_mm_s
        elif isinstance(move, Reorient):
            way, pushed = tip[None], np.zeros(1)
            row[0], row[2] = REORIENT, move.speed_deg_s
        if isinstance(move, Stroke | Travel) and move.acceleration_mm_s2 is not None:
            row[5] = move.acceleration_mm_s2
        if row[0] in (MARK, REORIENT):
            marks.append(move)  # type: ignore[arg-type]
        row[1] = len(way)
        pieces.append(Moves(np.column_stack([way, pushed]), np.array([row])))
        tip = way[-1] if len(way) else tip
    return MachineProgram.of(name, pieces, marks)


def moves_of(program: MachineProgram) -> tuple[Move, ...]:
    """The rows of a program one by one."""
    return tuple(_each(program))


def _each(program: MachineProgram) -> Iterator[Move]:
    marks = iter(program.marks)
    for k, what in enumerate(program.what.tolist()):
        points, speed = program.points_mm[program.starts[k] : program.starts[k + 1]], float(program.speed[k])
        filament_mm = program.filament_mm[program.starts[k] + 1 : program.starts[k + 1]]
        acceleration = None if np.isinf(program.acceleration_mm_s2[k]) else float(program.acceleration_mm_s2[k])
        if what < len(KINDS):
            fan = None if np.isnan(program.fan[k]) else float(program.fan[k])
            yield Stroke(KINDS[what], points, filament_mm, speed, float(program.width_mm[k]), fan, acceleration)
        elif what == TRAVEL:
            yield Travel(points, speed, acceleration)
        elif what == WIPE:
            yield Wipe(points, -filament_mm, speed)
        elif what == RETRACT:
            yield Retract(-float(program.filament_mm[program.starts[k]]), speed)
        else:
            yield next(marks)
