"""Fit: the signs, zeros and points of both rotary axes that put every touch onto one mark of the table, by least squares.

The mark is a point fixed to the table at a known height over its surface. Where the tip touches it at several poses, the forward
kinematics must give the same workpiece point each time. Unknown are the mark's place, the point at which the turn axis meets the
table, the tilt axis's place across itself, the tilt at which the table is level, and both signs; where they are asked for, also
the directions of the axes: two small angles of the tilt axis, and the turn axis's lean along it; about it is the tilt's zero.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from math import acos, atan2, cos, degrees, radians, sin

import numpy as np

from machine.kinematics.table import workpiece_path
from mdp.directions.unit_vectors import frame_across
from mdp.mesh import Floats
from mdp.pose import Pose, unit
from profiles.errors import ProfileError
from profiles.machine import UPRIGHT, Machine

TURN_POINT = tuple(f"turn.point_mm {letter}" for letter in "xyz")
UNKNOWN = (*TURN_POINT, "tilt.point_mm", "tilt.point_mm", "tilt.zero_deg", "the mark's x", "the mark's y")
DIRECTIONS = ("tilt.axis", "tilt.axis", "turn.axis")  # angles in degrees from where the profile has the axes
SIGNS = ((-1, -1), (-1, 1), (1, -1), (1, 1))
UPSIDE_DOWN_DEG = 90.0
STARTS_DEG = (0.0, 25.0, -25.0)
ROUNDS = 40
STEP = 1e-4
PULL = 0.01  # a touch is some hundredths of a mm off, a profile's numbers some mm
LITTLE = 1e-7  # a squared sum that falls by a smaller share is the least
HOPELESS = 400.0  # times the mean square of the best signs: such others are not worth another fit
SETTLED = 1e-7  # mm and deg: numbers that change by less are found
LEAST_SHARE = 1e-4  # a number that moves no touch by this share of its change is not determined by them
APART = 4.0  # the next best signs must fit this much worse
LEAST_MM = 1e-3
MOST_LEAN_DEG = degrees(acos(UPRIGHT))  # of a turn axis that a profile may have
GOOD_MM = 0.5  # a fit as good as this needs no other start


@dataclass(frozen=True)
class Touch:
    """X Y Z at which the tip touched the mark (or, with on_plate, the table's surface anywhere) at a pose."""

    pose: Pose
    at_mm: tuple[float, float, float]
    on_plate: bool = False


@dataclass(frozen=True)
class Calibration:
    """A machine with the found numbers, how far the touches are from them, and how sure each number is (one sigma, mm or deg).

    errors_mm: X Y Z of each residual, in the workpiece frame.
    """

    machine: Machine
    mark_mm: tuple[float, float, float]
    errors_mm: tuple[tuple[float, float, float], ...]
    sigma: dict[str, float]

    @property
    def residuals_mm(self) -> tuple[float, ...]:
        """How far each touch is from the mark."""
        return tuple(float(np.linalg.norm(error)) for error in self.errors_mm)

    @property
    def directions(self) -> bool:
        """Whether the directions of the axes were sought, too."""
        return DIRECTIONS[0] in self.sigma

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
    """One choice of both signs, and the touches that numbers are to explain: (8,) as in UNKNOWN, (11,) with DIRECTIONS."""

    machine: Machine
    signs: tuple[int, int]
    touches: Sequence[Touch]
    height_mm: float

    def fit(self, start_deg: float) -> tuple[float, Floats]:
        """Mean square and numbers of the best fit from a zero so far from the profile's, the axes directed as it says."""
        return self.improved(self._start(start_deg))

    def improved(self, numbers: Floats, pull: float = 0.0) -> tuple[float, Floats]:
        """Mean square and numbers of the best fit near to some numbers, by Levenberg's damped least squares.

        pull: how strongly they are drawn to where they begin, as a share of a touch's own weight: what the touches do not tell
        stays there.
        """
        usual, damping, here = numbers, 1e-3, np.append(self.residuals(numbers), np.zeros(len(numbers)))
        for _ in range(ROUNDS):
            slope = np.vstack([self._slope(numbers), pull * np.eye(len(numbers))])
            normal = slope.T @ slope
            step = np.linalg.lstsq(normal + damping * np.diag(np.diag(normal) + 1e-9), -slope.T @ here, rcond=None)[0]
            tried = np.append(self.residuals(numbers + step), pull * (numbers + step - usual))
            if tried @ tried < here @ here:
                settled = tried @ tried > (1.0 - LITTLE) * (here @ here)
                numbers, here, damping = numbers + step, tried, damping * 0.2
                if settled:
                    break
            else:
                damping *= 8.0
            if np.abs(step).max() < SETTLED or damping > 1e7:
                break
        here = here[: -len(numbers)]
        if abs(numbers[5] - self.machine.tilt.zero_deg) > UPSIDE_DOWN_DEG:  # the other way round fits a table seen from below
            return np.inf, numbers
        return float(here @ here) / len(here), numbers

    def _start(self, start_deg: float) -> Floats:
        """The profile's own numbers, the mark where the first touches put it."""
        machine = self.machine
        tilt_across = frame_across(unit(machine.tilt.axis)) @ np.array(machine.tilt.point_mm)
        numbers = np.array([*machine.turn.point_mm, *tilt_across, machine.tilt.zero_deg + start_deg, 0.0, 0.0])
        of_mark = [touch for touch in self.touches if not touch.on_plate] or self.touches
        numbers[6:8] = workpiece_path(self.machine_with(numbers), _positions(of_mark))[:, :2].mean(axis=0)
        return numbers

    def residuals(self, numbers: Floats) -> Floats:
        """Where the touches lie from the mark, x y z each; of a touch on the plate the height over the table alone.

        (..., k) numbers give (..., residuals): what the kinematics say of many choices at once.
        """
        machine, here = self.machine, _positions(self.touches)
        tilt_axis, tilt_point, turn_axis = (value[..., None, :] for value in self._axes(numbers))
        turn_point, zero_deg = numbers[..., None, :3], numbers[..., 5, None]
        tip = here[:, :3] - np.array(machine.tool_mm) - tilt_point
        tilt = np.radians(self.signs[0] * (here[:, 3] - zero_deg))
        turn = np.radians(self.signs[1] * (here[:, 4] - machine.turn.zero_deg))
        seen = _turned_about(turn_axis, turn, _turned_about(tilt_axis, tilt, tip) + tilt_point - turn_point)
        mark = np.append(numbers[..., 6:8], np.full((*numbers.shape[:-1], 1), self.height_mm), axis=-1)
        off = seen - mark[..., None, :]
        off[..., [touch.on_plate for touch in self.touches], 2] += self.height_mm
        residuals: Floats = off[..., _told(self.touches)]
        return residuals

    def _slope(self, numbers: Floats) -> Floats:
        """Derivative of the residuals by each number, from both sides."""
        steps = STEP * np.eye(len(numbers))
        ahead, behind = self.residuals(np.stack([numbers + steps, numbers - steps]))
        slope: Floats = (ahead - behind).T / (2.0 * STEP)
        return slope

    def _axes(self, numbers: Floats) -> tuple[Floats, Floats, Floats]:
        """(..., 3) each: the tilt axis, a point of it, the turn axis. Along itself that point stays where the profile has it."""
        machine, along = self.machine, unit(self.machine.tilt.axis)
        across = frame_across(along)
        point = along * (along @ np.array(machine.tilt.point_mm)) + numbers[..., 3:5] @ across
        angles = np.tan(np.radians(numbers[..., len(UNKNOWN) :]))
        if angles.shape[-1] == 0:
            angles = np.zeros((*numbers.shape[:-1], len(DIRECTIONS)))
        tilt = along + angles[..., :2] @ across
        turn = unit(machine.turn.axis) + angles[..., 2:] * _lean(machine)
        return _units(tilt), point, _units(turn)

    def sigma(self, numbers: Floats) -> dict[str, float]:
        """How sure each number is; raises ProfileError for those that the touches do not tell."""
        sought = (*UNKNOWN, *DIRECTIONS)[: len(numbers)]
        _, sizes, directions = np.linalg.svd(self._slope(numbers), full_matrices=False)
        if len(sizes) < len(numbers) or sizes[-1] < LEAST_SHARE * sizes[0]:
            lost = np.abs(directions[-1])
            names = dict.fromkeys(name for name, share in zip(sought, lost, strict=True) if share > 0.3 * lost.max())
            unknown = " and ".join(names)
            raise ProfileError(f"the touches do not tell {unknown}: touch the mark at four turns and at two more tilts")
        off = self.residuals(numbers)
        variance = float(off @ off) / max(1, len(off) - len(numbers))
        spread = np.sqrt(np.diag((directions.T / sizes**2) @ directions) * variance)
        sigma: dict[str, float] = {}
        for name, value in zip(sought, spread.tolist(), strict=True):
            sigma[name] = max(value, sigma.get(name, 0.0))
        return sigma

    def machine_with(self, numbers: Floats) -> Machine:
        """The machine with these numbers; directions that are not sought are the profile's own, to the digit."""
        machine, (tilt_axis, point, turn_axis) = self.machine, self._axes(numbers)
        tilt = {"sign": self.signs[0], "zero_deg": float(numbers[5]), "point_mm": tuple(point.tolist())}
        turn = {"sign": self.signs[1], "point_mm": tuple(numbers[:3].tolist())}
        if len(numbers) > len(UNKNOWN):
            tilt["axis"], turn["axis"] = tuple(tilt_axis.tolist()), tuple(turn_axis.tolist())
        changed = {"tilt": machine.tilt.model_copy(update=tilt), "turn": machine.turn.model_copy(update=turn)}
        return machine.model_copy(update=changed)


def calibrate(
    machine: Machine,
    touches: Sequence[Touch],
    mark_height_mm: float = 0.0,
    mark_angle_deg: float | None = None,
    directions: bool = False,
) -> Calibration:
    """The machine whose kinematics put all touches onto one mark mark_height_mm above the table.

    mark_angle_deg: where the mark is seen from the turn axis, counted from the workpiece's +x: then turn.zero_deg is found
    too, else it stays. directions: find those of the axes, too, up to a few degrees from the profile's. Raises ProfileError when
    the touches cannot tell all numbers or both signs.
    """
    _check_count(touches, len(UNKNOWN) + (len(DIRECTIONS) if directions else 0))
    guess, numbers = _best(machine, touches, mark_height_mm, directions)
    sigma = guess.sigma(numbers)
    calibrated = guess.machine_with(numbers)
    mark = (float(numbers[6]), float(numbers[7]), mark_height_mm)
    if mark_angle_deg is not None:
        calibrated, mark = _set_turn_zero(calibrated, mark, mark_angle_deg)
    _check_sound(machine, calibrated)
    told = _told(touches)
    errors = np.zeros(told.shape)
    errors[told] = guess.residuals(numbers)
    return Calibration(calibrated, mark, tuple((float(x), float(y), float(z)) for x, y, z in errors), sigma)


def estimate(
    machine: Machine, touches: Sequence[Touch], mark_mm: tuple[float, float, float]
) -> tuple[Machine, tuple[float, float, float]]:
    """The machine and the mark as far as a few touches tell them: what they do not tell, and both signs, stay as given."""
    guess = _Guess(machine, (machine.tilt.sign, machine.turn.sign), touches, mark_mm[2])
    tilt_point = frame_across(unit(machine.tilt.axis)) @ np.array(machine.tilt.point_mm)
    begin = np.array([*machine.turn.point_mm, *tilt_point, machine.tilt.zero_deg, *mark_mm[:2], *np.zeros(len(DIRECTIONS))])
    _, numbers = guess.improved(begin, PULL)
    return guess.machine_with(numbers), (float(numbers[6]), float(numbers[7]), mark_mm[2])


def _best(machine: Machine, touches: Sequence[Touch], mark_height_mm: float, directions: bool) -> tuple[_Guess, Floats]:
    """The signs that fit and the numbers that fit best with them."""
    guesses = [_Guess(machine, signs, touches, mark_height_mm) for signs in SIGNS]
    best: dict[tuple[int, int], tuple[float, Floats]] = {}
    for start_deg in STARTS_DEG:
        for guess in guesses:
            fit = guess.fit(start_deg)
            best[guess.signs] = min(best.get(guess.signs, fit), fit, key=lambda fit: fit[0])
        if min(cost for cost, _ in best.values()) < GOOD_MM**2:
            break
    if directions:
        worth = HOPELESS * min(cost for cost, _ in best.values())
        for guess in guesses:
            cost, numbers = best[guess.signs]
            if cost <= worth:
                best[guess.signs] = guess.improved(np.append(numbers, np.zeros(len(DIRECTIONS))))
    first, second = sorted(guesses, key=lambda guess: best[guess.signs][0])[:2]
    cost, numbers = best[first.signs]
    if best[second.signs][0] < APART**2 * cost + LEAST_MM**2:
        axis = machine.tilt if first.signs[0] != second.signs[0] else machine.turn
        raise ProfileError(
            f"the touches do not tell the sign of {axis.letter}: touch the mark at turns 0, 90, 180 and 270 and at two tilts"
        )
    return first, numbers


def _check_sound(machine: Machine, calibrated: Machine) -> None:
    """Refuse numbers that no profile may have."""
    least, most = machine.tilt.limits_deg
    if not least <= calibrated.tilt.zero_deg <= most:
        raise ProfileError(
            f"the table would be level at {machine.tilt.letter}{calibrated.tilt.zero_deg:.2f}, outside tilt.limits_deg "
            f"{list(machine.tilt.limits_deg)}: check the touches"
        )
    lean_deg = degrees(acos(min(1.0, abs(float(unit(calibrated.turn.axis)[2])))))
    if lean_deg > MOST_LEAN_DEG:
        raise ProfileError(
            f"the turn axis would lean by {lean_deg:.2f} deg along the tilt axis, at most {MOST_LEAN_DEG:.1f} is allowed: "
            "check the touches and the mechanics"
        )


def _check_count(touches: Sequence[Touch], sought: int) -> None:
    coordinates = sum(1 if touch.on_plate else 3 for touch in touches)
    if coordinates < sought:
        raise ProfileError(f"{len(touches)} touches tell {coordinates} numbers, {sought} are sought: touch the mark more often")
    tilts = {round(touch.pose.tilt_deg, 1) for touch in touches}
    if len(tilts) < 2:
        raise ProfileError(f"all touches are at tilt {tilts.pop():g}: the tilt axis is found from two tilts or more")


def _lean(machine: Machine) -> Floats:
    """(3,) unit vector across the turn axis towards the tilt axis: a lean about the tilt axis itself is the tilt's zero."""
    tilt, upright = unit(machine.tilt.axis), unit(machine.turn.axis)
    return unit(tilt - (tilt @ upright) * upright)


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


def _told(touches: Sequence[Touch]) -> np.ndarray:
    """(n, 3) which of x y z each touch tells."""
    return np.array([[not touch.on_plate, not touch.on_plate, True] for touch in touches])


def _units(vectors: Floats) -> Floats:
    scaled: Floats = vectors / np.linalg.norm(vectors, axis=-1, keepdims=True)
    return scaled


def _positions(touches: Sequence[Touch]) -> Floats:
    """(n, 5) X Y Z tilt turn of the touches."""
    return np.array([[*touch.at_mm, touch.pose.tilt_deg, touch.pose.turn_deg] for touch in touches])


def _turned_about(unit_axis: Floats, angles: Floats, points: Floats) -> Floats:
    """(..., 3) points turned about (..., 3) unit axes by (...) angles in radians (Rodrigues 1840); all are broadcast."""
    cosine, sine = np.cos(angles)[..., None], np.sin(angles)[..., None]
    along = (points * unit_axis).sum(axis=-1, keepdims=True)
    turned: Floats = points * cosine + np.cross(unit_axis, points) * sine + unit_axis * along * (1.0 - cosine)
    return turned
