"""Infill has its density and stays in its area; its lines follow the pattern."""

from itertools import pairwise

import manifold3d as m3
import numpy as np
import pytest
import shapely
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from slicer.bead import Bead
from slicer.fill.infill import GYROID_LENGTH, gyroid, honeycomb, infill_beads, pattern_density, side_mm
from slicer.fill.lines import clip_pattern
from slicer.geometry.clip import rotation_2d
from slicer.geometry.edge_index import index_edges
from slicer.geometry.polygons import Polygons, offset
from slicer.geometry.polyline import length_mm
from tests.slicer.fill.areas import HEIGHT, OVERLAP, STARS, WIDTH, plastic_mm2, ring, square
from tests.slicer.hand import as_shapely, distances_mm, profile

PATTERNS = ("cubic", "grid", "gyroid", "honeycomb", "rectilinear", "triangles")
PATTERN_NAMES = ("concentric", *PATTERNS)


def filled(
    area: Polygons,
    pattern: str,
    density: float,
    layer: int = 0,
    anchor: float = 2.5,
    joint: float = 12.0,
    angle: float = 30.0,
) -> list[Bead]:
    keys = {"pattern": pattern, "density": density, "angle_deg": angle, "anchor_mm": anchor, "joint_mm": joint}
    process = profile(*(f"process.infill_{key}={value}" for key, value in keys.items())).process
    return infill_beads(area, process, density=density, layer=layer, z_mm=(layer + 1) * HEIGHT, height_mm=HEIGHT)


@pytest.mark.parametrize("pattern", PATTERN_NAMES)
@pytest.mark.parametrize("density", [0.1, 0.2, 0.5, 0.9])
def test_sparse_infill_of_a_block_meets_its_density_anchors_and_all(pattern: str, density: float) -> None:
    block, layers = Polygons.square((60, 60)), range(0, 150, 3)
    keys = profile(f"process.infill_pattern={pattern}", f"process.infill_density={density}").process
    drawn = pattern_density([block] * 150, keys, HEIGHT)
    plastic = [
        plastic_mm2(infill_beads(block, keys, density=drawn, layer=k, z_mm=(k + 1) * HEIGHT, height_mm=HEIGHT)) for k in layers
    ]
    assert np.mean(plastic) / block.area() == pytest.approx(density, rel=0.02)


def test_no_density_is_no_infill() -> None:
    assert filled(square(), "grid", 0.0) == []


@pytest.mark.parametrize("pattern", PATTERN_NAMES)
def test_infill_stays_inside_and_reaches_into_the_wall_by_the_overlap(pattern: str) -> None:
    points = np.concatenate([b.points for b in filled(ring(), pattern, 0.3, layer=1)])
    nearest = distances_mm(ring(), points).min()
    assert nearest > 0.5 * (WIDTH - HEIGHT * (1 - np.pi / 4)) - OVERLAP * WIDTH - 1e-3


@pytest.mark.parametrize("pattern", PATTERNS)
def test_infill_is_chained_into_few_long_paths(pattern: str) -> None:
    single = filled(square(), pattern, 0.2, anchor=0, joint=0)
    chained = filled(square(), pattern, 0.2)
    assert len(chained) <= 0.2 * len(single) + 2


@pytest.mark.parametrize("pattern", ["rectilinear", "grid", "triangles", "cubic", "honeycomb"])
def test_every_end_of_an_infill_line_runs_along_the_wall(pattern: str) -> None:
    border = as_shapely(offset(square(), -(0.5 * (WIDTH - HEIGHT * (1 - np.pi / 4)) - OVERLAP * WIDTH))).boundary
    for bead in filled(square(), pattern, 0.2, joint=0):
        for end in (bead.points[:2], bead.points[-2:]):
            assert shapely.distance(border, shapely.points(end)).max() < 1e-6


def test_rectilinear_lines_turn_by_a_right_angle_from_layer_to_layer() -> None:
    first, second = (filled(square(), "rectilinear", 0.2, layer=k, anchor=0, joint=0)[0].points for k in (0, 1))
    a, b = (p[1] - p[0] for p in (first, second))
    assert abs(a @ b) < 1e-6 * np.hypot(*a) * np.hypot(*b)


def test_grid_lines_are_on_each_other_in_all_layers() -> None:
    layers = [filled(square(), "grid", 0.2, layer=k) for k in (0, 1)]
    assert [b.points.tobytes() for b in layers[0]] == [b.points.tobytes() for b in layers[1]]


