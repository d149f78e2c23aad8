"""The axes derived from readings of a calibration piece, compared with machines whose axes are known."""

from dataclasses import replace

import numpy as np
import pytest

from machine.setup.calibration.piece import correct
from profiles.errors import ProfileError
from profiles.profile import load
from tests.machine.setup.calibration.pieces import off, read_off, seam_mm, standing
from tests.machine.setup.calibration.touches import really

GENERIC = load().machine
MACHINES = ("generic_ac", "fractal5pro", "trident_5axis", "linuxcnc_xyzac")


def test_a_turn_axis_that_is_elsewhere_lays_the_pad_after_half_a_turn_aside_by_twice_as_much() -> None:
    piece = standing(GENERIC)
    opposite = next(pad for pad in piece.pads if abs(pad.pose.turn_deg) in (180.0,))
    true = really(GENERIC, {}, {"point_mm": (0.3, 0.0, 0.0)})
    aside = piece.laid_aside_mm(true)[opposite.number - 1] @ opposite.ways
    assert np.abs(aside) == pytest.approx([0.6, 0.0, 0.0], abs=1e-9)


def test_a_tilt_axis_that_is_too_low_by_h_lays_a_pad_at_60_degrees_off_by_h() -> None:
    true = really(GENERIC, {"point_mm": (0.0, 0.0, GENERIC.tilt.point_mm[2] - 0.2)}, {})
    off_mm = np.linalg.norm(standing(GENERIC).laid_aside_mm(true), axis=1)
    assert off_mm == pytest.approx([2 * 0.2 * np.sin(np.radians(30.0))] * 4)  # a chord of 60 degrees


def test_the_slope_is_what_pads_move_by() -> None:
    true = really(GENERIC, {"zero_deg": GENERIC.tilt.zero_deg + 0.01}, {})
    moved = standing(GENERIC).laid_aside_mm(true).reshape(-1)
    assert standing(GENERIC).slope()[:, 4] * 0.01 == pytest.approx(moved, abs=1e-6)


@pytest.mark.parametrize("name", MACHINES)
def test_one_piece_brings_the_seams_of_the_next_one_within_an_eighth_of_a_millimetre(name: str) -> None:
    random, machine = np.random.default_rng(5), load(machine=name).machine
    piece, before, after = standing(machine), [], []
    for _ in range(40):
        true = off(machine, random)
        readings = read_off(piece.laid_aside_mm(true), random)
        before.append(seam_mm(piece, machine, true))
        after.append(seam_mm(piece, correct(machine, [piece], readings[None]).machine, true))
    assert np.median(before) > 0.5
    assert np.median(after) < 0.1
    assert np.mean(np.array(after) < 0.15) >= 0.95


def test_a_second_piece_makes_all_numbers_surer() -> None:
    random = np.random.default_rng(6)
    true, first = off(GENERIC, random), standing(GENERIC)
    readings = [read_off(first.laid_aside_mm(true), random)]
    once = correct(GENERIC, [first], np.array(readings))
    second = replace(first, machine=once.machine)
    readings.append(read_off(second.laid_aside_mm(true), random))
    twice = correct(GENERIC, [first, second], np.array(readings))
    assert (twice.sigma < once.sigma).all()
    assert seam_mm(first, twice.machine, true) < 0.12


def test_readings_of_nought_change_nothing() -> None:
    correction = correct(GENERIC, [standing(GENERIC)], np.zeros((1, 4, 3)))
    assert not correction.significant
    assert correction.machine.tilt.point_mm == pytest.approx(GENERIC.tilt.point_mm)


def test_unread_pads_are_optional() -> None:
    random = np.random.default_rng(7)
    true, piece = off(GENERIC, random), standing(GENERIC)
    readings = piece.laid_aside_mm(true)[None]
    readings[0, 2] = np.nan
    assert seam_mm(piece, correct(GENERIC, [piece], readings).machine, true) < 0.15


def test_a_misread_pad_is_named() -> None:
    readings = np.zeros((1, 4, 3))
    readings[0, 1, 0] = 1.0
    assert correct(GENERIC, [standing(GENERIC)], readings).doubtful == (1, 2, "right")


def test_three_readings_are_too_few() -> None:
    readings = np.full((1, 4, 3), np.nan)
    readings[0, 0] = 0.0
    with pytest.raises(ProfileError, match="3 readings of the pads are given: at least 4 are needed"):
        correct(GENERIC, [standing(GENERIC)], readings)
