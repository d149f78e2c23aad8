"""Contact: the plate and ball of a true machine, which may differ from its profile, and the probe that senses them.

A probe stops the tip on its way down, with noise.
"""

import random
from dataclasses import dataclass
from math import hypot, inf, nan, sqrt

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
    """Z at which a tip lowered at X Y meets the plate; -inf beside it."""
    normal = rotation(machine, pose) @ UP
    middle = machine_points(machine, pose, np.zeros((1, 3)))[0]
    if normal[2] < 1e-3:
        return -inf
    z = float(middle[2] - (normal[0] * (x - middle[0]) + normal[1] * (y - middle[1])) / normal[2])
    away = float(np.linalg.norm(np.array([x, y, z]) - middle))
    return z if away <= machine.table.radius_mm else -inf


def ball_z(machine: Machine, ball: TrueBall, pose: Pose, x: float, y: float, flat_mm: float = 0.0) -> float:
    """Z at which a tip meets the ball, -inf beside it. A flat end of radius flat_mm touches with its nearer edge."""
    centre = machine_points(machine, pose, np.array([ball.centre_mm]))[0]
    aside = max(hypot(x - centre[0], y - centre[1]) - flat_mm, 0.0)
    return float(centre[2]) + sqrt(ball.radius_mm**2 - aside**2) if aside < ball.radius_mm else -inf


class ProbedTable:
    """The plate of a true machine, with or without a ball, and its probe.

    offset_mm: from the nozzle's tip to the contact; flat_mm: radius of its flat end. noise_mm: one sigma of a contact's height.
    """

    def __init__(
        self,
        machine: Machine,
        ball: TrueBall | None = None,
        *,
        offset_mm: tuple[float, float, float] = (0.0, 0.0, 0.0),
        flat_mm: float = 0.0,
        noise_mm: float = 0.0,
        seed: int = 0,
    ) -> None:
        self.machine, self.ball = machine, ball
        self.offset_mm, self.flat_mm, self.noise_mm = offset_mm, flat_mm, noise_mm
        self._random = random.Random(seed)

    def surface_z(self, x: float, y: float, tilt_deg: float, turn_deg: float) -> float:
        """Z at which the contact, lowered at X Y, meets plate or ball; -inf for neither."""
        pose = Pose(tilt_deg, turn_deg)
        plate = plate_z(self.machine, pose, x, y)
        return plate if self.ball is None else max(plate, ball_z(self.machine, self.ball, pose, x, y, self.flat_mm))

    def stop_z(self, positions: list[float], low_mm: float) -> float:
        """Z of the nozzle's tip when the probe stops a move down to low_mm; nan if it never triggers."""
        x, y, z, tilt, turn = positions
        met = self.surface_z(x + self.offset_mm[0], y + self.offset_mm[1], tilt, turn) - self.offset_mm[2]
        met += self._random.gauss(0.0, self.noise_mm) if self.noise_mm else 0.0
        return min(met, z) if met >= low_mm else nan
