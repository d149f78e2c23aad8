"""Probe: where the tip of a simulated printer is stopped on its way down, with the noise and the faults of a probe."""

import random
from math import inf, nan

from machine.simulator.contact.surface import TrueBall, ball_z, plate_z
from mdp.pose import Pose
from profiles.machine import Machine


class ProbedTable:
    """The plate of a true machine, with a ball on it or none, and what senses it.

    offset_mm: from the nozzle's tip to what touches; flat_mm: radius of its flat end. noise_mm: one sigma of a contact's height.
    silent_from, early_from: the probing moves, counted from 1, from which on the probe never triggers, or triggers at once.
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
        silent_from: float = inf,
        early_from: float = inf,
    ) -> None:
        self.machine, self.ball = machine, ball
        self.offset_mm, self.flat_mm, self.noise_mm = offset_mm, flat_mm, noise_mm
        self.silent_from, self.early_from = silent_from, early_from
        self.moves = 0
        self._random = random.Random(seed)

    def surface_z(self, x: float, y: float, tilt_deg: float, turn_deg: float) -> float:
        """Z at which what touches, coming down at X Y, meets plate or ball; -inf where it meets neither."""
        pose = Pose(tilt_deg, turn_deg)
        plate = plate_z(self.machine, pose, x, y)
        return plate if self.ball is None else max(plate, ball_z(self.machine, self.ball, pose, x, y, self.flat_mm))

    def stop_z(self, positions: list[float], low_mm: float) -> float:
        """Where the nozzle's tip is when the probe stops a move down to low_mm: nan where it triggers at no time."""
        self.moves += 1
        x, y, z, tilt, turn = positions
        if self.moves >= self.early_from:
            return z
        if self.moves >= self.silent_from:
            return nan
        met = self.surface_z(x + self.offset_mm[0], y + self.offset_mm[1], tilt, turn) - self.offset_mm[2]
        met += self._random.gauss(0.0, self.noise_mm) if self.noise_mm else 0.0
        return min(met, z) if met >= low_mm else nan
