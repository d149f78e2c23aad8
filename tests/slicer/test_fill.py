"""Skins are solid, infill meets its density, and both stay in their area."""

from itertools import pairwise

import manifold3d as m3
import numpy as np
import pytest
import shapely
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from slicer.bead import length_mm
from slicer.bundle import cut_to
from slicer.clip import border_of, turn
from slicer.gyroid import LENGTH, gyroid
from slicer.hatch import hatched
from slicer.honeycomb import honeycomb, side_mm
from slicer.infill import PATTERNS, infill, pattern_density
from slicer.paths import Kind, bead_area_mm2
from slicer.polygons import Polygons, grown
from slicer.skin import skin
from tests.slicer.hand import as_shapely, distances_mm, profile

WIDTH, HEIGHT, OVERLAP = 0.45, 0.2, 0.15
PATTERN_NAMES = sorted([*PATTERNS, "concentric"])


def square():
    return Polygons.square((40, 40))


def ring():
    return Polygons.circle(15, 64) - Polygons.circle(6, 48)


def strip():
    return Polygons.square((3, 30)).rotate(20)


def plastic_mm2(beads):
    return sum(length_mm(b.points) * bead_area_mm2(b.width_mm, HEIGHT) * b.flow for b in beads) / HEIGHT


@pytest.mark.parametrize("area", [square, ring, strip])
@pytest.mark.parametrize("angle", [45.0, 135.0, 20.0])
def test_a_skin_extrudes_its_area(area, angle):
    beads = skin(area(), Kind.SKIN, angle, WIDTH, HEIGHT, OVERLAP)
    assert plastic_mm2(beads) == pytest.approx(area().area(), rel=0.003)
    assert all(0.9 < bead.flow < 1.1 for bead in beads if bead.kind is Kind.SKIN)


def test_a_skin_covers_its_area_everywhere():
    lines = [shapely.LineString(b.points).buffer(b.width_mm / 2) for b in skin(ring(), Kind.SKIN, 45.0, WIDTH, HEIGHT, OVERLAP)]
    assert as_shapely(ring()).difference(shapely.union_all(lines)).area < 0.01 * ring().area()


def test_a_skin_of_a_square_is_one_zigzag():
    assert len(skin(square(), Kind.SKIN, 45.0, WIDTH, HEIGHT, OVERLAP)) == 1


def filled(area, pattern, density, layer=0, anchor=2.5, joint=12.0, angle=30.0):
    keys = {"pattern": pattern, "density": density, "angle_deg": angle, "anchor_mm": anchor, "joint_mm": joint}
    process = profile(*(f"process.infill_{key}={value}" for key, value in keys.items())).process
    return infill(area, process, density, layer, (layer + 1) * HEIGHT, HEIGHT)


@pytest.mark.parametrize("pattern", PATTERN_NAMES)
@pytest.mark.parametrize("density", [0.1, 0.2, 0.5, 0.9])
def test_sparse_infill_of_a_block_meets_its_density_anchors_and_all(pattern, density):
    block, layers = Polygons.square((60, 60)), range(0, 150, 3)
    keys = profile(f"process.infill_pattern={pattern}", f"process.infill_density={density}").process
    drawn = pattern_density([block] * 150, keys, HEIGHT)
    plastic = [plastic_mm2(infill(block, keys, drawn, k, (k + 1) * HEIGHT, HEIGHT)) for k in layers]
    assert np.mean(plastic) / block.area() == pytest.approx(density, rel=0.02)


def test_no_density_is_no_infill():
    assert filled(square(), "grid", 0.0) == []


@pytest.mark.parametrize("pattern", PATTERN_NAMES)
def test_infill_stays_inside_and_reaches_into_the_wall_by_the_overlap(pattern):
    points = np.concatenate([b.points for b in filled(ring(), pattern, 0.3, layer=1)])
    nearest = distances_mm(ring(), points).min()
    assert nearest > 0.5 * (WIDTH - HEIGHT * (1 - np.pi / 4)) - OVERLAP * WIDTH - 1e-3


