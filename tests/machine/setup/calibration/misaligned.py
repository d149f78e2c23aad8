"""Machines whose axes differ from the profile in position and direction, and the errors of predictions about them."""

import numpy as np

from machine.kinematics.table import machine_points
from machine.setup.calibration.fit import Touch
from mdp.mesh import Floats
from mdp.pose import Pose, unit
from profiles.machine import Machine
from tests.machine.setup.calibration.touches import really

MOST_MM, MOST_DEG = 2.0, 1.0


def misaligned(machine: Machine, random: np.random.Generator) -> Machine:
    """Centres up to 2 mm and zeros and directions up to 1 degree off, with random signs.

    A lean of the turn axis about the tilt axis is the tilt's zero, so the turn axis leans along the tilt axis only.
    """
    tilt, upright = unit(machine.tilt.axis), unit(machine.turn.axis)
    slope = np.tan(np.radians(random.uniform(-MOST_DEG, MOST_DEG, 3)))
    changed = [
        {"axis": unit(tilt + slope[0] * np.cross(upright, tilt) + slope[1] * upright), "point_mm": machine.tilt.point_mm},
        {"axis": unit(upright + slope[2] * tilt), "point_mm": machine.turn.point_mm},
    ]
    for axis in changed:
        axis["axis"] = tuple(axis["axis"].tolist())
        axis["point_mm"] = tuple((np.array(axis["point_mm"]) + random.uniform(-MOST_MM, MOST_MM, 3)).tolist())
        axis["sign"] = int(random.choice([-1, 1]))
    changed[0]["zero_deg"] = machine.tilt.zero_deg + float(random.uniform(-MOST_DEG, MOST_DEG))
    return really(machine, changed[0], changed[1])


def touches_at(
    real: Machine,
    tilts: tuple[float, ...],
    turns: int,
    mark: tuple[float, float, float],
    noise_mm: float,
    random: np.random.Generator,
) -> list[Touch]:
    """Touches of a mark at each tilt and a number of evenly spaced turns."""
    poses = [Pose(tilt, 360.0 * k / turns) for tilt in tilts for k in range(turns)]
    places = [machine_points(real, pose, np.array([mark]))[0] + random.normal(0.0, noise_mm, 3) for pose in poses]
    return [Touch(pose, (float(x), float(y), float(z))) for pose, (x, y, z) in zip(poses, places, strict=True)]


def prediction_errors_mm(
    found: Machine, real: Machine, radius_mm: float, height_mm: float, tilts: tuple[float, float], random: np.random.Generator
) -> Floats:
    """Distances of the tip from points of a cylinder on the plate, at poses over the whole range of tilts."""
    off = []
    for tilt, turn in zip(random.uniform(*tilts, 40), random.uniform(-180.0, 180.0, 40), strict=True):
        radius, angle = radius_mm * np.sqrt(random.random(20)), random.uniform(0.0, 2.0 * np.pi, 20)
        points = np.column_stack([radius * np.cos(angle), radius * np.sin(angle), random.uniform(0.0, height_mm, 20)])
        pose = Pose(float(tilt), float(turn))
        off.append(machine_points(found, pose, points) - machine_points(real, pose, points))
    errors: Floats = np.linalg.norm(np.concatenate(off), axis=1)
    return errors
