"""Calibration piece: a print of `demo:calibration`, which shows where the rotary axes are.

Its pads are on its roofs, each printed at a pose of its own; the roof below was printed at the level pose. The offset of a pad
shows the error of the axes: the program aims at a point of the workpiece, and the pad is where the true machine had its tip.

A few readings do not determine all numbers equally well: undetermined ones stay at the profile's values. The estimate minimises
the squares of readings and changes, each relative to its usual error (maximum a posteriori with independent normal errors).
"""

import json
from collections.abc import Sequence
from dataclasses import dataclass
from html import escape
from math import isnan
from pathlib import Path

import numpy as np

from machine.gcode.reader.parsed import MoveKind, ParsedProgram, pose_runs
from machine.kinematics.table import machine_points, workpiece_path, workpiece_points
from machine.setup.calibration.fit import least_squares, machine_with, numbers_of, slope_of
from mdp.directions.unit_vectors import frame_across
from mdp.mesh import Floats
from mdp.pose import UP, Pose, rotation, unit
from profiles.errors import ProfileError
from profiles.machine import Machine
from profiles.messages import option

PADS = 4
LEAST_LEAN_DEG = 10.0
EVEN_DEG = 1.0
WAYS = ("right", "up", "height")  # seen from outside, the pad's holes above
MARK_MM = 0.1
HEIGHT_MM = 1.2  # height of a pad at its nominal place
MOST_MARKS = 30.0
MOST_HEIGHT_MM = 4.0
NOT_READ = "-"
EXPECTED = f"two marks and a height are expected, such as 2,-1,1.25, {NOT_READ} for what was not read"
UNKNOWN = ("turn.point_mm x", "turn.point_mm y", "tilt.point_mm", "tilt.point_mm", "tilt.zero_deg")
USUAL = np.array([0.5, 0.5, 0.5, 0.5, 0.5])  # error before the first piece, mm and deg
READ_MM = np.array([0.05, 0.05, 0.07])  # reading error in each direction
# All pads of a piece may appear this much too far up and above their roofs, for a roof has steps and plastic swells.
BIAS_MM = np.array([0.0, 0.05, 0.1])
LEAST_READINGS = 4
DOUBTFUL_MM = 0.2
TEMPLATE = Path(__file__).parent / "piece.html"


@dataclass(frozen=True, eq=False)
class Pad:
    """A small plate on a roof of the calibration piece, whose offset is measured.

    number: number of holes in the pad, by which the user recognises it; pose: pose in which the pad was printed; middle_mm: (3,)
    centre of its underside, workpiece frame; ways: (3, 3) unit vectors to the right, upwards and away from its roof, workpiece
    frame.
    """

    number: int
    pose: Pose
    middle_mm: Floats
    ways: Floats


@dataclass(frozen=True, eq=False)
class Piece:
    """A printed calibration piece.

    machine: the machine for which the G-code was made; base: pose in which the roofs were printed; pads: by ascending number.
    """

    machine: Machine
    base: Pose
    pads: tuple[Pad, ...]

    def laid_aside_mm(self, true: Machine) -> Floats:
        """(pads, 3) offset of each pad from its nominal place, along its `ways`, if the real axes are those of `true`."""
        errors = [self._error_mm(true, pad, pad.pose) - self._error_mm(true, pad, self.base) for pad in self.pads]
        return np.array([pad.ways @ error for pad, error in zip(self.pads, errors, strict=True)])

    def slope(self) -> Floats:
        """(pads x ways, UNKNOWN) derivatives of the readings with respect to the calibrated values of the machine."""
        return slope_of(lambda changes: _explained(self.machine, [self], changes), np.zeros(len(UNKNOWN)))

    def _error_mm(self, true: Machine, pad: Pad, pose: Pose) -> Floats:
        aimed = machine_points(self.machine, pose, pad.middle_mm[None])
        error: Floats = workpiece_points(true, pose, aimed)[0] - pad.middle_mm
        return error


