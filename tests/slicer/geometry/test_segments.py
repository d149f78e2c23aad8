"""Predicates of plane geometry, checked by shapely and by exact fractions."""

from fractions import Fraction
from typing import Any

import numpy as np
import pytest
import shapely
from hypothesis import assume, given
from hypothesis import strategies as st
from numba import njit

from slicer.geometry import polyline
from slicer.geometry.polyline import Segment

whole = st.integers(-6, 6).map(float)
places = st.tuples(whole, whole)
tenths = st.integers(-300, 300).map(lambda n: 0.1 * n)  # shapely returns no distance to a segment of 1e-255
spots = st.tuples(tenths, tenths)


@njit
def orientation(line: Segment, x: float, y: float) -> float:
    return polyline.orientation(line, x, y)


@njit
def crossing(segment: Segment, crossed: Segment) -> float:
    return polyline.crossing(segment, crossed)


@njit
def squared_distance(segment: Segment, x: float, y: float) -> float:
    return polyline.squared_distance(segment, x, y)


@njit
def squared_distance_in_space(p: Any, a: Any, b: Any) -> float:
    return polyline.squared_distance_in_space(p, a, b)


def sides_of(a: tuple[float, float], b: tuple[float, float], p: tuple[float, float]) -> Fraction:
    """Twice the signed area of a triangle, exactly."""
    (ax, ay), (bx, by), (px, py) = ((Fraction(x), Fraction(y)) for x, y in (a, b, p))
    return (bx - ax) * (py - ay) - (by - ay) * (px - ax)


@given(places, places, places)
def test_orientation_is_twice_the_signed_area(a: tuple[float, float], b: tuple[float, float], p: tuple[float, float]) -> None:
    assert orientation(Segment(*a, *b), *p) == sides_of(a, b, p)


@given(places, places, places, places)
def test_segments_cross_if_the_ends_of_each_are_on_both_sides_of_the_other(
    a: tuple[float, float], b: tuple[float, float], p: tuple[float, float], q: tuple[float, float]
) -> None:
    assume(a != b and p != q)
    apart = [(sides_of(p, q, a) > 0) != (sides_of(p, q, b) > 0), (sides_of(a, b, p) > 0) != (sides_of(a, b, q) > 0)]
    share = crossing(Segment(*a, *b), Segment(*p, *q))
    assert (share >= 0.0) == all(apart)
    if share >= 0.0:
        at = np.array(a) + share * (np.array(b) - np.array(a))
        assert shapely.LineString([p, q]).distance(shapely.Point(at)) < 1e-9


@given(spots, spots, spots)
def test_distances_to_a_segment_are_shapely_s(a: tuple[float, float], b: tuple[float, float], p: tuple[float, float]) -> None:
    expected = shapely.LineString([a, b]).distance(shapely.Point(p)) ** 2
    assert squared_distance(Segment(*a, *b), *p) == pytest.approx(expected, abs=1e-9)
    assert squared_distance_in_space((*p, 0.0), (*a, 0.0), (*b, 0.0)) == pytest.approx(expected, abs=1e-9)


def test_in_space_the_nearest_point_of_a_segment_may_be_its_end() -> None:
    assert squared_distance_in_space((0.0, 0.0, 5.0), (0.0, 0.0, 0.0), (0.0, 0.0, 2.0)) == 9.0
    assert squared_distance_in_space((3.0, 4.0, 1.0), (0.0, 0.0, 0.0), (0.0, 0.0, 2.0)) == 25.0


def test_a_segment_of_no_length_is_a_point() -> None:
    assert squared_distance(Segment(1.0, 1.0, 1.0, 1.0), 4.0, 5.0) == 25.0
