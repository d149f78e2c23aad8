"""Park moves: commands that take the tip away from the print and back, from the parking place or from anywhere.

Away: pull filament, rise along the nozzle, move aside. Back: the same in reverse. The rotary axes never move.
"""

from collections.abc import Sequence
from dataclasses import replace
from math import hypot

import numpy as np

from machine.firmware import dialect_of
from machine.firmware.klipper import stepper_name
from machine.gcode.blocks import fill_block, resume_placeholders
from machine.gcode.modes import E_AXIS, ModalState, axes_of
from machine.gcode.pen import Pen, number, turn
from machine.gcode.words import read_letters, split_command
from machine.kinematics.collision import Printed
from machine.kinematics.table import axis_positions, followed_places
from machine.link.pause.printed_bounds import PrintedBounds
from machine.planning.stand import Park, Turn, find_park_position, obstacle_top_mm, over_print_mm, route
from mdp.mesh import Floats
from mdp.pose import UP, Pose, rotation
from profiles.errors import JournalError
from profiles.machine import Machine
from profiles.messages import key_name
from profiles.profile import Profile
from slicer.estimate.timing import speeds_of

PULL_MM, PULL_MM_S = 1.0, 30.0  # without a material
FILL_MM_S = 3.0  # Marlin's ADVANCED_PAUSE_PURGE_FEEDRATE
SLOWLY = 0.25  # share of the Z axis' speed for the last stretch down
NEAR_MM = 2.0
STILL_DEG = 0.01
COLD_C = 170.0  # Marlin's EXTRUDE_MINTEMP and Klipper's min_extrude_temp
NEAR_C = 10.0  # a print at a lower temperature shows that its firmware allows it


def plan_park(
    modal: ModalState, profile: Profile | None, bounds: PrintedBounds | None
) -> tuple[list[str], list[str], Park | None]:
    """Commands from the place of `modal`, all moves ended, to the parking place, and commands back to the print. The third value
    is None when the tip stays, because its position is unknown or no way is clear."""
    pull, push = filament_commands(modal, profile)
    up, down, park = _moves(modal, profile, bounds)
    away = ["G21", *pull, "G90", *up]
    standby_c = profile.material.standby_c if profile is not None else None
    if standby_c is not None and profile is not None and pull and standby_c < modal.nozzle_c:
        away.append(dialect_of(profile.machine).nozzle.format(number(standby_c)))
    return away, ["G21", "G90", *down, *push], park


def lift_move(modal: ModalState, machine: Machine) -> tuple[str, float] | None:
    """Words and mm/min of a move away from the print; None when the position is unknown or the tip is at the top."""
    standing = axis_position(machine, modal.coordinates(), modal.follows)
    if standing is None:
        return None
    at, pose = standing
    far = min(machine.lift_mm, machine.z.limits_mm[1] - float(at[2]))
    return (lift_words(machine, pose, far, modal.follows), 60.0 * machine.z.speed_mm_s) if far > 0 else None


def heat_commands(modal: ModalState, profile: Profile | None) -> list[str]:
    """Commands that wait for the program's temperatures: first the bed, which is slowest and holds the print."""
    wait = dialect_of(profile.machine).nozzle_wait if profile is not None else "M109 S{}"
    bed = [f"M190 S{number(modal.bed_c)}"] if modal.bed_c > 0 else []
    return bed + ([wait.format(number(modal.nozzle_c))] if modal.nozzle_c > 0 else [])


def least_extrusion_c(nozzle_c: float, profile: Profile | None) -> float:
    """The temperature from which filament is pulled and pushed by a nozzle with this target."""
    material_c = 0.0 if profile is None else profile.material.first_layer_nozzle_c
    return min(COLD_C, max(nozzle_c, material_c) - NEAR_C)


def extrudes(modal: ModalState, profile: Profile | None) -> bool:
    """Whether the nozzle's target is one at which filament is pulled and pushed."""
    return 0.0 < modal.nozzle_c >= least_extrusion_c(modal.nozzle_c, profile)


def filament_commands(modal: ModalState, profile: Profile | None) -> tuple[list[str], list[str]]:
    """Commands that retract before the tip leaves a place where it stood, and that prime at its return; none for a nozzle that is
    off, or that the program holds too cold for it."""
    pull, speed, extra = _filament(modal, profile)
    if not extrudes(modal, profile) or not pull:
        return [], []
    feed = f"F{60 * speed:.0f}"
    return ["M83", f"G1 E-{pull:.5f} {feed}"], ["M83", f"G1 E{pull + extra:.5f} {feed}"]


