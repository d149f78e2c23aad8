"""The fit of centres, signs and zeros of a simulated machine to touches of one mark."""

import numpy as np
import pytest

from machine.kinematics.table import machine_points
from machine.setup.calibration.fit import Touch, calibrate
from mdp.pose import Pose
from profiles.errors import ProfileError
from tests.machine.setup.calibration.touches import MARK, Wrong, machine_of, off_mm, really, touched

WRONG = [
    ("generic_ac", {"point_mm": (0.0, 3.1, -14.2), "zero_deg": 1.7}, {"point_mm": (1.3, -2.2, 0.4)}),
    ("generic_ac", {"point_mm": (0.0, -1.0, -11.0), "sign": 1}, {"point_mm": (-4.0, 2.0, -1.5)}),
    ("open5x_voron0", {"point_mm": (2.1, 0.0, -7.7), "zero_deg": -12.0}, {"point_mm": (0.7, 5.2, 0.9), "sign": 1}),
    ("linuxcnc_xyzac", {"point_mm": (0.0, 17.5, 13.0), "sign": 1, "zero_deg": 3.0}, {"point_mm": (6.0, -3.0, 1.0), "sign": 1}),
]


@pytest.mark.parametrize(("name", "tilt", "turn"), WRONG)
def test_exact_touches_give_exact_numbers(name: str, tilt: Wrong, turn: Wrong) -> None:
    real = really(machine_of(name), tilt, turn)
    fitted = calibrate(machine_of(name), touched(real), MARK[2])
    assert off_mm(fitted, real) < 1e-6
    assert fitted.machine.tilt.zero_deg == pytest.approx(real.tilt.zero_deg, abs=1e-6)
    assert (fitted.machine.tilt.sign, fitted.machine.turn.sign) == (real.tilt.sign, real.turn.sign)
    assert fitted.mark_mm == pytest.approx(MARK, abs=1e-6)


def test_along_the_tilt_axis_its_point_stays_where_the_profile_has_it() -> None:
    machine = really(machine_of("generic_ac"), {"point_mm": (5.0, 0.0, -12.0)}, {})
    real = really(machine, {"point_mm": (5.0, 1.0, -11.0)}, {})
    assert calibrate(machine, touched(real), MARK[2]).machine.tilt.point_mm == pytest.approx((5.0, 1.0, -11.0))


@pytest.mark.parametrize("seed", range(4))
@pytest.mark.parametrize(("name", "tilt", "turn"), WRONG[::2])
def test_touches_a_hundredth_off_give_centres_to_two_hundredths(name: str, tilt: Wrong, turn: Wrong, seed: int) -> None:
    real = really(machine_of(name), tilt, turn)
    fitted = calibrate(machine_of(name), touched(real, noise_mm=0.01, seed=seed), MARK[2])
    assert off_mm(fitted, real) < 0.02
    assert abs(fitted.machine.tilt.zero_deg - real.tilt.zero_deg) < 0.02
    assert 0.005 < fitted.rms_mm < 0.03


def test_two_tilts_to_one_side_are_enough() -> None:
    real = really(machine_of("fractal5pro"), {"point_mm": (0.0, 0.8, -0.5), "zero_deg": 0.4}, {"point_mm": (0.995, 0.805, 0.0)})
    fitted = calibrate(machine_of("fractal5pro"), touched(real, (0.0, 30.0, 60.0), 0.01), MARK[2])
    assert off_mm(fitted, real) < 0.02


def test_the_direction_of_the_mark_gives_the_zero_of_the_turn() -> None:
    real = really(machine_of("generic_ac"), {}, {"zero_deg": 33.0})
    angle_deg = float(np.degrees(np.arctan2(MARK[1], MARK[0])))
    fitted = calibrate(machine_of("generic_ac"), touched(real), MARK[2], angle_deg)
    assert fitted.machine.turn.zero_deg == pytest.approx(33.0)
    assert fitted.mark_mm == pytest.approx(MARK)
    assert calibrate(machine_of("generic_ac"), touched(real), MARK[2]).machine.turn.zero_deg == 0.0


def test_touches_of_the_plate_give_its_height_without_that_of_the_mark() -> None:
    real = really(machine_of("generic_ac"), {}, {"point_mm": (0.0, 0.0, 1.25)})
    at = machine_points(real, Pose(0.0, 0.0), np.array([[10.0, 5.0, 0.0], [-20.0, 5.0, 0.0]]))
    plate = [Touch(Pose(0.0, 0.0), tuple(row), on_plate=True) for row in at.tolist()]
    fitted = calibrate(machine_of("generic_ac"), [*touched(real), *plate], MARK[2])
    assert fitted.machine.turn.point_mm[2] == pytest.approx(1.25)
    assert max(fitted.residuals_mm) < 1e-6


def test_a_misread_touch_is_named() -> None:
    touches = touched(machine_of("generic_ac"), noise_mm=0.01)
    x, y, z = touches[6].at_mm
    touches[6] = Touch(touches[6].pose, (x + 1.0, y, z))
    fitted = calibrate(machine_of("generic_ac"), touches, MARK[2])
    assert (fitted.worst, fitted.rms_mm > 0.1) == (7, True)


@pytest.mark.parametrize(
    ("rows", "sentence"),
    [
        (slice(0, 2), "2 touches determine 6 numbers, 8 are sought"),
        (slice(0, 4), "all touches are at tilt 0: the tilt axis is found from two tilts or more"),
        (slice(0, 12, 4), "the touches do not determine"),
        (slice(0, 12, 2), "the touches do not determine the sign of C"),
    ],
)
def test_too_few_touches_are_refused(rows: slice, sentence: str) -> None:
    with pytest.raises(ProfileError, match=sentence):
        calibrate(machine_of("generic_ac"), touched(machine_of("generic_ac"))[rows], MARK[2])
