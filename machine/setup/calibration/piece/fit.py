"""Fit: the axes that explain how the pads of printed calibration pieces lie, as near to the profile's as the readings let them.

Few readings cannot tell all numbers alike: what they do not tell stays where the profile has it. The least sum of squares of
readings and of changes, each as a share of how far it is usually off (a maximum a posteriori estimate with independent normal
errors), by Gauss's and Newton's steps.
"""

import json
from collections.abc import Sequence
from dataclasses import dataclass
from html import escape
from pathlib import Path

import numpy as np

from machine.setup.calibration.piece.pads import HEIGHT_MM, MARK_MM, PADS, WAYS, Piece
from mdp.directions.unit_vectors import frame_across
from mdp.mesh import Floats
from mdp.pose import unit
from profiles.errors import ProfileError
from profiles.machine import Machine

UNKNOWN = ("turn.point_mm x", "turn.point_mm y", "tilt.point_mm", "tilt.point_mm", "tilt.zero_deg")
USUAL = np.array([0.5, 0.5, 0.5, 0.5, 0.5])  # how far they are off before the first piece, mm and deg
READ_MM = np.array([0.05, 0.05, 0.07])  # how well each way is read
# All pads of a piece may seem to lie so much higher up their roofs and over them: a roof is steps, and plastic swells.
BIAS_MM = np.array([0.0, 0.05, 0.1])
LEAST_READINGS = 4
ROUNDS = 20
STEP, SETTLED = 1e-4, 1e-7
DOUBTFUL_MM = 0.2
TEMPLATE = Path(__file__).parent / "page.html"


@dataclass(frozen=True, eq=False)
class Correction:
    """A machine with the found numbers, what each reading differs from them (pieces x pads, 3; nan: not read), and how sure each
    number is: one sigma, mm or deg, in the order of UNKNOWN."""

    machine: Machine
    left_mm: Floats
    sigma: Floats
    changes: Floats

    @property
    def significant(self) -> bool:
        """Whether any number changes by more than its uncertainty."""
        return bool((np.abs(self.changes) > self.sigma).any())

    @property
    def doubtful(self) -> tuple[int, int, str] | None:
        """Piece, pad and way of the reading that fits least, each counted from 1; None where all fit."""
        off = np.nan_to_num(np.abs(self.left_mm))
        worst = np.unravel_index(int(off.argmax()), off.shape)
        if off[worst] <= DOUBTFUL_MM:
            return None
        piece, pad = divmod(int(worst[0]), PADS)
        return piece + 1, pad + 1, WAYS[int(worst[1])]


def correct(machine: Machine, pieces: Sequence[Piece], readings_mm: Floats) -> Correction:
    """The machine that explains (pieces, pads, 3) readings, nan where one was not taken.

    Raises ProfileError for too few of them.
    """
    read = ~np.isnan(readings_mm).reshape(-1)
    if read.sum() < LEAST_READINGS:
        raise ProfileError(f"{read.sum()} readings of the pads are told: at least {LEAST_READINGS} are needed")
    target, weights = readings_mm.reshape(-1)[read], np.tile(1.0 / READ_MM, readings_mm.size // len(READ_MM))[read]
    places = np.kron(np.eye(len(pieces)), _biases(pieces[0]))[read]
    state = np.zeros(len(UNKNOWN) + places.shape[1])  # of numbers and biases, each as a share of what is usual
    for _ in range(ROUNDS):
        changes, biases = USUAL * state[: len(UNKNOWN)], state[len(UNKNOWN) :]
        left = target - _explained(machine, pieces, changes)[read] - places @ biases
        slope = np.hstack([_slope(machine, pieces, changes)[read] * USUAL, places]) * weights[:, None]
        system = np.vstack([slope, np.eye(len(state))])
        step = np.linalg.lstsq(system, np.append(left * weights, -state), rcond=None)[0]
        if np.abs(step).max() < SETTLED:
            break
        state = state + step
    off = np.full(readings_mm.size, np.nan)
    off[read] = left
    sigma = USUAL * np.sqrt(np.diag(np.linalg.inv(system.T @ system))[: len(UNKNOWN)])
    return Correction(_changed(machine, changes), off.reshape(-1, len(WAYS)), sigma, changes)


def slope_of(machine: Machine, piece: Piece) -> Floats:
    """(pads x ways, UNKNOWN) by how much a reading of a piece changes where a number of a machine changes by 1."""
    return _slope(machine, [piece], np.zeros(len(UNKNOWN)))


def _biases(piece: Piece) -> Floats:
    """(pads x ways, biases) by how much each reading of a piece is off where a bias is as large as usual."""
    return np.tile(np.diag(BIAS_MM)[:, BIAS_MM > 0.0], (len(piece.pads), 1))


def _explained(machine: Machine, pieces: Sequence[Piece], changes: Floats) -> Floats:
    true = _changed(machine, changes)
    return np.concatenate([piece.laid_aside_mm(true).reshape(-1) for piece in pieces])


def _slope(machine: Machine, pieces: Sequence[Piece], changes: Floats) -> Floats:
    columns = [
        _explained(machine, pieces, changes + step) - _explained(machine, pieces, changes - step)
        for step in STEP * np.eye(len(UNKNOWN))
    ]
    return np.column_stack(columns) / (2.0 * STEP)


def _changed(machine: Machine, changes: Floats) -> Machine:
    """The machine whose numbers differ so from its own, in the order of UNKNOWN; the tilt axis moves across itself."""
    x, y, z = machine.turn.point_mm
    tilt_point = np.array(machine.tilt.point_mm) + changes[2:4] @ frame_across(unit(machine.tilt.axis))
    tilt = {"point_mm": tuple(tilt_point.tolist()), "zero_deg": machine.tilt.zero_deg + float(changes[4])}
    turn = {"point_mm": (x + float(changes[0]), y + float(changes[1]), z)}
    update = {"tilt": machine.tilt.model_copy(update=tilt), "turn": machine.turn.model_copy(update=turn)}
    return machine.model_copy(update=update)


def piece_page(piece: Piece, machine_name: str, file_name: str) -> bytes:
    """The page of a printed piece; machine_name and file_name are those of the command that saves the corrections.

    Its script adds reading after reading to the estimate of `correct`, with the slope at the profile's own numbers.
    """
    machine = piece.machine
    values = {
        "machine": machine_name,
        "file": file_name,
        "markMm": MARK_MM,
        "heightMm": HEIGHT_MM,
        "slope": np.hstack([slope_of(machine, piece), _biases(piece)]).tolist(),
        "usual": [*USUAL.tolist(), *[1.0] * np.count_nonzero(BIAS_MM)],
        "readMm": READ_MM.tolist(),
        "turnMm": list(machine.turn.point_mm),
        "tiltMm": list(machine.tilt.point_mm),
        "acrossTilt": frame_across(unit(machine.tilt.axis)).tolist(),
        "zeroDeg": machine.tilt.zero_deg,
        "letters": [machine.turn.letter, machine.tilt.letter],
    }
    packed = json.dumps(values, allow_nan=False).replace("<", "\\u003c")
    text = TEMPLATE.read_text(encoding="utf-8")
    return text.replace("<!--TITLE-->", escape(f"{file_name} on {machine.name}")).replace("/*VALUES*/", packed).encode()
