"""Strokes of skin and infill end on the plastic below."""

from dataclasses import replace

import manifold3d as m3
import numpy as np
import pytest
import shapely
from hypothesis import given, settings
from hypothesis import strategies as st
from shapely.ops import substring

from slicer.bead import Bead
from slicer.fill.ends import cut_anchors, hold_ends, plastic_of
from slicer.geometry.polygons import Polygons
from slicer.paths import Kind
from slicer.slice import slice_part
from tests.shapes import standing
from tests.slicer.hand import profile, whole

WIDTH = 0.4
MODEL = Polygons.square((40.0, 40.0), True)
POINTS = st.tuples(st.floats(-8, 8), st.floats(-8, 8))


def bead(kind: Kind, *points: tuple[float, float], follows: bool = False) -> Bead:
    return Bead(kind, np.array(points, dtype=np.float64), WIDTH, 2, follows=follows)


def rail(x: float) -> Bead:
    return bead(Kind.INFILL, (x, -10.0), (x, 10.0))


def reach(skin: list[Bead]) -> tuple[float, float]:
    (only,) = skin
    return float(only.points[0, 0]), float(only.points[-1, 0])


@pytest.mark.parametrize(
    ("begin", "end", "held"),
    [
        (0.0, 3.0, (0.0, 3.0)),  # on both rails
        (0.1, 2.9, (0.1, 2.9)),  # part of the last width lies on them
        (0.4, 2.6, (0.0, 3.0)),  # continues to the nearby plastic
        (-2.0, 3.0, (-0.4, 3.0)),  # ends where there is plastic: at most half a line width and the rail farther
        (-2.0, 5.0, (-0.4, 3.4)),
    ],
)
def test_a_stroke_ends_on_the_plastic_that_is_nearest(begin: float, end: float, held: tuple[float, float]) -> None:
    skin = hold_ends([bead(Kind.SKIN, (begin, 0.0), (end, 0.0))], plastic_of([rail(0.0), rail(3.0)]), MODEL, MODEL, WIDTH)
    assert reach(skin) == pytest.approx(held, abs=0.5 * WIDTH)


def test_a_stroke_over_nothing_is_left_out_and_the_next_one_begins_again() -> None:
    chain = [bead(Kind.TOP_SKIN, (x, -1.0), (x, 1.0), follows=x > 5.0) for x in (5.0, 5.4, 12.0)]
    left = hold_ends([bead(Kind.SKIN, (0.0, 0.0), (0.0, 3.0)), *chain], plastic_of([rail(0.0), rail(12.0)]), MODEL, MODEL, WIDTH)
    assert [float(one.points[0, 0]) for one in left] == [0.0, 12.0]
    assert not left[1].follows


@pytest.mark.parametrize("kind", [Kind.INFILL, Kind.INNER_WALL, Kind.SUPPORT])
def test_only_skins_are_held(kind: Kind) -> None:
    beads = [bead(kind, (5.0, 0.0), (9.0, 0.0))]
    assert hold_ends(beads, plastic_of([rail(0.0)]), MODEL, MODEL, WIDTH) == beads


def test_a_bridge_that_ends_just_beyond_the_model_below_reaches_back_to_its_rim() -> None:
    below = Polygons.square((2.0, 20.0), True)  # from x -1 to 1
    rim = plastic_of([rail(-0.8), rail(0.8)])
    bridge = [bead(Kind.BRIDGE, (6.0, 5.0), (6.0, 0.0), (1.2, 0.0))]
    assert reach(hold_ends(bridge, rim, MODEL, below, WIDTH))[1] == pytest.approx(0.8, abs=0.5 * WIDTH)
    turned_away = bead(Kind.BRIDGE, (6.0, 5.0), (1.2, 0.0), (1.2, 0.2))
    assert hold_ends([turned_away], rim, MODEL, below, WIDTH)[0] is turned_away


def test_a_bridge_may_end_where_the_model_has_nothing_below() -> None:
    bridge = [bead(Kind.BRIDGE, (0.0, 0.0), (5.0, 0.0))]
    assert reach(hold_ends(bridge, plastic_of([rail(0.0)]), MODEL, Polygons.square((2.0, 20.0), True), WIDTH)) == (0.0, 5.0)


def test_a_stroke_is_not_extended_beyond_the_outline_of_its_layer() -> None:
    own = Polygons.square((6.0, 20.0), True)  # it ends at x 3, above the middle of the last rail
    below = plastic_of([rail(0.0), rail(2.0), rail(3.0)])
    skin = hold_ends([bead(Kind.SKIN, (0.0, 0.0), (2.6, 0.0))], below, own, MODEL, WIDTH)
    assert reach(skin) == pytest.approx((0.0, 2.0), abs=WIDTH)


