"""Skins are solid, and their joints stay in their area."""

from collections.abc import Callable
from itertools import pairwise

import manifold3d as m3
import numpy as np
import pytest
import shapely
from hypothesis import given, settings
from hypothesis import strategies as st

from slicer.fill.skin import SolidLines, skin_beads
from slicer.geometry.polygons import Polygons, offset
from slicer.paths import Kind
from tests.slicer.fill.areas import HEIGHT, OVERLAP, STARS, WIDTH, plastic_mm2, ring, square, strip
from tests.slicer.hand import as_shapely, distances_mm


@pytest.mark.parametrize(("area", "more"), [(square, 0.003), (ring, 0.003), (strip, 0.01)])
@pytest.mark.parametrize("angle", [45.0, 135.0, 20.0])
def test_a_skin_extrudes_its_area_a_strip_that_is_all_line_ends_little_more(
    area: Callable[[], Polygons], more: float, angle: float
) -> None:
    beads = skin_beads(area(), Kind.SKIN, SolidLines(angle, WIDTH, HEIGHT, OVERLAP))
    assert 0.997 < plastic_mm2(beads) / area().area() < 1.0 + more
    assert all(0.9 < bead.flow < 1.1 for bead in beads if bead.kind is Kind.SKIN)


def test_a_skin_covers_its_area_everywhere() -> None:
    lines = [
        shapely.LineString(b.points).buffer(b.width_mm / 2)
        for b in skin_beads(ring(), Kind.SKIN, SolidLines(45.0, WIDTH, HEIGHT, OVERLAP))
    ]
    assert as_shapely(ring()).difference(shapely.union_all(lines)).area < 0.01 * ring().area()


def test_a_skin_of_a_square_is_one_zigzag() -> None:
    assert len(skin_beads(square(), Kind.SKIN, SolidLines(45.0, WIDTH, HEIGHT, OVERLAP))) == 1


@settings(max_examples=30, deadline=None)
@given(STARS, st.floats(0, 180))
def test_joints_of_a_skin_never_leave_its_area(points: list[tuple[float, float]], angle: float) -> None:
    hull = m3.CrossSection.hull_points(np.array(points))
    star = hull - Polygons.circle(5.0, 20).translate((4, 4)) - Polygons.square((30, 1.5)).rotate(33)
    for bead in skin_beads(star, Kind.SKIN, SolidLines(angle, WIDTH, HEIGHT, OVERLAP)):
        middles = np.array([(a + b) / 2 for a, b in pairwise(bead.points)])
        assert distances_mm(star, middles).min() > 0.0


def test_shrinking_an_empty_area_gives_nothing() -> None:
    assert skin_beads(offset(Polygons.square((0.2, 0.2)), -0.2), Kind.SKIN, SolidLines(0.0, WIDTH, HEIGHT, OVERLAP)) == []
