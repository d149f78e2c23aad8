"""Simplified polylines keep few points and leave none of the others far off."""

import numpy as np
import shapely
from hypothesis import given, settings
from hypothesis import strategies as st

from mdp.mesh import Floats
from slicer.geometry.polyline import mark_corners

TOLERANCE_MM = 0.02


def kept(points: Floats) -> Floats:
    return points[mark_corners(points, np.array([0, len(points)]), TOLERANCE_MM)]


def test_a_quarter_turn_of_half_a_line_has_as_few_chords_as_the_tolerance_allows() -> None:
    angles = np.radians(np.arange(0.0, 91.0, 11.25))
    arc = 0.225 * np.stack([np.sin(angles), np.cos(angles)], axis=1)
    path = kept(np.concatenate([[[-20.0, 0.225]], arc, [[0.225, -14.0]]]))
    assert len(path) <= 5  # two straight lines and two chords of 45 degrees, which leave 0.225 (1 - cos 22.5 deg) = 0.017 mm


@settings(max_examples=100, deadline=None)
@given(st.lists(st.tuples(st.floats(0.0, 1.0), st.floats(0.0, 1.0)), min_size=3, max_size=30, unique=True))
def test_no_point_that_is_left_out_lies_farther_off_than_the_tolerance(corners: list[tuple[float, float]]) -> None:
    points = np.array(corners)
    line = shapely.LineString(kept(points))
    assert [line.coords[0], line.coords[-1]] == [corners[0], corners[-1]]
    assert max(line.distance(shapely.Point(x, y)) for x, y in corners) < TOLERANCE_MM + 1e-9
