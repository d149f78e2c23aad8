"""Simplified polylines keep few points and stay near all others."""

import numpy as np
import pytest
import shapely
from hypothesis import given, settings
from hypothesis import strategies as st

from mdp.mesh import Floats
from slicer.geometry.polyline import lengthen_steps, mark_corners

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
def test_no_removed_point_is_farther_off_than_the_tolerance(corners: list[tuple[float, float]]) -> None:
    points = np.array(corners)
    line = shapely.LineString(kept(points))
    assert [line.coords[0], line.coords[-1]] == [corners[0], corners[-1]]
    assert max(line.distance(shapely.Point(x, y)) for x, y in corners) < TOLERANCE_MM + 1e-9


def lengthened(points: Floats, shortest_mm: float, most_mm: float) -> Floats:
    moved, left = lengthen_steps(points, np.array([0, len(points)]), np.array([shortest_mm]), np.array([most_mm]))
    return moved[left]


def test_a_short_step_at_a_corner_is_lengthened_along_the_longer_neighbour() -> None:
    bevelled = np.array([[0.0, 0.0], [5.0, 0.0], [5.1, 0.1], [5.1, 5.0]])
    points = lengthened(bevelled, 0.25, 0.1)
    back_mm = np.sqrt(0.25**2 - 0.1**2) - 0.1  # its corner moves back until the step is the hypotenuse of 0.1 and 0.1 + back
    assert points.tolist() in [
        [[0.0, 0.0], [pytest.approx(5.0 - back_mm), 0.0], [5.1, 0.1], [5.1, 5.0]],
        [[0.0, 0.0], [5.0, 0.0], [5.1, pytest.approx(0.1 + back_mm)], [5.1, 5.0]],
    ]


def test_a_short_step_stays_where_its_line_would_move_too_far() -> None:
    there_and_back = np.array([[0.0, 0.0], [5.0, 0.0], [5.0, 0.1], [0.0, 0.1]])
    assert lengthened(there_and_back, 0.2, 0.05).tolist() == there_and_back.tolist()
    assert lengthened(there_and_back, 0.0, 1.0).tolist() == there_and_back.tolist()


@settings(max_examples=200, deadline=None)
@given(st.lists(st.tuples(st.floats(0.0, 1.0), st.floats(0.0, 1.0)), min_size=2, max_size=30, unique=True))
def test_lengthening_steps_keeps_the_line_and_shortens_no_other(corners: list[tuple[float, float]]) -> None:
    points = np.array(corners)
    line = lengthened(points, 0.2, 0.1)
    before, after = (np.hypot(*np.diff(way, axis=0).T) for way in (points, line))
    assert [line[0].tolist(), line[-1].tolist()] == [list(corners[0]), list(corners[-1])]
    assert (after < 0.2 - 1e-9).sum() <= (before < 0.2 - 1e-9).sum()
    assert shapely.LineString(points).hausdorff_distance(shapely.LineString(line)) < 0.2 + 1e-9  # a point and its successor move
