"""Strokes of skin end on the plastic of the layer below."""

import numpy as np
import pytest
import shapely
from hypothesis import given, settings
from hypothesis import strategies as st
from shapely.ops import substring

from slicer.bead import Bead
from slicer.fill.ends import hold_ends
from slicer.geometry.polygons import Polygons
from slicer.paths import Kind

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
        (0.1, 2.9, (0.1, 2.9)),  # some of the last width lies on them
        (0.4, 2.6, (0.0, 3.0)),  # goes on to what is near
        (-2.0, 3.0, (-0.4, 3.0)),  # ends where there is plastic: no farther beyond than half a line and the rail
        (-2.0, 5.0, (-0.4, 3.4)),
    ],
)
def test_a_stroke_ends_on_the_plastic_that_is_nearest(begin: float, end: float, held: tuple[float, float]) -> None:
    skin = hold_ends([bead(Kind.SKIN, (begin, 0.0), (end, 0.0))], [rail(0.0), rail(3.0)], MODEL, WIDTH)
    assert reach(skin) == pytest.approx(held, abs=0.5 * WIDTH)


def test_a_stroke_over_nothing_is_left_out_and_what_follows_it_begins_anew() -> None:
    chain = [bead(Kind.TOP_SKIN, (x, -1.0), (x, 1.0), follows=x > 5.0) for x in (5.0, 5.4, 12.0)]
    left = hold_ends([bead(Kind.SKIN, (0.0, 0.0), (0.0, 3.0)), *chain], [rail(0.0), rail(12.0)], MODEL, WIDTH)
    assert [float(one.points[0, 0]) for one in left] == [0.0, 12.0]
    assert not left[1].follows


@pytest.mark.parametrize("kind", [Kind.INFILL, Kind.INNER_WALL, Kind.SUPPORT])
def test_only_skins_are_held(kind: Kind) -> None:
    beads = [bead(kind, (5.0, 0.0), (9.0, 0.0))]
    assert hold_ends(beads, [rail(0.0)], MODEL, WIDTH) == beads


def test_a_bridge_may_end_where_the_model_has_nothing_below() -> None:
    bridge = [bead(Kind.BRIDGE, (0.0, 0.0), (5.0, 0.0))]
    assert reach(hold_ends(bridge, [rail(0.0)], Polygons.square((2.0, 20.0), True), WIDTH)) == (0.0, 5.0)


@settings(max_examples=100, deadline=None)
@given(st.lists(POINTS, min_size=2, max_size=6, unique=True), st.lists(st.floats(-8, 8), min_size=1, max_size=4))
def test_under_the_last_width_of_a_stroke_lies_plastic(points: list[tuple[float, float]], rails: list[float]) -> None:
    below = [rail(x) for x in rails]
    plastic = shapely.union_all([shapely.LineString(one.points).buffer(0.5 * WIDTH, cap_style="flat") for one in below])
    for held in hold_ends([bead(Kind.SKIN, *points)], below, MODEL, WIDTH):
        line = shapely.LineString(held.points)
        for tail in (substring(line, 0.0, WIDTH), substring(line, line.length - WIDTH, line.length)):
            assert tail.intersects(plastic)
