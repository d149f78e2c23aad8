"""Polygons: booleans and offsets checked by shapely, connected pieces, contours."""

from dataclasses import fields, is_dataclass
from importlib import import_module
from inspect import isfunction

import numpy as np
import pytest
import shapely
from hypothesis import example, given, settings
from hypothesis import strategies as st
from manifold3d import CrossSection, Manifold

from mdp.mesh import Floats
from slicer.geometry.polygons import (
    MITRE,
    Polygons,
    area_mm2,
    bounding_box,
    close_loop,
    closing,
    contours,
    edges,
    half_plane,
    islands,
    larger,
    offset,
    offset_round,
    opening,
    start_at,
    strips,
    union,
)
from slicer.geometry.triangulation import resample
from tests.slicer.hand import as_shapely, ragged
from tools.docs.draw_rooms import modules

seeds = st.integers(0, 10**6)
few = settings(deadline=None, max_examples=25)

# a section of a thin curved shell without its infill: the hole touches the outline in two corners, to 1e-8 mm
OUTLINE = [
    (-7.61836115, 68.88669977), (-10.77783701, 72.16484606), (-13.81933971, 70.4981398), (-16.24925241, 57.79847275),
    (-16.40994936, 55.98709728), (-16.2319522, 54.25942789), (-16.05534578, 53.72724398),
]  # fmt: skip
HOLE = [
    (-16.4050434, 56.04239728), (-16.2492524, 57.7984728), (-13.81933971, 70.49813979), (-11.72465853, 71.64599944),
    (-10.77783701, 72.16484606), (-8.1398312, 69.42775632), (-15.70857212, 55.82834867),
]  # fmt: skip
RING = Polygons([np.array(OUTLINE)]) - Polygons([np.array(HOLE)[::-1]])


def test_a_hole_that_touches_the_outline_stays_a_hole() -> None:
    pieces = islands(RING)
    assert [piece.area() for piece in pieces] == [pytest.approx(RING.area(), abs=1e-6)]


def test_every_piece_has_its_own_holes() -> None:
    square = Polygons.square((4.0, 4.0), True)
    frame = square - offset(square, -1.0)
    two = Polygons.compose([frame, frame.translate((10.0, 0.0)), Polygons.square((1.0, 1.0), True)])
    assert sorted(piece.area() for piece in islands(two)) == [pytest.approx(area) for area in (1.0, 12.0, 12.0)]


def disc(count: int, radius_mm: float, x_mm: float = 0.0, y_mm: float = 0.0) -> Polygons:
    turns = 2.0 * np.pi * np.arange(count) / count
    return Polygons([np.stack([x_mm + radius_mm * np.cos(turns), y_mm + radius_mm * np.sin(turns)], axis=1)])


@pytest.mark.parametrize("hole", [(60, 24.0, -8.0, -6.0), (30, 23.0, -8.0, -2.0)])
@pytest.mark.parametrize("distance_mm", [-0.1, 0.1])
def test_a_hole_that_touches_the_outline_at_its_farthest_point_is_not_taken_for_an_outline(
    hole: tuple[int, float, float, float], distance_mm: float
) -> None:
    whole = disc(33, 30.0)
    crescent = whole - offset(disc(*hole) ^ whole, 0.45)
    solid = whole - opening(crescent, 0.45)
    assert offset(solid, distance_mm).area() == pytest.approx(grown_mm2(solid, distance_mm), rel=0.01)
    assert offset_round(solid, distance_mm).area() == pytest.approx(grown_mm2(solid, distance_mm), rel=0.01)


def grown_mm2(polygons: Polygons, distance_mm: float) -> float:
    """Area of offset polygons, by shapely."""
    loops = [shapely.Polygon(loop) for loop in contours(polygons)]
    whole = loops[0].difference(shapely.union_all(loops[1:]))
    return float(whole.buffer(distance_mm).area)


def differs_mm2(polygons: Polygons, expected: shapely.Geometry) -> float:
    return float(as_shapely(polygons).symmetric_difference(expected).area)


