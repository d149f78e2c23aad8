"""Zigzags against shapely."""

import manifold3d as m3
import numpy as np
import pytest
import shapely
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from slicer.geometry.polygons import Polygons, offset
from slicer.geometry.polyline import length_mm
from slicer.support.beads import zigzag_lines
from tests.slicer.fill.areas import STARS
from tests.slicer.hand import as_shapely, ragged


@settings(max_examples=30, deadline=None)
@given(STARS, st.floats(0, 180), st.floats(0.4, 5.0))
def test_zigzag_lines_agree_with_shapely(points: list[tuple[float, float]], angle: float, spacing: float) -> None:
    hull = m3.CrossSection.hull_points(np.array(points))
    assume(hull.area() > 0.01)
    area = hull - Polygons.circle(4.0, 20).translate((3, 1)) if hull.area() > 1 else hull
    lines = zigzag_lines(area, area, angle, spacing, 0.0)
    solid = as_shapely(area)
    along = np.array([np.cos(np.radians(angle)), np.sin(np.radians(angle))])
    across = np.array([-along[1], along[0]])
    pattern = shapely.MultiLineString(
        [[(k + 0.5) * spacing * across - 90 * along, (k + 0.5) * spacing * across + 90 * along] for k in range(-80, 80)]
    )
    assert sum(length_mm(line) for line in lines) == pytest.approx(solid.intersection(pattern).length, rel=1e-6, abs=1e-4)


@settings(max_examples=30, deadline=None)
@given(st.integers(0, 10**6), st.floats(0.5, 3.0), st.floats(0.0, 9.0), st.floats(0.0, 180.0))
def test_joined_lines_have_every_line_once_and_no_joint_is_long_or_crosses_the_fence(
    seed: int, apart_mm: float, reach_mm: float, angle_deg: float
) -> None:
    area = ragged(seed)
    fence = offset(area, 0.05)
    joined, alone = zigzag_lines(area, fence, angle_deg, apart_mm, reach_mm), zigzag_lines(area, fence, angle_deg, apart_mm, 0.0)
    drawn = [piece for line in joined for piece in line.reshape(-1, 2, 2)]
    assert sorted(tuple(sorted(piece.ravel().tolist())) for piece in drawn) == sorted(
        tuple(sorted(line.ravel().tolist())) for line in alone
    )
    for line in joined:
        for a, b in line[1:-1].reshape(-1, 2, 2):
            assert np.hypot(*(b - a)) < reach_mm
            assert as_shapely(fence).contains(shapely.LineString([a, b]))