def read_piece(program: ParsedProgram, machine: Machine, name: str) -> Piece:
    """The calibration piece that a G-code program prints on a machine. Raises ProfileError for a program of another model."""
    poses, middles = _laid(program, machine)
    if sorted(poses) != list(range(1, PADS + 2)):
        raise ProfileError(f"{name} prints {len(poses)} parts: a program of demo:calibration has {PADS + 1}")
    pads = tuple(_pad(part - 1, poses[part], middles[part], machine) for part in range(2, PADS + 2))
    heading = [np.degrees(np.arctan2(pad.ways[2, 1], pad.ways[2, 0])) for pad in pads]
    quarters = np.diff(heading) % 360.0
    level = float(rotation(machine, poses[1])[2] @ UP)
    leans = np.degrees(np.arccos(np.clip([pad.ways[2, 2] for pad in pads], -1.0, 1.0)))
    alike = leans.min() >= LEAST_LEAN_DEG and np.ptp(leans) <= EVEN_DEG
    if level < np.cos(np.radians(EVEN_DEG)) or (np.abs(quarters - 90.0) > EVEN_DEG).any() or not alike:
        raise ProfileError(f"{name} is not a program of demo:calibration: its parts are placed differently")
    return Piece(machine, poses[1], pads)


def _laid(program: ParsedProgram, machine: Machine) -> tuple[dict[int, Pose], dict[int, Floats]]:
    """Pose of each part's beads, and the centre of the lowest of them."""
    poses: dict[int, Pose] = {}
    middles: dict[int, Floats] = {}
    parts = program.part
    for run, pose in pose_runs(program):
        rows = run.start + np.flatnonzero(program.kind[run] == MoveKind.EXTRUDE)
        for part in np.unique(parts[rows]).tolist():
            own = rows[parts[rows] == part]
            lowest = own[program.end[own, 2] <= program.end[own, 2].min() + 1e-3]
            if part > 0 and poses.setdefault(part, pose) == pose and part not in middles:
                points = workpiece_path(machine, program.end[lowest])
                middles[part] = 0.5 * (points.min(axis=0) + points.max(axis=0))
    return poses, middles


def _pad(number: int, pose: Pose, middle_mm: Floats, machine: Machine) -> Pad:
    away = rotation(machine, pose)[2]
    right = unit(np.cross(UP, away)) if abs(away @ UP) < 1.0 - 1e-6 else np.array([1.0, 0.0, 0.0])
    return Pad(number, pose, middle_mm, np.array([right, np.cross(away, right), away]))


def parse_readings(text: str) -> Floats:
    """(pads, 3) mm aside, up and too high, nan if not read, from a text such as `2,-1,1.25 0,0.5,- -,-,- 1,0,1.2`.

    Raises ProfileError for another format, or for impossible numbers.

    >>> parse_readings("2,-1,1.25 0,0.5,- -,-,- 1,0,1.2")[0].round(6).tolist()
    [0.2, -0.1, 0.05]
    """
    pads = text.split()
    if len(pads) != PADS:
        raise ProfileError(f"{option('readings')} {text!r} has {len(pads)} pads: {PADS} are expected, with a space between them")
    return np.array([parse_pad(pad, number) for number, pad in enumerate(pads, start=1)])


def parse_pad(text: str, number: int) -> list[float]:
    """The three readings of a pad in mm, nan if not read. Raises ProfileError naming the pad."""
    try:
        values = [float("nan") if word == NOT_READ else float(word) for word in text.replace(",", " ").split()]
    except ValueError:
        values = []
    if len(values) not in (2, 3):
        raise ProfileError(f"pad {number}: {text!r} cannot be read: {EXPECTED}")
    values += [float("nan")] * (3 - len(values))
    for way, value, most in zip(WAYS, values, (MOST_MARKS, MOST_MARKS, MOST_HEIGHT_MM), strict=True):
        least = 0.0 if way == "height" else -most
        if not isnan(value) and not least <= value <= most:
            raise ProfileError(f"pad {number}: {way} {value:g} cannot be: {least:g} to {most:g} is allowed")
    return [MARK_MM * values[0], MARK_MM * values[1], values[2] - HEIGHT_MM]


