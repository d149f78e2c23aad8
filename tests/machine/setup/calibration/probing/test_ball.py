"""The centre of a ball from contacts along Z."""

from math import sqrt

import numpy as np
import pytest

from machine.setup.calibration.probing.ball import ball_centre, contact_heights
from profiles.errors import PrinterError

CROSS = np.array([[0.0, 0.0], [4.0, 0.0], [0.0, 4.0], [-4.0, 0.0], [0.0, -4.0]])


def contacts(centre: tuple[float, float, float], flat_mm: float = 0.0) -> np.ndarray:
    return np.column_stack([CROSS, contact_heights(np.array(centre), 10.0, flat_mm, CROSS)])


def test_a_ball_is_as_high_as_pythagoras_says() -> None:
    heights = contact_heights(np.array([0.0, 0.0, 5.0]), 10.0, 0.0, np.array([[0.0, 0.0], [6.0, 0.0], [0.0, -8.0], [11.0, 0.0]]))
    assert heights[:3].tolist() == [15.0, 13.0, 11.0]
    assert np.isnan(heights[3])


def test_a_flat_tip_touches_with_its_nearer_edge() -> None:
    assert contact_heights(np.zeros(3), 10.0, 0.5, np.array([[0.4, 0.0], [6.5, 0.0]])).tolist() == [10.0, 8.0]


@pytest.mark.parametrize("flat_mm", [0.0, 0.5])
def test_exact_contacts_give_the_exact_centre_whatever_the_flat_of_the_tip(flat_mm: float) -> None:
    centre = (0.7, -0.4, 31.25)
    assert ball_centre(contacts(centre, flat_mm), 10.0, seek_flat=True) == pytest.approx(centre, abs=1e-6)


def test_two_pairs_across_the_middle_give_the_closed_form() -> None:
    height = sqrt(100.0 - 16.0)
    seen = np.array([[4.0, 0.0, height], [-4.0, 0.0, height], [0.0, 4.0, height], [0.0, -4.0, height]])
    assert ball_centre(seen, 10.0) == pytest.approx((0.0, 0.0, 0.0), abs=1e-9)


def test_contacts_of_no_such_ball_are_refused() -> None:
    with pytest.raises(PrinterError, match="the contacts are not those of a ball 4 mm in diameter"):
        ball_centre(contacts((0.0, 0.0, 0.0)), 2.0)
