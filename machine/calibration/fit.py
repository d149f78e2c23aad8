"""Fit: the signs, zeros and points of both rotary axes that put every touch onto one mark of the table, by least squares.

The mark is a point fixed to the table at a known height over its surface. Where the tip touches it at several poses, the forward
kinematics must give the same workpiece point each time. Unknown are the mark's place, the point at which the turn axis meets the
table, the tilt axis's place across itself, the tilt at which the table is level, and both signs.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from math import atan2, cos, degrees, radians, sin

import numpy as np

from machine.kinematics.table import workpiece_path
from mdp.mesh import Floats
from mdp.pose import UP, Pose, unit
from profiles.errors import ProfileError
from profiles.machine import Machine

TURN_POINT = tuple(f"turn.point_mm {letter}" for letter in "xyz")
UNKNOWN = (*TURN_POINT, "tilt.point_mm", "tilt.point_mm", "tilt.zero_deg", "the mark's x", "the mark's y")
SIGNS = ((-1, -1), (-1, 1), (1, -1), (1, 1))
UPSIDE_DOWN_DEG = 90.0
STARTS_DEG = (0.0, 25.0, -25.0)
ROUNDS = 40
STEP = 1e-4
LEAST_SHARE = 1e-4  # a number that moves no touch by this share of its change is not determined by them
APART = 4.0  # the next best signs must fit this much worse
LEAST_MM = 1e-3
GOOD_MM = 0.5  # a fit as good as this needs no other start


@dataclass(frozen=True)
class Touch:
    """X Y Z at which the tip touched the mark (or, with on_plate, the table's surface anywhere) at a pose."""

    pose: Pose
    at_mm: tuple[float, float, float]
    on_plate: bool = False


@dataclass(frozen=True)
class Calibration:
    """A machine with the found numbers, how far the touches are from them, and how sure each number is (one sigma)."""

    machine: Machine
    mark_mm: tuple[float, float, float]
    residuals_mm: tuple[float, ...]
    sigma: dict[str, float]

    @property
    def rms_mm(self) -> float:
        """Root mean square of how far the touches are from the mark."""
        return float(np.sqrt(np.mean(np.square(self.residuals_mm))))

    @property
    def worst(self) -> int:
        """Which touch, counted from 1, is farthest off."""
        return int(np.argmax(self.residuals_mm)) + 1


def calibrate(
    machine: Machine, touches: Sequence[Touch], mark_height_mm: float = 0.0, mark_angle_deg: float | None = None
) -> Calibration:
    """The machine whose kinematics put all touches onto one mark mark_height_mm above the table.

    mark_angle_deg: where the mark is seen from the turn axis, counted from the workpiece's +x: then turn.zero_deg is found
    too, else it stays. Raises ProfileError when the touches cannot tell all numbers or both signs.
    """
    _check_count(touches)
    fits: list[tuple[float, tuple[int, int], Floats]] = []
    for start_deg in STARTS_DEG:
        fits += [_fit(machine, signs, start_deg, touches, mark_height_mm) for signs in SIGNS]
        if min(fits, key=lambda fit: fit[0])[0] < GOOD_MM**2:
            break
    best = [min((fit for fit in fits if fit[1] == signs), key=lambda fit: fit[0]) for signs in SIGNS]
    ranked = sorted(best, key=lambda fit: fit[0])
    (cost, signs, numbers), (next_cost, next_signs, _) = ranked[:2]
    if next_cost < APART**2 * cost + LEAST_MM**2:
        axis = machine.tilt if signs[0] != next_signs[0] else machine.turn
        raise ProfileError(
            f"the touches do not tell the sign of {axis.letter}: touch the mark at turns 0, 90, 180 and 270 and at two tilts"
        )
    sigma = _sigma(machine, signs, numbers, touches, mark_height_mm)
    calibrated = _machine_with(machine, signs, numbers)
    mark = (float(numbers[6]), float(numbers[7]), mark_height_mm)
    if mark_angle_deg is not None:
        calibrated, mark = _set_turn_zero(calibrated, mark, mark_angle_deg)
    least, most = machine.tilt.limits_deg
    if not least <= calibrated.tilt.zero_deg <= most:
        raise ProfileError(
            f"the table would be level at {machine.tilt.letter}{calibrated.tilt.zero_deg:.2f}, outside tilt.limits_deg "
            f"{list(machine.tilt.limits_deg)}: check the touches"
        )
    off = _residuals(machine, signs, numbers, touches, mark_height_mm)
    owner = np.repeat(np.arange(len(touches)), [1 if touch.on_plate else 3 for touch in touches])
    return Calibration(calibrated, mark, tuple(np.sqrt(np.bincount(owner, weights=off**2)).tolist()), sigma)


def _check_count(touches: Sequence[Touch]) -> None:
    coordinates = sum(1 if touch.on_plate else 3 for touch in touches)
    if coordinates < len(UNKNOWN):
        raise ProfileError(
            f"{len(touches)} touches tell {coordinates} numbers, {len(UNKNOWN)} are sought: touch the mark more often"
        )
    tilts = {round(touch.pose.tilt_deg, 1) for touch in touches}
    if len(tilts) < 2:
        raise ProfileError(f"all touches are at tilt {tilts.pop():g}: the tilt axis is found from two tilts or more")


def _fit(
    machine: Machine, signs: tuple[int, int], start_deg: float, touches: Sequence[Touch], height_mm: float
) -> tuple[float, tuple[int, int], Floats]:
    """Mean square, signs and numbers of the best fit with these signs that begins at a zero so far from the profile's."""
    cost, numbers = _descend(machine, signs, _start(machine, signs, touches, start_deg), touches, height_mm)
    if abs(numbers[5] - machine.tilt.zero_deg) > UPSIDE_DOWN_DEG:  # turning the other way fits a table seen from below
        cost = np.inf
    return cost, signs, numbers


def _start(machine: Machine, signs: tuple[int, int], touches: Sequence[Touch], start_deg: float) -> Floats:
    """The profile's own numbers, the mark where the first touches put it."""
    across = _across(machine)
    tilt_point = np.array(machine.tilt.point_mm)
    numbers = np.array([*machine.turn.point_mm, *(across @ tilt_point), machine.tilt.zero_deg + start_deg, 0.0, 0.0])
    marks = workpiece_path(_machine_with(machine, signs, numbers), _positions([t for t in touches if not t.on_plate] or touches))
    numbers[6:8] = marks[:, :2].mean(axis=0)
    return numbers


def _descend(
    machine: Machine, signs: tuple[int, int], numbers: Floats, touches: Sequence[Touch], height_mm: float
) -> tuple[float, Floats]:
    """Mean square and numbers at the bottom: Levenberg's damped least squares."""
    damping, here = 1e-3, _residuals(machine, signs, numbers, touches, height_mm)
    for _ in range(ROUNDS):
        slope = _slope(machine, signs, numbers, touches, height_mm)
        normal = slope.T @ slope
        step = np.linalg.lstsq(normal + damping * np.diag(np.diag(normal) + 1e-9), -slope.T @ here, rcond=None)[0]
        tried = _residuals(machine, signs, numbers + step, touches, height_mm)
        if tried @ tried < here @ here:
            numbers, here, damping = numbers + step, tried, damping * 0.2
        else:
            damping *= 8.0
        if np.abs(step).max() < 1e-9 or damping > 1e7:
            break
    return float(here @ here) / len(here), numbers


def _residuals(machine: Machine, signs: tuple[int, int], numbers: Floats, touches: Sequence[Touch], height_mm: float) -> Floats:
    """Where the touches lie from the mark, x y z each; of a touch on the plate the height over the table alone."""
    seen = workpiece_path(_machine_with(machine, signs, numbers), _positions(touches))
    off = seen - np.array([numbers[6], numbers[7], height_mm])
    off[[touch.on_plate for touch in touches], 2] += height_mm
    measured = np.array([[not touch.on_plate, not touch.on_plate, True] for touch in touches])
    residuals: Floats = off[measured]
    return residuals


def _slope(machine: Machine, signs: tuple[int, int], numbers: Floats, touches: Sequence[Touch], height_mm: float) -> Floats:
    """Derivative of the residuals by each number, from both sides."""
    columns = []
    for k in range(len(numbers)):
        step = np.zeros(len(numbers))
        step[k] = STEP
        ahead, behind = (_residuals(machine, signs, numbers + s * step, touches, height_mm) for s in (1.0, -1.0))
        columns.append((ahead - behind) / (2.0 * STEP))
    return np.column_stack(columns)


def _sigma(
    machine: Machine, signs: tuple[int, int], numbers: Floats, touches: Sequence[Touch], height_mm: float
) -> dict[str, float]:
    """How sure each number is; raises ProfileError for those that the touches do not tell."""
    slope = _slope(machine, signs, numbers, touches, height_mm)
    _, sizes, directions = np.linalg.svd(slope, full_matrices=False)
    if len(sizes) < len(numbers) or sizes[-1] < LEAST_SHARE * sizes[0]:
        lost = np.abs(directions[-1])
        names = dict.fromkeys(name for name, share in zip(UNKNOWN, lost, strict=True) if share > 0.3 * lost.max())
        raise ProfileError(f"the touches do not tell {' and '.join(names)}: touch the mark at four turns and at two more tilts")
    off = _residuals(machine, signs, numbers, touches, height_mm)
    variance = float(off @ off) / max(1, len(off) - len(numbers))
    spread = np.sqrt(np.diag((directions.T / sizes**2) @ directions) * variance)
    named = zip(UNKNOWN, spread.tolist(), strict=True)
    sigma: dict[str, float] = {}
    for name, value in named:
        sigma[name] = max(value, sigma.get(name, 0.0))
    return sigma


def _machine_with(machine: Machine, signs: tuple[int, int], numbers: Floats) -> Machine:
    """The machine with these numbers; along its own axis the tilt's point stays where the profile has it."""
    along = unit(machine.tilt.axis)
    point = along * (along @ np.array(machine.tilt.point_mm)) + numbers[3:5] @ _across(machine)
    tilt = machine.tilt.model_copy(
        update={"sign": signs[0], "zero_deg": float(numbers[5]), "point_mm": tuple(float(x) for x in point)}
    )
    turn = machine.turn.model_copy(update={"sign": signs[1], "point_mm": tuple(float(x) for x in numbers[:3])})
    return machine.model_copy(update={"tilt": tilt, "turn": turn})


def _across(machine: Machine) -> Floats:
    """(2, 3) unit vectors across the tilt axis."""
    along = unit(machine.tilt.axis)
    first = unit(np.cross(along, UP if abs(along[2]) < 0.9 else np.array([1.0, 0.0, 0.0])))
    return np.array([first, np.cross(along, first)])


def _set_turn_zero(
    machine: Machine, mark_mm: tuple[float, float, float], angle_deg: float
) -> tuple[Machine, tuple[float, float, float]]:
    """The machine whose turn.zero_deg puts the mark into a direction of the workpiece."""
    seen_deg, radius = degrees(atan2(mark_mm[1], mark_mm[0])), float(np.hypot(*mark_mm[:2]))
    upright = 1.0 if machine.turn.axis[2] > 0 else -1.0
    moved = (angle_deg - seen_deg) * -machine.turn.sign * upright
    zero = (machine.turn.zero_deg + moved + 180.0) % 360.0 - 180.0
    angle = radians(angle_deg)
    turn = machine.turn.model_copy(update={"zero_deg": zero})
    return machine.model_copy(update={"turn": turn}), (radius * cos(angle), radius * sin(angle), mark_mm[2])


def _positions(touches: Sequence[Touch]) -> Floats:
    """(n, 5) X Y Z tilt turn of the touches."""
    return np.array([[*touch.at_mm, touch.pose.tilt_deg, touch.pose.turn_deg] for touch in touches])