@pytest.mark.parametrize("pattern", PATTERN_NAMES)
def test_infill_is_chained_into_few_long_paths(pattern):
    single = filled(square(), pattern, 0.2, anchor=0, joint=0)
    chained = filled(square(), pattern, 0.2)
    assert pattern == "concentric" or len(chained) <= 0.2 * len(single) + 2


@pytest.mark.parametrize("pattern", ["rectilinear", "grid", "triangles", "cubic", "honeycomb"])
def test_every_end_of_an_infill_line_runs_along_the_wall(pattern):
    border = as_shapely(grown(square(), -(0.5 * (WIDTH - HEIGHT * (1 - np.pi / 4)) - OVERLAP * WIDTH))).boundary
    for bead in filled(square(), pattern, 0.2, joint=0):
        for end in (bead.points[:2], bead.points[-2:]):
            assert shapely.distance(border, shapely.points(end)).max() < 1e-6


def test_rectilinear_lines_turn_by_a_right_angle_from_layer_to_layer():
    first, second = (filled(square(), "rectilinear", 0.2, layer=k, anchor=0, joint=0)[0].points for k in (0, 1))
    a, b = (p[1] - p[0] for p in (first, second))
    assert abs(a @ b) < 1e-6 * np.hypot(*a) * np.hypot(*b)


def test_grid_lines_lie_on_each_other_in_all_layers():
    layers = [filled(square(), "grid", 0.2, layer=k) for k in (0, 1)]
    assert [b.points.tobytes() for b in layers[0]] == [b.points.tobytes() for b in layers[1]]


@pytest.mark.parametrize("height", [0.4, 3.0, 7.7, 12.1])
def test_gyroid_lines_lie_on_the_minimal_surface(height):
    unit = LENGTH * 0.4 / 0.2 / (2 * np.pi)
    bundle = gyroid(0.0, height, 0.4, 0.2)
    x, y = (bundle.draw((-20, -20, 20, 20))[0] @ turn(bundle.angle_deg).T / unit).T
    z = height / unit
    assert np.abs(np.sin(x) * np.cos(y) + np.sin(y) * np.cos(z) + np.sin(z) * np.cos(x)).max() < 1e-9


def test_cubic_lines_lie_on_planes_at_right_angles():
    normals = [
        np.array([np.sqrt(2 / 3) * np.cos(a), np.sqrt(2 / 3) * np.sin(a), -np.sqrt(1 / 3)]) for a in np.radians((120, 240, 0))
    ]
    assert np.array(normals) @ np.array(normals).T == pytest.approx(np.eye(3), abs=1e-12)
    apart = 3 * (WIDTH - HEIGHT * (1 - np.pi / 4)) / 0.2
    for layer in (0, 7, 40):
        for bead in filled(square(), "cubic", 0.2, layer, anchor=0, joint=0):
            middle = [*bead.points.mean(axis=0), (layer + 1) * HEIGHT]
            places = [n @ middle / (np.sqrt(2 / 3) * apart) for n in normals]
            assert min(abs(place % 1 - 0.5) for place in places) < 1e-6


def test_honeycomb_cells_are_hexagons_of_their_side():
    points, starts = honeycomb(0.0, 0, 0.4, 0.1).draw((0, 0, 40, 40))
    slanted = np.diff(points[: starts[1]], axis=0)[1::2]
    assert np.degrees(np.arctan2(*np.abs(slanted).T)) == pytest.approx(30.0, abs=1e-6) or np.degrees(
        np.arctan2(*np.abs(slanted).T[::-1])
    ) == pytest.approx(60.0, abs=1e-6)
    assert np.ptp(points[: starts[1], 1]) == pytest.approx(np.sqrt(3) / 2 * side_mm(0.4, 0.1) - 0.4)


STARS = st.lists(st.tuples(st.floats(-20, 20), st.floats(-20, 20)), min_size=4, max_size=9)


