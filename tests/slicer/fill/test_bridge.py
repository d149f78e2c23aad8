"""Bridges: their direction against brute force, the ends of their lines, and their printing."""

import manifold3d as m3
import numpy as np
import pytest
import shapely
from hypothesis import given, settings
from hypothesis import strategies as st
from shapely.affinity import rotate

from mdp.mesh import Mesh
from slicer.geometry.edge_index import index_edges
from slicer.geometry.polygons import Polygons, offset
from slicer.overhangs import Bridge, find_bridge, find_bridges
from slicer.paths import Kind, Path
from slicer.slice import slice_part
from tests.shapes import box, standing
from tests.slicer.hand import SOLID, as_shapely, cut, of_kind, profile, whole

WIDTH = 0.45


def gap(length: float, span: float, turn_deg: float) -> tuple[Polygons, Polygons]:
    """A hanging rectangle between two banks along its long sides."""
    hanging = Polygons.square((length, span), True).rotate(turn_deg)
    sides = [Polygons.square((length, 4), True).translate((0, side * (span / 2 + 2))).rotate(turn_deg) for side in (-1, 1)]
    return hanging, Polygons.compose(sides)


def bridge_over(hanging: Polygons, banks: Polygons) -> Bridge:
    span = find_bridge(hanging, index_edges(offset(banks, 0.25 * WIDTH)), WIDTH)
    assert span is not None
    return span


def apart_deg(a: float, b: float) -> float:
    return abs((a - b + 90) % 180 - 90)


@settings(max_examples=40, deadline=None)
@given(st.floats(3, 30), st.floats(2, 30), st.floats(0, 180))
def test_lines_cross_a_gap_of_any_direction_at_right_angles(length: float, span: float, turn: float) -> None:
    over = bridge_over(*gap(length, span, turn))
    assert apart_deg(over.angle_deg, turn + 90) < 0.1
    assert over.longest_mm == pytest.approx(span, abs=0.01)
    assert over.loose < 0.01


@settings(max_examples=10, deadline=None)
@given(st.lists(st.tuples(st.floats(0, 6.28), st.floats(3, 6)), min_size=5, max_size=9, unique_by=lambda p: round(p[0], 1)))
def test_in_no_direction_do_lines_sag_much_less(corners: list[tuple[float, float]]) -> None:
    points = np.array([[r * np.cos(a), r * np.sin(a)] for a, r in sorted(corners)])
    hanging = Polygons.hull_points(points)
    over = bridge_over(hanging, offset(hanging, 5) - hanging)
    shape = as_shapely(hanging)
    assert mean_sag(shape, over.angle_deg) <= 1.15 * min(mean_sag(shape, angle) for angle in range(0, 180, 3))


def test_lines_over_a_rectangle_run_along_its_short_side() -> None:
    """Slanted lines are shorter in the corners only."""
    hanging = Polygons.square((20.0, 14.0), True)
    assert bridge_over(hanging, offset(hanging, 3.0) - hanging).angle_deg == pytest.approx(90.0, abs=0.1)


def test_a_ring_of_bridges_between_four_legs_is_bridged_arm_by_arm() -> None:
    legs = Polygons.compose([Polygons.square((8, 8), True).translate((x, y)) for x in (-8, 8) for y in (-8, 8)])
    ring = Polygons.square((24, 24), True) - Polygons.square((6, 6), True)
    pieces = find_bridges(ring - legs, index_edges(offset(legs, 0.25 * WIDTH)), WIDTH)
    by_angle = {round(piece.angle_deg) % 180: piece.hanging.area() for piece in pieces if piece.loose == 0.0}
    assert by_angle == {0: pytest.approx(2 * 8 * 8, rel=0.03), 90: pytest.approx(2 * 8 * 8, rel=0.03)}


@settings(max_examples=30, deadline=None)
@given(st.floats(3, 30), st.floats(2, 30), st.floats(0, 180))
def test_a_place_that_one_direction_holds_is_one_bridge(length: float, span: float, turn: float) -> None:
    hanging, banks = gap(length, span, turn)
    (piece,) = find_bridges(hanging, index_edges(offset(banks, 0.25 * WIDTH)), WIDTH)
    assert piece.hanging.area() == pytest.approx(hanging.area())


