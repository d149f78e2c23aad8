"""Islands: the piece of a section in which a bead begins, by shapely, and travels that retract because they leave it."""

import numpy as np
import pytest
import shapely
from hypothesis import given, settings
from hypothesis import strategies as st

from slicer.bead import OUTSIDE, Bead, outer_wall_width_mm
from slicer.geometry.polygons import Polygons, offset
from slicer.paths import Kind
from slicer.strokes.order import FIRST, islands_of, order_beads
from slicer.strokes.travels import SAFE, travels
from tests.slicer.hand import as_shapely, profile, ragged, rows_of

seeds = st.integers(0, 10**6)
STRAIGHT = profile("process.combing=false").process


def line(x: float, y: float, rank: int = 0, kind: Kind = Kind.INFILL) -> Bead:
    return Bead(kind, np.array([(x, y), (x + 0.1, y)]), 0.45, rank)


@settings(max_examples=30)
@given(seeds)
def test_beads_share_an_island_where_shapely_finds_their_starts_in_the_same_outline(seed: int) -> None:
    section = ragged(seed) + ragged(seed + 1).translate((70.0, 0.0))
    starts = np.random.default_rng(seed).uniform((-30, -30), (100, 30), (150, 2))
    outlines = [shapely.Polygon(piece.exterior) for piece in as_shapely(section).geoms]
    smallest = sorted(outlines, key=lambda outline: outline.area)
    around = [
        next((k for k, outline in enumerate(smallest) if outline.contains(shapely.Point(s))), len(smallest)) for s in starts
    ]
    islands = islands_of([line(*s) for s in starts], section, Polygons())
    assert islands.tolist() == around


def test_pieces_of_support_are_islands_and_a_skirt_is_not() -> None:
    section, support = Polygons.square((10.0, 10.0)), Polygons.square((4.0, 4.0)) + Polygons.square((4.0, 4.0)).translate((20, 0))
    support = support.translate((-30.0, 0.0))
    beads = [
        line(1, 1),
        line(-29, 1, OUTSIDE, Kind.SUPPORT),
        line(-9, 1, OUTSIDE, Kind.SUPPORT_INTERFACE),
        line(8, 8),
        line(-28, 2, OUTSIDE, Kind.SUPPORT),
        line(40, 0, OUTSIDE, Kind.SKIRT),
    ]
    first, second, third, fourth, fifth, skirt = islands_of(beads, section, support).tolist()
    assert (first, second, skirt) == (fourth, fifth, FIRST)
    assert len({first, second, third, skirt}) == 4
    assert islands_of([], section, support).tolist() == []


@settings(max_examples=40)
@given(seeds)
def test_a_travel_retracts_where_it_is_long_and_no_area_covers_it(seed: int) -> None:
    section, support = ragged(seed), ragged(seed + 7).translate((40.0, 0.0))
    since, to = np.random.default_rng(seed).uniform((-25, -20), (65, 20), (2, 80, 2))
    to[::2] = since[::2] + (to[::2] - since[::2]) * 0.05
    retracts, detours = travels(since, to, section, support, STRAIGHT)
    width = min(STRAIGHT.line_width_mm, outer_wall_width_mm(STRAIGHT))
    safe = [as_shapely(offset(section, -SAFE * width)), as_shapely(offset(support, -SAFE * STRAIGHT.line_width_mm))]
    for a, b, retract in zip(since, to, retracts, strict=True):
        way = shapely.LineString([a, b])
        covered = any(area.covers(way) for area in safe)
        assert retract == (way.length >= STRAIGHT.retract_travel_mm and not covered)
    assert detours == {}


