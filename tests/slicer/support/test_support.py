"""Support lies under overhangs, rests on plastic or the plate within its lean, and keeps its distances."""

from collections.abc import Callable

import manifold3d as m3
import numpy as np
import pytest
import shapely
from hypothesis import given, settings
from hypothesis import strategies as st

from mdp.decomposition import Part
from mdp.mesh import Floats, Mesh
from mdp.pose import UP, about
from slicer.geometry.polygons import Polygons
from slicer.overhangs import find_overhangs
from slicer.paths import Kind, Layer, SlicedPart
from slicer.sectioning import section_part
from slicer.slice import slice_part
from tests.shapes import branch, from_manifold, standing, tee
from tests.slicer.hand import cut, distances_mm, of_kind, profile, section_at, volume_mm3, whole
from tests.slicer.support.laws import as_shapely, assert_sound, supported

DISTANCE, GAP, LINE_MM = 0.3, 0.2, 0.45
SPACING = 0.45 - 0.2 * (1 - np.pi / 4)
PROPS = (Kind.SUPPORT, Kind.SUPPORT_INTERFACE)
COLUMNS = ("process.support_style=grid", "process.support_walls=0")


def layers_with_support(sliced: SlicedPart) -> list[Layer]:
    return [layer for layer in sliced.layers if any(path.kind in PROPS for path in layer.paths)]


def support_points(sliced: SlicedPart) -> Floats:
    return np.concatenate([path.points for path in of_kind(sliced, *PROPS)])


def lines_right_of_the_stem(layer: Layer, kind: Kind) -> Floats:
    """Positions of the long straight lines along y of a kind with x > 0, ascending, mm."""
    paths = [path.points for path in layer.paths if path.kind is kind]
    sides = np.concatenate([np.hstack([points[:-1], points[1:]]) for points in paths])
    along_y = (np.abs(sides[:, 2] - sides[:, 0]) < 1e-6) & (np.abs(sides[:, 3] - sides[:, 1]) > 5.0) & (sides[:, 0] > 0.0)
    return np.sort(sides[along_y, 0])


def table(span: float, depth: float = 5.0, height: float = 10.0) -> Mesh:
    """Two posts and a plate across them, `span` mm apart."""
    posts = m3.Manifold.cube((5, depth, height)) + m3.Manifold.cube((5, depth, height)).translate((5 + span, 0, 0))
    return standing(posts + m3.Manifold.cube((10 + span, depth, 2)).translate((0, 0, height)))


def funnel(angle: float) -> Mesh:
    """A pyramid on its tip whose four faces overhang by an angle from upright."""
    return standing(m3.Manifold.cylinder(6, 5, 5 + 6 * np.sqrt(2) * np.tan(np.radians(angle)), 4).rotate((0, 0, 45)))


def mushroom() -> Mesh:
    """A round cap on a round stem."""
    return standing(m3.Manifold.cylinder(20, 4, 4, 48) + m3.Manifold.cylinder(4, 15, 15, 48).translate((0, 0, 18)))


def gallows(arm: float = 16.0, height: float = 20.0) -> m3.Manifold:
    """A post with an arm to one side."""
    return m3.Manifold.cube((8, 8, height)) + m3.Manifold.cube((8 + arm, 8, 4)).translate((0, 0, height))


def test_both_arms_of_a_tee_are_supported_from_the_build_plate_up_to_the_gap() -> None:
    sliced = slice_part(whole(tee()), profile())
    held = layers_with_support(sliced)
    assert held[0].z_mm == pytest.approx(0.2)
    assert held[-1].z_mm == pytest.approx(30.0 - GAP)
    points = support_points(sliced)
    assert points[:, 0].min() < -19
    assert points[:, 0].max() > 19
    assert sliced.unsupported_mm2 == 0.0


@pytest.mark.parametrize("style", ["tree", "grid"])
@pytest.mark.parametrize("gap", [0.3, 0.6, 1.5])
def test_support_keeps_its_distance_from_the_part(gap: float, style: str) -> None:
    set_so = (f"process.support_distance_mm={gap}", f"process.support_style={style}")
    points = support_points(slice_part(whole(tee(height=20)), profile(*set_so)))
    away = np.hypot(*np.maximum(np.abs(points) - 5.0, 0.0).T).min() - 0.225
    assert gap - 0.02 < away < gap + 0.15


