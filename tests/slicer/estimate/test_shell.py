"""Shells of sections by hand: a square of 20 mm and beads 0.45 mm wide, 0.2 mm high, 0.407 mm apart."""

import numpy as np
import pytest
import shapely
from hypothesis import given, settings
from hypothesis import strategies as st

from slicer.bead import spacing_mm
from slicer.estimate.shell import Extent, extent_of, shell_of
from slicer.geometry.polygons import Polygons, area_mm2, close_loop
from slicer.geometry.polyline import length_mm
from tests.slicer.hand import as_shapely, profile, ragged

PROCESS = profile().process
SQUARE = Polygons.square((20.0, 20.0))
SPACING = spacing_mm(0.45, 0.2)


def test_walls_are_nested_a_spacing_apart() -> None:
    sides = [area_mm2(loops[0]) ** 0.5 for loops in shell_of(SQUARE, PROCESS, 0.2, covered=SQUARE).walls]
    outer = 20.0 - 0.45
    assert sides == pytest.approx([outer, outer - 2.0 * SPACING, outer - 4.0 * SPACING], abs=0.01)


def test_what_is_covered_is_sparse_and_what_is_bare_is_skin() -> None:
    half = Polygons.square((10.0, 20.0))
    inside = 20.0 - 0.45 - 5.0 * SPACING
    covered = shell_of(SQUARE, PROCESS, 0.2, covered=SQUARE)
    bare = shell_of(SQUARE, PROCESS, 0.2, covered=None)
    partly = shell_of(SQUARE, PROCESS, 0.2, covered=half)
    assert (covered.skin.area_mm2, covered.sparse.area_mm2) == pytest.approx((0.0, inside**2), abs=0.1)
    assert (bare.skin.area_mm2, bare.sparse.area_mm2) == pytest.approx((inside**2, 0.0), abs=0.1)
    assert partly.skin.area_mm2 + partly.sparse.area_mm2 == pytest.approx(inside**2, abs=0.1)
    assert partly.sparse.area_mm2 == pytest.approx(inside * (10.0 - (20.0 - inside) / 2.0 - 0.45), rel=0.01)


def test_a_strip_of_three_beads_keeps_a_gap_between_its_walls() -> None:
    strip = shell_of(Polygons.square((20.0, 1.2)), PROCESS, 0.2, covered=None)
    assert sum(extent.area_mm2 for extent in strip.narrow) == pytest.approx(19.0 * (1.2 - 0.45 - SPACING), rel=0.1)
    assert strip.skin.area_mm2 == 0.0


def test_along_the_face_of_a_cut_runs_one_wall_and_infill_begins_behind_it() -> None:
    model = Polygons.square((40.0, 20.0))
    cut = shell_of(SQUARE, PROCESS, 0.2, covered=SQUARE, model=model)
    three_walls, one_wall = 0.225 + 2.5 * SPACING, 0.225 + 0.5 * SPACING
    assert len(cut.walls) == PROCESS.interface_walls == 1
    assert cut.sparse.area_mm2 == pytest.approx((20.0 - three_walls - one_wall) * (20.0 - 2.0 * three_walls), rel=0.01)
    assert cut.ending.area_mm2 == pytest.approx((20.0 - 2.0 * one_wall) ** 2 - cut.sparse.area_mm2, rel=0.01)


def test_under_a_later_part_is_a_floor() -> None:
    half = Polygons.square((10.0, 20.0))
    assert shell_of(SQUARE, PROCESS, 0.2, covered=SQUARE, ceiling=half).sparse.area_mm2 == pytest.approx(
        (20.0 - 0.225 - 2.5 * SPACING - 10.0) * (20.0 - 0.45 - 5.0 * SPACING), rel=0.01
    )


@settings(max_examples=30)
@given(st.integers(0, 10**6))
def test_an_extent_is_what_shapely_measures(seed: int) -> None:
    section = ragged(seed)
    area = as_shapely(section)
    pieces = len(shapely.get_parts(area))
    assert extent_of(section) == Extent(pytest.approx(area.area), pytest.approx(area.length), pieces)
    assert extent_of(Polygons()) == Extent(0.0, 0.0, 0)


@settings(max_examples=25)
@given(st.integers(0, 10**6), st.floats(0.3, 1.0), st.booleans())
def test_walls_what_they_leave_and_the_inside_share_out_a_section(seed: int, scale: float, bare: bool) -> None:
    section = ragged(seed).scale((scale, scale))
    shell = shell_of(section, PROCESS, 0.2, covered=None if bare else section)
    widths = [0.225 + 0.5 * SPACING, *[SPACING] * (len(shell.walls) - 1)]
    walls = [sum(length_mm(close_loop(loop)) for loop in loops) for loops in shell.walls]
    rest = sum(extent.area_mm2 for extent in shell.narrow) + shell.skin.area_mm2 + shell.sparse.area_mm2
    assert np.dot(widths, walls) + rest == pytest.approx(section.area(), rel=0.01)
    assert not bare or shell.sparse.area_mm2 == 0.0


@pytest.mark.parametrize("section", [Polygons(), Polygons.square((0.2, 0.2))])
def test_of_nothing_and_of_a_speck_no_wall_is_printed(section: Polygons) -> None:
    shell = shell_of(section, PROCESS, 0.2, covered=None)
    assert [loop for loops in shell.walls for loop in loops] == []
    assert (shell.skin.area_mm2, shell.sparse.area_mm2) == (0.0, 0.0)
