"""Turning: the lines that bring the table to a pose, in each firmware's way."""

from collections.abc import Iterator
from math import ceil, hypot

import numpy as np

from machine.gcode.pen import Pen, angle, number
from machine.kinematics.coordinates import axis_positions, followed_places
from mdp.mesh import Floats
from mdp.pose import Pose

STEP_DEG = 1.0  # a followed turn goes in steps: between them the tip leaves its place by a thousandth of its distance to the axes


def turn(to: Pose, speed_deg_s: float, pen: Pen) -> Iterator[str]:
    """Turn the table from pen.pose to a pose at a speed along sqrt(tilt^2 + turn^2), the head standing still."""
    if pen.machine.shape == "fixed":
        return
    tilt_deg, turn_deg = to.tilt_deg - pen.pose.tilt_deg, to.turn_deg - pen.pose.turn_deg
    if pen.dialect.steppers:
        yield from _stepped(to, tilt_deg, turn_deg, speed_deg_s, pen)
    elif pen.machine.coordinates == "workpiece" and (tilt_deg or turn_deg):
        yield from _followed(to, hypot(tilt_deg, turn_deg) / speed_deg_s, pen)
    else:
        pen.forget_speed()
        along = hypot(tilt_deg, turn_deg)
        share = max(abs(tilt_deg), abs(turn_deg)) / along if pen.dialect.largest_delta and along > 0 else 1.0
        yield f"{pen.dialect.travel}{_words(to, pen)}{pen.speed(speed_deg_s * share)}"
    pen.pose = to
    pen.forget_speed()


def _words(pose: Pose, pen: Pen) -> str:
    return f" {pen.machine.tilt.letter}{angle(pose.tilt_deg)} {pen.machine.turn.letter}{angle(pose.turn_deg)}"


def _stepped(to: Pose, tilt_deg: float, turn_deg: float, speed_deg_s: float, pen: Pen) -> Iterator[str]:
    """MANUAL_STEPPER, one line an axis: both begin together, and speeds and accelerations in proportion end them together.

    Only the last one is waited for; it is the one that goes farther.
    """
    axes = [
        (abs(tilt_deg), pen.values["tilt_stepper"], to.tilt_deg, pen.machine.tilt),
        (abs(turn_deg), pen.values["turn_stepper"], to.turn_deg, pen.machine.turn),
    ]
    along = hypot(tilt_deg, turn_deg)
    acceleration = min((axis.acceleration_deg_s2 * along / far for far, _, _, axis in axes if far > 0), default=0.0)
    for wait, (far, stepper, value, axis) in enumerate(sorted(axes, key=lambda turned: turned[0])):
        share = far / along if along > 0 else 0.0
        how = f"SPEED={number(max(speed_deg_s * share, 1e-4))} ACCEL={number(max(acceleration * share, 1e-4))}"
        if share == 0.0:
            how = f"SPEED={number(axis.speed_deg_s)}"
        yield f"MANUAL_STEPPER STEPPER={stepper} MOVE={angle(value)} {how} SYNC={wait}"


def _followed(to: Pose, seconds: float, pen: Pen) -> Iterator[str]:
    """A turn under a firmware that keeps the tip on the table: small steps whose places keep the head where it is."""
    machine, begin = pen.machine, pen.pose
    head = _head_mm(pen)
    far = max(abs(to.tilt_deg - begin.tilt_deg), abs(to.turn_deg - begin.turn_deg))
    count = max(1, ceil(far / STEP_DEG))
    if pen.dialect.inverse_time:
        yield "G93"
    for k in range(1, count + 1):
        share = k / count
        tilt_deg = begin.tilt_deg + share * (to.tilt_deg - begin.tilt_deg)
        pose = Pose(tilt_deg, begin.turn_deg + share * (to.turn_deg - begin.turn_deg)) if k < count else to
        before = pen.place_mm
        words = pen.coordinates(followed_places(machine, pose, head)[0])
        moved = float(np.linalg.norm(pen.place_mm - before))
        if pen.dialect.inverse_time:
            feed = f" F{number(60.0 * count / seconds)}"
        else:
            step = moved if moved > 0 else hypot(to.tilt_deg - begin.tilt_deg, to.turn_deg - begin.turn_deg) / count
            feed = f" F{number(max(60.0 * step * count / seconds, 0.001))}"
        yield f"G1{words}{_words(pose, pen)}{feed}"
    if pen.dialect.inverse_time:
        yield "G94"


def _head_mm(pen: Pen) -> Floats:
    """(1, 3) axis positions at which the head stands; the file's places are rounded, the head's own are not needed finer."""
    row = np.array([[*pen.place_mm, pen.pose.tilt_deg, pen.pose.turn_deg]])
    return axis_positions(pen.machine, row)