def test_columns_have_the_density_that_is_set() -> None:
    sliced = slice_part(whole(tee()), profile("process.support_density=0.2", "process.infill_angle_deg=90", *COLUMNS))
    across = lines_right_of_the_stem(sliced.layers[50], Kind.SUPPORT)
    assert np.diff(across) == pytest.approx(SPACING / 0.2)
    assert across[0] - (5 + DISTANCE) < SPACING / 0.2
    assert 20 - across[-1] < SPACING / 0.2


def test_the_layers_under_the_part_are_dense() -> None:
    keys = ("process.support_interface_layers=2", "process.support_interface_density=0.7", "process.infill_angle_deg=0")
    sliced = slice_part(whole(tee()), profile(*keys))
    dense = [layer for layer in sliced.layers if any(path.kind is Kind.SUPPORT_INTERFACE for path in layer.paths)]
    assert [round(layer.z_mm, 6) for layer in dense] == [29.6, 29.8]
    across = lines_right_of_the_stem(dense[-1], Kind.SUPPORT_INTERFACE)
    assert np.diff(across) == pytest.approx(SPACING / 0.7)
    edge = SPACING + 0.225  # the outline, and half a line
    assert across[0] - (5 + DISTANCE + edge) < SPACING / 0.7
    assert 20 - edge - across[-1] < SPACING / 0.7


def test_dense_lines_cross_the_sparse_ones() -> None:
    layer = slice_part(whole(tee()), profile("process.infill_angle_deg=0", *COLUMNS)).layers[148]
    longest: dict[Kind, Floats] = {}
    for path in (path for path in layer.paths if path.kind in PROPS):
        steps = np.abs(np.diff(path.points, axis=0)).sum(axis=0)
        longest[path.kind] = longest.get(path.kind, np.zeros(2)) + steps
    assert longest[Kind.SUPPORT_INTERFACE][1] > 2 * longest[Kind.SUPPORT_INTERFACE][0]


def test_a_tree_takes_less_plastic_than_columns() -> None:
    grid, tree = (
        volume_mm3(slice_part(whole(tee(height=30)), profile(f"process.support_style={s}")), *PROPS) for s in ("grid", "tree")
    )
    assert tree < 0.7 * grid


def test_a_part_begins_with_its_support_and_higher_up_takes_what_is_near() -> None:
    layers = slice_part(whole(tee()), profile("process.skirt_loops=0")).layers
    kinds = [path.kind for path in layers[0].paths if path.kind is not Kind.SKIRT]
    assert kinds[0] in PROPS
    assert not set(PROPS) & set(kinds[kinds.index(Kind.INNER_WALL) :])
    assert all(set(PROPS) & {path.kind for path in layer.paths} for layer in layers[:100])


def test_a_rim_that_gets_thick_enough_for_a_line_in_mid_air_hangs_there() -> None:
    bell = m3.Manifold.revolve(m3.CrossSection([[(8, 6), (8.8, 20), (8.8, 22), (0, 22), (0, 20), (8, 20)]]), 64)
    sections = section_part(whole(standing(bell + m3.Manifold.cylinder(22, 3, 3, 64))), profile())
    first = next(i for i, outline in enumerate(sections.outlines) if outline.bounds()[2] > 5.0)
    ring = sections.outlines[first] - Polygons.circle(4.0, 32)
    assert 0.16 < ring.area() / (2.0 * np.pi * 8.0) < 0.18  # as thick as the thinnest ring that gets a line all along
    assert find_overhangs(sections)[first].hanging.area() == pytest.approx(ring.area(), rel=0.01)


def test_support_none_prints_no_support() -> None:
    assert of_kind(slice_part(whole(tee()), profile("process.support=none")), *PROPS) == []


@pytest.mark.parametrize("angle", [40.0, 44.9, 45.0])
def test_faces_up_to_the_self_supporting_angle_need_nothing(angle: float) -> None:
    assert of_kind(slice_part(whole(funnel(angle)), profile()), *PROPS) == []


@pytest.mark.parametrize("angle", [47.0, 60.0, 80.0])
def test_flatter_faces_are_supported(angle: float) -> None:
    assert len(of_kind(slice_part(whole(funnel(angle)), profile()), *PROPS)) > 10


