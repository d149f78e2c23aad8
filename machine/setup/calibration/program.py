"""Touch program: poses at which a mark is touched, G-code that goes there and waits for readings, and keys that jog the tip."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from itertools import product
from math import pi

import numpy as np

from machine.firmware import dialect_of
from machine.gcode.blocks import check_blocks, cold_block, fill_block, placeholders
from machine.gcode.commands import COMMANDS, TOOL, command_in
from machine.gcode.pen import Pen, number, turn
from machine.gcode.writer import BLOCKS
from machine.kinematics.table import machine_points, workpiece_points
from machine.planning.limits import turn_speed
from mdp.clearance import find_obstacle, least_tip_height_mm
from mdp.head import corners
from mdp.pose import UP, Pose, level
from profiles.errors import MoveError
from profiles.machine import Box, Machine
from profiles.profile import Profile

TURNS_DEG = (0.0, 90.0, 180.0, 270.0)
TILTS_DEG = (60.0, 45.0, 30.0, 20.0, 15.0, 10.0)
MOST_MARK_RADIUS_MM = 45.0
MARGIN_MM = 10.0  # possible error of the profile's centres before a calibration
ABOVE_MM = 8.0
WAYS = {"a": (0, -1), "d": (0, 1), "s": (1, -1), "w": (1, 1), "f": (2, -1), "r": (2, 1)}  # axis and direction of a key
DOWN = "f"
STEPS_MM = {"1": 10.0, "2": 1.0, "3": 0.1, "4": 0.02}
BELOW_MM = 6.0  # below the expected mark: the lowest step, and the possible error of the head's clearance
NEAR_STEP_MM = 1.0  # downward, near the mark


@dataclass(frozen=True)
class TouchPlan:
    """Poses at which the mark is touched, its expected position at each, and the tip's height while the table turns."""

    poses: tuple[Pose, ...]
    expected_mm: tuple[tuple[float, float, float], ...]
    safe_z_mm: float
    mark_mm: tuple[float, float, float]


def plan_touches(machine: Machine, mark_height_mm: float, mark_radius_mm: float | None = None) -> TouchPlan:
    """Touches at four turns of the level table and of two tilts, as steep as head, limits and mark height allow.

    Raises MoveError when no tilt of 10 degrees or more is possible.
    """
    if not machine.tilts:
        raise MoveError(f"{machine.name} has three axes: there is no rotary axis to calibrate")
    mark = (usual_radius_mm(machine, mark_radius_mm), 0.0, mark_height_mm)
    tilts = _tilts(machine, mark)
    turns = turns_deg(machine)
    poses = tuple(Pose(tilt, value) for tilt in (machine.tilt.zero_deg, *tilts) for value in turns)
    expected = tuple(expected_mm(machine, pose, mark) for pose in poses)
    return TouchPlan(poses, expected, safe_z_mm(machine, mark, max(abs(t - machine.tilt.zero_deg) for t in tilts)), mark)


def usual_radius_mm(machine: Machine, asked_mm: float | None = None) -> float:
    """Distance of the mark from the centre: the requested one, or the usual. Raises MoveError for a mark off the plate."""
    least = machine.table.radius_mm if machine.table.size_mm is None else 0.5 * min(machine.table.size_mm)
    radius = asked_mm if asked_mm is not None else min(0.6 * least, MOST_MARK_RADIUS_MM)
    if not 5.0 <= radius <= least:
        raise MoveError(f"a mark {radius:g} mm from the middle cannot be used: 5 to {least:g} mm are allowed on {machine.name}")
    return radius


def calibration_lines(profile: Profile, touches: TouchPlan) -> Iterator[str]:
    """Lines of the program: cold homing as in the start block, every touch, then level again.

    Raises ProfileError, before the first line, for a block of the profile that the firmware refuses.
    """
    pen = calibration_pen(profile)
    machine = pen.machine
    yield f"; {machine.name}: calibration, {len(touches.poses)} touches of one mark, nozzle cold and clean"
    radius, _, height = touches.mark_mm
    yield f"; the mark is {height:g} mm high and stands {radius:g} mm from the middle, towards +X at turn 0"
    yield from cold_start(pen)
    dialect = pen.dialect
    up, across = 60.0 * machine.z.speed_mm_s, 60.0 * min(machine.x.speed_mm_s, machine.y.speed_mm_s, 100.0)
    for index, (pose, (x, y, z)) in enumerate(zip(touches.poses, touches.expected_mm, strict=True), start=1):
        name = f"{machine.tilt.letter}{number(pose.tilt_deg)} {machine.turn.letter}{number(pose.turn_deg)}"
        yield f"; touch {index}: {name}, expected near X{x:.1f} Y{y:.1f} Z{z:.1f}"
        yield f"G1 Z{touches.safe_z_mm:.3f} F{up:.0f}"
        yield from turn_lines(pose, pen)
        yield f"G1 X{x:.3f} Y{y:.3f} F{across:.0f}"
        yield f"G1 Z{hover_z_mm(machine, z, touches.safe_z_mm):.3f} F{up:.0f}"
        yield from (line.format(text=f"touch {index} {name} note X Y Z") for line in dialect.wait_for_person)
    yield f"G1 Z{touches.safe_z_mm:.3f} F{up:.0f}"
    yield from turn_lines(level(machine), pen)
    for word in dialect.before_end:
        yield from _fill(word, pen)
    if dialect.last:
        yield dialect.last


