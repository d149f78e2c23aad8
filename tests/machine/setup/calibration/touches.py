"""Touches of one mark by a machine that differs from its profile."""

import numpy as np

from machine.kinematics.table import machine_points
from machine.setup.calibration.fit import Calibration, Touch
from mdp.pose import Pose
from profiles.machine import Machine
from profiles.profile import load_one

MARK = (38.0, 12.0, 20.0)
Wrong = dict[str, float | int | tuple[float, float, float]]


def machine_of(name: str) -> Machine:
    machine = load_one(name)["machine"]
    assert isinstance(machine, Machine)
    return machine


def really(machine: Machine, tilt: Wrong, turn: Wrong) -> Machine:
    """The real machine, with other values than the profile's."""
    return machine.model_copy(update={"tilt": machine.tilt.model_copy(update=tilt), "turn": machine.turn.model_copy(update=turn)})


def touched(machine: Machine, tilts: tuple[float, ...] = (0.0, 40.0, -40.0), noise_mm: float = 0.0, seed: int = 0) -> list[Touch]:
    """X Y Z of a real machine with the tip on the mark, at four turns for each tilt."""
    random = np.random.default_rng(seed)
    touches = []
    for pose in [Pose(tilt, turn) for tilt in tilts for turn in (0.0, 90.0, 180.0, 270.0)]:
        x, y, z = machine_points(machine, pose, np.array([MARK]))[0] + random.normal(0.0, noise_mm, 3)
        touches.append(Touch(pose, (float(x), float(y), float(z))))
    return touches


def off_mm(fitted: Calibration, real: Machine) -> float:
    """Greatest error of the fitted centres; the tilt's error only across its own axis."""
    along = np.array(real.tilt.axis) / np.linalg.norm(real.tilt.axis)
    tilt = np.subtract(fitted.machine.tilt.point_mm, real.tilt.point_mm)
    tilt = tilt - along * (along @ tilt)
    return float(max(np.abs(tilt).max(), np.abs(np.subtract(fitted.machine.turn.point_mm, real.turn.point_mm)).max()))
