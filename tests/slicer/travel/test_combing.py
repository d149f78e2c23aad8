"""Travels through the inside of a section, judged by shapely."""

import numpy as np
import pytest
import shapely
from hypothesis import given, settings
from hypothesis import strategies as st

from slicer.bead import Bead
from slicer.geometry.polygons import Polygons, contours, offset
from slicer.paths import Kind
from slicer.travel.combing import BEHIND, SAFE, Combing
from slicer.travel.order import order_beads
from tests.slicer.hand import as_shapely, profile, ragged

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


def test_a_travel_round_a_corner_goes_behind_the_outer_wall_instead_of_retracting() -> None:
    ell = Polygons.square((20, 20)) - Polygons.square((15, 15)).translate((5, 5))
    beads = [Bead(Kind.INFILL, np.array(line, dtype=float), WIDTH, 3) for line in ([[2, 12], [2, 18]], [[12, 2], [18, 2]])]
    combed = order_beads(beads, ell, profile().process, np.array([2.0, 11.0]))
    straight = order_beads(beads, ell, profile("process.combing=false").process, np.array([2.0, 11.0]))
    assert [p.retract for p in combed] == [False, False]
    assert [p.retract for p in straight] == [False, True]
    assert len(combed[1].approach) >= 1


def test_a_layer_with_five_thousand_holes_is_put_in_order() -> None:
    places = [(x, y) for x in range(72) for y in range(70)]
    holes = Polygons.compose([Polygons.circle(0.9, 12).translate((3.0 * x, 3.0 * y)) for x, y in places])
    section = Polygons.square((216, 210)).translate((-1.5, -1.5)) - holes
    loops = [np.vstack([loop, loop[:1]]) for loop in contours(offset(section, -0.225))]
    beads = [Bead(Kind.OUTER_WALL, loop, WIDTH, 0) for loop in loops]
    placed = order_beads(beads, section, profile().process, None)
    assert len(placed) == len(beads) == 5041
    assert sum(p.retract for p in placed) == 1