def mean_sag(shape: shapely.Geometry, angle: float) -> float:
    """Mean fourth power of the lengths of lines across a shape, like a beam's sag, weighted by length."""
    turned = rotate(shape, -angle, origin=(0, 0))
    low, high = turned.bounds[1], turned.bounds[3]
    spans = [shapely.LineString([(-99, y), (99, y)]).intersection(turned).length for y in np.arange(low + WIDTH / 2, high, WIDTH)]
    return float(sum(s**4 for s in spans) / sum(spans))


def test_a_ledge_is_printed_outwards_from_its_only_bank() -> None:
    hanging = Polygons.square((10, 3))
    over = bridge_over(hanging, Polygons.square((10, 3)).translate((0, 3)))
    assert apart_deg(over.angle_deg, 90) < 0.1
    assert over.loose == 1.0
    assert not over.carries(100)


def test_a_region_without_anchors_is_not_a_bridge() -> None:
    banks = index_edges(Polygons.square((5, 5)).translate((20, 0)))
    assert find_bridge(Polygons.square((5, 5)), banks, WIDTH) is None


def portal(span: float) -> Mesh:
    """Two posts and a plate across them."""
    posts = m3.Manifold.cube((6, 10, 8)) + m3.Manifold.cube((6, 10, 8)).translate((6 + span, 0, 0))
    return standing(posts + m3.Manifold.cube((12 + span, 10, 2)).translate((0, 0, 8)))


def test_bridges_have_their_own_speed_and_flow_and_end_on_their_anchors() -> None:
    sliced = slice_part(whole(portal(5)), profile(*SOLID, "process.bridge_speed_mm_s=27", "process.bridge_flow=0.9"))
    beads = of_kind(sliced, Kind.BRIDGE)
    layer = next(layer for layer in sliced.layers if layer.is_of(Kind.BRIDGE).any())
    assert layer.z_mm == pytest.approx(8.2)
    assert {p.speed_mm_s for p in beads} == {27.0}
    ends = np.concatenate([p.points for p in beads])
    assert np.abs(ends[:, 0]).min() > 2.5
    assert np.abs(ends[:, 0]).max() < 2.5 + 4 * WIDTH
    plain = of_kind(slice_part(whole(portal(5)), profile(*SOLID)), Kind.BRIDGE)
    assert beads[0].flow == pytest.approx(0.9 * plain[0].flow)


@pytest.mark.parametrize("angle_deg", [60.0, 180.0])
def test_bridges_run_in_the_direction_that_is_set(angle_deg: float) -> None:
    """At 180 degrees, along the banks of a gap, no bridge is held; without a set angle, portals are bridged along x."""
    hanging, banks = gap(20, 5, 0)
    span = find_bridge(hanging, index_edges(offset(banks, 0.25 * WIDTH)), WIDTH, angle_deg)
    assert (span is None) == (angle_deg == 180.0)
    beads = of_kind(slice_part(whole(portal(5)), profile(*SOLID, f"process.bridge_angle_deg={angle_deg}")), Kind.BRIDGE)
    steps = np.diff(max(beads, key=lambda p: p.length_mm).points, axis=0)
    longest = steps[np.argmax(np.hypot(*steps.T))]
    assert apart_deg(float(np.degrees(np.arctan2(longest[1], longest[0]))), angle_deg) < 0.1


def test_thick_bridges_are_round_threads_of_the_nozzle_s_diameter_as_far_apart() -> None:
    """A thread of 0.4 mm has pi / 4 * 0.4^2 = 0.1257 mm2. Between three walls on each side 7.5 mm are left, 17 times 0.45 mm."""
    sliced = slice_part(whole(portal(5)), profile(*SOLID, "process.thick_bridges=true"))
    layer = next(layer for layer in sliced.layers if layer.is_of(Kind.BRIDGE).any())
    rows = layer.is_of(Kind.BRIDGE)
    volume, length = layer.volumes_mm3[rows].sum(), sum(path.length_mm for path in of_kind(sliced, Kind.BRIDGE))
    assert volume / length == pytest.approx(0.12566, rel=1e-3)
    steps = np.concatenate([np.diff(path.points, axis=0) for path in of_kind(sliced, Kind.BRIDGE)])
    assert int((np.hypot(*steps.T) > 4.0).sum()) == 17


