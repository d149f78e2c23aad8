"""Shells about a point."""

import numpy as np
import pytest

from mdp.repair.shells import winding_number
from tests.mdp.files import both, placed


def test_winding_about_a_point_counts_the_shells_around_it() -> None:
    nest = both(placed(20, 20, 20), placed(10, 10, 10, (5, 5, 5)))
    for place, turns in (((10, 10, 10), 2), ((2, 2, 2), 1), ((30, 0, 0), 0)):
        assert winding_number(np.array(place, float), nest.vertices, nest.faces) == pytest.approx(turns, abs=1e-9)
