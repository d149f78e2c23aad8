"""Calibration pieces as they would be printed, without a program: pads on roofs facing four sides, at poses of a machine."""

from dataclasses import replace

import numpy as np

from machine.setup.calibration.piece import Pad, Piece
from mdp.mesh import Floats
from mdp.pose import UP, level, poses, rotation
from profiles.machine import Machine
from tests.machine.setup.calibration.touches import really

MIDDLE_MM = 17.0, 23.0


def standing(machine: Machine, lean_deg: float = 60.0) -> Piece:
    """The piece whose pads are in the middle of roofs with this lean."""
    return Piece(machine, level(machine), tuple(_pad(machine, number, lean_deg) for number in range(1, 5)))


def _pad(machine: Machine, number: int, lean_deg: float) -> Pad:
    heading, lean = np.radians(90.0 * (number - 1)), np.radians(lean_deg)
    out = np.array([np.cos(heading), np.sin(heading), 0.0])
    away = np.sin(lean) * out + np.cos(lean) * UP
    right = np.cross(UP, out)
    pose = poses(machine, away)[0]
    assert np.allclose(rotation(machine, pose) @ away, UP)
    return Pad(number, pose, MIDDLE_MM[0] * out + MIDDLE_MM[1] * UP, np.array([right, np.cross(away, right), away]))


def read_off(exact_mm: Floats, random: np.random.Generator) -> Floats:
    """Readings of pads by a user: rounded to 0.05 mm, with some noise and the plastic slightly too high."""
    seen = exact_mm + random.normal(0.0, 0.03, exact_mm.shape) + np.array([0.0, 0.03, 0.05])
    rounded: Floats = np.round(seen / 0.05) * 0.05
    return rounded


def off(machine: Machine, random: np.random.Generator) -> Machine:
    """Centres up to 0.4 mm and the tilt's zero up to 0.4 degrees off."""
    tilt, turn = (np.array(axis.point_mm) + random.uniform(-0.4, 0.4, 3) for axis in (machine.tilt, machine.turn))
    turn[2] = machine.turn.point_mm[2]  # no pad shows the height of the plate
    zero = {"zero_deg": machine.tilt.zero_deg + float(random.uniform(-0.4, 0.4)), "point_mm": tuple(tilt.tolist())}
    return really(machine, zero, {"point_mm": tuple(turn.tolist())})


def seam_mm(piece: Piece, found: Machine, true: Machine) -> float:
    """The distance of the pads of the next piece from their places."""
    return float(np.linalg.norm(replace(piece, machine=found).laid_aside_mm(true), axis=1).max())
