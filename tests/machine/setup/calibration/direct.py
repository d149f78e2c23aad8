"""A simulated probe without firmware: it moves at once over a probed table and records its least distance to table and ball."""

from math import isnan

import numpy as np

from machine.setup.calibration.probing import Ball, Measuring, Probe
from machine.simulator.contact import ProbedTable, TrueBall
from mdp.pose import Pose
from profiles.machine import Machine
from tests.machine.setup.calibration.misaligned import misaligned
from tests.machine.simulator.faulty_table import FaultyTable

RADIUS_MM, HEIGHT_MM = 10.0, 45.0
PLACED_MM = 2.0  # how far from its expected position the user puts the ball
STEPS = 8


class DirectProber:
    """Implements Prober; least_mm: the least distance of the tip from table or ball outside of seeking."""

    def __init__(self, table: ProbedTable, z_mm: float) -> None:
        self.table, self.least_mm = table, float("inf")
        self.at = [0.0, 0.0, z_mm, table.machine.tilt.zero_deg, 0.0]
        self.poses: list[Pose] = []

    def turn(self, pose: Pose) -> None:
        self.poses.append(pose)
        self._go([*self.at[:3], pose.tilt_deg, pose.turn_deg])

    def rise(self, z_mm: float) -> None:
        self._go([*self.at[:2], z_mm, *self.at[3:]])

    def cross(self, x_mm: float, y_mm: float) -> None:
        self._go([x_mm, y_mm, *self.at[2:]])

    def seek(self, low_mm: float) -> float | None:
        stop = self.table.stop_z(self.at, low_mm)
        self.at[2] = low_mm if isnan(stop) else stop
        return None if isnan(stop) else stop

    def _go(self, end: list[float]) -> None:
        # Leaving a touched point straight up is not a contact.
        rises = end[2] > self.at[2] and end[:2] == self.at[:2]
        for share in np.linspace(1.0 if rises else 0.0, 1.0, 1 if rises else STEPS):
            x, y, z, tilt, turn = ((1.0 - share) * np.array(self.at) + share * np.array(end)).tolist()
            x, y, z = (value + offset for value, offset in zip((x, y, z), self.table.offset_mm, strict=True))
            self.least_mm = min(self.least_mm, z - self.table.surface_z(x, y, tilt, turn))
        self.at = end


def usual_ball(machine: Machine) -> Ball:
    """The position at which the user is instructed to put the ball."""
    return Ball(RADIUS_MM, (min(0.6 * machine.table.radius_mm, 45.0), 0.0, HEIGHT_MM))


def probed(machine: Machine, seed: int, noise_mm: float = 0.0, **table: object) -> tuple[Measuring, DirectProber]:
    """A measurement on a machine that differs from its profile, with a ball that is slightly displaced."""
    random = np.random.default_rng(seed)
    real, ball = misaligned(machine, random), usual_ball(machine)
    x, y = (float(value) for value in ball.centre_mm[:2] + random.uniform(-PLACED_MM, PLACED_MM, 2))
    placed = TrueBall(RADIUS_MM, (x, y, HEIGHT_MM))
    prober = DirectProber(FaultyTable(real, placed, noise_mm=noise_mm, seed=seed, **table), machine.z.limits_mm[1])
    probe = Probe(prober.table.offset_mm, 0.0)
    return Measuring(machine, ball, prober, probe), prober
