"""Order of beads, travels, seams, speeds."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from slicer.bead import OUTSIDE, Bead
from slicer.geometry.polygons import Polygons
from slicer.geometry.polyline import lengths_mm
from slicer.paths import KINDS, Kind
from slicer.slice import slice_part
from slicer.strokes.order import order_beads
from slicer.strokes.speed import timed
from slicer.strokes.strokes import strokes_of
from tests.shapes import box, tee
from tests.slicer.hand import profile, rows_of, whole

STANDARD = profile().process
STRAIGHT = profile("process.combing=false").process


def line(x0: float, y0: float, x1: float, y1: float, rank: int = 3, kind: Kind = Kind.INFILL) -> Bead:
    return Bead(kind, np.array([[x0, y0], [x1, y1]], dtype=float), 0.45, rank)


def test_lines_are_visited_from_the_nearest_end() -> None:
    beads = [line(0, 9, 9, 9), line(0, 0, 9, 0), line(0, 3, 9, 3)]
    placed = order_beads(beads, Polygons.square((10, 10)), STANDARD, np.array([0.0, 0.0]))
    assert placed.first_points.tolist() == [[0, 0], [9, 3], [0, 9]]


def test_an_island_is_finished_before_the_next_begins() -> None:
    section = Polygons.square((10, 10), True) + Polygons.square((10, 10), True).translate((20, 0))
    rank_of = {0.4: -1, 0.45: 0, 0.5: 2}  # by the width, so that a row shows its rank
    lines = [(line(x, y, x + 1, y, rank), width) for width, rank in rank_of.items() for x in (-3, 17) for y in (0, 2)]
    beads = [replace(bead, width_mm=width) for bead, width in lines]
    placed = order_beads(beads, section, STANDARD, np.array([0.0, 0.0]))
    assert (placed.first_points[:, 0] > 10).tolist() == [False] * 6 + [True] * 6
    assert [rank_of[width] for width in placed.width_mm.tolist()] == [-1, -1, 0, 0, 2, 2] * 2


def test_an_island_in_a_hole_is_a_separate_island() -> None:
    section = Polygons.square((30, 30), True) - Polygons.square((20, 20), True) + Polygons.square((6, 6), True)
    beads = [line(-1, 0, 1, 0, 0), line(-13, -13, -13, 13, 0), line(-1, 1, 1, 1, 2), line(-12, -13, -12, 13, 2)]
    placed = order_beads(beads, section, STANDARD, np.array([-13.0, -13.0]))
    assert (placed.first_points[:, 0] < -10).tolist() == [True, True, False, False]


def test_small_walls_of_an_island_are_printed_together_and_its_long_ones_too() -> None:
    """A row of alternating squares of 2 and 20 mm: only the small ones, 8 mm round, are printed at small_wall_speed_mm_s."""
    square = np.array([[0, 0], [1, 0], [1, 1], [0, 1], [0, 0]], dtype=float)
    beads = [Bead(Kind.OUTER_WALL, (2.0 if k % 2 else 20.0) * square + (1.0 * k, 0.0), 0.45, 0) for k in range(8)]
    placed = order_beads(beads, Polygons.square((99, 99), True), STANDARD, np.zeros(2))
    assert STANDARD.small_wall_speed_mm_s < STANDARD.outer_wall_speed_mm_s
    assert np.count_nonzero(np.diff(placed.small)) == 1


def test_a_first_layer_of_one_speed_is_printed_in_the_shortest_order() -> None:
    square = np.array([[0, 0], [1, 0], [1, 1], [0, 1], [0, 0]], dtype=float)
    beads = [Bead(Kind.OUTER_WALL, (2.0 if k % 2 else 20.0) * square + (1.0 * k, 0.0), 0.45, 0) for k in range(8)]
    section, one_speed = Polygons.square((99, 99), True), np.full(len(KINDS), 20.0)
    placed = order_beads(beads, section, STANDARD, np.zeros(2), kind_mm_s=one_speed)
    assert np.hypot(*(placed.first_points[1:] - placed.last_points[:-1]).T).sum() == pytest.approx(7.0)


def test_inner_walls_that_are_lines_are_printed_among_the_skin_after_all_other_walls() -> None:
    ring = np.array([[1, 1], [40, 1], [40, 20], [1, 20], [1, 1]], dtype=float)
    walls = [Bead(Kind.OUTER_WALL, ring, 0.45, 0), replace(line(2, 2, 3, 2, -1, Kind.INNER_WALL), line=True)]
    inner = [replace(line(x, 10, x + 5, 10, -1, Kind.INNER_WALL), line=True) for x in (10, 20)]
    skins = [line(x, 10, x + 3, 10, kind=Kind.SKIN) for x in (6, 16, 26)]
    placed = order_beads([*walls, *inner, *skins], Polygons.square((41, 21)), STANDARD, np.array([1.0, 1.0]))
    assert placed.first_points[:, 0].tolist() == [2, 1, 6, 10, 16, 20, 26]


@settings(max_examples=40)
@given(st.integers(0, 10**6), st.integers(1, 60))
def test_the_nearest_point_is_the_nearest_of_all(seed: int, count: int) -> None:
    """Inner walls of different ranks are printed in sequence, each before the outer wall nearest to its start."""
    random = np.random.default_rng(seed)
    points, places = random.uniform(0, 40, (count, 2)) ** (1, 0.5), random.uniform(-20, 60, (50, 2))
    outer = [line(x, y, x, y, 0, Kind.OUTER_WALL) for x, y in points]
    inner = [line(x, y, x + 1, y, -1 - k, Kind.INNER_WALL) for k, (x, y) in enumerate(places)]
    placed = order_beads([*outer, *inner], Polygons.square((200, 200), True), STRAIGHT, np.zeros(2))
    outer_rows, inner_rows = (np.flatnonzero(placed.is_of(kind)) for kind in (Kind.OUTER_WALL, Kind.INNER_WALL))
    next_outer = outer_rows[np.searchsorted(outer_rows, inner_rows)]
    begin, ahead = placed.first_points[inner_rows], placed.first_points[next_outer]
    apart = np.hypot(*(begin[:, None] - points).transpose(2, 0, 1))
    assert np.hypot(*(begin - ahead).T) == pytest.approx(apart.min(axis=1))
    assert sorted(begin.tolist()) == sorted(places.tolist())


def test_a_travel_inside_the_section_does_not_retract_and_one_across_a_hole_does() -> None:
    section = Polygons.square((20, 20)) - Polygons.square((4, 4)).translate((8, 8))
    beads = [line(1, 5, 5, 5), line(15, 5, 19, 5), line(15, 10, 19, 10, 4), line(1, 10, 5, 10, 5)]
    placed = order_beads(beads, section, STRAIGHT, np.array([0.9, 5.0]))
    assert placed.retract.tolist() == [False, False, True, False]
    assert placed.first_points[2].tolist() == [15, 10]  # from (5, 10), across the hole


def test_a_short_travel_never_retracts() -> None:
    apart = Polygons.square((2, 2)) + Polygons.square((2, 2)).translate((3, 0))
    placed = order_beads([line(0.5, 1, 1.7, 1), line(3.1, 1, 4, 1)], apart, STANDARD, np.array([0.5, 1.0]))
    assert placed.retract.tolist() == [False, False]


def test_a_part_begins_with_a_retracted_travel() -> None:
    assert slice_part(whole(box(5, 5, 1)), profile()).layers[0].paths[0].retract


def test_every_travel_without_retraction_is_short_or_inside_the_box() -> None:
    sliced = slice_part(whole(box(12, 12, 2)), profile("process.skirt_loops=0"))
    assert sum(path.retract for layer in sliced.layers for path in layer.paths) == 1


def test_inner_walls_come_from_the_inside_out_then_the_outer_wall_then_the_fill() -> None:
    kinds = [path.kind for path in slice_part(whole(box(20, 20, 4)), profile()).layers[10].paths]
    assert kinds[:3] == [Kind.INNER_WALL, Kind.INNER_WALL, Kind.OUTER_WALL]
    assert set(kinds[3:]) == {Kind.INFILL}


def test_seams_of_a_tower_are_aligned() -> None:
    sliced = slice_part(whole(tee()), profile("process.support=none"))
    below_its_shade = sliced.layers[1:120]  # above the first layer, which is smaller, and below the arms, which hide seams better
    seams = [p.points[0] for layer in below_its_shade for p in layer.paths if p.kind is Kind.OUTER_WALL]
    assert np.ptp(seams, axis=0) == pytest.approx([0, 0], abs=1e-6)


def test_a_small_layer_is_slowed_down_to_last_its_time() -> None:
    sliced = slice_part(whole(box(8, 8, 4)), profile("process.least_layer_time_s=6", "process.travel_speed_mm_s=2000"))
    layer = sliced.layers[10]
    assert sum(path.length_mm / path.speed_mm_s for path in layer.paths) == pytest.approx(6, rel=0.02)


def test_slowing_stops_at_the_least_speed() -> None:
    sliced = slice_part(whole(box(4, 4, 4)), profile("process.least_layer_time_s=500"))
    assert {path.speed_mm_s for path in sliced.layers[10].paths} == {10.0}


def test_beads_at_the_floor_leave_the_waiting_to_the_others() -> None:
    beads = [line(0, 0, 12, 0, kind=Kind.GAP), line(12, 0, 112, 0)]
    strokes = strokes_of(beads, np.zeros(2, np.bool_), {}, 0.0)
    speeds = np.array([12.0 if kind is Kind.GAP else 100.0 for kind in KINDS])
    limits = ("process.least_layer_time_s=6", "process.least_speed_mm_s=10", "material.volumetric_limit_mm3_s=50")
    _, slowed = timed(strokes, profile(*limits), 0.2, speeds, 1.0)
    assert slowed[0] == pytest.approx(10.0)
    assert (strokes.lengths_mm / slowed).sum() == pytest.approx(6.0, rel=1e-3)


def test_no_bead_asks_for_more_than_the_hot_end_melts() -> None:
    chosen = profile("process.infill_speed_mm_s=500", "material.volumetric_limit_mm3_s=5", "process.least_layer_time_s=0")
    sliced = slice_part(whole(box(20, 20, 4)), chosen)
    for layer in sliced.layers:
        areas = layer.volumes_mm3 / lengths_mm(layer.points, layer.starts)
        assert (areas * layer.speed_mm_s).max() <= 5.0 + 1e-9


def column(x: float) -> Bead:
    """A line of support 3 mm long."""
    return Bead(Kind.SUPPORT, np.array([[x, 1.0], [x, 4.0]]), 0.45, OUTSIDE)


def test_a_travel_over_one_piece_of_support_does_not_retract_and_one_through_the_air_to_the_next_piece_does() -> None:
    support = Polygons.square((10, 5)) + Polygons.square((5, 5)).translate((13, 0))
    placed = order_beads([column(1), column(9), column(14)], Polygons(), STANDARD, np.array([1.0, 0.9]), support)
    assert [(row.points[0, 0], row.retract) for row in rows_of(placed)] == [(1, False), (9, False), (14, True)]


def test_a_travel_round_a_hole_of_its_support_does_not_retract() -> None:
    support = Polygons.square((10, 10)) - Polygons.square((6, 3)).translate((2, 1))
    placed = order_beads([column(1), column(9)], Polygons(), STANDARD, np.array([1.0, 0.9]), support)
    assert [(row.retract, len(row.approach) > 0) for row in rows_of(placed)] == [(False, False), (False, True)]


def ring(x: float, y: float, kind: Kind = Kind.SUPPORT) -> Bead:
    """A square of 2 mm around a point, beginning at its lower left corner."""
    corners = np.array([[-1, -1], [1, -1], [1, 1], [-1, 1], [-1, -1]], dtype=float)
    return Bead(kind, corners + np.array([x, y]), 0.45, OUTSIDE if kind is Kind.SUPPORT else 0)


def test_an_outline_of_support_begins_where_the_tip_comes_from_and_a_wall_at_its_seam() -> None:
    support = Polygons.square((3, 3), True)
    for kind, start in ((Kind.SUPPORT, (1, 1)), (Kind.OUTER_WALL, (-1, -1))):
        placed = order_beads([ring(0, 0, kind)], support, STANDARD, np.array([5.0, 5.0]), support)
        assert tuple(placed.first_points[0]) == tuple(placed.last_points[0]) == start


def test_a_piece_of_support_is_finished_before_the_next_begins() -> None:
    support = Polygons.square((6, 6), True) + Polygons.square((6, 6), True).translate((7, 0))
    beads = [line(x, -1, x, 1, OUTSIDE, Kind.SUPPORT) for x in (-2, 2, 5, 9)] + [ring(0, 0), ring(7, 0)]
    placed = order_beads(beads, Polygons(), STANDARD, np.array([0.0, -4.0]), support)
    assert [bool(row.points[:, 0].mean() > 3.5) for row in rows_of(placed)] == [False] * 3 + [True] * 3


def test_a_layer_ends_near_the_support_with_which_the_next_one_begins() -> None:
    section, support = Polygons.square((20, 4), True), Polygons.square((3, 3), True).translate((12, 0))
    placed = order_beads([line(-9, 0, 9, 0), ring(12, 0)], section, STANDARD, np.array([12.0, 0.0]), support)
    assert tuple(placed.last_points[-1]) == (9, 0)


def test_every_phase_of_an_island_ends_near_the_next_one() -> None:
    beads = [line(0, 1, 9, 1, 1), line(0, 2, 9, 2, 1), line(12, 1, 20, 1, 2)]  # the line of rank 2 is right of the others
    placed = order_beads(beads, Polygons.square((30, 10)), STANDARD, np.array([4.5, 0.0]))
    assert placed.last_points[:2, 0].tolist() == [0, 9]
