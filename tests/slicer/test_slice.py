"""Whole parts: plastic, positions, frames, speeds, flow, determinism, errors."""

from collections.abc import Callable
from functools import cache
from pathlib import Path

import manifold3d as m3
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mdp.mesh import Mesh
from mdp.read import read_mesh
from profiles.errors import ProfileError, SliceError
from slicer.geometry.polygons import offset
from slicer.paths import Kind, SlicedPart
from slicer.slice import slice_part
from tests.shapes import ball, bowl, box, branch, hollow, standing
from tests.slicer.hand import BARE, SOLID, content, cut, distances_mm, of_kind, profile, section_at, shared, volume_mm3, whole

OWN = (Kind.OUTER_WALL, Kind.INNER_WALL, Kind.GAP, Kind.INFILL, Kind.SKIN, Kind.TOP_SKIN)
BULGE = 0.04 * 0.45  # surplus of outer beads, mm
ROUNDING = 0.5 * 0.2 * (1 - np.pi / 4) - BULGE  # depth that the round sides of outer beads leave open, mm


def cylinder() -> Mesh:
    return standing(m3.Manifold.cylinder(12, 9, 9, 96))


def expected_mm3(mesh: Mesh, sliced: SlicedPart) -> float:
    """The volume less the space that the round sides of the outermost beads leave open."""
    return mesh.volume_mm3 - 0.2 * ROUNDING * sum(path.length_mm for path in of_kind(sliced, Kind.OUTER_WALL))


@pytest.mark.parametrize(("thick_mm", "layers"), [(0.3, 0), (0.08, 4)])
def test_layers_with_nothing_wide_enough_for_a_line_below_others_are_counted(thick_mm: float, layers: int) -> None:
    block = m3.Manifold.cube((4, 4, 1))
    neck = m3.Manifold.cube((2, thick_mm, 0.8)).translate((1, 2, 1))
    sliced = slice_part(whole(standing(block + neck + block.translate((0, 0, 1.8)))), profile())
    assert (sliced.too_thin, sliced.too_thin_mm) == (layers, pytest.approx(1.2 if layers else 0.0))


def test_a_part_that_would_begin_above_the_plate_is_refused() -> None:
    hair = m3.Manifold.cube((2, 0.08, 1.0)).translate((1, 2, 0)) + m3.Manifold.cube((4, 4, 1)).translate((0, 0, 1.0))
    said = r"part 1 would begin in air, 1.00 mm above the plate: .* lines of 0.45 mm: .*, or process.support = auto"
    with pytest.raises(SliceError, match=said):
        slice_part(whole(standing(hair)), profile("process.support=none"))
    slice_part(whole(standing(hair)), profile())


@pytest.mark.parametrize("make", [box, cylinder, hollow, bowl, ball, branch])
def test_a_solid_part_extrudes_its_volume(make: Callable[[], Mesh]) -> None:
    sliced = slice_part(whole(make()), profile(*SOLID))
    assert sliced.volume_mm3 == pytest.approx(make().volume_mm3, rel=0.015)
    assert sliced.volume_mm3 == pytest.approx(expected_mm3(make(), sliced), rel=0.006)


@settings(max_examples=15, deadline=None)
@given(st.floats(3.0, 30.0), st.floats(3.0, 30.0), st.floats(0.4, 3.0), st.floats(0, 90))
def test_any_solid_block_extrudes_its_volume(x: float, y: float, z: float, turn: float) -> None:
    mesh = standing(m3.Manifold.cube((x, y, z)).rotate((0, 0, turn)))
    sliced = slice_part(whole(mesh), profile(*SOLID))
    assert sliced.volume_mm3 == pytest.approx(expected_mm3(mesh, sliced), rel=0.02)


@pytest.mark.parametrize("name", ["org_kitten", "org_deer", "mec_bracket"])
def test_a_solid_real_model_extrudes_its_volume(name: str) -> None:
    mesh = shared(name, 20.0)
    assert slice_part(whole(mesh), profile(*SOLID)).volume_mm3 == pytest.approx(mesh.volume_mm3, rel=0.02)


@pytest.mark.parametrize("pattern", ["rectilinear", "grid", "triangles", "concentric"])
def test_every_point_is_inside_the_section(pattern: str) -> None:
    mesh = branch()
    sliced = slice_part(whole(mesh), profile(*BARE, f"process.infill_pattern={pattern}"))
    for layer in sliced.layers[::17]:
        allowed = offset(section_at(mesh, layer.z_mm - 0.5 * layer.height_mm), 0.01)
        assert distances_mm(allowed, np.concatenate([p.points for p in layer.paths])).min() > 0.0