@settings(max_examples=30)
@given(seeds, st.integers(1, 25))
def test_a_layer_prints_every_bead_once_island_by_island_and_by_rising_rank(seed: int, count: int) -> None:
    random = np.random.default_rng(seed)
    section = Polygons.square((10.0, 10.0)) + Polygons.square((10.0, 10.0)).translate((12.0, 0.0))
    starts = random.uniform(0.5, 8.5, (count, 2)) + random.choice([0.0, 12.0], (count, 1)) * (1.0, 0.0)
    beads = [
        Bead(Kind.INFILL, s + np.array([(0.0, 0.0), (0.5, 0.3)]), 0.45, int(random.choice([-3, -1, 0, 4, 120]))) for s in starts
    ]
    rank_of = {tuple(sorted(map(tuple, bead.points.tolist()))): bead.rank for bead in beads}
    placed = rows_of(order_beads(beads, section, STRAIGHT, np.array([5.0, 5.0])))
    printed = [tuple(sorted(map(tuple, row.points.tolist()))) for row in placed]
    assert sorted(printed) == sorted(rank_of)
    right = [bool(row.points[:, 0].mean() > 11.0) for row in placed]
    assert right in (sorted(right), sorted(right, reverse=True))
    for side in (False, True):
        ranks = [rank_of[ends] for ends, on in zip(printed, right, strict=True) if on == side]
        assert ranks == sorted(ranks)


@settings(max_examples=15)
@given(seeds, st.integers(2, 40))
def test_every_outer_wall_comes_right_after_the_inner_wall_nearest_to_it(seed: int, count: int) -> None:
    random = np.random.default_rng(seed)
    cells = random.choice(100, count, replace=False)
    middles = 9.0 * np.column_stack([cells % 10, cells // 10]) + random.uniform(0, 3, (count, 2))
    square = np.array([(-1, -1), (1, -1), (1, 1), (-1, 1), (-1, -1)], np.float64)
    walls = [
        Bead(kind, middle + size * square, 0.45, rank)
        for middle in middles
        for kind, size, rank in ((Kind.INNER_WALL, 1.5, -1), (Kind.OUTER_WALL, 2.0, 0))
    ]
    plate = Polygons.square((120.0, 120.0), True).translate((45.0, 45.0))
    placed = rows_of(order_beads([walls[k] for k in random.permutation(len(walls))], plate, STRAIGHT, np.zeros(2)))
    assert [row.kind for row in placed] == [Kind.INNER_WALL, Kind.OUTER_WALL] * count
    around = [row.points[:4].mean(axis=0) for row in placed]
    assert np.array(around[::2]) == pytest.approx(np.array(around[1::2]))


@pytest.mark.parametrize("first", [True, False])
def test_support_is_printed_first_where_a_part_begins_else_by_the_shorter_travel(first: bool) -> None:
    section, support = Polygons.square((10.0, 10.0)), Polygons.square((10.0, 10.0)).translate((30.0, 0.0))
    beads = [line(5, 5), line(35, 5, OUTSIDE, Kind.SUPPORT)]
    placed = order_beads(beads, section, STRAIGHT, None if first else np.array([4.0, 5.0]), support)
    assert [row.kind for row in rows_of(placed)] == ([Kind.SUPPORT, Kind.INFILL] if first else [Kind.INFILL, Kind.SUPPORT])


def test_a_travel_avoids_the_outer_wall_beside_an_interface_or_retracts() -> None:
    notched = Polygons.square((20.0, 20.0)) - Polygons([np.array([(9.0, 0.0), (11.0, 0.0), (10.0, 9.7)])])
    since, to, near = np.array([[2.0, 10.0]]), np.array([[18.0, 10.0]]), np.array([[1.0, 10.0]])
    skin = notched - offset(notched, -0.36)
    process = profile().process
    assert travels(since, to, notched, Polygons(), process) == (np.array([False]), {})
    retracts, detours = travels(since, to, notched, Polygons(), process, skin)
    way = shapely.LineString([since[0], *detours[0], to[0]])
    assert not retracts[0]
    assert not as_shapely(skin).intersects(way)
    assert travels(since, to, notched, Polygons(), STRAIGHT, skin)[0].tolist() == [True]
    assert travels(since, near, notched, Polygons(), process, skin) == (np.array([False]), {})


def test_a_short_travel_over_the_outer_wall_next_to_an_interface_retracts() -> None:
    gap = Polygons.square((8.0, 8.0)) + Polygons.square((8.0, 8.0)).translate((8.2, 0.0))
    skin = gap - offset(gap, -0.36)
    since, to = np.array([[7.5, 4.0]]), np.array([[8.7, 4.0]])
    assert travels(since, to, gap, Polygons(), STRAIGHT)[0].tolist() == [False]
    assert travels(since, to, gap, Polygons(), STRAIGHT, skin)[0].tolist() == [True]
