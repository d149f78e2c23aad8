"""Jog: the tip taken to a mark by keys, a step at a time: what a key makes of a place, and which places are refused."""

from dataclasses import dataclass, replace
from itertools import product

import numpy as np

from machine.kinematics.table import workpiece_points
from machine.setup.calibration.program import ABOVE_MM, TouchPlan, expected_mm, unsure_signs
from mdp.clearance import find_obstacle
from mdp.pose import UP, Pose
from profiles.errors import MoveError
from profiles.machine import Machine

WAYS = {"a": (0, -1), "d": (0, 1), "s": (1, -1), "w": (1, 1), "f": (2, -1), "r": (2, 1)}  # axis and direction of a key
DOWN = "f"
STEPS_MM = {"1": 10.0, "2": 1.0, "3": 0.1, "4": 0.02}
BELOW_MM = 6.0  # the place at which the mark is expected: no step goes deeper, and by so much the head may be nearer than is sure
NEAR_STEP_MM = 1.0  # downwards, where the mark may be


@dataclass(frozen=True)
class Jog:
    """Where the tip is, the step that a key makes, and the lowest place that is allowed, mm."""

    at_mm: tuple[float, float, float]
    lowest_mm: float
    step_mm: float = 1.0


def begin_jog(machine: Machine, plan: TouchPlan, index: int, z_mm: float) -> Jog:
    """Over the mark at a pose of the plan, the tip at a height."""
    x, y, _ = plan.expected_mm[index]
    deepest = min(expected_mm(other, plan.poses[index], plan.mark_mm)[2] for other in _either_way(machine))
    return Jog((x, y, z_mm), max(machine.z.limits_mm[0], deepest - BELOW_MM))


def pressed(jog: Jog, key: str, machine: Machine, pose: Pose) -> Jog:
    """What a key makes of it; other keys nothing. Raises MoveError for a step that the machine must not make."""
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
    """The machine with each choice of the signs that nobody knows yet."""
    unsure = unsure_signs(machine)
    machines = []
    for signs in product((-1, 1), repeat=len(unsure)):
        turned = {
            axis: getattr(machine, axis).model_copy(update={"sign": sign}) for axis, sign in zip(unsure, signs, strict=True)
        }
        machines.append(machine.model_copy(update=turned))
    return machines
