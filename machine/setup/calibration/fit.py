"""Least-squares fit of the rotary axes: signs, zeros and points that map every touch to one mark on the table.

The mark is fixed to the table at a known height above its surface. Wherever the tip touches it, at any pose, the forward
kinematics must give the same workpiece point. The unknowns are the mark's position, the point where the turn axis meets the
table, the position of the tilt axis across itself, the tilt at which the table is level, and both signs. On request also the
directions of the axes: two small angles of the tilt axis, and the lean of the turn axis along it; the lean about it is the tilt's
zero.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from math import acos, atan2, cos, degrees, radians, sin
from typing import Any

import numpy as np

from machine.kinematics.table import workpiece_path
from mdp.directions.unit_vectors import frame_across
from mdp.mesh import Floats
from mdp.pose import Pose, unit
from profiles.errors import ProfileError
from profiles.machine import UPRIGHT, Machine

TURN_POINT = tuple(f"turn.point_mm {letter}" for letter in "xyz")
UNKNOWN = (*TURN_POINT, "tilt.point_mm", "tilt.point_mm", "tilt.zero_deg", "the mark's x", "the mark's y")
DIRECTIONS = ("tilt.axis", "tilt.axis", "turn.axis")  # angles in degrees from the profile's axes
DIGITS = {"axis": 6}  # a millionth of a unit vector is a tenth of a micrometre at 100 mm; other numbers keep four digits
KEYS = (*(f"machine.{axis}.{key}" for axis in ("tilt", "turn") for key in ("sign", "point_mm")), "machine.tilt.zero_deg")
TURN_ZERO, AXES = ("machine.turn.zero_deg",), ("machine.tilt.axis", "machine.turn.axis")
SIGNS = ((-1, -1), (-1, 1), (1, -1), (1, 1))
UPSIDE_DOWN_DEG = 90.0
STARTS_DEG = (0.0, 25.0, -25.0)
ROUNDS = 40
STEP = 1e-4
PULL = 0.01  # touches are some hundredths of a mm off, a profile's numbers some mm
LITTLE = 1e-7  # a sum of squares that falls by a smaller fraction has converged
UNPROMISING = 400.0  # times the mean square of the best signs: no further fit for such signs
SETTLED = 1e-7  # mm and deg: smaller changes mean convergence
LEAST_SHARE = 1e-4  # a number that moves no touch by this fraction of its change is undetermined
APART = 4.0  # ratio by which the next best signs must fit worse
LEAST_MM = 1e-3
MOST_LEAN_DEG = degrees(acos(UPRIGHT))  # greatest lean of a profile's turn axis
GOOD_MM = 0.5  # a fit as good as this needs no other start


@dataclass(frozen=True)
class Touch:
    """Position X Y Z of the tip on the mark (with on_plate: anywhere on the table's surface) at a pose."""

    pose: Pose
    at_mm: tuple[float, float, float]
    on_plate: bool = False


@dataclass(frozen=True)
class Calibration:
    """A calibrated machine, the residuals of the touches, and the uncertainty of each number (one sigma, mm or deg).

    errors_mm: X Y Z of each residual, in the workpiece frame.
    """

    machine: Machine
    mark_mm: tuple[float, float, float]
    errors_mm: tuple[tuple[float, float, float], ...]
    sigma: dict[str, float]

    @property
    def residuals_mm(self) -> tuple[float, ...]:
        """Distance of each touch from the mark, mm."""
        return tuple(float(np.linalg.norm(error)) for error in self.errors_mm)

    @property
    def directions(self) -> bool:
        """Whether the directions of the axes were fitted too."""
        return DIRECTIONS[0] in self.sigma

    @property
    def rms_mm(self) -> float:
        """Root mean square of the residuals, mm."""
        return float(np.sqrt(np.mean(np.square(self.residuals_mm))))

    @property
    def worst(self) -> int:
        """Number of the touch with the largest residual, from 1."""
        return int(np.argmax(self.residuals_mm)) + 1


def least_squares(
    residuals: Callable[[Floats], Floats], numbers: Floats, pull: float = 0.0, little: float = LITTLE
) -> tuple[Floats, Floats]:
    """Minimise the sum of squares of (n,) residuals over (k,) numbers; returns the numbers and the residuals there.

    Levenberg-Marquardt. pull: weight that draws the numbers to their start, as a fraction of a residual's weight, so that
    undetermined numbers stay there. little: smallest relative decrease of the sum that calls for another step.
    """
    usual, damping, count = numbers, 1e-3, len(numbers)
    here = np.append(residuals(numbers), np.zeros(count))
    for _ in range(ROUNDS):
        slope = np.vstack([slope_of(residuals, numbers), pull * np.eye(count)])
        normal = slope.T @ slope
        step = np.linalg.lstsq(normal + damping * np.diag(np.diag(normal) + 1e-9), -slope.T @ here, rcond=None)[0]
        tried = np.append(residuals(numbers + step), pull * (numbers + step - usual))
        if tried @ tried < here @ here:
            settled = tried @ tried > (1.0 - little) * (here @ here)
            numbers, here, damping = numbers + step, tried, damping * 0.2
            if settled:
                break
        else:
            damping *= 8.0
        if np.abs(step).max() < SETTLED or damping > 1e7:
            break
    return numbers, here[:-count]


def slope_of(function: Callable[[Floats], Floats], numbers: Floats) -> Floats:
    """(n, k) derivative of a function's (n,) values by each number, by central differences."""
    steps = STEP * np.eye(len(numbers))
    return np.column_stack([function(numbers + step) - function(numbers - step) for step in steps]) / (2.0 * STEP)


def numbers_of(machine: Machine) -> Floats:
    """(6,) values of the machine's numbers in UNKNOWN. The point of the tilt axis is given across that axis."""
    across = frame_across(unit(machine.tilt.axis))
    return np.array([*machine.turn.point_mm, *across @ np.array(machine.tilt.point_mm), machine.tilt.zero_deg])


def machine_with(machine: Machine, numbers: Floats) -> Machine:
    """The machine with the numbers of UNKNOWN and, if given, DIRECTIONS. The tilt axis's point keeps its component along the
    axis, and directions not given stay exactly as they are."""
    along = unit(machine.tilt.axis)
    across = frame_across(along)
    point = along * (along @ np.array(machine.tilt.point_mm)) + numbers[3:5] @ across
    tilt: dict[str, object] = {"zero_deg": float(numbers[5]), "point_mm": tuple(point.tolist())}
    turn: dict[str, object] = {"point_mm": tuple(numbers[:3].tolist())}
    if len(numbers) > len(UNKNOWN):
        angles, upright = np.tan(np.radians(numbers[len(UNKNOWN) :])), unit(machine.turn.axis)
        lean = unit(along - (along @ upright) * upright)  # lean about the tilt axis is the tilt's zero
        tilt["axis"] = tuple(unit(along + angles[:2] @ across).tolist())
        turn["axis"] = tuple(unit(upright + angles[2] * lean).tolist())
    changed = {"tilt": machine.tilt.model_copy(update=tilt), "turn": machine.turn.model_copy(update=turn)}
    return machine.model_copy(update=changed)


def _residuals(machine: Machine, touches: Sequence[Touch], height_mm: float) -> Callable[[Floats], Floats]:
    """Function of a machine's numbers for the offsets of touches from the mark, x y z each; for touches on the plate only the
    height above the table."""
    here, measured = _positions(touches), _measured(touches)
    heights_mm = np.array([0.0 if touch.on_plate else height_mm for touch in touches])

    def residuals(numbers: Floats) -> Floats:
        seen = workpiece_path(machine_with(machine, numbers), here)
        off: Floats = (seen - np.column_stack([np.tile(numbers[6:8], (len(here), 1)), heights_mm]))[measured]
        return off

    return residuals


def calibrate(
    machine: Machine,
    touches: Sequence[Touch],
    mark_height_mm: float = 0.0,
    mark_angle_deg: float | None = None,
    directions: bool = False,
) -> Calibration:
    """The machine whose kinematics map all touches to one mark mark_height_mm above the table.

    mark_angle_deg: direction of the mark from the turn axis, from the workpiece's +x: then turn.zero_deg is found too, otherwise
    it stays. directions: also fit those of the axes, up to a few degrees from the profile's. Raises ProfileError when the touches
    do not determine all numbers or both signs.
    """
    _check_count(touches, len(UNKNOWN) + (len(DIRECTIONS) if directions else 0))
    signed, numbers = _best(machine, touches, mark_height_mm, directions)
    residuals = _residuals(signed, touches, mark_height_mm)
    sigma = _sigma(residuals, numbers)
    calibrated = machine_with(signed, numbers)
    mark = (float(numbers[6]), float(numbers[7]), mark_height_mm)
    if mark_angle_deg is not None:
        calibrated, mark = _set_turn_zero(calibrated, mark, mark_angle_deg)
    _check_sound(machine, calibrated)
    measured = _measured(touches)
    errors = np.zeros(measured.shape)
    errors[measured] = residuals(numbers)
    return Calibration(calibrated, mark, tuple((float(x), float(y), float(z)) for x, y, z in errors), sigma)


def estimate(
    machine: Machine, touches: Sequence[Touch], mark_mm: tuple[float, float, float]
) -> tuple[Machine, tuple[float, float, float]]:
    """The machine and the mark as far as a few touches determine them; other numbers, and both signs, stay."""
    begin = np.append(numbers_of(machine), [*mark_mm[:2], *np.zeros(len(DIRECTIONS))])
    numbers, _ = least_squares(_residuals(machine, touches, mark_mm[2]), begin, PULL)
    return machine_with(machine, numbers), (float(numbers[6]), float(numbers[7]), mark_mm[2])


def _best(machine: Machine, touches: Sequence[Touch], mark_height_mm: float, directions: bool) -> tuple[Machine, Floats]:
    """The machine with the best signs, and the best numbers for them."""
    signed = [_with_signs(machine, *signs) for signs in SIGNS]
    best = [(np.inf, np.zeros(0)) for _ in signed]
    for start_deg in STARTS_DEG:
        for k, candidate in enumerate(signed):
            fit = _fit(candidate, touches, mark_height_mm, _start(candidate, touches, start_deg))
            best[k] = min(best[k], fit, key=lambda fit: fit[0])
        if min(cost for cost, _ in best) < GOOD_MM**2:
            break
    if directions:
        worth = UNPROMISING * min(cost for cost, _ in best)
        for k, candidate in enumerate(signed):
            cost, numbers = best[k]
            if cost <= worth:
                best[k] = _fit(candidate, touches, mark_height_mm, np.append(numbers, np.zeros(len(DIRECTIONS))))
    first, second = sorted(range(len(SIGNS)), key=lambda k: best[k][0])[:2]
    cost, numbers = best[first]
    if not np.isfinite(cost):
        raise ProfileError("the touches do not determine the axes: they must not all be at one position")
    if best[second][0] < APART**2 * cost + LEAST_MM**2:
        axis = machine.tilt if SIGNS[first][0] != SIGNS[second][0] else machine.turn
        raise ProfileError(
            f"the touches do not determine the sign of {axis.letter}: touch the mark at turns 0, 90, 180 and 270 and at two tilts"
        )
    return signed[first], numbers


def _with_signs(machine: Machine, tilt: int, turn: int) -> Machine:
    signs = {"tilt": machine.tilt.model_copy(update={"sign": tilt}), "turn": machine.turn.model_copy(update={"sign": turn})}
    return machine.model_copy(update=signs)


def _fit(machine: Machine, touches: Sequence[Touch], height_mm: float, numbers: Floats) -> tuple[float, Floats]:
    """Mean square and numbers of the best fit near given numbers; inf if the table would be upside down."""
    numbers, off = least_squares(_residuals(machine, touches, height_mm), numbers)
    upside_down = abs(numbers[5] - machine.tilt.zero_deg) > UPSIDE_DOWN_DEG
    return np.inf if upside_down else float(off @ off) / len(off), numbers


def _start(machine: Machine, touches: Sequence[Touch], zero_add_deg: float) -> Floats:
    """Start of a fit: the profile's numbers, the tilt's zero shifted, and the mean of the touches as mark."""
    numbers = np.append(numbers_of(machine), [0.0, 0.0])
    numbers[5] += zero_add_deg
    of_mark = [touch for touch in touches if not touch.on_plate] or touches
    numbers[6:8] = workpiece_path(machine_with(machine, numbers), _positions(of_mark))[:, :2].mean(axis=0)
    return numbers


def _sigma(residuals: Callable[[Floats], Floats], numbers: Floats) -> dict[str, float]:
    """Uncertainty of each number. Raises ProfileError for numbers that the touches do not determine."""
    sought = (*UNKNOWN, *DIRECTIONS)[: len(numbers)]
    _, sizes, directions = np.linalg.svd(slope_of(residuals, numbers), full_matrices=False)
    if len(sizes) < len(numbers) or sizes[-1] < LEAST_SHARE * sizes[0]:
        lost = np.abs(directions[-1])
        names = dict.fromkeys(name for name, share in zip(sought, lost, strict=True) if share > 0.3 * lost.max())
        unknown = " and ".join(names)
        raise ProfileError(f"the touches do not determine {unknown}: touch the mark at four turns and at two more tilts")
    off = residuals(numbers)
    variance = float(off @ off) / max(1, len(off) - len(numbers))
    spread = np.sqrt(np.diag((directions.T / sizes**2) @ directions) * variance)
    sigma: dict[str, float] = {}
    for name, value in zip(sought, spread.tolist(), strict=True):
        sigma[name] = max(value, sigma.get(name, 0.0))
    return sigma


def _check_sound(machine: Machine, calibrated: Machine) -> None:
    """Raise ProfileError for numbers that a profile cannot have."""
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
        raise ProfileError(f"{len(touches)} touches determine {coordinates} numbers, {sought} are sought: add more touches")
    tilts = {round(touch.pose.tilt_deg, 1) for touch in touches}
    if len(tilts) < 2:
        raise ProfileError(f"all touches are at tilt {tilts.pop():g}: the tilt axis is found from two tilts or more")


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


def _measured(touches: Sequence[Touch]) -> np.ndarray:
    """(n, 3) mask of the coordinates that each touch measures."""
    return np.array([[not touch.on_plate, not touch.on_plate, True] for touch in touches])


def _positions(touches: Sequence[Touch]) -> Floats:
    """(n, 5) X Y Z tilt turn of the touches."""
    return np.array([[*touch.at_mm, touch.pose.tilt_deg, touch.pose.turn_deg] for touch in touches])


def fitted_tables(before: Machine, calibration: Calibration, zero_of_turn: bool) -> dict[str, Any]:
    """Tables of the calibrated profile: numbers, sources, and the keys still uncalibrated.

    zero_of_turn: the mark's direction is known, so that the turn's zero is found too.
    """
    keys = (*KEYS, *(TURN_ZERO if zero_of_turn else ()), *(AXES if calibration.directions else ()))
    source = f"tiltprint calibrate, {len(calibration.residuals_mm)} touches, {calibration.rms_mm:.3f} mm off"
    return found_tables(before, calibration.machine, keys, source)


def found_tables(before: Machine, after: Machine, keys: Sequence[str], source: str) -> dict[str, Any]:
    """Tables of a profile with these keys of the rotary axes: values, source, and the keys still uncalibrated."""
    axes: dict[str, dict[str, Any]] = {"tilt": {}, "turn": {}}
    for key in keys:
        _, axis, name = key.split(".")
        value = getattr(getattr(after, axis), name)
        digits = DIGITS.get(name, 4)
        axes[axis][name] = [round(x, digits) for x in value] if isinstance(value, tuple) else round(value, digits)
    left = [key for key in before.uncalibrated if key not in keys]
    return {"machine": {"uncalibrated": left, **axes, "sources": dict.fromkeys(keys, source)}}
