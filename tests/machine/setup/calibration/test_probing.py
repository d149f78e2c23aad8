"""A misaligned machine measures itself, touches only the ball, and stops with one sentence when its probe fails."""

from math import sqrt

import numpy as np
import pytest

from machine.setup.calibration.fit import calibrate
from machine.setup.calibration.probing import ball_centre, contact_heights
from profiles.errors import MoveError, PrinterError
from tests.machine.setup.calibration.direct import HEIGHT_MM, probed, usual_ball
from tests.machine.setup.calibration.misaligned import prediction_errors_mm
from tests.machine.setup.calibration.touches import machine_of

CROSS = np.array([[0.0, 0.0], [4.0, 0.0], [0.0, 4.0], [-4.0, 0.0], [0.0, -4.0]])
NAMES = (
    "fractal5pro",
    "gen5x",
    "generic_ac",
    "linuxcnc_xyzac",
    "open5x_jubilee",
    "open5x_prusa_i3",
    "open5x_voron0",
    "trident_5axis",
)


def contacts(centre: tuple[float, float, float], flat_mm: float = 0.0) -> np.ndarray:
    return np.column_stack([CROSS, contact_heights(np.array(centre), 10.0, flat_mm, CROSS)])


def test_a_ball_is_as_high_as_pythagoras_says() -> None:
    heights = contact_heights(np.array([0.0, 0.0, 5.0]), 10.0, 0.0, np.array([[0.0, 0.0], [6.0, 0.0], [0.0, -8.0], [11.0, 0.0]]))
    assert heights[:3].tolist() == [15.0, 13.0, 11.0]
    assert np.isnan(heights[3])


def test_a_flat_tip_touches_with_its_nearer_edge() -> None:
    assert contact_heights(np.zeros(3), 10.0, 0.5, np.array([[0.4, 0.0], [6.5, 0.0]])).tolist() == [10.0, 8.0]


@pytest.mark.parametrize("flat_mm", [0.0, 0.5])
def test_exact_contacts_give_the_exact_centre_for_any_tip_flat(flat_mm: float) -> None:
    centre = (0.7, -0.4, 31.25)
    assert ball_centre(contacts(centre, flat_mm), 10.0, seek_flat=True) == pytest.approx(centre, abs=1e-6)


def test_two_pairs_across_the_middle_give_the_closed_form() -> None:
    height = sqrt(100.0 - 16.0)
    seen = np.array([[4.0, 0.0, height], [-4.0, 0.0, height], [0.0, 4.0, height], [0.0, -4.0, height]])
    assert ball_centre(seen, 10.0) == pytest.approx((0.0, 0.0, 0.0), abs=1e-9)


def test_contacts_that_fit_no_such_ball_are_refused() -> None:
    with pytest.raises(PrinterError, match="the contacts are not those of a ball 4 mm in diameter"):
        ball_centre(contacts((0.0, 0.0, 0.0)), 2.0)


@pytest.mark.parametrize("seed", range(len(NAMES)))
def test_every_machine_finds_its_axes_and_touches_only_the_ball(seed: int) -> None:
    machine = machine_of(NAMES[seed])
    measuring, prober = probed(machine, seed, noise_mm=0.01, flat_mm=0.5)
    found = calibrate(machine, measuring.run(), HEIGHT_MM, directions=True).machine
    real = prober.table.machine
    assert (found.tilt.sign, found.turn.sign) == (real.tilt.sign, real.turn.sign)
    errors = prediction_errors_mm(found, real, usual_ball(machine).centre_mm[0], HEIGHT_MM, (0.0, 45.0), np.random.default_rng(0))
    assert float(errors.max()) < 0.05
    assert prober.least_mm > 0.5


def test_a_probe_that_measures_exactly_leaves_nothing_over() -> None:
    measuring, prober = probed(machine_of("generic_ac"), 3)
    found = calibrate(machine_of("generic_ac"), measuring.run(), HEIGHT_MM, directions=True)
    assert found.rms_mm < 1e-4
    assert found.machine.tilt.axis == pytest.approx(prober.table.machine.tilt.axis, abs=1e-6)


def test_larger_tilts_come_only_after_the_signs_are_known() -> None:
    measuring, prober = probed(machine_of("generic_ac"), 1)
    measuring.run()
    tilts = [round(abs(pose.tilt_deg), 1) for pose in prober.poses]
    assert tilts[:3] == [0.0, 0.0, 0.0]
    assert 1.0 < tilts[3] < 5.0
    assert max(tilts[4:]) > 40.0
    assert tilts[-1] == 0.0


def test_a_probe_beside_the_nozzle_is_used_where_it_reaches() -> None:
    measuring, prober = probed(machine_of("generic_ac"), 2, offset_mm=(-20.0, 5.0, -2.0))
    found = calibrate(machine_of("generic_ac"), measuring.run(), HEIGHT_MM, directions=True)
    assert found.rms_mm < 1e-4
    assert found.machine.turn.point_mm == pytest.approx(prober.table.machine.turn.point_mm, abs=1e-3)
    assert prober.least_mm > 0.5


def test_a_probe_that_reaches_nowhere_is_refused_before_anything_moves() -> None:
    measuring, prober = probed(machine_of("open5x_voron0"), 2, offset_mm=(120.0, 0.0, 0.0))
    with pytest.raises(MoveError, match="the ball cannot be measured at B0 C0: X would go from"):
        measuring.run()
    assert prober.poses == []


@pytest.mark.parametrize(
    ("fault", "sentence"),
    [
        ({"silent_from": 30}, r"at A\S+ C\S+ the probe met nothing down to Z\S+, contact is expected near Z\S+: does it sense"),
        ({"early_from": 30}, r"the probe triggered at once, at Z\S+, contact is expected near"),
        (
            {"noise_mm": 0.5},
            r"4 contacts at one place lie \S+ mm apart and more, 0\.03 mm is allowed|not those of a ball|not found",
        ),
    ],
)
def test_a_probe_that_fails_ends_it_with_a_sentence(fault: dict[str, float], sentence: str) -> None:
    measuring, prober = probed(machine_of("generic_ac"), 4, **fault)
    with pytest.raises(PrinterError, match=sentence):
        measuring.run()
    assert prober.least_mm > 0.5


def test_a_ball_that_is_not_there_is_noticed_above_the_plate() -> None:
    measuring, prober = probed(machine_of("generic_ac"), 5)
    prober.table.ball = None
    with pytest.raises(PrinterError, match="the probe met nothing down to"):
        measuring.run()
    assert prober.at[2] > 40.0