@pytest.mark.parametrize("height", [0.4, 3.0, 7.7, 12.1])
def test_gyroid_lines_are_on_the_minimal_surface(height: float) -> None:
    unit = GYROID_LENGTH * 0.4 / 0.2 / (2 * np.pi)
    turned_deg, draw = gyroid(height, 0.0, 0.4, 0.2)
    x, y = (draw((-20, -20, 20, 20))[0] @ rotation_2d(turned_deg).T / unit).T
    z = height / unit
    assert np.abs(np.sin(x) * np.cos(y) + np.sin(y) * np.cos(z) + np.sin(z) * np.cos(x)).max() < 1e-9


def test_cubic_lines_are_on_perpendicular_planes() -> None:
    normals = [
        np.array([np.sqrt(2 / 3) * np.cos(a), np.sqrt(2 / 3) * np.sin(a), -np.sqrt(1 / 3)]) for a in np.radians((120, 240, 0))
    ]
    assert np.array(normals) @ np.array(normals).T == pytest.approx(np.eye(3), abs=1e-12)
    apart = 3 * (WIDTH - HEIGHT * (1 - np.pi / 4)) / 0.2
    for layer in (0, 7, 40):
        for bead in filled(square(), "cubic", 0.2, layer, anchor=0, joint=0):
            middle = [*bead.points.mean(axis=0), (layer + 1) * HEIGHT]
            places = [n @ middle / (np.sqrt(2 / 3) * apart) for n in normals]
            assert min(abs(position % 1 - 0.5) for position in places) < 1e-6


def test_honeycomb_cells_are_regular_hexagons_of_the_density() -> None:
    points, starts = honeycomb(0, 0.0, 0.4, 0.1)[1]((0, 0, 40, 40))
    line = points[: starts[1]]
    steps = np.diff(line, axis=0)
    flat, slanted = steps[0::2], steps[1::2]
    assert np.abs(flat[:, 1]).max() < 1e-9
    assert np.degrees(np.arctan2(np.abs(slanted[:, 1]), slanted[:, 0])) == pytest.approx(60.0)
    period = float(line[4, 0] - line[0, 0])
    side, strip = period / 3, period / 3 * np.sqrt(3) / 2
    assert np.ptp(line[:, 1]) == pytest.approx(strip - 0.4)
    assert 0.4 * np.hypot(*steps[:4].T).sum() / (period * strip) == pytest.approx(0.1)
    assert side == pytest.approx(side_mm(0.4, 0.1))


@settings(max_examples=25, deadline=None)
@given(STARS, st.floats(0, 180), st.floats(0.5, 5.0))
def test_clipping_agrees_with_shapely(points: list[tuple[float, float]], angle: float, apart: float) -> None:
    hull = m3.CrossSection.hull_points(np.array(points))
    assume(hull.area() > 1.0)
    area = hull - Polygons.circle(4.0, 20).translate((3, 1)) - Polygons.square((30, 1.5)).rotate(33)
    turned_deg, draw = gyroid(1.7, angle, 0.4, 0.4 / apart)
    pieces = clip_pattern(index_edges(area), turned_deg, draw)
    clipped_mm = sum(length_mm(pieces.points[a:b]) for a, b in pairwise(pieces.starts))
    drawn, starts = draw((-60, -60, 60, 60))
    lines = shapely.MultiLineString([line @ rotation_2d(turned_deg).T for line in np.split(drawn, starts[1:])])
    assert clipped_mm == pytest.approx(as_shapely(area).intersection(lines).length, rel=1e-6, abs=1e-4)


@settings(max_examples=25, deadline=None)
@given(STARS, st.floats(0, 180), st.sampled_from(["grid", "triangles", "gyroid", "honeycomb"]))
def test_anchors_never_leave_the_area_nor_change_the_lines(points: list[tuple[float, float]], angle: float, pattern: str) -> None:
    hull = m3.CrossSection.hull_points(np.array(points))
    star = hull - Polygons.circle(5.0, 20).translate((4, 4)) - Polygons.square((30, 1.5)).rotate(33)
    plain = filled(star, pattern, 0.3, anchor=0, joint=0, angle=angle)
    beads = filled(star, pattern, 0.3, angle=angle)
    for bead in beads:
        assert as_shapely(star).buffer(1e-6).covers(shapely.LineString(bead.points))
    assert sum(b.length_mm for b in beads) >= sum(b.length_mm for b in plain) - 1e-6
