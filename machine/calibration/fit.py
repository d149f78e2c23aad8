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


@dataclass(frozen=True, eq=False)
class _Guess:
    """One choice of both signs, and the touches that (8,) numbers in the order of UNKNOWN are to explain."""

    machine: Machine
    signs: tuple[int, int]
    touches: Sequence[Touch]
    height_mm: float

    def fit(self, start_deg: float) -> tuple[float, Floats]:
        """Mean square and numbers of the best fit from a zero so far from the profile's, by Levenberg's damped least squares."""
        numbers = self._start(start_deg)
        damping, here = 1e-3, self.residuals(numbers)
        for _ in range(ROUNDS):
            slope = self._slope(numbers)
            normal = slope.T @ slope
            step = np.linalg.lstsq(normal + damping * np.diag(np.diag(normal) + 1e-9), -slope.T @ here, rcond=None)[0]
            tried = self.residuals(numbers + step)
            if tried @ tried < here @ here:
                numbers, here, damping = numbers + step, tried, damping * 0.2
            else:
                damping *= 8.0
            if np.abs(step).max() < 1e-9 or damping > 1e7:
                break
        if abs(numbers[5] - self.machine.tilt.zero_deg) > UPSIDE_DOWN_DEG:  # the other way round fits a table seen from below
            return np.inf, numbers
        return float(here @ here) / len(here), numbers

    def _start(self, start_deg: float) -> Floats:
        """The profile's own numbers, the mark where the first touches put it."""
        machine = self.machine
        tilt_across = _across(machine) @ np.array(machine.tilt.point_mm)
        numbers = np.array([*machine.turn.point_mm, *tilt_across, machine.tilt.zero_deg + start_deg, 0.0, 0.0])
        of_mark = [touch for touch in self.touches if not touch.on_plate] or self.touches
        numbers[6:8] = workpiece_path(self.machine_with(numbers), _positions(of_mark))[:, :2].mean(axis=0)
        return numbers

    def residuals(self, numbers: Floats) -> Floats:
        """Where the touches lie from the mark, x y z each; of a touch on the plate the height over the table alone."""
        seen = workpiece_path(self.machine_with(numbers), _positions(self.touches))
        off = seen - np.array([numbers[6], numbers[7], self.height_mm])
        off[[touch.on_plate for touch in self.touches], 2] += self.height_mm
        residuals: Floats = off[np.array([[not touch.on_plate, not touch.on_plate, True] for touch in self.touches])]
        return residuals

    def _slope(self, numbers: Floats) -> Floats:
        """Derivative of the residuals by each number, from both sides."""
        steps = STEP * np.eye(len(numbers))
        return np.column_stack([(self.residuals(numbers + h) - self.residuals(numbers - h)) / (2.0 * STEP) for h in steps])

    def sigma(self, numbers: Floats) -> dict[str, float]:
        """How sure each number is; raises ProfileError for those that the touches do not tell."""
        _, sizes, directions = np.linalg.svd(self._slope(numbers), full_matrices=False)
        if len(sizes) < len(numbers) or sizes[-1] < LEAST_SHARE * sizes[0]:
            lost = np.abs(directions[-1])
            names = dict.fromkeys(name for name, share in zip(UNKNOWN, lost, strict=True) if share > 0.3 * lost.max())
            unknown = " and ".join(names)
            raise ProfileError(f"the touches do not tell {unknown}: touch the mark at four turns and at two more tilts")
        off = self.residuals(numbers)
        variance = float(off @ off) / max(1, len(off) - len(numbers))
        spread = np.sqrt(np.diag((directions.T / sizes**2) @ directions) * variance)
        sigma: dict[str, float] = {}
        for name, value in zip(UNKNOWN, spread.tolist(), strict=True):
            sigma[name] = max(value, sigma.get(name, 0.0))
        return sigma

    def machine_with(self, numbers: Floats) -> Machine:
        """The machine with these numbers; along its own axis the tilt's point stays where the profile has it."""
        machine, along = self.machine, unit(self.machine.tilt.axis)
        point = along * (along @ np.array(machine.tilt.point_mm)) + numbers[3:5] @ _across(machine)
        tilt = {"sign": self.signs[0], "zero_deg": float(numbers[5]), "point_mm": tuple(point.tolist())}
        turn = machine.turn.model_copy(update={"sign": self.signs[1], "point_mm": tuple(numbers[:3].tolist())})
        return machine.model_copy(update={"tilt": machine.tilt.model_copy(update=tilt), "turn": turn})


def calibrate(
    machine: Machine, touches: Sequence[Touch], mark_height_mm: float = 0.0, mark_angle_deg: float | None = None
) -> Calibration:
    """The machine whose kinematics put all touches onto one mark mark_height_mm above the table.

    mark_angle_deg: where the mark is seen from the turn axis, counted from the workpiece's +x: then turn.zero_deg is found
    too, else it stays. Raises ProfileError when the touches cannot tell all numbers or both signs.
    """
    _check_count(touches)
    guesses = [_Guess(machine, signs, touches, mark_height_mm) for signs in SIGNS]
    best: dict[tuple[int, int], tuple[float, Floats]] = {}
    for start_deg in STARTS_DEG:
        for guess in guesses:
            fit = guess.fit(start_deg)
            best[guess.signs] = min(best.get(guess.signs, fit), fit, key=lambda fit: fit[0])
        if min(cost for cost, _ in best.values()) < GOOD_MM**2:
            break
    first, second = sorted(guesses, key=lambda guess: best[guess.signs][0])[:2]
    cost, numbers = best[first.signs]
    if best[second.signs][0] < APART**2 * cost + LEAST_MM**2:
        axis = machine.tilt if first.signs[0] != second.signs[0] else machine.turn
        raise ProfileError(
            f"the touches do not tell the sign of {axis.letter}: touch the mark at turns 0, 90, 180 and 270 and at two tilts"
        )
    sigma = first.sigma(numbers)
    calibrated = first.machine_with(numbers)
    mark = (float(numbers[6]), float(numbers[7]), mark_height_mm)
    if mark_angle_deg is not None:
        calibrated, mark = _set_turn_zero(calibrated, mark, mark_angle_deg)
    least, most = machine.tilt.limits_deg
    if not least <= calibrated.tilt.zero_deg <= most:
        raise ProfileError(
            f"the table would be level at {machine.tilt.letter}{calibrated.tilt.zero_deg:.2f}, outside tilt.limits_deg "
            f"{list(machine.tilt.limits_deg)}: check the touches"
        )
    off = first.residuals(numbers)
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