@pytest.mark.parametrize(("rail_mm", "stays"), [(0.8, True), (0.4, False)])
def test_wide_beads_carry_what_begins_farther_from_their_middle(rail_mm: float, stays: bool) -> None:
    below = plastic_of([replace(rail(0.0), width_mm=rail_mm), rail(3.0)])
    begin, _ = reach(hold_ends([bead(Kind.SKIN, (0.25, 0.0), (3.0, 0.0))], below, MODEL, MODEL, WIDTH))
    assert (begin == 0.25) is stays


@settings(max_examples=100, deadline=None)
@given(st.lists(POINTS, min_size=2, max_size=6, unique=True), st.lists(st.floats(-8, 8), min_size=1, max_size=4))
def test_the_last_width_of_a_stroke_is_on_plastic(points: list[tuple[float, float]], rails: list[float]) -> None:
    below = [rail(x) for x in rails]
    plastic = shapely.union_all([shapely.LineString(one.points).buffer(0.5 * WIDTH, cap_style="flat") for one in below])
    for held in hold_ends([bead(Kind.SKIN, *points)], plastic_of(below), MODEL, MODEL, WIDTH):
        line = shapely.LineString(held.points)
        for tail in (substring(line, 0.0, WIDTH), substring(line, max(line.length - WIDTH, 0.0), line.length)):
            assert tail.intersects(plastic)


def anchored(*points: tuple[float, float]) -> Bead:
    return replace(bead(Kind.INFILL, *points), anchor_mm=2.5)


def cut(line: Bead, *layers: list[Bead]) -> Bead:
    (only,) = cut_anchors([line], [plastic_of(layer) for layer in layers])
    return only


@pytest.mark.parametrize("turned", [False, True])
@pytest.mark.parametrize(("tip", "stays"), [(0.3, True), (1.5, False), (2.0, False), (4.0, True)])
def test_the_anchor_of_a_line_of_infill_is_cut_back_to_what_carries_it(tip: float, stays: bool, turned: bool) -> None:
    points = (0.0, 8.0), (0.0, 0.0), (tip, 0.0)  # along a line below, and from its end along a wall
    ends = sorted(cut(anchored(*(points[::-1] if turned else points)), [rail(0.0)]).points[[0, -1], 0])
    assert ends == pytest.approx([0.0, tip if stays else 0.0], abs=1e-9 if stays else WIDTH)


def test_a_line_without_anchors_is_not_cut() -> None:
    line = bead(Kind.INFILL, (0.0, 8.0), (0.0, 0.0), (2.0, 0.0))
    assert cut(line, [rail(0.0)]) is line


def test_an_anchor_is_carried_by_any_of_the_layers_below() -> None:
    line, along = anchored((0.0, 8.0), (0.0, 0.0), (2.0, 0.0)), bead(Kind.INFILL, (-3.0, 0.0), (3.0, 0.0))
    assert cut(line, [rail(0.0)], [], [along]) is line
    assert cut(line, [rail(0.0)], []) is not line


def test_an_anchor_grows_from_layer_to_layer() -> None:
    line, layers, reached = anchored((0.0, 8.0), (0.0, 0.0), (2.0, 0.0)), [[rail(0.0)]], [0.0]
    while reached[-1] < 2.0:
        layers = [[cut(line, *layers)], *layers][:3]
        reached.append(layers[0][0].points[-1, 0])
    assert len(reached) > 4
    assert (np.diff(reached) < 1.5 * WIDTH).all()


@pytest.mark.parametrize("walls", [1, 2])
@pytest.mark.parametrize("density", [0.0, 0.02])
def test_a_roof_spans_an_empty_inside_with_any_number_of_walls(walls: int, density: float) -> None:
    box = standing(m3.Manifold.cube((30.0, 30.0, 4.0)))
    layers = slice_part(whole(box), profile(f"process.walls={walls}", f"process.infill_density={density}")).layers
    roof_mm3 = [layer.volumes_mm3.sum() for layer in layers[-4:]]
    assert roof_mm3 == pytest.approx([30.0 * 30.0 * 0.2] * 4, rel=0.03)


@pytest.mark.parametrize("pattern", ["gyroid", "cubic"])
def test_hardly_a_line_of_infill_ends_over_nothing(pattern: str) -> None:
    box = m3.Manifold.cube((28.0, 22.0, 12.0), True).rotate((0.0, 0.0, 20.0))
    layers = slice_part(whole(standing(box)), profile("process.infill_density=0.15", f"process.infill_pattern={pattern}")).layers
    plastic = [shapely.union_all([shapely.LineString(path.points).buffer(0.25) for path in layer.paths]) for layer in layers]
    ends = [
        end.difference(shapely.union_all(plastic[k - 3 : k])).length
        for k in range(3, len(layers))
        for path in layers[k].paths
        if path.kind is Kind.INFILL and len(path.points) > 1
        for line in (shapely.LineString(path.points),)
        for end in (substring(line, 0.0, 2.0), substring(line, max(line.length - 2.0, 0.0), line.length))
    ]
    assert sum(mm > 1.0 for mm in ends) < 0.03 * len(ends)
