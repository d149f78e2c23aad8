"""Branches alone: where shrinking, joining and meeting move them, checked by shapely and over all pairs."""

import numpy as np
import pytest
import shapely
from hypothesis import given, settings
from hypothesis import strategies as st

from slicer.geometry.polygons import Polygons, islands, union
from slicer.support.reachable import ReachableAreas
from slicer.support.tree import (
    CELL_MM,
    MEETING,
    add_contact,
    branch_of,
    lower_branches,
    trunk,
    trunk_radius_mm,
)
from tests.shapes import box
from tests.slicer.hand import as_shapely, ragged, sections_at

seeds = st.integers(0, 10**6)


def in_the_open(lean_mm: float) -> ReachableAreas:
    """Two layers of 0.2 mm without obstacles for branches."""
    wide, cuts_mm = Polygons.square((200.0, 200.0), True), np.array([0.1, 0.3])
    sections = sections_at(box(1, 1, 1), cuts_mm)
    return ReachableAreas(sections, np.full(2, lean_mm), (Polygons(), Polygons()), (wide, wide))


@settings(max_examples=25)
@given(seeds, st.floats(0.05, 0.95))
def test_a_branch_that_shrinks_moves_no_place_further_than_its_radius_becomes_less(seed: int, share: float) -> None:
    whole = branch_of(ragged(seed))
    middle = shapely.Point(whole.x, whole.y)
    assert middle.hausdorff_distance(as_shapely(whole.area)) == pytest.approx(whole.radius)
    low = whole.shrink(share * whole.radius)
    lean_mm = whole.radius - low.radius
    assert as_shapely(low.area).buffer(lean_mm + 0.01, quad_segs=64).covers(as_shapely(whole.area).buffer(-1e-3))
    assert low.area.area() == pytest.approx(share**2 * whole.area.area())
    assert middle.hausdorff_distance(as_shapely(low.area)) == pytest.approx(low.radius)


@given(st.floats(0.1, 5.0))
def test_a_trunk_has_every_place_within_its_radius_and_reaches_little_further(radius: float) -> None:
    branch = trunk(3.0, -2.0, radius)
    area = as_shapely(branch.area)
    assert area.buffer(1e-9).covers(shapely.Point(3.0, -2.0).buffer(radius - 1e-9))
    assert shapely.Point(3.0, -2.0).hausdorff_distance(area) == pytest.approx(branch.reach_mm)
    assert radius < branch.reach_mm < 1.04 * radius


@settings(max_examples=40)
@given(seeds, st.integers(0, 12))
def test_coincident_trunks_become_one(seed: int, count: int) -> None:
    areas = in_the_open(1e-9)
    thick_mm = trunk_radius_mm(areas.process, areas.radius_mm)
    rows = np.random.default_rng(seed).uniform((-2, -2), (2, 2), (count, 2)).tolist()
    left = lower_branches([trunk(x, y, thick_mm) for x, y in [*rows, *rows[: count // 3]]], areas, 1)
    assert sorted((round(b.x, 6), round(b.y, 6)) for b in left) == sorted((round(x, 6), round(y, 6)) for x, y in rows)


@settings(max_examples=40)
@given(seeds, st.integers(0, 9), st.floats(0.0, 20.0))
def test_trunks_move_half_way_to_the_nearest_one_that_they_can_reach(seed: int, count: int, reach: float) -> None:
    at = np.random.default_rng(seed).uniform(-15.0, 15.0, (count, 2))
    expected = []
    for k, own in enumerate(at):
        others = sorted((float(np.hypot(*(own - neighbour))), j) for j, neighbour in enumerate(at) if j != k)
        meets = others and others[0][0] <= 2.0 * MEETING * reach
        expected.append(tuple(0.5 * (own + at[others[0][1]])) if meets else tuple(own))
    areas = in_the_open(reach)
    thick_mm = trunk_radius_mm(areas.process, areas.radius_mm)
    lower = lower_branches([trunk(x, y, thick_mm) for x, y in at.tolist()], areas, 1)
    places = {tuple(np.round(place, 6)) for place in expected}  # two that have met become one
    assert {(round(b.x, 6), round(b.y, 6)) for b in lower} == places


@settings(max_examples=25)
@given(seeds)
def test_a_tree_takes_up_all_of_a_contact_that_is_reachable_in_a_branch_for_every_square(seed: int) -> None:
    contact, reachable = ragged(seed), Polygons.square((60.0, 60.0), True) - Polygons.square((9.0, 60.0)).translate((4.0, -30.0))
    grown = add_contact([], contact ^ reachable, reachable)
    wanted, area = as_shapely(contact ^ reachable), as_shapely(union([branch.area for branch in grown]))
    assert wanted.difference(area).area < 0.02 * wanted.area
    assert as_shapely(reachable).buffer(1e-6).covers(area)
    squares = {(int(np.floor(b.x / CELL_MM)), int(np.floor(b.y / CELL_MM))) for b in grown}
    assert len(squares) <= len(grown) <= len(islands(contact ^ reachable)) + 36


def test_empty_layers_change_no_tree_and_no_branches_give_no_tree() -> None:
    tree = [trunk(3.0, -2.0, 1.0)]
    assert add_contact(tree, Polygons(), Polygons.square((9.0, 9.0))) == tree
    assert lower_branches([], in_the_open(1.0), 1) == []
