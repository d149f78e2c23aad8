"""Surface: how high plate and ball of a true machine stand under a tip that comes from above."""

from dataclasses import dataclass
from math import hypot, inf, sqrt

import numpy as np

from machine.kinematics.table import machine_points
from mdp.pose import UP, Pose, rotation
from profiles.machine import Machine


@dataclass(frozen=True)
class TrueBall:
    """A ball on the plate, in the workpiece frame of the true machine; mm."""

    radius_mm: float
    centre_mm: tuple[float, float, float]


def plate_z(machine: Machine, pose: Pose, x: float, y: float) -> float:
    """Z at which a tip that comes down at X Y meets the plate; -inf beside it."""
    normal = rotation(machine, pose) @ UP
    middle = machine_points(machine, pose, np.zeros((1, 3)))[0]
    if normal[2] < 1e-3:
        return -inf
    z = float(middle[2] - (normal[0] * (x - middle[0]) + normal[1] * (y - middle[1])) / normal[2])
    away = float(np.linalg.norm(np.array([x, y, z]) - middle))
    return z if away <= machine.table.radius_mm else -inf


def ball_z(machine: Machine, ball: TrueBall, pose: Pose, x: float, y: float, flat_mm: float = 0.0) -> float:
    """The same of the ball, for a tip with a flat end of radius flat_mm: its nearer edge touches first."""
    centre = machine_points(machine, pose, np.array([ball.centre_mm]))[0]
    aside = max(hypot(x - centre[0], y - centre[1]) - flat_mm, 0.0)
    return float(centre[2]) + sqrt(ball.radius_mm**2 - aside**2) if aside < ball.radius_mm else -inf
