"""Way: back to a print from wherever the head stands: up, across above everything, the table turned at a proved height, down."""

from collections.abc import Sequence
from math import hypot

import numpy as np

from machine.blocks import filled
from machine.collide import Printed
from machine.dialects import DIALECTS
from machine.link.park import top_mm
from machine.link.retreat import NEAR_MM, SLOWLY
from machine.pen import Pen
from machine.placeholders import stepper
from machine.reorient import Speeds, route
from machine.turning import turn
from mdp.mesh import Floats
from mdp.pose import Pose
from profiles.errors import JournalError
from profiles.profile import Profile

STILL_DEG = 0.01


def way_back(profile: Profile, printed: Printed, at: Floats, pose: Pose, goal: Floats, wanted: Pose) -> list[str]:
    """G0 lines from axis positions at one pose to axis positions at another; G21 and G90 hold. Raises JournalError, MoveError."""
    machine, process = profile.machine, profile.process
    rise, across = 60.0 * machine.z.speed_mm_s, 60.0 * process.travel_speed_mm_s
    near = min(float(goal[2]) + NEAR_MM, machine.z.limits_mm[1])
    down = [f"G0 Z{near:.3f} F{rise:.0f}", f"G1 Z{goal[2]:.3f} F{SLOWLY * rise:.0f}"]
    if hypot(wanted.tilt_deg - pose.tilt_deg, wanted.turn_deg - pose.turn_deg) > STILL_DEG:
        found = route(machine, printed, at, goal, pose, wanted, Speeds(machine.z.speed_mm_s, process.travel_speed_mm_s), 0)
        return [
            f"G0 Z{found.z_mm:.3f} F{rise:.0f}",
            f"G0 X{found.over_mm[0]:.3f} Y{found.over_mm[1]:.3f} F{across:.0f}",
            *_turned(profile, pose, wanted),
            f"G0 Z{found.across_z_mm:.3f} F{rise:.0f}",
            f"G0 X{goal[0]:.3f} Y{goal[1]:.3f} F{across:.0f}",
            *down,
        ]
    height = max(_clear_mm(profile, printed, wanted), float(at[2]))
    return [f"G0 Z{height:.3f} F{rise:.0f}", f"G0 X{goal[0]:.3f} Y{goal[1]:.3f} F{across:.0f}", *down]


def home_way(
    profile: Profile, printed: Printed, at: Floats, pose: Pose, goal: Floats, wanted: Pose, heat: Sequence[str]
) -> list[str]:
    """The same for a firmware that has forgotten where its axes stand: it is told, `heat` is done, the tip rises, X and Y are
    homed.

    machine.gcode.resume takes the place of that where the profile has it. Raises JournalError, MoveError, ProfileError.
    """
    machine, dialect = profile.machine, DIALECTS[profile.machine.dialect]
    height = _clear_mm(profile, printed, pose)
    values = {
        "x_mm": float(at[0]), "y_mm": float(at[1]), "z_mm": float(at[2]), "tilt_deg": pose.tilt_deg, "turn_deg": pose.turn_deg,
        "clear_z_mm": height, "tilt": machine.tilt.letter, "turn": machine.turn.letter,
        "tilt_stepper": stepper(machine.tilt), "turn_stepper": stepper(machine.turn),
        "tilt_speed": machine.tilt.speed_deg_s, "turn_speed": machine.turn.speed_deg_s,
        "tilt_acceleration": machine.tilt.acceleration_deg_s2, "turn_acceleration": machine.turn.acceleration_deg_s2,
    }  # fmt: skip
    named = "machine.gcode.resume"
    if machine.gcode.resume:
        homed = filled(machine.gcode.resume, named, values, dialect.longest_line)
    else:
        rise = f"G0 Z{{clear_z_mm}} F{60.0 * machine.z.speed_mm_s:.0f}"
        homed = filled("\n".join((*dialect.stands, *heat, rise, "G28 X Y")), named, values, dialect.longest_line)
    raised = np.array([at[0], at[1], height])
    after = heat if machine.gcode.resume else ()
    return ["G21", "G90", *homed, *after, *way_back(profile, printed, raised, pose, goal, wanted)]


def _clear_mm(profile: Profile, printed: Printed, pose: Pose) -> float:
    """Z above which the head may cross anywhere at a pose; raises JournalError where the axis does not reach it."""
    machine = profile.machine
    height = top_mm(machine, printed, pose) + machine.lift_mm
    if height > machine.z.limits_mm[1]:
        raise JournalError(
            f"to cross the print the tip must rise to Z {height:.1f} mm, {machine.name} allows {machine.z.limits_mm[1]:g} mm"
        )
    return height


def _turned(profile: Profile, pose: Pose, wanted: Pose) -> list[str]:
    machine = profile.machine
    pen = Pen(DIALECTS[machine.dialect], machine, "E", pose)
    pen.values = {"tilt_stepper": stepper(machine.tilt), "turn_stepper": stepper(machine.turn)}
    return list(turn(wanted, min(machine.tilt.speed_deg_s, machine.turn.speed_deg_s), pen))