def calibration_pen(profile: Profile) -> Pen:
    """A pen for the axes' coordinates with a level table. Raises ProfileError for a block that the firmware refuses."""
    check_blocks(profile)
    machine = profile.machine.model_copy(update={"coordinates": "table"})
    pen = Pen(dialect_of(machine), machine, "", level(machine))
    pen.values = placeholders("calibration", profile, [], 0.0, 0.0)
    return pen


def cold_start(pen: Pen) -> Iterator[str]:
    """Homing of the start block without heat, and a program's modes; heating lines become comments. Raises MoveError when the
    machine is not homed without them."""
    dialect = pen.dialect
    lines, left_out = cold_block(_fill(pen.machine.gcode.start, pen), dialect)
    yield from (f"; left out because it may heat: {line}" for line in left_out)
    if any(command_in(line) is COMMANDS[TOOL] for line in lines):  # selecting a tool heats it to its active temperature
        yield dialect.nozzle.format(number(0.0))
    for word in dialect.before_start:
        yield from _fill(word, pen)
    yield from lines
    yield from (mode for mode in dialect.modes if mode not in ("M83", "M82"))
    for word in dialect.after_start:
        yield from _fill(word, pen)
    if dialect.follow_persists:
        yield dialect.follow_off


def turn_lines(pose: Pose, pen: Pen) -> Iterator[str]:
    """Lines that turn the table to a pose."""
    speed = turn_speed(pose.tilt_deg - pen.pose.tilt_deg, pose.turn_deg - pen.pose.turn_deg, pen.machine)
    yield from turn(pose, speed, pen)


def _fill(block: str, pen: Pen) -> list[str]:
    return fill_block(block, BLOCKS[0], pen.values, pen.dialect)


def unsure_signs(machine: Machine) -> tuple[str, ...]:
    """The rotary axes whose sign is uncalibrated."""
    return tuple(axis for axis in ("tilt", "turn") if f"machine.{axis}.sign" in machine.uncalibrated)


def hover_z_mm(machine: Machine, expected_z_mm: float, safe_z_mm: float) -> float:
    """Z above the expected mark; the safe height while a sign is unknown, for the mark may be on the other side."""
    return safe_z_mm if unsure_signs(machine) else min(safe_z_mm, expected_z_mm + ABOVE_MM)


def steepest_tilts(machine: Machine, is_possible: Callable[[float], bool]) -> list[float]:
    """The steepest possible tilts, deg: one to each side, or to one, or none."""
    angles = ([machine.tilt.zero_deg + side * tilt for tilt in TILTS_DEG] for side in (1.0, -1.0))
    steepest = (next(filter(is_possible, of_side), None) for of_side in angles)
    return [tilt for tilt in steepest if tilt is not None]


def _tilts(machine: Machine, mark: tuple[float, float, float]) -> tuple[float, float]:
    """The steepest tilts: one to each side if the limits allow, else two to one side. Raises MoveError."""
    tilts = steepest_tilts(machine, lambda tilt_deg: _reachable(machine, mark, tilt_deg))
    if not tilts:
        raise MoveError(
            f"no tilt of {TILTS_DEG[-1]:g} deg or more can be measured on {machine.name} with a mark {mark[2]:g} mm high: "
            "its head or its limits stand in the way; take a higher mark, nearer to the middle"
        )
    return tilts[0], tilts[1] if len(tilts) > 1 else 0.5 * (tilts[0] + machine.tilt.zero_deg)


def _reachable(machine: Machine, mark: tuple[float, float, float], tilt_deg: float) -> bool:
    """Whether the tip can touch the mark at a tilt at every turn: axes within limits, head above the plate, space to turn."""
    if not machine.tilt.reach_deg[0] <= tilt_deg <= machine.tilt.reach_deg[1]:
        return False
    if safe_z_mm(machine, mark, abs(tilt_deg - machine.tilt.zero_deg)) > machine.z.limits_mm[1]:
        return False
    if least_tip_height_mm(clipped_head(machine, mark), Pose(tilt_deg, machine.turn.zero_deg)) > mark[2]:
        return False
    limits = np.array([axis.limits_mm for axis in (machine.x, machine.y, machine.z)])
    places = np.array([expected_mm(machine, Pose(tilt_deg, value), mark) for value in turns_deg(machine)])
    return bool((places >= limits[:, 0]).all() and (places <= limits[:, 1]).all())


