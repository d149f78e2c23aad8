"""Return path: from wherever the head stands back to a print: up, over everything, the table turned at a proved height, down."""

from collections.abc import Sequence
from dataclasses import replace
from math import hypot

import numpy as np

from machine.firmware import dialect_of
from machine.firmware.klipper import stepper_name
from machine.gcode.blocks import fill_block, resume_placeholders
from machine.gcode.pen import Pen, turn
from machine.kinematics.collision import Printed
from machine.link.pause.park_moves import NEAR_MM, SLOWLY
from machine.planning.stand import Turn, obstacle_top_mm, over_print_mm, route
from mdp.pose import Pose
from profiles.errors import JournalError
from profiles.profile import Profile
from slicer.estimate.timing import speeds_of

STILL_DEG = 0.01


def return_moves(profile: Profile, printed: Printed, way: Turn) -> list[str]:
    """G0 lines from axis positions at one pose to axis positions at another; G21 and G90 hold. Raises JournalError, MoveError."""
    machine, process, goal = profile.machine, profile.process, way.target_mm
    assert goal is not None  # it leads back into a print
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


def homed_return_moves(profile: Profile, printed: Printed, way: Turn, heat: Sequence[str]) -> list[str]:
    """The same for a firmware that has forgotten where its axes stand: they are set, `heat` is done, the tip rises, X and Y are
    homed.

    machine.gcode.resume takes the place of that where the profile has it. Raises JournalError, MoveError, ProfileError.
    """
    machine, dialect = profile.machine, dialect_of(profile.machine)
    height = _clear_z_mm(profile, printed, way.start)
    values = resume_placeholders(machine, way.at_mm, way.start, height)
    named = "machine.gcode.resume"
    if machine.gcode.resume:
        homing = fill_block(machine.gcode.resume, named, values, dialect)
    else:
        rise = f"G0 Z{{clear_z_mm}} F{60.0 * machine.z.speed_mm_s:.0f}"
        homing = fill_block("\n".join((*dialect.stands, *heat, rise, "G28 X Y")), named, values, dialect)
    raised = replace(way, at_mm=np.array([*way.at_mm[:2], height]))
    after = heat if machine.gcode.resume else ()
    return ["G21", "G90", *homing, *after, *return_moves(profile, printed, raised)]


def _clear_z_mm(profile: Profile, printed: Printed, pose: Pose) -> float:
    """Z above which the head may cross anywhere at a pose; raises JournalError where the axis does not reach it."""
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