def test_a_deck_between_posts_that_widen_into_it_is_a_bridge() -> None:
    gate = [(0, 0), (6, 0), (6, 9.75), (6.29, 10.05), (12.11, 10.05), (12.4, 9.75), (12.4, 0), (18.4, 0), (18.4, 12), (0, 12)]
    solid = m3.Manifold.extrude(m3.CrossSection([gate]), 10).rotate((90, 0, 0))
    layer = slice_part(whole(standing(solid)), profile(*SOLID)).layers[50]
    lines = shapely.union_all([shapely.LineString(p.points).buffer(0.25) for p in layer.paths if p.kind is Kind.BRIDGE])
    assert lines.area > 0.7 * 6.0 * 10.0


def test_a_plate_resting_on_plastic_is_no_bridge() -> None:
    base, plate = cut(portal(0.0001), ((0, 0, 1), 8.0))
    assert of_kind(slice_part(plate, profile(*SOLID), [base]), Kind.BRIDGE) == []


def test_a_part_that_spans_two_posts_of_an_earlier_one_is_a_bridge_from_its_first_layer() -> None:
    base, plate = cut(portal(5), ((0, 0, 1), 8.0))
    sliced = slice_part(plate, profile(), [base])
    assert Kind.BRIDGE in {p.kind for p in sliced.layers[0].paths}
    assert Kind.BRIDGE not in {p.kind for p in sliced.layers[1].paths}


def test_without_support_a_long_span_is_still_a_bridge() -> None:
    beads = of_kind(slice_part(whole(portal(25)), profile(*SOLID)), Kind.BRIDGE)
    steps = np.diff(max(beads, key=lambda p: p.length_mm).points, axis=0)
    assert np.abs(steps[:, 1])[np.abs(steps[:, 0]) > 1].max() < 1e-6


OWN = ("process.infill_bridge_speed_mm_s=33", "material.fan_infill_bridge=0.8", "process.infill_bridge_flow=1.1")


def bridged_layers(*settings: str) -> dict[int, list[Path]]:
    """The layers of a box that have bridges, by number, with those bridges."""
    sliced = slice_part(whole(box(24, 24, 4)), profile("process.least_layer_time_s=0", *settings))
    bridges = {k: [p for p in layer.paths if p.kind is Kind.BRIDGE] for k, layer in enumerate(sliced.layers)}
    return {k: paths for k, paths in bridges.items() if paths}


def test_the_first_skin_over_sparse_infill_is_a_bridge_with_its_own_speed_fan_and_flow() -> None:
    ((layer, paths),) = bridged_layers(*OWN).items()
    assert layer == 20 - 4
    assert {(path.speed_mm_s, path.fan) for path in paths} == {(33.0, 0.8)}
    assert max(path.flow for path in paths) == pytest.approx(1.1, abs=0.05)
    assert 1.0 < sum(path.length_mm for path in paths) * 0.407 / (24 - 2 * 1.24) ** 2 < 1.06  # joints between lines add length


def test_bridges_over_sparse_lines_run_across_them() -> None:
    layers = bridged_layers("process.infill_pattern=rectilinear", "process.infill_angle_deg=20")
    ((layer, paths),) = layers.items()
    steps = np.diff(max(paths, key=lambda path: path.length_mm).points[:2], axis=0)[0]
    below_deg = 20 + 90 * ((layer - 1) % 2)
    assert abs(steps @ [np.cos(np.radians(below_deg)), np.sin(np.radians(below_deg))]) < 0.05 * np.hypot(*steps)


@pytest.mark.parametrize("density", [0.0, 0.6, 1.0])
def test_skin_over_dense_infill_is_no_bridge(density: float) -> None:
    assert (density > 0) == (not bridged_layers(f"process.infill_density={density}"))
