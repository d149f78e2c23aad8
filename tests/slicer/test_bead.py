"""Widths of beads by kind and in the first layer on the plate."""

import manifold3d as m3
import numpy as np
import pytest
import shapely
from hypothesis import given, settings
from hypothesis import strategies as st

from slicer.paths import SKINS, Kind
from slicer.slice import slice_part
from tests.shapes import box, standing, tee
from tests.slicer.hand import SOLID, cut, of_kind, profile, volume_mm3, whole

WIDTHS = {Kind.OUTER_WALL: 0.35, Kind.INNER_WALL: 0.45, Kind.TOP_SKIN: 0.4, Kind.SKIN: 0.45, Kind.INFILL: 0.6, Kind.SUPPORT: 0.3}
KEYS = ("outer_wall", "top_skin", "infill", "support")
BY_KIND = [f"process.{key}_line_width_mm={WIDTHS[Kind[key.upper()]]}" for key in KEYS]


def test_every_kind_of_bead_has_its_width() -> None:
    sliced = slice_part(whole(tee()), profile("process.solid_below_mm2=0", *BY_KIND))
    for kind, width in WIDTHS.items():
        assert {path.width_mm for path in of_kind(sliced, kind)} == {width}


def test_first_layer_beads_have_one_width_on_the_plate_and_another_on_plastic() -> None:
    chosen = profile("process.first_layer_line_width_mm=0.6", "process.interface_line_width_mm=0.7", *BY_KIND)
    base, top = (slice_part(part, chosen) for part in cut(box(10, 10, 6), ((0.0, 0.0, 1.0), 3.0)))
    assert {path.width_mm for path in base.layers[0].paths if path.kind is not Kind.GAP} == {0.6}
    assert {path.width_mm for path in top.layers[0].paths if path.kind is not Kind.GAP} == {0.7}
    assert {path.width_mm for path in top.layers[1].paths if path.kind is Kind.OUTER_WALL} == {0.35}


@pytest.mark.parametrize("width", [0.3, 0.7])
def test_an_outer_wall_is_inset_by_half_its_width(width: float) -> None:
    sliced = slice_part(whole(box(20, 20, 1)), profile(f"process.outer_wall_line_width_mm={width}"))
    points = np.concatenate([path.points for path in of_kind(sliced, Kind.OUTER_WALL)])
    assert np.abs(points).max() == pytest.approx(10 - 0.5 * width)


@pytest.mark.parametrize("key", ["first_layer", "outer_wall", "top_skin"])
@pytest.mark.parametrize("width", [0.3, 0.7])
def test_a_solid_part_extrudes_its_volume_with_any_widths(key: str, width: float) -> None:
    mesh = box(20, 15, 3)
    sliced = slice_part(whole(mesh), profile(*SOLID, f"process.{key}_line_width_mm={width}"))
    assert sliced.volume_mm3 == pytest.approx(mesh.volume_mm3, rel=0.015)


def test_wide_infill_keeps_its_density() -> None:
    plain, wide = (
        slice_part(whole(box(40, 40, 6)), profile("process.infill_pattern=rectilinear", f"process.infill_line_width_mm={w}"))
        for w in (0.45, 0.7)
    )
    assert volume_mm3(wide, Kind.INFILL) == pytest.approx(volume_mm3(plain, Kind.INFILL), rel=0.05)


def test_the_first_layer_has_its_own_flow() -> None:
    plain, rich = (slice_part(whole(box(20, 20, 1)), profile(f"process.first_layer_flow={f}")) for f in (1.0, 1.1))
    ratios = [b.volumes_mm3.sum() / a.volumes_mm3.sum() for a, b in zip(plain.layers, rich.layers, strict=True)]
    assert ratios == pytest.approx([1.1, 1.0, 1.0, 1.0, 1.0])


@settings(max_examples=5)
@given(st.sampled_from([0.0125, 0.025, 0.05, 0.2]), st.integers(0, 3))
def test_no_point_of_a_path_is_farther_than_the_resolution_from_its_simplification(resolution_mm: float, seed: int) -> None:
    waves = 8.0 + np.random.default_rng(seed).normal(0.0, 0.1, 90)
    turn = 2.0 * np.pi * np.arange(90) / 90
    outline = m3.CrossSection([np.column_stack([waves * np.cos(turn), waves * np.sin(turn)])])
    part = whole(standing(m3.Manifold.extrude(outline, 1.0)))
    exact, simple = (slice_part(part, profile(f"process.resolution_mm={mm}")) for mm in (0.0, resolution_mm))
    for fine, coarse in zip(exact.layers, simple.layers, strict=True):
        for before, after in zip(fine.paths, coarse.paths, strict=True):
            line = shapely.LineString(after.points)
            aside_mm = (
                0.25 * before.width_mm if before.kind in SKINS else 0.0
            )  # where a short step of a skin's line is lengthened
            assert shapely.distance(shapely.points(before.points), line).max() <= resolution_mm + aside_mm + 1e-9
            assert (before.points[[0, -1]] == after.points[[0, -1]]).all(), "closed paths stay closed"
            assert before.speed_mm_s == after.speed_mm_s
    counts = [sum(len(path.points) for layer in each.layers for path in layer.paths) for each in (exact, simple)]
    assert counts[1] < counts[0]


def test_walls_of_a_fine_mesh_have_no_specks() -> None:
    column = whole(standing(m3.Manifold.cylinder(2.0, 6.0, 6.0, 1440)))
    for path in of_kind(slice_part(column, profile(*SOLID)), Kind.OUTER_WALL, Kind.INNER_WALL):
        lengths = np.hypot(*np.diff(path.points, axis=0).T)
        assert (lengths < 0.1).sum() <= 1, "but for the rest before the seam"
        assert np.ptp(np.hypot(*path.points[1:-1].T)) < 0.02
