"""Shells of sections by hand: a square of 20 mm and beads 0.45 mm wide, 0.2 mm high, 0.407 mm apart."""

import pytest

from slicer.bead import spacing_mm
from slicer.estimate.shell import shell_of
from slicer.geometry.polygons import Polygons, area_mm2
from tests.slicer.hand import profile

PROCESS = profile().process
SQUARE = Polygons.square((20.0, 20.0))
SPACING = spacing_mm(0.45, 0.2)


def test_walls_are_nested_a_spacing_apart() -> None:
    sides = [area_mm2(loops[0]) ** 0.5 for loops in shell_of(SQUARE, PROCESS, 0.2, SQUARE, SQUARE).walls]
    outer = 20.0 - 0.45
    assert sides == pytest.approx([outer, outer - 2.0 * SPACING, outer - 4.0 * SPACING], abs=0.01)


def test_what_is_covered_is_sparse_and_what_is_bare_is_skin() -> None:
    half = Polygons.square((10.0, 20.0))
    inside = 20.0 - 0.45 - 5.0 * SPACING
    covered = shell_of(SQUARE, PROCESS, 0.2, SQUARE, SQUARE)
    bare = shell_of(SQUARE, PROCESS, 0.2, None, None)
    partly = shell_of(SQUARE, PROCESS, 0.2, half, SQUARE)
    assert (covered.skin.area_mm2, covered.sparse.area_mm2) == pytest.approx((0.0, inside**2), abs=0.1)
    assert (bare.skin.area_mm2, bare.sparse.area_mm2) == pytest.approx((inside**2, 0.0), abs=0.1)
    assert partly.skin.area_mm2 + partly.sparse.area_mm2 == pytest.approx(inside**2, abs=0.1)
    assert partly.sparse.area_mm2 == pytest.approx(inside * (10.0 - (20.0 - inside) / 2.0 - 0.45), rel=0.01)


def test_a_strip_of_three_beads_keeps_a_gap_between_its_walls() -> None:
    strip = shell_of(Polygons.square((20.0, 1.2)), PROCESS, 0.2, None, None)
    assert sum(place.area_mm2 for place in strip.narrow) == pytest.approx(19.0 * (1.2 - 0.45 - SPACING), rel=0.1)
    assert strip.skin.area_mm2 == 0.0