def fill_commands(modal: ModalState, profile: Profile) -> list[str]:
    """Commands that refill a nozzle that cooled while the tip waited, assuming that as much oozed as a retraction holds back. The
    filament's position is the same after them as before."""
    pull, speed, _ = _filament(modal, profile)
    back = pull + modal.pulled_mm
    push = back + max(profile.material.retract_mm, PULL_MM)
    return ["M83", f"G1 E{push:.5f} F{60 * FILL_MM_S:.0f}", f"G1 E-{back:.5f} F{60 * speed:.0f}"]


def _filament(modal: ModalState, profile: Profile | None) -> tuple[float, float, float]:
    """Filament to pull back (less what the program has retracted), mm; its speed, mm/s; and the extra to push, mm."""
    material = profile.material if profile is not None else None
    whole = material.retract_mm if material is not None else PULL_MM
    speed = material.retract_speed_mm_s if material is not None else PULL_MM_S
    pull = max(0.0, whole - modal.pulled_mm)
    return pull, speed, material.prime_extra_mm if material is not None else 0.0


def _moves(modal: ModalState, profile: Profile | None, bounds: PrintedBounds | None) -> tuple[list[str], list[str], Park | None]:
    if profile is None or bounds is None:
        return [], [], None
    machine, following = profile.machine, modal.follows
    standing = axis_position(machine, modal.coordinates(), following)
    if standing is None:
        return [], [], None
    at, pose = standing
    park = find_park_position(machine, bounds.corners(following), at, pose)
    if park is None:
        return [], [], None
    rise, across = 60.0 * machine.z.speed_mm_s, 60.0 * profile.process.travel_speed_mm_s
    ways = zip(move_words(machine, park, pose, following), (rise, across), strict=False)
    up = [f"G0 {words} F{feed:.0f}" for words, feed in ways]
    above = np.array([at[0], at[1], min(at[2] + NEAR_MM, park.lift_mm[2])])
    near, home = Park(tuple(above), tuple(above)), Park(tuple(at), tuple(at))
    over = move_words(machine, Park(park.lift_mm, park.lift_mm), pose, True)[0] if following else _words(park.lift_mm)
    down = [
        f"G0 {over} F{across:.0f}",
        f"G0 {move_words(machine, near, pose, following)[0]} F{rise:.0f}",
        f"G1 {move_words(machine, home, pose, following)[0]} F{SLOWLY * rise:.0f}",
    ]
    return up, down, park


def _words(point: tuple[float, float, float]) -> str:
    return f"X{point[0]:.3f} Y{point[1]:.3f}"


def move_words(machine: Machine, park: Park, pose: Pose, following: bool) -> list[str]:
    """G0 words of the move up and aside, in the firmware's coordinates; following: it follows the table (TCP)."""
    stops = [park.lift_mm] if park.stand_mm == park.lift_mm else [park.lift_mm, park.stand_mm]
    if following:
        return [f"X{x:.3f} Y{y:.3f} Z{z:.3f}" for x, y, z in followed_places(machine, pose, np.array(stops))]
    return [f"Z{park.lift_mm[2]:.3f}", *map(_words, stops[1:])]


def axis_position(machine: Machine, coordinates: tuple[float | None, ...], following: bool) -> tuple[Floats, Pose] | None:
    """(3,) axis positions and the pose of the program's coordinates; None when one of X Y Z is unknown."""
    x, y, z, tilt, turn = coordinates[:5]
    if x is None or y is None or z is None:
        return None
    pose = Pose(machine.tilt.zero_deg if tilt is None else tilt, machine.turn.zero_deg if turn is None else turn)
    at = np.array([[x, y, z, pose.tilt_deg, pose.turn_deg]])
    return (axis_positions(machine, at)[0] if following else at[0, :3]), pose


def lift_words(machine: Machine, pose: Pose, far_mm: float, following: bool) -> str:
    """Words of a relative move (G91) along the nozzle."""
    step = rotation(machine, pose).T @ (far_mm * UP) if following else far_mm * UP
    return " ".join(f"{letter}{value:.3f}" for letter, value in zip("XYZ", step, strict=True) if abs(value) > 5e-4)