def test_a_short_bridge_needs_no_support_and_a_long_one_does() -> None:
    assert of_kind(slice_part(whole(table(30)), profile()), *PROPS) == []
    assert len(of_kind(slice_part(whole(table(31)), profile()), *PROPS)) > 10
    assert len(of_kind(slice_part(whole(table(5)), profile("process.bridge_longest_mm=1")), *PROPS)) > 10


@pytest.mark.parametrize(("diameter", "hangs"), [(4.0, False), (8.0, False), (12.0, True)])
def test_the_crown_of_a_level_hole_is_supported_only_where_the_search_counts_it(diameter: float, hangs: bool) -> None:
    drill = m3.Manifold.cylinder(30, diameter / 2, -1, 64, True).rotate((90, 0, 0)).translate((10, 10, 10))
    overhangs, supports = supported(whole(standing(m3.Manifold.cube((20, 20, 20)) - drill)))
    assert (sum(overhang.hanging.area() for overhang in overhangs) > 1.0) == hangs
    assert any(not area.is_empty() for area in supports.areas) == hangs


@pytest.mark.parametrize(("depth", "hangs"), [(0.8, False), (5.0, True), (10.0, True)])
def test_a_ledge_is_supported_unless_it_is_narrow(depth: float, hangs: bool) -> None:
    ledge = m3.Manifold.cube((10, 20, 20)) + m3.Manifold.cube((depth, 20, 3)).translate((10, 0, 12))
    overhangs, _ = supported(whole(standing(ledge)), "process.support_least_mm2=0")
    assert sum(overhang.hanging.area() for overhang in overhangs) == pytest.approx(20 * depth if hangs else 0.0, rel=0.02)


def test_a_tiny_overhang_needs_no_support() -> None:
    nose = m3.Manifold.cube((10, 10, 10)) + m3.Manifold.cube((1.0, 0.9, 1)).translate((10, 4, 5))
    assert of_kind(slice_part(whole(standing(nose)), profile()), *PROPS) == []
    assert of_kind(slice_part(whole(standing(nose)), profile("process.support_least_mm2=0")), *PROPS) != []


@pytest.mark.parametrize(("bottom", "top"), [(0.2, 0.2), (0.4, 0.2), (0.2, 0.6), (0.0, 0.0)])
def test_support_on_the_part_itself_leaves_the_gaps_below_and_above_it(bottom: float, top: float) -> None:
    hook = m3.Manifold.cube((20, 8, 3)) + m3.Manifold.cube((5, 8, 20)) + m3.Manifold.cube((20, 8, 3)).translate((0, 0, 17))
    gaps = (f"process.support_bottom_gap_mm={bottom}", f"process.support_gap_mm={top}")
    held = layers_with_support(slice_part(whole(standing(hook)), profile(*gaps)))
    assert held[0].z_mm - held[0].height_mm == pytest.approx(3.0 + bottom)
    assert held[-1].z_mm == pytest.approx(17.0 - top)


def test_support_from_the_build_plate_only_leans_out_to_it() -> None:
    hook = m3.Manifold.cube((14, 8, 3)) + m3.Manifold.cube((5, 8, 30)) + m3.Manifold.cube((14, 8, 3)).translate((0, 0, 27))
    sliced = slice_part(whole(standing(hook)), profile("process.support_on_part=false"))
    assert layers_with_support(sliced)[0].z_mm == pytest.approx(0.2)
    assert sliced.unsupported_mm2 == 0.0


def test_an_overhang_without_room_for_support_is_reported_unless_plastic_is_close_below() -> None:
    slit = m3.Manifold.cube((30, 30, 10)) - m3.Manifold.cube((20, 20, 0.2)).translate((5, 5, 5))
    assert slice_part(whole(standing(slit)), profile("process.bridge_longest_mm=1")).unsupported_mm2 == 0.0
    drawer = m3.Manifold.cube((30, 30, 10)) - m3.Manifold.cube((20, 20, 0.7)).translate((5, 5, 5))
    sliced = slice_part(whole(standing(drawer)), profile("process.bridge_longest_mm=1", "process.support_bottom_gap_mm=0.6"))
    (face,) = sliced.unsupported
    assert face.mm2 == pytest.approx((20.0 - 2.0 * LINE_MM) ** 2, rel=0.02)  # a line along each side lies on the plastic below
    assert sliced.layers[face.layer - 1].z_mm == pytest.approx(6.0)
    assert face.reason == "there is no room for support between it and the plastic below"


