"""Skins are solid, and the joints of their lines stay in their area."""

from collections.abc import Callable
from itertools import pairwise

import manifold3d as m3
import numpy as np
import pytest
import shapely
from hypothesis import given, settings
from hypothesis import strategies as st

from profiles.settings.layers import SkinPattern
from slicer.fill.skin import FEW_HIDDEN, SolidLines, skin_beads
from slicer.geometry.polygons import Polygons, offset
from slicer.paths import Kind
from slicer.slice import slice_part
from slicer.walls.walls import uncovered_area
from tests.shapes import box
from tests.slicer.fill.areas import HEIGHT, OVERLAP, STARS, WIDTH, plastic_mm2, ring, square, strip
from tests.slicer.hand import SOLID, as_shapely, distances_mm, profile, whole


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


def open_mm2(area: Polygons, solid: SolidLines) -> float:
    """Area covered neither by the lines of a skin nor by the walls around it, which overlap its border by half a gap."""
    lines = [shapely.LineString(b.points).buffer(b.width_mm / 2) for b in skin_beads(area, Kind.TOP_SKIN, solid)]
    return float(as_shapely(area).buffer(0.5 * (solid.spacing_mm - WIDTH)).difference(shapely.union_all(lines)).area)


@pytest.mark.parametrize("pattern", ["monotonic", "rectilinear"])
@pytest.mark.parametrize("angle", [30.0, 45.0, 60.0])
def test_visible_skins_leave_less_than_half_as_much_open_beside_the_walls(angle: float, pattern: SkinPattern) -> None:
    slot = Polygons.square((40.0, 4.0))
    seen, hidden = (open_mm2(slot, SolidLines(angle, WIDTH, HEIGHT, OVERLAP, pattern, seen)) for seen in (True, False))
    assert 0.0 < seen < 0.5 * hidden
    assert skin_beads(slot, Kind.TOP_SKIN, SolidLines(90.0, WIDTH, HEIGHT, OVERLAP, pattern, True))  # no open area to reach into


@pytest.mark.parametrize("pattern", ["monotonic", "rectilinear"])
def test_wherever_the_last_line_of_a_seen_skin_meets_a_corner_less_than_a_quarter_of_a_square_of_it_stays_open(
    pattern: SkinPattern,
) -> None:
    solid = SolidLines(45.0, WIDTH, HEIGHT, OVERLAP, pattern, True)
    for length in np.arange(3.0, 3.6, 0.1):  # of an arm, one row of lines after another
        arm = Polygons.square((1.2, float(length))).translate((4.0, 10.0))
        assert open_mm2(Polygons.square((10.0, 10.0)) + arm, solid) < 0.25 * WIDTH**2


def test_no_line_is_a_dot_in_a_corner() -> None:
    (bead,) = skin_beads(Polygons.square((12.0, 12.0)), Kind.SKIN, SolidLines(45.0, WIDTH, HEIGHT, OVERLAP))
    assert np.hypot(*np.diff(bead.points, axis=0).T).min() > 0.2


def test_specks_beside_lines_are_filled_only_where_visible() -> None:
    speck = Polygons.square((0.4 * WIDTH, 2.0 * WIDTH))  # 0.8 of the width squared
    area, line = (
        Polygons.square((10.0, WIDTH)) + speck.translate((4.0, WIDTH)),
        np.array([[0.0, 0.5 * WIDTH], [10.0, 0.5 * WIDTH]]),
    )
    assert uncovered_area(area, [line], WIDTH).area() == pytest.approx(0.8 * WIDTH**2, rel=0.05)
    assert uncovered_area(area, [line], WIDTH, FEW_HIDDEN).is_empty()


@pytest.mark.parametrize("area", [square, ring, strip])
def test_a_concentric_skin_extrudes_its_area(area: Callable[[], Polygons]) -> None:
    beads = skin_beads(area(), Kind.SKIN, SolidLines(45.0, WIDTH, HEIGHT, OVERLAP, "concentric"))
    assert plastic_mm2(beads) == pytest.approx(area().area(), rel=0.01)


def test_the_lines_of_a_concentric_skin_are_squares_in_a_square_a_spacing_apart() -> None:
    block = Polygons.square((20.0, 20.0), True)
    rings = [bead for bead in skin_beads(block, Kind.SKIN, SolidLines(45.0, WIDTH, HEIGHT, 0.0, "concentric")) if bead.closed]
    sides = sorted(np.ptp(bead.points[:, 0]) for bead in rings)
    spacing = WIDTH - HEIGHT * (1 - np.pi / 4)
    assert sides == pytest.approx([20 - (2 * k + 1) * spacing for k in range(24, -1, -1)], abs=0.01)


@pytest.mark.parametrize(
    ("key", "layer"),
    [
        ("bottom_skin_pattern=concentric", 0),
        ("top_skin_pattern=concentric", 9),
        ("skin_angle_deg=0", 5),
    ],
)
def test_patterns_and_angle_of_skins_apply_where_they_are_set(key: str, layer: int) -> None:
    """All lines of a block's skin are straight along x or y there; in a skin at 45 degrees none is."""
    sliced = slice_part(whole(box(12, 12, 2)), profile(*SOLID, f"process.{key}"))

    def upright(number: int) -> float:
        paths = [path for path in sliced.layers[number].paths if path.kind in (Kind.SKIN, Kind.TOP_SKIN)]
        steps = np.concatenate([np.abs(np.diff(path.points, axis=0)) for path in paths])
        return float(steps[steps.min(axis=1) < 1e-3].sum() / steps.sum())

    assert upright(layer) > 0.9
    if "pattern" in key:
        assert all(upright(number) < 0.2 for number in range(10) if number != layer)


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
