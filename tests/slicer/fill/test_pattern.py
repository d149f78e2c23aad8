"""Zigzags against shapely."""

import manifold3d as m3
import numpy as np
import pytest
import shapely
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from slicer.fill.pattern import zigzag_lines
from slicer.geometry.polygons import Polygons
from slicer.geometry.polyline import length_mm
from tests.slicer.fill.areas import STARS
from tests.slicer.hand import as_shapely


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
