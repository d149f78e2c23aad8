"""Planes that are too similar for both to count."""

import numpy as np
import pytest

from mdp.mesh import Floats
from mdp.plane import Plane
from mdp.ranking.candidates import directions
from mdp.ranking.ranking import SAME_COSINE, nearly_equal
from profiles.profile import load


def _lowest(elevation_deg: float, turn_deg: float) -> Floats:
    elevation, turn = np.radians([elevation_deg, turn_deg])
    return np.array([np.cos(elevation) * np.cos(turn), np.cos(elevation) * np.sin(turn), np.sin(elevation)])


@pytest.mark.parametrize("offset_mm", [0.0, 5.0, -5.0])
def test_opposite_planes_are_never_alike(offset_mm: float) -> None:
    normal = np.array([1.0, 0.0, 0.0])
    assert nearly_equal(Plane(normal, offset_mm), Plane(normal, offset_mm + 1.9))
    assert not nearly_equal(Plane(normal, offset_mm), Plane(normal, offset_mm + 2.1))
    assert not any(nearly_equal(Plane(normal, offset_mm), Plane(-normal, other_mm)) for other_mm in (offset_mm, -offset_mm))


def test_planes_18_degrees_apart_are_different() -> None:
    normals = [_lowest(60.0, 0.0), _lowest(77.0, 0.0), _lowest(79.0, 0.0)]
    assert [nearly_equal(Plane(normals[0], 5.0), Plane(other, 5.0)) for other in normals[1:]] == [True, False]


def test_no_two_directions_look_opposite_ways_unless_they_may_be_lower_than_nine_degrees() -> None:
    """Therefore the authors' rule, which takes the absolute value, gives equal results in all searches with the default
    directions."""
    spread = directions(load().search)
    assert (spread @ spread.T).min() > -SAME_COSINE
    assert _lowest(9.1, 0.0) @ _lowest(9.1, 180.0) > -SAME_COSINE > _lowest(9.0, 0.0) @ _lowest(9.0, 180.0)
