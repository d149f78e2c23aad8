"""Lightning infill holds the solid layers above it, leans no farther than plastic may, and uses no more than necessary."""

from collections.abc import Sequence

import manifold3d as m3
import numpy as np
import pytest
import shapely
from hypothesis import given, settings
from hypothesis import strategies as st

from mdp.mesh import Floats
from slicer.fill.lightning import LEAN_DEG, _grow, _prune, lightning_lines
from slicer.geometry.edge_index import index_edges
from slicer.geometry.polygons import Polygons
from slicer.paths import Kind
from slicer.slice import slice_part
from tests.shapes import box, standing
from tests.slicer.hand import BARE, as_shapely, profile, whole

CELL, HEIGHT, LAYERS = 4.0, 0.2, 100
LEAN = HEIGHT * np.tan(np.radians(LEAN_DEG))
LIGHTNING = (*BARE, "process.infill_pattern=lightning")


def square(side: float) -> Polygons:
    return Polygons.square((side, side), True)


def planned(insides: Sequence[Polygons], roof: Polygons) -> list[list[Floats]]:
    """The lines under a roof over the last of some layers."""
    solid = [Polygons()] * (len(insides) - 1) + [roof]
    return lightning_lines([*insides[:-1], Polygons()], solid, CELL, np.full(len(insides), HEIGHT))


SHAPES = {
    "a box": [square(40.0)] * LAYERS,
    "a box round a chimney": [square(40.0) - square(12.0)] * LAYERS,
    "a funnel": [square(20.0 + 0.3 * k) for k in range(LAYERS)],
    "a pyramid": [square(50.0 - 0.2 * k) for k in range(LAYERS)],
    "two towers": [square(16.0).translate((-10.0, 0.0)) + square(16.0).translate((10.0, 0.0))] * LAYERS,
    "a box on a narrower one": [square(20.0)] * (LAYERS // 2) + [square(40.0)] * (LAYERS // 2),
}


@pytest.fixture(scope="module", params=SHAPES, ids=str)
def shape(request: pytest.FixtureRequest) -> tuple[list[Polygons], list[list[Floats]]]:
    insides = SHAPES[request.param]
    return insides, planned(insides, insides[-2])


def test_no_place_under_a_roof_is_farther_than_a_cell_from_a_branch_or_a_wall(
    shape: tuple[list[Polygons], list[list[Floats]]],
) -> None:
    insides, lines = shape
    area = as_shapely(insides[-2])
    held = shapely.union_all([area.boundary, *(shapely.linestrings(line) for line in lines[-2])])
    x0, y0, x1, y1 = area.bounds
    places = shapely.points(*np.meshgrid(np.arange(x0, x1, 0.3), np.arange(y0, y1, 0.3))).ravel()
    assert shapely.distance(places[shapely.within(places, area)], held).max() < CELL


def test_no_branch_leans_farther_from_the_layer_below_than_plastic_may(shape: tuple[list[Polygons], list[list[Floats]]]) -> None:
    insides, lines = shape
    for k in range(1, LAYERS - 1):
        inside = as_shapely(insides[k - 1])
        below = shapely.union_all([inside.boundary, *(shapely.linestrings(line) for line in lines[k - 1])])
        upper = [shapely.linestrings(line).intersection(inside) for line in lines[k]]
        points = shapely.points(shapely.get_coordinates([shapely.segmentize(line, 0.2) for line in upper]))
        assert len(points) == 0 or shapely.distance(points, below).max() < 2.0 * LEAN + 0.01, k


def test_every_branch_is_inside(shape: tuple[list[Polygons], list[list[Floats]]]) -> None:
    for inside, lines in zip(*shape, strict=True):
        room = as_shapely(inside).buffer(1e-3)
        assert all(room.covers(shapely.linestrings(line)) for line in lines)


def test_deep_below_a_roof_there_is_no_infill() -> None:
    lines = planned([square(20.0)] * 200, square(20.0))
    deepest = int(np.ceil(10.0 * np.sqrt(2.0) / LEAN))  # no branch is longer than half a diagonal
    assert [len(lines[k]) for k in range(198 - deepest)] == [0] * (198 - deepest)
    assert len(lines[198]) > 0


def test_without_a_solid_layer_above_nothing_is_planned() -> None:
    assert lightning_lines([square(20.0)] * 5, [Polygons()] * 5, CELL, np.full(5, HEIGHT)) == [[]] * 5


def test_a_box_takes_less_than_half_of_the_infill_of_a_grid_and_as_much_of_all_else() -> None:
    grid, lightning = (
        slice_part(whole(box(30.0, 30.0, 20.0)), profile(*BARE, f"process.infill_pattern={pattern}"))
        for pattern in ("grid", "lightning")
    )
    lengths = [
        {kind: sum(path.length_mm for layer in part.layers for path in layer.paths if path.kind is kind) for kind in Kind}
        for part in (grid, lightning)
    ]
    assert 0.0 < lengths[1][Kind.INFILL] < 0.5 * lengths[0][Kind.INFILL]
    assert lengths[1][Kind.OUTER_WALL] == pytest.approx(lengths[0][Kind.OUTER_WALL])
    assert lengths[1][Kind.TOP_SKIN] == pytest.approx(lengths[0][Kind.TOP_SKIN])


def test_the_floor_of_a_pocket_is_held_as_a_roof_is() -> None:
    pocketed = standing(m3.Manifold.cube((30, 30, 20)) - m3.Manifold.cube((10, 10, 10)).translate((10, 10, 12)))
    part = slice_part(whole(pocketed), profile(*LIGHTNING))
    held = [
        k
        for k, layer in enumerate(part.layers)
        for path in layer.paths
        if path.kind is Kind.INFILL and np.abs(path.points[:, :2]).max() < 6.0
    ]
    assert held
    assert max(held) < 60  # the floor is at 12 mm


@pytest.mark.parametrize("branches", [(0.1, 0.5), (0.5, 0.1)])
def test_a_trunk_loses_no_more_than_its_longest_branch_has_left(branches: tuple[float, float]) -> None:
    nodes = np.array([[0.0, 0.0], [1.0, 0.0], [1.0, branches[0]], [1.0, -branches[1]]])
    left, _ = _prune(nodes, np.array([-1, 0, 1, 1]), 0.6)
    assert left == pytest.approx(np.array([[0.0, 0.0], [0.9, 0.0]]))


@settings(max_examples=20, deadline=None)
@given(st.integers(0, 999))
def test_branches_grow_from_the_nearest_node_or_wall_as_a_scan_of_all_nodes_finds_them(seed: int) -> None:
    rng, near, step = np.random.default_rng(seed), 1.5, 0.7
    border = index_edges(Polygons.square((40.0, 25.0)))
    nodes, wanting = rng.uniform((0, 0), (40, 25), (8, 2)), rng.integers((1, 1), (39, 24), (40, 2)).astype(np.float64)
    grown, parent = _grow(nodes, np.full(8, -1), wanting, border, (near, step))
    at = 8
    for x, y in wanting:
        far = np.hypot(*(grown[:at] - (x, y)).T)
        wall = min(x, 40 - x, y, 25 - y)
        if far.min() <= near:
            continue
        since = int(np.argmin(far)) if far.min() < wall else at
        assert parent[at] == (since if since < at else -1)
        at = int(np.flatnonzero((grown == (x, y)).all(axis=1) & (np.arange(len(grown)) >= at))[0]) + 1
    assert at == len(grown)
