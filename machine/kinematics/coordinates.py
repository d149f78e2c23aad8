"""Coordinates: axis positions and the places on the table that a following firmware (TCP) calls X Y Z."""

from itertools import pairwise

import numpy as np

from machine.firmware import dialect_of
from machine.kinematics.table import machine_points, workpiece_points
from mdp.mesh import Floats
from mdp.pose import Pose, level, shift
from profiles.machine import Machine


def origin_mm(machine: Machine) -> Floats:
    """(3,) the workpiece origin as a following firmware calls it.

    LinuxCNC and Marlin: where X Y Z stand there with the table level, for their kinematics change nothing at tilt 0, turn 0.
    grblHAL: zero, the turn axis on the table.
    """
    if dialect_of(machine).follow_from_turn_axis:
        return np.zeros(3)
    return shift(machine, level(machine))


def followed_places(machine: Machine, pose: Pose, points_mm: Floats) -> Floats:
    """(n, 3) places on the table for (n, 3) axis positions at a pose."""
    places: Floats = workpiece_points(machine, pose, points_mm) + origin_mm(machine)
    return places


def axis_positions(machine: Machine, rows: Floats) -> Floats:
    """(n, 3) axis positions for (n, 5) rows of a followed X Y Z and tilt, turn in degrees."""
    places = rows[:, :3] - origin_mm(machine)
    positions = np.empty_like(places)
    changes = np.flatnonzero((rows[1:, 3:5] != rows[:-1, 3:5]).any(axis=1)) + 1
    bounds = [0, *changes.tolist(), len(rows)]
    for first, last in pairwise(bounds):
        pose = Pose(float(rows[first, 3]), float(rows[first, 4])) if last > first else level(machine)
        positions[first:last] = machine_points(machine, pose, places[first:last])
    return positions
