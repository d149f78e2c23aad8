"""Limits: what every axis allows; a program outside is refused before any text is written, a speed is lowered to fit."""

import numpy as np

from machine.planning.moves import BeginLayer, BeginPart, MachineProgram, Rows
from mdp.kernels.arrays import floats
from mdp.kernels.kernel import kernel
from mdp.mesh import Floats, Indices
from profiles.errors import MoveError
from profiles.frozen import Limits
from profiles.machine import Machine

ROUNDING = 5e-4


def axis_limits(machine: Machine) -> dict[str, Limits]:
    """Least and greatest value of X, Y, Z and the two rotary letters, mm and deg, as limits and cables allow."""
    return {
        "X": machine.x.limits_mm,
        "Y": machine.y.limits_mm,
        "Z": machine.z.limits_mm,
        machine.tilt.letter: machine.tilt.reach_deg,
        machine.turn.letter: machine.turn.reach_deg,
    }


def check(program: MachineProgram, rows: Rows, machine: Machine) -> None:
    """Raise MoveError when an end of a straight move lies outside an axis's limits; the first one in print order is named."""
    limits = axis_limits(machine)
    least, most = (np.array([pair[k] for pair in limits.values()]) for k in (0, 1))
    outside = (rows.end[:, :5] < least - ROUNDING) | (rows.end[:, :5] > most + ROUNDING)
    if not outside.any():
        return
    row, axis = (int(k) for k in np.argwhere(outside)[0])
    letter = list(limits)[axis]
    worst = rows.end[row, axis]
    unit = "mm" if axis < 3 else "deg"
    raise MoveError(
        f"{location(program, int(rows.move[row]))}: {letter} would go to {worst:.3f} {unit}, "
        f"allowed is {least[axis]:g} to {most[axis]:g} {unit} on {machine.name}"
    )


def location(program: MachineProgram, index: int) -> str:
    """Where a move stands in the print: "part 2, layer 14", or how it gets there."""
    before = program.marks[: int(np.searchsorted(program.mark_rows, index, side="right"))]
    part = next((mark for mark in reversed(before) if isinstance(mark, BeginPart)), None)
    layer = next((mark for mark in reversed(before) if isinstance(mark, BeginLayer)), None)
    if part is None:
        return "before the first part"
    if layer is None or layer.part != part.index:
        return f"part {part.index}, before its first layer"
    return f"part {part.index}, layer {layer.index}"


def travel_speeds(points_mm: Floats, starts: Indices, speeds_mm_s: Floats, machine: Machine) -> Floats:
    """(k,) speeds lowered to what X, Y and Z allow along paths one after the other; points_mm: (n, 3); starts: (k + 1,)."""
    most = np.array([machine.x.speed_mm_s, machine.y.speed_mm_s, machine.z.speed_mm_s])
    lowered: Floats = np.minimum(speeds_mm_s, np.where(speeds_mm_s <= most.min(), np.inf, _fastest(points_mm, starts, most)))
    return lowered


def travel_speed(points_mm: Floats, speed_mm_s: float, machine: Machine) -> float:
    """The speed along (n, 3) machine points lowered to what X, Y and Z allow."""
    if speed_mm_s <= min(machine.x.speed_mm_s, machine.y.speed_mm_s, machine.z.speed_mm_s):
        return speed_mm_s
    return float(travel_speeds(points_mm, np.array([0, len(points_mm)]), np.array([speed_mm_s]), machine)[0])


@kernel
def _fastest(points_mm: Floats, starts: Indices, most_mm_s: Floats) -> Floats:
    """(k,) the greatest speed along each path at which no axis is faster than its most."""
    out: Floats = floats(len(starts) - 1, np.inf)
    for path in range(len(out)):
        for k in range(starts[path], starts[path + 1] - 1):
            squared = 0.0
            for axis in range(3):
                squared += (points_mm[k + 1, axis] - points_mm[k, axis]) ** 2
            length = np.sqrt(squared)
            for axis in range(3):
                step = abs(points_mm[k + 1, axis] - points_mm[k, axis])
                if length > 1e-9 and step > 0.0:
                    out[path] = min(out[path], most_mm_s[axis] / (step / length))
    return out


def turn_speed(tilt_deg: float, turn_deg: float, machine: Machine) -> float:
    """deg/s along a turn of both rotary axes at once (sqrt of the sum of squares), the slower axis at its greatest speed."""
    seconds = max(abs(tilt_deg) / machine.tilt.speed_deg_s, abs(turn_deg) / machine.turn.speed_deg_s)
    if seconds == 0.0:
        return min(machine.tilt.speed_deg_s, machine.turn.speed_deg_s)
    return float(np.hypot(tilt_deg, turn_deg)) / seconds