@pytest.mark.parametrize("overlap", [0.0, 0.3])
def test_without_walls_no_stroke_extends_beyond_half_its_width(overlap: float) -> None:
    bare = profile("process.walls=0", "process.infill_density=0.2", f"process.infill_overlap={overlap}")
    sliced = slice_part(whole(standing(m3.Manifold.cube((20, 20, 6), True))), bare)
    assert of_kind(sliced, Kind.BRIDGE)
    width_mm, least_mm = bare.process.line_width_mm, 0.5 * (bare.process.line_width_mm - 0.2 * (1.0 - np.pi / 4.0))
    assert width_mm == 0.45
    points = np.concatenate([path.points for layer in sliced.layers for path in layer.paths if path.kind is not Kind.SKIRT])
    assert np.abs(points[:, :2]).max() <= 10.0 - least_mm + 1e-3


def test_infill_has_the_density_that_is_set() -> None:
    thick = standing(m3.Manifold.cube((60, 60, 4)))
    settings_ = [(*BARE, f"process.infill_density={d}") for d in (0.0, 0.3)]
    empty, filled = (slice_part(whole(thick), profile(*s)) for s in settings_)
    layer = filled.layers[10]
    sparse = layer.volumes_mm3[layer.is_of(Kind.INFILL)].sum() / layer.height_mm
    side = 60 - 2 * (0.225 + 2.5 * (0.45 - 0.2 * (1 - np.pi / 4)))
    assert sparse == pytest.approx(0.3 * side**2, rel=0.03)
    assert of_kind(empty, Kind.INFILL) == []


def test_layers_are_at_their_heights_above_the_build_plate() -> None:
    sliced = slice_part(whole(box(5, 5, 1)), profile("process.first_layer_height_mm=0.3"))
    assert [layer.z_mm for layer in sliced.layers] == pytest.approx([0.3, 0.5, 0.7, 0.9, 1.0])


def test_a_part_on_plastic_is_pressed_in_solid_slow_and_rich() -> None:
    base, arm = cut(branch(), ((np.sin(np.pi / 3), 0, 0.5), 14.0))
    first = slice_part(arm, profile(), [base]).layers[0]
    assert first.z_mm == pytest.approx(0.1)
    assert {p.speed_mm_s for p in first.paths} == {25.0}
    assert {p.flow for p in first.paths if p.kind is Kind.INNER_WALL} == {1.1}
    assert Kind.INFILL not in {p.kind for p in first.paths}
    assert Kind.SKIRT not in {p.kind for p in first.paths}
    assert first.fan == 0.0
    assert first.nozzle_add_c == 10.0


def test_slicing_a_part_does_not_depend_on_its_pose_in_the_workpiece() -> None:
    base, arm = cut(branch(), ((np.sin(np.pi / 3), 0, 0.5), 14.0))
    sliced = slice_part(arm, profile(*SOLID), [base])
    rich = 0.1 * sliced.layers[0].volumes_mm3.sum() / 1.1
    assert sliced.volume_mm3 == pytest.approx(arm.mesh.volume_mm3 + rich, rel=0.015)


def test_first_layer_and_fan_of_part_one() -> None:
    sliced = slice_part(whole(box(20, 20, 1)), profile("material.fan=0.7", "material.fan_least=0.7"))
    assert [layer.fan for layer in sliced.layers] == pytest.approx([0.0, 0.7, 0.7, 0.7, 0.7])
    assert {p.speed_mm_s for p in sliced.layers[0].paths} == {20.0}
    assert {p.speed_mm_s for p in sliced.layers[2].paths if p.kind is Kind.OUTER_WALL} == {40.0}


def test_material_flow_multiplies_all_plastic() -> None:
    half, full = (slice_part(whole(box()), profile(f"material.flow={f}")).volume_mm3 for f in (0.5, 1.0))
    assert half == pytest.approx(0.5 * full, rel=1e-9)


def test_the_skirt_runs_once_around_the_first_layer_only() -> None:
    sliced = slice_part(whole(box(10, 10, 2)), profile("process.elephant_foot_mm=0"))
    (skirt,) = of_kind(sliced, Kind.SKIRT)
    assert sliced.layers[0].paths[0].kind is Kind.SKIRT
    assert np.abs(skirt.points).max() == pytest.approx(5 + 4 + 0.225)


def test_a_brim_replaces_the_skirt_and_touches_the_part() -> None:
    sliced = slice_part(whole(box(10, 10, 2)), profile("process.brim_mm=4", "process.elephant_foot_mm=0"))
    sides = sorted(np.abs(p.points).max() for p in of_kind(sliced, Kind.SKIRT))
    spacing = 0.45 - 0.2 * (1 - np.pi / 4)
    assert sides == pytest.approx([5 + (k + 0.5) * spacing for k in range(10)])
    assert volume_mm3(sliced, Kind.SKIRT) / 0.2 == pytest.approx(40 * 10 * spacing + np.pi * (10 * spacing) ** 2, rel=0.02)


