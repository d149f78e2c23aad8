"""Near anchors: triangles within reach of anchored sides, held against what shapely leaves of them outside that reach."""

import numpy as np
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from numba import njit
from shapely import LineString, MultiLineString, Polygon

from mdp.kernels.arrays import table
from mdp.mesh import Floats
from mdp.support_need import spans
from mdp.support_need.spans import DEEP, Sides

REACH_MM = 0.9
SLACK_MM = 0.06  # two places that are looked at are 0.1 mm apart


@njit
def near_anchors(sides: Sides, reach_mm: float, triangle: Floats, nearest: int) -> int:
    return spans.is_near_anchors(sides, reach_mm, triangle, table(DEEP, 6), nearest)


@settings(max_examples=150)
@given(st.integers(0, 100_000), st.integers(0, 9), st.floats(0.2, 3.0))
def test_a_triangle_is_near_anchors_where_none_of_it_lies_out_of_their_reach(seed: int, count: int, size: float) -> None:
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


def test_a_wide_triangle_whose_corners_alone_lie_at_anchors_is_not_near_them() -> None:
    corners = np.array([(0.0, 0.0), (8.0, 0.0), (0.0, 8.0)])
    dots = Sides(np.hstack([corners, corners + 0.01]), np.ones(3, np.int32))
    assert near_anchors(dots, REACH_MM, corners.ravel(), 0) == -1
    assert near_anchors(dots, 8.0, corners.ravel(), 0) >= 0


def test_an_anchor_reaches_no_further_along_itself_than_aside() -> None:
    side = Sides(np.array([(0.0, 0.0, 1.0, 0.0)]), np.ones(1, np.int32))
    for x, near in ((1.8, True), (2.0, False), (-0.8, True), (-1.0, False)):
        assert (near_anchors(side, REACH_MM, np.array([x, 0.0, x, 0.0, x, 0.0]), 0) >= 0) == near