@few
@given(seeds)
def test_the_union_of_several_is_shapely_s(seed: int) -> None:
    first, second, third = ragged(seed), ragged(seed + 1).translate((9.0, 4.0)), ragged(seed + 2).translate((-7.0, 8.0))
    theirs = [as_shapely(area) for area in (first, second, third)]
    assert differs_mm2(union([first, second, third]), shapely.union_all(theirs)) < 1e-4


@few
@given(seeds, st.floats(0.05, 2.0))
@example(seed=230, distance_mm=1.0)  # a cut-off corner is 1.2 % nearer than the distance
def test_an_offset_is_between_round_offsets_of_its_distance_and_of_the_mitre_limit(seed: int, distance_mm: float) -> None:
    star = ragged(seed)
    area = as_shapely(star)
    wide, narrow = as_shapely(offset(star, distance_mm)), as_shapely(offset(star, -distance_mm))
    assert wide.buffer(1e-4).covers(area.buffer(0.98 * distance_mm))
    assert area.buffer(1.01 * MITRE * distance_mm).covers(wide)
    assert area.buffer(-0.98 * distance_mm).buffer(1e-4).covers(narrow)
    assert narrow.buffer(1e-4).covers(area.buffer(-1.01 * MITRE * distance_mm))


@few
@given(seeds, st.floats(-1.5, 1.5).filter(lambda distance: abs(distance) > 0.05))
def test_a_round_offset_is_shapely_s(seed: int, distance_mm: float) -> None:
    star = ragged(seed)
    expected = as_shapely(star).buffer(distance_mm, quad_segs=8)
    assert differs_mm2(offset_round(star, distance_mm), expected) < 0.01 * abs(distance_mm) * as_shapely(star).length


@few
@given(seeds, st.floats(0.1, 1.5))
def test_opening_removes_and_closing_adds_only_narrow_regions(seed: int, radius_mm: float) -> None:
    star = ragged(seed)
    area, opened, closed = (as_shapely(polygons) for polygons in (star, opening(star, radius_mm), closing(star, radius_mm)))
    assert area.buffer(1e-4).covers(opened)
    assert opened.buffer(1e-4).covers(area.buffer(-1.01 * MITRE * radius_mm).buffer(radius_mm))
    assert (area - closed).area < 2.0 * radius_mm**2, "but for tips that are sharper than a mitre"
    assert area.buffer(1.01 * MITRE * radius_mm).buffer(-radius_mm).buffer(0.02).covers(closed)


@few
@given(seeds, st.floats(0.0, 6.3), st.floats(-40.0, 40.0))
def test_a_half_plane_is_the_region_on_one_side_of_a_line(seed: int, turn: float, c: float) -> None:
    star, (a, b) = ragged(seed), (np.cos(turn), np.sin(turn))
    side = shapely.affinity.rotate(shapely.box(-c, -200.0, 200.0, 200.0), turn, origin=(0.0, 0.0), use_radians=True)
    assert differs_mm2(half_plane(star, a, b, c), as_shapely(star) & side) < 1e-4


@pytest.mark.parametrize(("c", "area"), [(0.0, 4.0), (1e-12, 4.0), (-1e-12, 0.0)])
def test_a_half_plane_without_a_direction_holds_all_or_nothing(c: float, area: float) -> None:
    assert half_plane(Polygons.square((2.0, 2.0)), 0.0, 0.0, c).area() == area
    assert half_plane(Polygons(), 1.0, 0.0, 5.0).is_empty()


@few
@given(st.lists(st.tuples(st.floats(-20, 20), st.floats(-20, 20)), min_size=2, max_size=8, unique=True), st.floats(0.1, 2.0))
def test_strips_are_segments_with_square_ends(points: list[tuple[float, float]], reach_mm: float) -> None:
    line = np.array(points)
    segments = [shapely.LineString(line[k : k + 2]) for k in range(len(line) - 1)]
    expected = shapely.union_all([segment.buffer(reach_mm, cap_style="square") for segment in segments if segment.length > 1e-3])
    assert differs_mm2(strips([line], reach_mm), expected) < 1e-3