def clipped_head(machine: Machine, mark: tuple[float, float, float]) -> Machine:
    """The machine with the head's boxes clipped to the reach of the plate."""
    far = machine.table.radius_mm + mark[0] + MARGIN_MM
    boxes = []
    for box in machine.head.boxes:
        low = (max(box.min_mm[0], -far), max(box.min_mm[1], -far), box.min_mm[2])
        high = (min(box.max_mm[0], far), min(box.max_mm[1], far), box.max_mm[2])
        if low[0] < high[0] and low[1] < high[1]:
            boxes.append(Box(name=box.name, min_mm=low, max_mm=high))
    return machine.model_copy(update={"head": machine.head.model_copy(update={"boxes": boxes})})


def turns_deg(machine: Machine) -> list[float]:
    """The four turns within limits and cable reach, each as near to zero as possible."""
    least, most = machine.turn.reach_deg
    zero = machine.turn.zero_deg
    inside = [next((zero + v for v in (t, t - 360.0) if least <= zero + v <= most), None) for t in TURNS_DEG]
    return [value for value in inside if value is not None]


def expected_mm(machine: Machine, pose: Pose, mark: tuple[float, float, float]) -> tuple[float, float, float]:
    """X Y Z at which the tip touches a mark at a pose."""
    x, y, z = machine_points(machine, pose, np.array([mark]))[0].tolist()
    return x, y, z


def safe_z_mm(machine: Machine, mark: tuple[float, float, float], tilt_deg: float) -> float:
    """Machine Z above everything that turns, for tilts to either side, whatever the signs of the axes."""
    around = np.linspace(0.0, 2.0 * pi, 24, endpoint=False)
    ring = np.column_stack([np.cos(around), np.sin(around), np.zeros(24)])
    solid = [ring * machine.table.radius_mm, ring * mark[0] + np.array([0.0, 0.0, mark[2]])]
    solid += [corners(box.min_mm, box.max_mm) for box in machine.cradle]
    for clip in machine.table.clips:
        away = np.linalg.norm(corners(clip.min_mm, clip.max_mm)[:, :2], axis=1).max()
        solid.append(ring * away + np.array([0.0, 0.0, clip.max_mm[2]]))
    steps = np.append(np.arange(-tilt_deg, tilt_deg, 2.0), tilt_deg)
    zero = machine.turn.zero_deg
    points = np.vstack(solid)
    swept = [machine_points(machine, Pose(machine.tilt.zero_deg + step, zero), points) for step in steps.tolist()]
    return float(np.max([points[:, 2].max() for points in swept])) + MARGIN_MM


@dataclass(frozen=True)
class Jog:
    """Position of the tip, step of a key, and lowest allowed position, mm."""

    at_mm: tuple[float, float, float]
    lowest_mm: float
    step_mm: float = 1.0


def begin_jog(machine: Machine, plan: TouchPlan, index: int, z_mm: float) -> Jog:
    """A jog above the mark at a pose of the plan, with the tip at z_mm."""
    x, y, _ = plan.expected_mm[index]
    deepest = min(expected_mm(other, plan.poses[index], plan.mark_mm)[2] for other in _either_way(machine))
    return Jog((x, y, z_mm), max(machine.z.limits_mm[0], deepest - BELOW_MM))


def pressed(jog: Jog, key: str, machine: Machine, pose: Pose) -> Jog:
    """The jog after a key; unknown keys change nothing. Raises MoveError for a step that is not allowed."""
    if key in STEPS_MM:
        return replace(jog, step_mm=STEPS_MM[key])
    if key not in WAYS:
        return jog
    (axis, way), at = WAYS[key], list(jog.at_mm)
    near = key == DOWN and at[2] - jog.step_mm < jog.lowest_mm + BELOW_MM + ABOVE_MM
    at[axis] = round(at[axis] + way * (min(jog.step_mm, NEAR_STEP_MM) if near else jog.step_mm), 3)
    least_mm, most_mm = (machine.x, machine.y, machine.z)[axis].limits_mm
    least_mm = max(least_mm, jog.lowest_mm) if axis == 2 else least_mm
    if not least_mm <= at[axis] <= most_mm:
        raise MoveError(f"{'XYZ'[axis]} would be {at[axis]:.2f} mm: {least_mm:.2f} to {most_mm:.2f} are allowed here")
    if not unsure_signs(machine):
        tip = workpiece_points(machine, pose, np.array([at])) + BELOW_MM * UP
        if (obstacle := find_obstacle(machine, pose, tip)) is not None:
            raise MoveError(obstacle)
    return replace(jog, at_mm=(at[0], at[1], at[2]))


def _either_way(machine: Machine) -> list[Machine]:
    """The machine with every combination of the unknown signs."""
    unsure = unsure_signs(machine)
    machines = []
    for signs in product((-1, 1), repeat=len(unsure)):
        turned = {
            axis: getattr(machine, axis).model_copy(update={"sign": sign}) for axis, sign in zip(unsure, signs, strict=True)
        }
        machines.append(machine.model_copy(update=turned))
    return machines