def test_a_part_lower_than_a_layer_is_printed_as_one() -> None:
    sliced = slice_part(whole(box(10, 10, 0.12)), profile(*SOLID))
    assert [layer.z_mm for layer in sliced.layers] == pytest.approx([0.12])
    assert [layer.height_mm for layer in sliced.layers] == pytest.approx([0.12])
    assert sliced.volume_mm3 == pytest.approx(12.0, rel=0.035)  # lines that extend into the corners of a skin overlap there


@pytest.mark.parametrize("walls", [0, 1, 50])
def test_any_number_of_walls_fills_the_part(walls: int) -> None:
    mesh = box(20, 20, 2)
    assert slice_part(whole(mesh), profile(*SOLID, f"process.walls={walls}")).volume_mm3 == pytest.approx(800, rel=0.02)


@cache
def coarse_branch() -> SlicedPart:
    """The branch with its support, in thick layers, sliced once for all tests."""
    return slice_part(whole(branch()), profile("process.layer_height_mm=0.4"))


def test_the_same_part_gives_the_same_bytes() -> None:
    assert content(slice_part(whole(branch()), profile("process.layer_height_mm=0.4"))) == content(coarse_branch())


def test_every_path_has_length_and_width_and_speed() -> None:
    for path in of_kind(coarse_branch(), *OWN):
        assert path.length_mm > 0.04
        assert 0.09 < path.width_mm < 0.91  # the least gap is 0.12 of a line, and its bead is 0.04 mm wider
        assert 0 < path.speed_mm_s <= 80
        assert path.points.shape[1] == path.approach.shape[1] == 2
        assert (path.points[1:] != path.points[:-1]).any(axis=1).all()


def test_a_part_thinner_than_any_line_is_refused_with_its_measures() -> None:
    with pytest.raises(SliceError, match=r"part 1 gives no path at all: it measures 0.1 x 5 x 5 mm"):
        slice_part(whole(box(0.1, 5, 5)), profile())


def test_settings_that_leave_nothing_to_print_are_named() -> None:
    nothing = profile("process.walls=0", "process.infill_density=0", "process.top_layers=0", "process.bottom_layers=0")
    with pytest.raises(SliceError, match=r"process\.walls and process\.infill_density are 0"):
        slice_part(whole(box(20, 20, 5)), nothing)


def test_a_plate_with_a_thousand_holes_is_sliced() -> None:
    pins = [m3.Manifold.cylinder(2, 0.8, 0.8, 12).translate((3 * i, 3 * j, -0.5)) for i in range(32) for j in range(32)]
    plate = m3.Manifold.cube((100, 100, 0.2)).translate((-4, -4, 0)) - m3.Manifold.batch_boolean(pins, m3.OpType.Add)
    sliced = slice_part(whole(standing(plate)), profile(*BARE))
    walls_ = [p for p in sliced.layers[0].paths if p.kind is Kind.OUTER_WALL]
    assert len(walls_) == 1025


@pytest.mark.parametrize("key", ["layer_height_mm", "first_layer_height_mm"])
def test_a_layer_higher_than_the_nozzle_is_wide_is_refused(key: str) -> None:
    with pytest.raises(ProfileError, match=rf"process\.{key} is 0.5: a 0.4 mm nozzle prints layers of at most 0.4 mm"):
        profile(f"process.{key}=0.5", "process.line_width_mm=0.8")


def test_islands_narrower_than_a_line_are_printed_beside_larger_ones() -> None:
    pins = m3.Manifold.cylinder(2, 0.2, 0.2, 16).translate((8, 0, 0)) + m3.Manifold.cylinder(2, 0.09, 0.09, 8).translate(
        (-8, 0, 0)
    )
    sliced = slice_part(whole(standing(m3.Manifold.cube((5, 5, 2)) + pins)), profile(*BARE))
    across = np.concatenate([p.points for p in sliced.layers[3].paths])[:, 0]
    assert across.max() > 7.5
    assert across.min() > -6.0


@pytest.mark.slow
@pytest.mark.parametrize(("file", "scale"), [
    ("hook.stl", 0.75), ("fan_support.stl", 0.5), ("dancinggirl.stl", 0.55), ("pencildome.stl", 0.3)])  # fmt: skip
def test_every_solid_model_extrudes_its_volume(file: str, scale: float) -> None:
    path = Path(__file__).resolve().parents[3] / "shared" / "models" / file
    if not path.exists():
        pytest.skip(f"{file} is not here")
    read, _ = read_mesh(path)
    mesh = Mesh(scale * read.vertices, read.faces)
    assert slice_part(whole(mesh), profile(*SOLID)).volume_mm3 == pytest.approx(mesh.volume_mm3, rel=0.015)