def readings_text(readings_mm: Floats) -> str:
    """The text from which `parse_readings` makes these readings."""
    marks = (readings_mm + np.array([0.0, 0.0, HEIGHT_MM])) / np.array([MARK_MM, MARK_MM, 1.0])
    words = [[NOT_READ if isnan(value) else f"{round(value, 3) + 0.0:g}" for value in pad] for pad in marks.tolist()]
    return " ".join(map(",".join, words))


@dataclass(frozen=True, eq=False)
class Correction:
    """A corrected machine. left_mm: residual of each reading (pieces x pads, 3; nan: not read); sigma: uncertainty of each
    number, one sigma, mm or deg, in the order of UNKNOWN; changes: of the numbers, in that order."""

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
        """Piece, pad and direction of the reading that fits worst, each from 1; None if all fit."""
        off = np.nan_to_num(np.abs(self.left_mm))
        worst = np.unravel_index(int(off.argmax()), off.shape)
        if off[worst] <= DOUBTFUL_MM:
            return None
        piece, pad = divmod(int(worst[0]), PADS)
        return piece + 1, pad + 1, WAYS[int(worst[1])]


def correct(machine: Machine, pieces: Sequence[Piece], readings_mm: Floats) -> Correction:
    """The machine that explains (pieces, pads, 3) readings, nan for missing ones. Raises ProfileError for too few."""
    read = ~np.isnan(readings_mm).reshape(-1)
    if read.sum() < LEAST_READINGS:
        raise ProfileError(f"{read.sum()} readings of the pads are given: at least {LEAST_READINGS} are needed")
    target, weights = readings_mm.reshape(-1)[read], np.tile(1.0 / READ_MM, readings_mm.size // len(READ_MM))[read]
    places = np.kron(np.eye(len(pieces)), _biases(pieces[0]))[read]

    def left(state: Floats) -> Floats:  # numbers, then biases, each relative to its usual error
        explained = _explained(machine, pieces, USUAL * state[: len(UNKNOWN)])[read]
        return (explained + places @ state[len(UNKNOWN) :] - target) * weights

    state, off = least_squares(left, np.zeros(len(UNKNOWN) + places.shape[1]), pull=1.0, little=0.0)
    slope = slope_of(left, state)
    left_mm = np.full(readings_mm.size, np.nan)
    left_mm[read] = -off / weights
    variances = np.diag(np.linalg.inv(slope.T @ slope + np.eye(len(state))))
    sigma, changes = (USUAL * values[: len(UNKNOWN)] for values in (np.sqrt(variances), state))
    return Correction(_changed(machine, changes), left_mm.reshape(-1, len(WAYS)), sigma, changes)


def _biases(piece: Piece) -> Floats:
    """(pads x ways, biases) effect of each bias, at its usual size, on the readings of a piece."""
    return np.tile(np.diag(BIAS_MM)[:, BIAS_MM > 0.0], (len(piece.pads), 1))


def _explained(machine: Machine, pieces: Sequence[Piece], changes: Floats) -> Floats:
    true = _changed(machine, changes)
    return np.concatenate([piece.laid_aside_mm(true).reshape(-1) for piece in pieces])


def _changed(machine: Machine, changes: Floats) -> Machine:
    """The machine with changed numbers, in the order of UNKNOWN; the tilt axis moves across itself."""
    return machine_with(machine, numbers_of(machine) + np.insert(changes, 2, 0.0))


def piece_page(piece: Piece, machine_name: str, file_name: str) -> bytes:
    """The page of a printed piece; machine_name and file_name are used in its command that saves the corrections.

    Its script adds one reading after another to the estimate of `correct`, with the slope at the profile's numbers.
    """
    machine = piece.machine
    values = {
        "machine": machine_name,
        "file": file_name,
        "markMm": MARK_MM,
        "heightMm": HEIGHT_MM,
        "slope": np.hstack([piece.slope(), _biases(piece)]).tolist(),
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