@settings(max_examples=25, deadline=None)
@given(STARS, st.floats(0, 180), st.floats(0.5, 5.0))
def test_clipping_agrees_with_shapely(points, angle, apart):
    hull = m3.CrossSection.hull_points(np.array(points))
    assume(hull.area() > 1.0)
    area = hull - Polygons.circle(4.0, 20).translate((3, 1)) - Polygons.square((30, 1.5)).rotate(33)
    waves = gyroid(angle, 1.7, 0.4, 0.4 / apart)
    pieces = cut_to(border_of(area), waves)
    bounds = np.append(pieces.starts, len(pieces.points))
    found = sum(length_mm(pieces.points[a:b]) for a, b in pairwise(bounds))
    drawn, starts = waves.draw((-60, -60, 60, 60))
    lines = shapely.MultiLineString([line @ turn(waves.angle_deg).T for line in np.split(drawn, starts[1:])])
    assert found == pytest.approx(as_shapely(area).intersection(lines).length, rel=1e-6, abs=1e-4)


@settings(max_examples=25, deadline=None)
@given(STARS, st.floats(0, 180), st.sampled_from(["grid", "triangles", "gyroid", "honeycomb"]))
def test_anchors_never_leave_the_area_nor_change_the_lines(points, angle, pattern):
    hull = m3.CrossSection.hull_points(np.array(points))
    star = hull - Polygons.circle(5.0, 20).translate((4, 4)) - Polygons.square((30, 1.5)).rotate(33)
    plain = filled(star, pattern, 0.3, anchor=0, joint=0, angle=angle)
    beads = filled(star, pattern, 0.3, angle=angle)
    for bead in beads:
        assert as_shapely(star).buffer(1e-6).covers(shapely.LineString(bead.points))
    assert sum(b.length_mm for b in beads) >= sum(b.length_mm for b in plain) - 1e-6


@settings(max_examples=30, deadline=None)
@given(
    st.lists(st.tuples(st.floats(-20, 20), st.floats(-20, 20)), min_size=4, max_size=9),
    st.floats(0, 180),
    st.floats(0.4, 5.0),
)
def test_hatching_agrees_with_shapely(points, angle, spacing):
    hull = m3.CrossSection.hull_points(np.array(points))
    assume(hull.area() > 0.01)
    area = hull - Polygons.circle(4.0, 20).translate((3, 1)) if hull.area() > 1 else hull
    lines = hatched(area, area, angle, spacing, 0.0)
    solid = as_shapely(area)
    along = np.array([np.cos(np.radians(angle)), np.sin(np.radians(angle))])
    across = np.array([-along[1], along[0]])
    bundle = shapely.MultiLineString(
        [[(k + 0.5) * spacing * across - 90 * along, (k + 0.5) * spacing * across + 90 * along] for k in range(-80, 80)]
    )
    assert sum(length_mm(line) for line in lines) == pytest.approx(solid.intersection(bundle).length, rel=1e-6, abs=1e-4)


@settings(max_examples=30, deadline=None)
@given(st.lists(st.tuples(st.floats(-20, 20), st.floats(-20, 20)), min_size=4, max_size=9), st.floats(0, 180))
def test_joints_of_a_skin_never_leave_its_area(points, angle):
    hull = m3.CrossSection.hull_points(np.array(points))
    star = hull - Polygons.circle(5.0, 20).translate((4, 4)) - Polygons.square((30, 1.5)).rotate(33)
    for bead in skin(star, Kind.SKIN, angle, WIDTH, HEIGHT, OVERLAP):
        middles = np.array([(a + b) / 2 for a, b in pairwise(bead.points)])
        assert distances_mm(star, middles).min() > 0.0


def test_shrinking_an_empty_area_gives_nothing():
    assert skin(grown(Polygons.square((0.2, 0.2)), -0.2), Kind.SKIN, 0.0, WIDTH, HEIGHT, OVERLAP) == []
