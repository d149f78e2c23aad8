"""Strokes: patterns counted on hatched shapes, walls and support by their lengths."""

import numpy as np
import pytest
import shapely
from hypothesis import given, settings
from hypothesis import strategies as st

from slicer.bead import spacing_mm
from slicer.estimate.hanging import ThickSupport
from slicer.estimate.shell import NOTHING, Extent, extent_of
from slicer.estimate.strokes import LayerSpeeds, Strokes, line_strokes, loop_strokes, support_strokes
from slicer.geometry.polygons import Polygons
from slicer.paths import Kind, bead_area_mm2
from tests.slicer.hand import as_shapely, profile, ragged

PROFILE = profile()
PROCESS = PROFILE.process
SPEEDS = LayerSpeeds(PROFILE, 0.2)
SPACING = spacing_mm(0.45, 0.2)


def lines(area: Extent, density: float) -> list[Strokes]:
    return line_strokes(Kind.INFILL, area, SPEEDS, density=density, width_mm=0.45, angle_deg=45.0)


def hatched(area: shapely.Geometry, spacing: float, angle: float) -> tuple[int, float]:
    """How many lines that far apart lie in an area, and how long they are together."""
    level = shapely.affinity.rotate(area, -angle, origin=(0, 0))
    x0, y0, x1, y1 = level.bounds
    rows = np.arange(y0 + 0.5 * spacing, y1, spacing)
    pieces = shapely.get_parts(shapely.intersection(level, [shapely.LineString([(x0, y), (x1, y)]) for y in rows]))
    return int((shapely.length(pieces) > 0.0).sum()), float(shapely.length(pieces).sum())


@settings(max_examples=12)
@given(st.integers(0, 10**6), st.floats(0.2, 1.0))
def test_a_pattern_has_as_many_lines_and_as_much_length_as_a_hatching_has_over_all_angles(seed: int, density: float) -> None:
    section = ragged(seed)
    (strokes,) = lines(extent_of(section), density)
    counts, lengths = zip(*(hatched(as_shapely(section), SPACING / density, angle) for angle in range(0, 180, 12)), strict=True)
    assert strokes.count == pytest.approx(np.mean(counts), rel=0.06)
    assert strokes.length_mm == pytest.approx(np.mean(lengths), rel=0.02)
    assert strokes.mm3 == pytest.approx(strokes.length_mm * bead_area_mm2(0.45, 0.2))


def test_slanting_lines_have_the_acceleration_of_both_axes() -> None:
    stopping = LayerSpeeds(profile("machine.junction_speed_mm_s=0.01"), 0.2)
    level, slanting = (
        line_strokes(Kind.INFILL, Extent(4.0, 8.0, 1), stopping, density=0.5, width_mm=0.45, angle_deg=angle)[0].time_s
        for angle in (90.0, 45.0)
    )
    assert level / slanting == pytest.approx(2.0**0.25, rel=0.01)  # short lines never reach their speed


@pytest.mark.parametrize(("area", "density"), [(NOTHING, 0.5), (Extent(4.0, 8.0, 1), 0.0)])
def test_nothing_and_no_density_make_no_lines(area: Extent, density: float) -> None:
    assert lines(area, density) == []


def test_loops_have_their_length_and_the_small_ones_the_speed_of_small_walls() -> None:
    square = np.array([(0, 0), (1, 0), (1, 1), (0, 1)], np.float64)
    small, large = loop_strokes(Kind.OUTER_WALL, [square, 20 * square, 2 * square], 0.08, 10.0, SPEEDS)
    assert [(s.length_mm, s.count, s.mm3) for s in (small, large)] == [
        (12.0, 2, pytest.approx(0.96)),
        (80.0, 1, pytest.approx(6.4)),
    ]
    assert small.speed_mm_s == PROCESS.small_wall_speed_mm_s < large.speed_mm_s == PROCESS.outer_wall_speed_mm_s


def thick(area: Polygons, contact: Polygons, height_mm: float = 0.8) -> ThickSupport:
    """Two thick layers of support, nothing in the lower one."""
    tips = np.array([height_mm, 2.0 * height_mm])
    walls = ((), (np.array([(0.0, 0.0), (10.0, 0.0), (10.0, 10.0), (0.0, 10.0)]),))
    extents = (NOTHING, extent_of(area)), (NOTHING, extent_of(contact))
    return ThickSupport(tips, np.full(2, height_mm), *extents, walls, Polygons())


def test_support_fills_what_its_walls_leave_densely_for_as_many_layers_as_the_roof_has() -> None:
    """A pillar of 10 mm whose thick layer of 0.8 mm touches the part all over: four layers, two of them roof."""
    process = profile("process.support_interface_layers=2", "process.support_walls=2").process
    pillar = Polygons.square((10.0, 10.0))
    strokes = support_strokes(thick(pillar, pillar), 1.2, process, SPEEDS, False)
    walls, sparse, roof = ([s for s in strokes if pick(s)] for pick in (_is_wall, _is_sparse, _is_roof))
    assert sum(s.length_mm for s in walls) == pytest.approx(80.0)
    width = process.support_line_width_mm or process.line_width_mm
    inside = 100.0 - 80.0 * spacing_mm(width, 0.2)
    assert sum(s.length_mm for s in roof) == pytest.approx(
        0.5 * 100.0 * process.support_interface_density / spacing_mm(width, 0.2)
    )
    assert sum(s.length_mm for s in sparse) == pytest.approx((inside - 50.0) * process.support_density / spacing_mm(width, 0.2))


def _is_wall(strokes: Strokes) -> bool:
    return strokes.kind is Kind.SUPPORT and strokes.pieces == 0


def _is_sparse(strokes: Strokes) -> bool:
    return strokes.kind is Kind.SUPPORT and strokes.pieces > 0


def _is_roof(strokes: Strokes) -> bool:
    return strokes.kind is Kind.SUPPORT_INTERFACE


def test_the_foot_on_the_platform_has_a_density_of_its_own() -> None:
    dense = profile("process.support_foot_density=0.6", "process.support_density=0.2").process
    pillar = thick(Polygons.square((10.0, 10.0)), Polygons())
    foot, above = (next(filter(_is_sparse, support_strokes(pillar, 1.2, dense, SPEEDS, first))) for first in (True, False))
    assert foot.length_mm == pytest.approx(3.0 * above.length_mm)


@pytest.mark.parametrize(("z_mm", "layer"), [(0.1, None), (0.8, None), (0.81, 1), (1.6, 1), (1.61, None)])
def test_the_thick_layer_at_a_height(z_mm: float, layer: int | None) -> None:
    support = thick(Polygons.square((10.0, 10.0)), Polygons())
    assert support.at(z_mm) == layer
    assert (support_strokes(support, z_mm, PROCESS, SPEEDS, False) == []) == (layer is None)
    assert ThickSupport(np.zeros(0), np.zeros(0), (), (), (), Polygons()).at(z_mm) is None