def test_a_plate_on_its_own_base_plane_cannot_be_supported() -> None:
    base, plate = cut(tee(), ((0, 0, 1), 30.0))
    sliced = slice_part(plate, profile(), [base])
    assert sliced.unsupported_mm2 == pytest.approx(300.0, abs=5)
    assert of_kind(sliced, *PROPS) == []


def test_support_of_a_later_part_roots_on_earlier_plastic() -> None:
    slab = m3.Manifold.cube((40, 10, 10)) + m3.Manifold.cube((8, 10, 30)) + m3.Manifold.cube((30, 10, 5)).translate((0, 0, 30))
    base, top = cut(standing(slab), ((0, 0, 1), 10.0))
    sliced = slice_part(top, profile(), [base])
    assert sliced.unsupported_mm2 == 0.0
    assert layers_with_support(sliced)[0].z_mm < 0.6


def test_support_leans_over_the_edge_of_its_base() -> None:
    foot = m3.Manifold.cube((16, 8, 10)) + gallows(18.0, 34.0)
    base, top = cut(standing(foot), ((0, 0, 1), 10.0))
    sliced = slice_part(top, profile(), [base])
    edge = base.mesh.bounds_mm[1, 0]
    assert sliced.unsupported_mm2 == 0.0
    assert np.concatenate([p.points for p in of_kind(sliced, *PROPS)])[:, 0].max() > edge + 9.0
    low = [p.points[:, 0].max() for layer in layers_with_support(sliced)[:3] for p in layer.paths if p.kind in PROPS]
    assert max(low) < edge + 1.0


def test_overhangs_beyond_the_lean_are_reported() -> None:
    foot = m3.Manifold.cube((16, 8, 10)) + gallows(18.0, 18.0)
    base, top = cut(standing(foot), ((0, 0, 1), 10.0))
    sliced = slice_part(top, profile("process.support_branch_angle_deg=30"), [base])
    reach = (8.0 - 0.2) * np.tan(np.radians(30.0))
    assert sliced.unsupported_mm2 == pytest.approx((26.0 - 16.0 - reach) * 8.0, rel=0.2)


@pytest.mark.parametrize("tilt", [30.0, -30.0, 90.0])
def test_support_stays_below_the_base_plane_of_every_later_part(tilt: float) -> None:
    part = whole(tee())
    guest = from_manifold(m3.Manifold.cube((4, 4, 4)).translate((30, 0, 30)))
    normal = about(np.array([0.0, 1.0, 0.0]), np.radians(tilt)) @ UP
    base = type(part.base)(normal, float(normal @ (14.0, 0.0, 24.0)))
    sliced = slice_part(part, profile(), later=[Part(2, guest, base, part.pose, part.rotation, 64.0, 0.0)])
    for layer in layers_with_support(sliced):
        points = np.concatenate([path.points for path in layer.paths if path.kind in PROPS])
        for z in (layer.z_mm, layer.z_mm - layer.height_mm):
            highest = (np.column_stack([points, np.full(len(points), z)]) @ normal).max() + 0.225 * np.hypot(*normal[:2])
            assert highest < base.offset_mm - DISTANCE
    assert sliced.unsupported_mm2 > 10.0


def test_support_of_a_leaning_arm_never_touches_the_part() -> None:
    mesh = branch()
    sliced = slice_part(whole(mesh), profile())
    for layer in sliced.layers[5:150:12]:
        points = [path.points for path in layer.paths if path.kind in PROPS]
        section = section_at(mesh, layer.z_mm - 0.5 * layer.height_mm)
        if points:
            assert distances_mm(section, np.concatenate(points)).max() < -(DISTANCE + 0.2)


def test_support_gets_a_foot_on_the_build_plate() -> None:
    wide, narrow = (
        slice_part(whole(tee(height=16)), profile(f"process.support_foot_mm={mm}", "process.skirt_loops=0")).layers[0]
        for mm in (3, 0)
    )
    reach = [max(p.points[:, 0].max() for p in layer.paths if p.kind is Kind.SUPPORT) for layer in (wide, narrow)]
    assert reach[0] - reach[1] == pytest.approx(3.0, abs=0.3)


