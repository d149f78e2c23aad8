"""Limits: what every axis allows; a program outside is refused before any text is written, speeds are lowered to fit."""

from math import pi

import numpy as np

from machine.planning.moves import REORIENT, RICHER, BeginLayer, BeginPart, MachineProgram, Reorient
from mdp.kernels.arrays import floats
from mdp.kernels.kernel import kernel, no_nrt
from mdp.mesh import Floats, Indices
from profiles.errors import MoveError
from profiles.frozen import Limits
from profiles.machine import Machine, Table
from profiles.profile import Profile
from slicer.estimate.timing import along

ROUNDING = 5e-4


def axis_limits(machine: Machine) -> dict[str, Limits]:
    """Least and greatest value of X, Y, Z and the two rotary letters, mm and deg, by limits and cables."""
    return {
        "X": machine.x.limits_mm,
        "Y": machine.y.limits_mm,
        "Z": machine.z.limits_mm,
        machine.tilt.letter: machine.tilt.reach_deg,
        machine.turn.letter: machine.turn.reach_deg,
    }


def check(program: MachineProgram, machine: Machine) -> None:
    """Raise MoveError when a point or a turn exceeds an axis's limits, naming the first one in print order."""
    limits = axis_limits(machine)
    least, most = np.array(list(limits.values())).T
    reached = np.full((len(program.points_mm), 5), np.nan)
    reached[:, :3] = program.points_mm
    poses = [(mark.pose.tilt_deg, mark.pose.turn_deg) for mark in program.marks if isinstance(mark, Reorient)]
    reached[program.starts[:-1][program.what == REORIENT], 3:] = np.array(poses).reshape(-1, 2)
    outside = (reached < least - ROUNDING) | (reached > most + ROUNDING)
    if not outside.any():
        return
    point, axis = (int(k) for k in np.argwhere(outside)[0])
    unit = "mm" if axis < 3 else "deg"
    raise MoveError(
        f"{location(program, int(np.searchsorted(program.starts, point, side='right')) - 1)}: {list(limits)[axis]} would go to "
        f"{reached[point, axis]:.3f} {unit}, allowed is {least[axis]:g} to {most[axis]:g} {unit} on {machine.name}"
    )


def location(program: MachineProgram, index: int) -> str:
    """Location of a move in the print: "part 2, layer 14", or between these."""
    before = program.marks[: int(np.searchsorted(program.mark_rows, index, side="right"))]
    part = next((mark for mark in reversed(before) if isinstance(mark, BeginPart)), None)
    layer = next((mark for mark in reversed(before) if isinstance(mark, BeginLayer)), None)
    if part is None:
        return "before the first part"
    if layer is None or layer.part != part.index:
        return f"part {part.index}, before its first layer"
    return f"part {part.index}, layer {layer.index}"


def wipe_filament_mm_s(machine: Machine) -> float:
    """Greatest planned filament speed of a wipe, mm/s: rounding in the text may raise it a little."""
    return machine.extruder_speed_mm_s / RICHER


def stroke_filament_mm_s(profile: Profile) -> float:
    """Greatest planned filament speed of a stroke, mm/s: as for a wipe, and within the hot end's limit."""
    filament_mm2 = 0.25 * pi * profile.material.diameter_mm**2
    return min(profile.material.volumetric_limit_mm3_s / filament_mm2, wipe_filament_mm_s(profile.machine))


@kernel
def path_speeds(points_mm: Floats, starts: Indices, speeds_mm_s: Floats, axes_mm_s: Floats) -> Floats:
    """(k,) speeds lowered to the limits of X, Y and Z along consecutive paths; points_mm: (n, 3 or more); starts: (k + 1,)."""
    lowered: Floats = floats(len(speeds_mm_s), 0.0)
    for k in range(len(lowered)):
        lowered[k] = path_speed(points_mm, starts[k], starts[k + 1], speeds_mm_s[k], axes_mm_s)
    return lowered


@no_nrt
def path_speed(points_mm: Floats, first: int, end: int, speed_mm_s: float, axes_mm_s: Floats) -> float:
    """The speed lowered to the limits of X, Y and Z along points first to end."""
    for k in range(first + 1, end):
        squared = 0.0
        for axis in range(3):
            squared += (points_mm[k, axis] - points_mm[k - 1, axis]) ** 2
        for axis in range(3):
            step = points_mm[k, axis] - points_mm[k - 1, axis]
            speed_mm_s = min(speed_mm_s, along(axes_mm_s[axis], step, np.sqrt(squared)))
    return speed_mm_s


def over_edge_mm(points_mm: Floats, table: Table) -> tuple[Floats, str]:
    """(...) distance of places (..., 2) beyond the plate's edge, below 0 on the plate; and the edge in words."""
    if table.size_mm is None:
        over: Floats = np.hypot(points_mm[..., 0], points_mm[..., 1]) - table.radius_mm
        return over, f"{table.radius_mm:g} mm from its middle"
    x, y = table.size_mm
    over = (np.abs(points_mm) - 0.5 * np.array([x, y])).max(axis=-1)
    return over, f"it measures {x:g} x {y:g} mm"


def turn_speed(tilt_deg: float, turn_deg: float, machine: Machine) -> float:
    """Speed along a turn of both rotary axes, deg/s (root of the sum of squares), with the slower axis at its limit."""
    seconds = max(abs(tilt_deg) / machine.tilt.speed_deg_s, abs(turn_deg) / machine.turn.speed_deg_s)
    if seconds == 0.0:
        return min(machine.tilt.speed_deg_s, machine.turn.speed_deg_s)
    return float(np.hypot(tilt_deg, turn_deg)) / seconds
