"""Travels through the inside of a section, judged by shapely."""

import numpy as np
import pytest
import shapely
from hypothesis import given, settings
from hypothesis import strategies as st
from numba import njit

from slicer import lattice as cells
from slicer.bead import Bead
from slicer.combing import BEHIND, SAFE, Ground
from slicer.lattice import lattice
from slicer.order import ordered
from slicer.paths import Kind
from slicer.polygons import Polygons, contours, grown
from tests.slicer.hand import as_shapely, profile

WIDTH = 0.45
ROOM = 200


@njit
def within(sides, x, y):
    return cells.within(sides, x, y)


@njit
def free(sides, x0, y0, x1, y1):
    return cells.free(sides, x0, y0, x1, y1)


@njit
def nearest(sides, x, y, reach):
    return cells.nearest(sides, x, y, reach)


@njit
def crossings(sides, x0, y0, x1, y1):
    at, which = np.zeros(ROOM), np.zeros(ROOM, np.int64)
    return at[: cells.crossings(sides, x0, y0, x1, y1, at, which)]


def ragged(seed):
    """A star with holes and an island in one of them."""
    random = np.random.default_rng(seed)
    turn = np.sort(random.uniform(0, 2 * np.pi, 25))
    star = Polygons([np.column_stack([np.cos(turn), np.sin(turn)]) * random.uniform(8, 30, (25, 1))])
    for place in random.uniform(-15, 15, (6, 2)):
        star = star - Polygons.circle(random.uniform(1, 4), 12).translate(place)
    return star + Polygons.circle(0.8, 8)


def holed(seed):
    """The star, its lattice, and 40 random segments around it."""
    area = ragged(seed)
    return as_shapely(area), lattice(area), np.random.default_rng(seed).uniform(-25, 25, (40, 4))


@settings(deadline=None, max_examples=25)
@given(st.integers(0, 10**6))
def test_points_within_and_segments_that_cross_are_those_that_shapely_finds(seed):
    area, sides, segments = holed(seed)
    for x0, y0, x1, y1 in segments:
        line = shapely.LineString([(x0, y0), (x1, y1)])
        assert within(sides, x0, y0) == area.contains(shapely.Point(x0, y0))
        assert free(sides, x0, y0, x1, y1) != area.boundary.intersects(line)
        cuts = shapely.get_coordinates(area.boundary.intersection(line))
        at = np.sort(np.hypot(*(cuts - [x0, y0]).T)) / line.length
        assert crossings(sides, x0, y0, x1, y1) == pytest.approx(at, abs=1e-9)


@settings(deadline=None, max_examples=25)
@given(st.integers(0, 10**6))
def test_the_nearest_point_of_the_border_is_shapely_s(seed):
    area, sides, segments = holed(seed)
    for x, y in segments[:, :2]:
        px, py, side = nearest(sides, x, y, 100.0)
        assert side >= 0
        assert np.hypot(px - x, py - y) == pytest.approx(area.boundary.distance(shapely.Point(x, y)))


@settings(deadline=None, max_examples=60)
@given(st.integers(0, 10**6), st.floats(0, 40))
def test_a_way_never_leaves_the_section_and_is_no_longer_than_allowed(seed, detour):
    section = ragged(seed)
    safe, ground = as_shapely(grown(section, -SAFE * WIDTH)), Ground(section, WIDTH)
    walls = np.concatenate(contours(grown(section, -0.5 * WIDTH)))
    ends = np.random.default_rng(seed).choice(walls, (12, 2))
    for a, b in ends:
        way = ground.way(a, b, detour)
        if way is not None:
            line = shapely.LineString([a, *way, b])
            assert line.length <= np.hypot(*(b - a)) + detour + 1e-9
            assert safe.buffer(1e-6).covers(line)


def test_the_way_round_a_square_hole_is_the_shortest_there_is():
    section = Polygons.square((30, 30), True) - Polygons.square((10, 10), True)
    way = Ground(section, WIDTH).way(np.array([-8.0, 1.0]), np.array([8.0, 1.0]), 10.0)
    corner = 5 + BEHIND * WIDTH
    shortest = 2 * np.hypot(8 - corner, corner - 1) + 2 * corner
    assert shapely.LineString([(-8, 1), *way, (8, 1)]).length == pytest.approx(shortest, abs=1e-6)
    assert Ground(section, WIDTH).way(np.array([-8.0, 1.0]), np.array([8.0, 1.0]), 2.0) is None


def test_there_is_no_way_from_island_to_island():
    apart = Polygons.square((5, 5)) + Polygons.square((5, 5)).translate((6, 0))
    assert Ground(apart, WIDTH).way(np.array([1.0, 1.0]), np.array([8.0, 1.0]), 1000.0) is None


def test_a_travel_round_a_corner_goes_behind_the_outer_wall_instead_of_retracting():
    ell = Polygons.square((20, 20)) - Polygons.square((15, 15)).translate((5, 5))
    beads = [Bead(Kind.INFILL, np.array(line, dtype=float), WIDTH, 3) for line in ([[2, 12], [2, 18]], [[12, 2], [18, 2]])]
    combed = ordered(beads, ell, profile().process, np.array([2.0, 11.0]))
    straight = ordered(beads, ell, profile("process.combing=false").process, np.array([2.0, 11.0]))
    assert [p.retract for p in combed] == [False, False]
    assert [p.retract for p in straight] == [False, True]
    assert len(combed[1].approach) >= 1


def test_a_layer_with_five_thousand_holes_is_put_in_order():
    places = [(x, y) for x in range(72) for y in range(70)]
    holes = Polygons.compose([Polygons.circle(0.9, 12).translate((3.0 * x, 3.0 * y)) for x, y in places])
    section = Polygons.square((216, 210)).translate((-1.5, -1.5)) - holes
    loops = [np.vstack([loop, loop[:1]]) for loop in contours(grown(section, -0.225))]
    beads = [Bead(Kind.OUTER_WALL, loop, WIDTH, 0) for loop in loops]
    placed = ordered(beads, section, profile().process, None)
    assert len(placed) == len(beads) == 5041
    assert sum(p.retract for p in placed) == 1