@pytest.mark.parametrize(("span", "height"), [(4.0, 1.4), (4.0, 3.0), (4.0, 12.0), (16.0, 3.0), (16.0, 14.0)])
def test_a_foot_widens_support_to_twice_its_height_at_most(span: float, height: float) -> None:
    feet = (
        supported(whole(table(span, span, height)), "process.bridge_longest_mm=1", "process.support_style=grid", foot)[1].areas[0]
        for foot in ("process.support_foot_mm=1.5", "process.support_foot_mm=0")
    )
    wide, narrow = (as_shapely(foot) for foot in feet)
    lacking_mm = 2.0 * (height - GAP) - 4.0 * narrow.area / narrow.length
    assert wide.bounds[3] - narrow.bounds[3] == pytest.approx(np.clip(0.5 * lacking_mm, 0.0, 1.5), abs=0.12)


def test_support_next_to_a_slope_reaches_half_a_line_under_it() -> None:
    sides = ((-1, 0), (1, 0), (-3, 1.2), (3, 1.2), (-3, 4), (3, 4))
    slope = m3.Manifold.hull_points([(x, y, z) for x in (-20, 20) for y, z in sides])
    overhangs, supports = supported(whole(standing(slope)), "process.support_foot_mm=0")
    assert_sound(overhangs, supports)
    reach = max(float(area.bounds()[3]) for area in supports.areas if not area.is_empty())
    assert 3.0 < reach < 3.0 + 1.5 * LINE_MM + 0.1


@pytest.mark.parametrize("style", ["tree", "grid"])
def test_the_foot_covers_all_support_on_it(style: str) -> None:
    foot, above = (
        [path for path in layer.paths if path.kind in PROPS]
        for layer in slice_part(whole(mushroom()), profile(f"process.support_style={style}")).layers[:2]
    )
    laid = shapely.union_all([shapely.LineString(path.points).buffer(0.5 * path.width_mm) for path in foot])
    lines = shapely.union_all([shapely.LineString(path.points) for path in above])
    bare = lines - laid
    assert max(piece.length for piece in getattr(bare, "geoms", [bare])) < 1.0
    assert bare.length < 0.1 * lines.length


SOLIDS: dict[str, Callable[[], Mesh]] = {
    "a table": lambda: table(34, 12, 16),
    "a mushroom": mushroom,
    "a funnel": lambda: funnel(65.0),
    "a leaning arm": branch,
    "a gallows": lambda: standing(gallows()),
    "a cone on its tip": lambda: standing(m3.Manifold.cylinder(8, 2, 14, 40)),
    "a ball": lambda: standing(m3.Manifold.sphere(9, 40)),
}


@pytest.mark.parametrize("style", ["tree", "grid"])
@pytest.mark.parametrize("name", SOLIDS)
def test_every_overhang_is_supported_or_reported_and_every_support_has_a_base(name: str, style: str) -> None:
    assert_sound(*supported(whole(SOLIDS[name]()), f"process.support_style={style}"))


@pytest.mark.parametrize("style", ["tree", "grid"])
def test_every_overhang_on_a_tilted_base_is_supported_or_reported(style: str) -> None:
    mesh = standing(gallows(20.0, 26.0))
    base, top = cut(mesh, ((0.3, 0.0, 1.0), 9.0))
    assert_sound(*supported(top, f"process.support_style={style}", earlier=[base]))


@settings(max_examples=5, deadline=None)
@given(
    boxes=st.lists(
        st.tuples(*[st.integers(-8, 8)] * 2, st.integers(4, 14), *[st.integers(3, 14)] * 2, st.integers(1, 4)),
        min_size=1,
        max_size=4,
    ),
    style=st.sampled_from(["tree", "grid"]),
)
def test_every_overhang_of_any_heap_of_boxes_is_supported_or_reported(
    boxes: list[tuple[int, int, int, int, int, int]], style: str
) -> None:
    heap = m3.Manifold.cube((6, 6, 20), False).translate((-3, -3, 0))
    for x, y, z, a, b, c in boxes:
        heap += m3.Manifold.cube((a, b, c), True).translate((x, y, z + c / 2))
    heap = max(heap.decompose(), key=lambda piece: piece.volume())
    assert_sound(*supported(whole(standing(heap)), f"process.support_style={style}"))