@few
@given(seeds, st.floats(0.2, 5.0))
def test_a_sampled_loop_keeps_its_corners_and_has_bounded_edges(seed: int, step_mm: float) -> None:
    for loop in contours(ragged(seed)):
        sampled, _, _ = resample(loop, np.array([0, len(loop)]), step_mm)
        assert np.hypot(*np.diff(close_loop(sampled), axis=0).T).max() <= step_mm + 1e-9
        assert {tuple(point) for point in loop.tolist()} <= {tuple(point) for point in sampled.tolist()}
        assert area_mm2(sampled) == pytest.approx(area_mm2(loop))


@few
@given(seeds)
def test_contours_edges_and_areas_agree_with_shapely(seed: int) -> None:
    star = ragged(seed)
    area, sides = as_shapely(star), edges(star)
    assert np.hypot(*(sides[:, 2:] - sides[:, :2]).T).sum() == pytest.approx(area.length)
    assert sum(area_mm2(loop) for loop in contours(star)) == pytest.approx(area.area)
    assert sorted(piece.area() for piece in islands(star)) == pytest.approx(sorted(p.area for p in shapely.get_parts(area)))
    assert bounding_box(star, 0.5).bounds() == pytest.approx(area.envelope.buffer(0.5, join_style="mitre").bounds)


def test_a_loop_is_the_same_from_any_of_its_points() -> None:
    loop: Floats = np.array([[0.0, 0.0], [3.0, 0.0], [3.0, 2.0]])
    assert start_at(loop, 2).tolist() == [[3.0, 2.0], [0.0, 0.0], [3.0, 0.0]]
    assert area_mm2(start_at(loop, 1)) == area_mm2(loop) == 3.0


def test_an_empty_polygon_has_no_pieces_contours_or_edges() -> None:
    assert (islands(Polygons()), contours(Polygons()), edges(Polygons()).shape) == ([], [], (0, 4))
    assert union([]).is_empty()


def test_no_module_keeps_polygons_that_manifold3d_would_report_as_leaked() -> None:
    names = [name for name in modules() if name.startswith(("mdp.", "slicer.", "machine.planning")) and "learning" not in name]
    held = [value for name in names for value in vars(import_module(name)).values()]
    held += [field.default for kind in held if is_dataclass(kind) for field in fields(kind)]
    held += [default for function in held if isfunction(function) for default in function.__defaults__ or ()]
    assert [value for value in held if isinstance(value, CrossSection | Manifold)] == []


def test_a_strip_is_as_wide_as_each_of_its_segments() -> None:
    line = np.array([[0.0, 0.0], [4.0, 0.0], [10.0, 0.0]])
    narrow, wide = shapely.box(-0.5, -0.5, 4.5, 0.5), shapely.box(3.0, -1.0, 11.0, 1.0)
    assert differs_mm2(strips([line], np.array([0.5, 1.0])), narrow | wide) < 1e-9


def test_a_degenerate_speck_vanishes_when_offset_inward() -> None:
    x = np.array([-8.572013482451439, -8.5720134973526, -8.652947783470154, -8.814816400408745])  # the result of a boolean
    y = np.array([-16.172413803637028, -16.172413803637028, -16.179024517536163, -16.192245960235596])
    assert offset(Polygons([np.column_stack([x, y])]), -0.136).is_empty()


def test_larger_keeps_the_pieces_of_at_least_that_area_with_their_holes() -> None:
    pieces = [
        Polygons.square((2.0, 2.0)) - Polygons.square((1.0, 1.0)).translate((0.5, 0.5)),
        Polygons.square((1.0, 1.0)).translate((5.0, 0.0)),
    ]
    assert larger(Polygons.compose(pieces), 2.0).area() == 3.0
    assert larger(Polygons.compose(pieces), 1.0).area() == 4.0
    assert larger(Polygons.compose(pieces), 3.5).is_empty()
