"""Lines over a hanging region: rectangles by closed formulas, and every line over regions of any outline by shapely.

Near anchors: triangles within reach of anchored sides, compared with the part that shapely leaves outside that reach.
"""

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from numba import njit
from shapely import LineString, MultiLineString, Point, Polygon, affinity, box

from mdp.kernels.arrays import table
from mdp.mesh import Floats
from mdp.support_need import spans as spanning
from mdp.support_need.spans import DEEP, Sides

WIDTH_MM = 0.45
TURN = st.floats(0.0, 360.0)
REACH_MM = 0.9
SLACK_MM = 0.06  # sample points are 0.1 mm apart


@njit
def spans(sides: Sides, area_mm2: float, longest_mm: float, width_mm: float) -> bool:
    return spanning.spans(sides, area_mm2, longest_mm, width_mm)


def sides_of(hanging: Polygon, anchored: tuple[int, ...] | None = None) -> Sides:
    """The sides of a region by their ends, and which of them are anchors; None: all."""
    corners = np.array(hanging.exterior.coords)
    ends: Floats = np.hstack([corners[:-1], corners[1:]])
    anchors = range(len(ends)) if anchored is None else anchored
    return Sides(ends, np.isin(np.arange(len(ends)), anchors).astype(np.int32))


def is_spanned(hanging: Polygon, longest_mm: float, anchored: tuple[int, ...] | None = None) -> bool:
    return spans(sides_of(hanging, anchored), hanging.area, longest_mm, WIDTH_MM)


# The sides of shapely's box run up at x = 10, left along y = 6, down at x = 0, right along y = 0.
@pytest.mark.parametrize(
    ("anchored", "length_mm"),
    [((0, 2), 10.0), ((1, 3), 6.0), ((0, 1, 2, 3), 6.0), ((0, 1), None), ((0,), None), ((0, 1, 2), 10.0), ((), None)],
)
@settings(max_examples=15)
@given(TURN, st.floats(0.5, 40.0))
def test_a_rectangle_is_spanned_between_two_opposite_sides_that_are_anchors(
    anchored: tuple[int, ...], length_mm: float | None, turn: float, longest: float
) -> None:
    assume(length_mm is None or abs(longest - length_mm) > 0.1)
    hanging = affinity.translate(affinity.rotate(box(0, 0, 10, 6), turn), 5.0, -70.0)
    assert is_spanned(hanging, longest, anchored) == (length_mm is not None and longest > length_mm)


def longest_line_mm(hanging: Polygon, angle: float) -> float:
    """The longest of lines 0.1 mm apart over a region in a direction."""
    level = affinity.rotate(hanging, -angle, origin=(0, 0))
    x0, y0, x1, y1 = level.bounds
    lines = [level.intersection(LineString([(x0 - 1, y), (x1 + 1, y)])) for y in np.arange(y0 + 0.05, y1, 0.1)]
    return max(piece.length for line in lines for piece in getattr(line, "geoms", [line]))


@settings(max_examples=25)
@given(st.integers(0, 10_000), st.floats(2.0, 12.0))
def test_no_place_is_spanned_over_which_lines_of_every_direction_are_too_long(seed: int, longest: float) -> None:
    rng = np.random.default_rng(seed)
    angles = np.sort(rng.uniform(0, 2 * np.pi, 9))
    assume(np.diff(angles, append=angles[0] + 2 * np.pi).max() < 3.0)  # otherwise the centre lies outside
    hanging = Polygon(rng.uniform(2.0, 9.0, (9, 1)) * np.column_stack([np.cos(angles), np.sin(angles)]))
    least = min(longest_line_mm(hanging, angle) for angle in range(0, 180, 10))
    assume(abs(least - longest) > 0.15 * longest)  # lines are one width apart, angles 22 degrees
    if is_spanned(hanging, longest):
        assert least < longest


def test_a_disc_at_the_end_of_a_strip_is_not_spanned_though_most_lines_over_both_are_short() -> None:
    lollipop = box(0, -1, 60, 1).union(Point(0, 0).buffer(5.0))
    assert not is_spanned(lollipop, 6.0)
    assert is_spanned(lollipop, 10.1)


def test_a_line_may_end_loose_over_a_fiftieth_of_a_place_and_no_more() -> None:
    ends_mm = {0.0: True, 0.1: True, 0.5: False, 2.0: False}  # of 12 mm of a side without an anchor
    for loose, spanned in ends_mm.items():
        hanging = Polygon([(0, 0), (8, 0), (8, 12 - loose), (8, 12), (0, 12)])
        assert is_spanned(hanging, 9.0, (1, 4)) == spanned


def test_nothing_is_a_bridge_without_length_or_sides() -> None:
    assert not is_spanned(box(0, 0, 10, 6), 0.0)
    assert not spans(Sides(np.zeros((0, 4)), np.zeros(0, np.int32)), 1.0, 5.0, WIDTH_MM)


@njit
def near_anchors(sides: Sides, reach_mm: float, triangle: Floats, nearest: int) -> int:
    return spanning.is_near_anchors(sides, reach_mm, triangle, table(DEEP, 6), nearest)


@settings(max_examples=150)
@given(st.integers(0, 100_000), st.integers(0, 9), st.floats(0.2, 3.0))
def test_a_triangle_is_near_anchors_if_all_of_it_is_within_their_reach(seed: int, count: int, size: float) -> None:
    rng = np.random.default_rng(seed)
    ends, anchored = rng.uniform(-1.5, 1.5, (count, 4)), rng.integers(0, 2, count).astype(np.int32)
    triangle = rng.uniform(-size / 2, size / 2, (3, 2))
    anchors = MultiLineString(ends[anchored > 0].reshape(-1, 2, 2).tolist())
    inner, outer = (Polygon(triangle) - anchors.buffer(REACH_MM + slack, quad_segs=90) for slack in (-SLACK_MM, SLACK_MM))
    assume(inner.is_empty or not outer.is_empty)
    side = near_anchors(Sides(ends, anchored), REACH_MM, triangle.ravel(), 0)
    assert (side >= 0) == inner.is_empty
    if side >= 0:
        assert anchored[side]
        assert LineString(ends[side].reshape(2, 2)).distance(Polygon(triangle)) <= REACH_MM + 1e-6


def test_a_wide_triangle_with_only_its_corners_at_anchors_is_not_near_them() -> None:
    corners = np.array([(0.0, 0.0), (8.0, 0.0), (0.0, 8.0)])
    dots = Sides(np.hstack([corners, corners + 0.01]), np.ones(3, np.int32))
    assert near_anchors(dots, REACH_MM, corners.ravel(), 0) == -1
    assert near_anchors(dots, 8.0, corners.ravel(), 0) >= 0


def test_an_anchor_reaches_no_further_along_itself_than_aside() -> None:
    side = Sides(np.array([(0.0, 0.0, 1.0, 0.0)]), np.ones(1, np.int32))
    for x, near in ((1.8, True), (2.0, False), (-0.8, True), (-1.0, False)):
        assert (near_anchors(side, REACH_MM, np.array([x, 0.0, x, 0.0, x, 0.0]), 0) >= 0) == near