def return_moves(profile: Profile, printed: Printed, way: Turn) -> list[str]:
    """G0 lines from axis positions at one pose to those at another; require G21 and G90. Raises JournalError, MoveError."""
    machine, process, goal = profile.machine, profile.process, way.target_mm
    assert goal is not None  # the way leads back into a print
    rise, across = 60.0 * machine.z.speed_mm_s, 60.0 * process.travel_speed_mm_s
    near = min(float(goal[2]) + NEAR_MM, machine.z.limits_mm[1])
    down = [f"G0 Z{near:.3f} F{rise:.0f}", f"G1 Z{goal[2]:.3f} F{SLOWLY * rise:.0f}"]
    if hypot(way.end.tilt_deg - way.start.tilt_deg, way.end.turn_deg - way.start.turn_deg) > STILL_DEG:
        speeds = speeds_of(profile)._replace(lift_mm_s=machine.z.speed_mm_s, travel_mm_s=process.travel_speed_mm_s)
        least_z_mm = over_print_mm(machine, printed, way.start), over_print_mm(machine, printed, way.end)
        path = route(replace(way, least_z_mm=least_z_mm), 0, printed, machine, speeds)
        return [
            f"G0 Z{path.z_mm:.3f} F{rise:.0f}",
            f"G0 X{path.over_mm[0]:.3f} Y{path.over_mm[1]:.3f} F{across:.0f}",
            *_turn_commands(profile, way.start, way.end),
            f"G0 Z{path.across_z_mm:.3f} F{rise:.0f}",
            f"G0 X{goal[0]:.3f} Y{goal[1]:.3f} F{across:.0f}",
            *down,
        ]
    height = max(_clear_z_mm(profile, printed, way.end), float(way.at_mm[2]))
    return [f"G0 Z{height:.3f} F{rise:.0f}", f"G0 X{goal[0]:.3f} Y{goal[1]:.3f} F{across:.0f}", *down]


def homed_return_moves(profile: Profile, printed: Printed, way: Turn, heat: Sequence[str], z_offset_mm: float = 0.0) -> list[str]:
    """Way back for a firmware that lost its position: set the axes, run `heat`, lift the tip, home X and Y, return_moves().

    machine.gcode.resume replaces the homing if the profile has it. If that homes Z, the Z offset that the way starts with is set
    again; otherwise Z is set to its programmed value, so that the axis keeps the offset: Marlin ignores M290 until Z is homed.
    Raises JournalError, MoveError, ProfileError.
    """
    machine, dialect = profile.machine, dialect_of(profile.machine)
    if not homes_z(machine):
        way, z_offset_mm = replace(way, at_mm=way.at_mm - np.array([0.0, 0.0, z_offset_mm])), 0.0
    height = _clear_z_mm(profile, printed, way.start) + max(0.0, z_offset_mm)  # the print is higher than programmed
    values = resume_placeholders(machine, way.at_mm, way.start, height)
    named = key_name("machine.gcode.resume")
    if machine.gcode.resume:
        homing = fill_block(machine.gcode.resume, named, values, dialect)
    else:
        rise = f"G0 Z{{clear_z_mm}} F{60.0 * machine.z.speed_mm_s:.0f}"
        homing = fill_block("\n".join((*dialect.stands, *heat, rise, "G28 X Y")), named, values, dialect)
    raised = replace(way, at_mm=np.array([*way.at_mm[:2], height]))
    after = heat if machine.gcode.resume else ()
    offset = [dialect.babystep.format(f"{z_offset_mm:.3f}")] if z_offset_mm else []
    return ["G21", "G90", *homing, *after, *offset, *return_moves(profile, printed, raised)]


def homes_z(machine: Machine) -> bool:
    """Whether machine.gcode.resume homes Z."""
    commands = (split_command(line.split(";")[0].strip().upper()) for line in machine.gcode.resume.splitlines())
    homed = [set(read_letters(rest)) & set(axes_of(machine).letters[:E_AXIS]) for name, rest in commands if name == "G28"]
    return any(not letters or "Z" in letters for letters in homed)


def _clear_z_mm(profile: Profile, printed: Printed, pose: Pose) -> float:
    """Z above which the head may cross anywhere at a pose. Raises JournalError when the axis does not reach it."""
    machine = profile.machine
    height = obstacle_top_mm(machine, printed, pose) + machine.lift_mm
    if height > machine.z.limits_mm[1]:
        raise JournalError(
            f"to cross the print the tip must rise to Z {height:.1f} mm, {machine.name} allows {machine.z.limits_mm[1]:g} mm"
        )
    return height


def _turn_commands(profile: Profile, pose: Pose, goal_pose: Pose) -> list[str]:
    machine = profile.machine
    pen = Pen(dialect_of(machine), machine, "E", pose)
    pen.values = {"tilt_stepper": stepper_name(machine.tilt), "turn_stepper": stepper_name(machine.turn)}
    return list(turn(goal_pose, min(machine.tilt.speed_deg_s, machine.turn.speed_deg_s), pen))
