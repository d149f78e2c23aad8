"""Brims, skirts and the base: closed formulas of the section modulus, parts that need a brim, the first layer's outline."""

import numpy as np
import pytest
import shapely
from hypothesis import given
from hypothesis import strategies as st

from mdp.cost.footing import section_edges, tips_over
from mdp.mesh import Mesh
from mdp.sweep.bending import greatest_stress_per_moment
from slicer.geometry.polygons import Polygons
from slicer.paths import Kind, Path
from slicer.slice import slice_part
from tests.shapes import box, tee
from tests.slicer.hand import BARE, as_shapely, cut, of_kind, profile, whole


def section_modulus_mm3(area: Polygons) -> float:
    return 1.0 / greatest_stress_per_moment(section_edges(area))


@given(st.floats(1, 50), st.floats(1, 50), st.floats(0, 180), st.floats(-90, 90))
def test_the_section_modulus_of_a_rectangle(b: float, h: float, turn_deg: float, x: float) -> None:
    area = Polygons.square((b, h), True).rotate(turn_deg).translate((x, 2 * x))
    assert section_modulus_mm3(area) == pytest.approx(1 / np.hypot(6 / (b * h**2), 6 / (h * b**2)), rel=1e-6)


def test_a_strip_of_5_by_20_mm_holds_a_push_at_16_mm_but_not_at_17() -> None:
    """A push of 1 N at 16 mm against 0.2 N/mm2 over 80.8 mm3."""
    assert [tips_over(Polygons.square((5, 20)), height_mm) for height_mm in (14, 16, 17)] == [False, False, True]


def test_no_base_holds_nothing() -> None:
    assert section_modulus_mm3(Polygons()) == 0.0
    assert tips_over(Polygons(), 0.1)


def test_the_section_modulus_of_a_tube() -> None:
    tube = Polygons.circle(10, 720) - Polygons.circle(8, 720)
    assert section_modulus_mm3(tube) == pytest.approx(np.pi * (10**4 - 8**4) / 40, rel=1e-3)


def test_feet_far_apart_hold_better_than_one() -> None:
    foot = Polygons.square((4, 4), True)
    four = Polygons.compose([foot.translate((x, y)) for x in (-20, 20) for y in (-20, 20)])
    assert tips_over(foot, 30)
    assert not tips_over(four, 30)


def brim_of(mesh: Mesh, *settings: str) -> list[Path]:
    return of_kind(slice_part(whole(mesh), profile(*settings)), Kind.SKIRT)


def test_a_tall_part_on_a_small_base_gets_a_brim_and_a_stout_one_its_skirt() -> None:
    thin, stout = brim_of(box(6, 6, 40)), brim_of(box(20, 20, 20))
    assert min(np.abs(p.points).max() for p in thin) < 3.3
    assert max(np.abs(p.points).max() for p in thin) == pytest.approx(8, abs=0.45)
    assert min(np.abs(p.points).max() for p in stout) > 13


def test_the_brim_of_a_small_base_surrounds_it_and_not_its_support() -> None:
    sliced, base = slice_part(whole(tee(4, 40, 40)), profile("process.elephant_foot_mm=0")), shapely.box(-2, -2, 2, 2)
    away = [shapely.distance(base, shapely.points(path.points)) for path in of_kind(sliced, Kind.SKIRT)]
    assert max(np.abs(path.points).max() for path in sliced.layers[0].paths if path.kind is Kind.SUPPORT) > 6.5
    assert max(distance.max() for distance in away) == pytest.approx(5, abs=0.3), "round the support it would reach 11.8"
    assert min(distance.min() for distance in away) == pytest.approx(0.5 * (0.45 - 0.2 * (1 - np.pi / 4)), abs=0.01)


def test_no_brim_where_it_is_not_wanted() -> None:
    assert brim_of(box(6, 6, 40), *BARE, "process.small_base_brim_mm=0") == []


def test_later_parts_on_top_count_as_height() -> None:
    base, top = cut(box(8, 8, 60), ((0, 0, 1), 5.0))
    alone, both = (of_kind(slice_part(base, profile(), later=later), Kind.SKIRT) for later in ((), (top,)))
    assert (len(alone), len(both)) == (1, 13)


def test_the_gap_of_a_brim() -> None:
    settings = "process.brim_mm=3", "process.brim_gap_mm=0.15", "process.elephant_foot_mm=0"
    near = min(np.abs(p.points).max() for p in brim_of(box(10, 10, 2), *settings))
    assert near == pytest.approx(5 + 0.15 + 0.5 * (0.45 - 0.2 * (1 - np.pi / 4)))


PLATE = "machine.table.radius_mm=14"


def test_a_skirt_that_finds_no_room_on_the_plate_follows_its_edge() -> None:
    wide = profile("process.skirt_loops=2", "process.small_base_brim_mm=0", "process.support=none", PLATE)
    skirt = of_kind(slice_part(whole(box(18, 18, 2)), wide), Kind.SKIRT)
    farthest = [np.hypot(*path.points.T).max() for path in skirt]
    assert farthest == pytest.approx([14 - 0.225, 14 - 0.225 - 0.407], abs=0.01)
    assert all(as_shapely(Polygons.square((18, 18), True)).distance(shapely.LineString(p.points)) > 0.2 for p in skirt)


def test_support_is_on_the_plate_only_and_leans_over_its_edge() -> None:
    near, far = (slice_part(whole(tee()), profile(f"machine.table.radius_mm={radius}")) for radius in (100, 12))
    reach = [np.hypot(*np.vstack([p.points for p in s.layers[0].paths]).T).max() for s in (near, far)]
    assert reach[0] > 13 > 12 >= reach[1]
    assert (near.unsupported_mm2, far.unsupported_mm2) == (0.0, 0.0)
