"""Travels through the inside of a section, checked by shapely."""

import numpy as np
import pytest
import shapely
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from mdp.mesh import Floats
from slicer.bead import Bead
from slicer.geometry.polygons import Polygons, contours, offset
from slicer.paths import Kind
from slicer.strokes.order import order_beads
from slicer.strokes.travels import BEHIND, SAFE, Combing
from tests.slicer.hand import as_shapely, profile, ragged, rows_of

WIDTH = 0.45


@settings(deadline=None, max_examples=60)
@given(st.integers(0, 10**6), st.floats(0, 40))
def test_a_detour_never_leaves_the_section_and_is_no_longer_than_allowed(seed: int, most_mm: float) -> None:
    section = ragged(seed)
    safe, combing = as_shapely(offset(section, -SAFE * WIDTH)), Combing(section, WIDTH)
    walls = np.concatenate(contours(offset(section, -0.5 * WIDTH)))
    ends = np.random.default_rng(seed).choice(walls, (12, 2))
    for a, b in ends:
        detour = combing.detour(a, b, most_mm)
        if detour is not None:
            line = shapely.LineString([a, *detour, b])
            assert line.length <= np.hypot(*(b - a)) + most_mm + 1e-9
            assert safe.buffer(1e-6).covers(line)


@settings(max_examples=30)
@given(st.integers(0, 10**6))
def test_travels_leave_the_inside_where_shapely_does(seed: int) -> None:
    section = ragged(seed)
    safe = as_shapely(offset(section, -SAFE * WIDTH))
    since, to = np.random.default_rng(seed).uniform(-20, 20, (2, 100, 2))
    ways = shapely.linestrings(np.stack([since, to], axis=1))
    assert np.array_equal(Combing(section, WIDTH).leaves(since, to), ~shapely.covers(safe, ways))


def _ways_mm(a: Floats, b: Floats, obstacle: shapely.Geometry) -> list[float]:
    """Lengths of the shorter and the longer way past a convex obstacle between two points, along their common convex hull."""
    around = shapely.convex_hull(shapely.union(obstacle, shapely.MultiPoint([a, b]))).exterior
    half_round = abs(around.project(shapely.Point(a)) - around.project(shapely.Point(b)))
    return sorted([half_round, around.length - half_round])


@settings(max_examples=40)
@given(st.integers(0, 10**6), st.integers(6, 12))
def test_a_detour_around_a_convex_hole_is_the_shortest_path(seed: int, corners: int) -> None:
    random = np.random.default_rng(seed)
    hole = Polygons.circle(6.0, corners).rotate(random.uniform(0, 360))
    plate, turn, spread = Polygons.square((60.0, 60.0), True) - hole, random.uniform(0, 2 * np.pi), random.uniform(-0.7, 0.7)
    a = random.uniform(9, 20) * np.array([np.cos(turn), np.sin(turn)])
    b = -random.uniform(9, 20) * np.array([np.cos(turn + spread), np.sin(turn + spread)])
    near, behind = (as_shapely(offset(hole, times * WIDTH)) for times in (SAFE, BEHIND))
    assume(shapely.LineString([a, b]).crosses(near))
    (least, _), (most, longer) = _ways_mm(a, b, near), _ways_mm(a, b, behind)
    assume(longer > most + 1.0)  # the choice between nearly equal ways depends on their course along the border
    detour = Combing(plate, WIDTH).detour(a, b, 1000.0)
    assert detour is not None
    assert least - 1e-6 <= shapely.LineString([a, *detour, b]).length <= most + 1e-6


def test_a_detour_leads_past_several_holes_one_after_the_other() -> None:
    holes = [Polygons.square((4.0, 4.0), True).translate((x, 0.0)) for x in (-10.0, 0.0, 10.0)]
    plate = Polygons.square((50.0, 30.0), True) - Polygons.compose(holes)
    a, b = np.array([-18.0, 0.5]), np.array([18.0, 0.5])
    detour = Combing(plate, WIDTH).detour(a, b, 10.0)
    edge = 2.0 + BEHIND * WIDTH
    assert detour is not None
    taut = 2 * np.hypot(8.0 - edge, edge - 0.5) + 2 * (10.0 + edge)
    assert shapely.LineString([a, *detour, b]).length == pytest.approx(taut, abs=1e-6)


def test_the_detour_round_a_square_hole_is_the_shortest_there_is() -> None:
    section = Polygons.square((30, 30), True) - Polygons.square((10, 10), True)
    detour = Combing(section, WIDTH).detour(np.array([-8.0, 1.0]), np.array([8.0, 1.0]), 10.0)
    corner = 5 + BEHIND * WIDTH
    shortest = 2 * np.hypot(8 - corner, corner - 1) + 2 * corner
    assert shapely.LineString([(-8, 1), *detour, (8, 1)]).length == pytest.approx(shortest, abs=1e-6)
    assert Combing(section, WIDTH).detour(np.array([-8.0, 1.0]), np.array([8.0, 1.0]), 2.0) is None


def test_there_is_no_detour_from_island_to_island() -> None:
    apart = Polygons.square((5, 5)) + Polygons.square((5, 5)).translate((6, 0))
    assert Combing(apart, WIDTH).detour(np.array([1.0, 1.0]), np.array([8.0, 1.0]), 1000.0) is None


def test_a_travel_around_a_corner_stays_behind_the_outer_wall_instead_of_retracting() -> None:
    ell = Polygons.square((20, 20)) - Polygons.square((15, 15)).translate((5, 5))
    beads = [Bead(Kind.INFILL, np.array(line, dtype=float), WIDTH, 3) for line in ([[2, 12], [2, 18]], [[12, 2], [18, 2]])]
    combed = order_beads(beads, ell, profile().process, np.array([2.0, 11.0]))
    straight = order_beads(beads, ell, profile("process.combing=false").process, np.array([2.0, 11.0]))
    assert combed.retract.tolist() == [False, False]
    assert straight.retract.tolist() == [False, True]
    assert len(rows_of(combed)[1].approach) >= 1


def test_a_layer_with_five_thousand_holes_is_put_in_order() -> None:
    places = [(x, y) for x in range(72) for y in range(70)]
    holes = Polygons.compose([Polygons.circle(0.9, 12).translate((3.0 * x, 3.0 * y)) for x, y in places])
    section = Polygons.square((216, 210)).translate((-1.5, -1.5)) - holes
    loops = [np.vstack([loop, loop[:1]]) for loop in contours(offset(section, -0.225))]
    beads = [Bead(Kind.OUTER_WALL, loop, WIDTH, 0) for loop in loops]
    placed = order_beads(beads, section, profile().process, None)
    assert len(placed) == len(beads) == 5041
    assert placed.retract.sum() == 1
