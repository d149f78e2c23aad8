"""Filament that oozed during a table turn is replaced inside the part, along a stroke, within the hot end's melt rate."""

from math import pi

import numpy as np
import pytest

from machine.planning.layer import RUN_MM, run_in
from machine.planning.moves import SPEED, Moves
from profiles.profile import Profile, load
from slicer.bead import Bead
from slicer.paths import Kind, Layer, Path
from slicer.slice import begin_inside, slice_part
from tests.shapes import box
from tests.slicer.hand import BARE, cut

PER_MM = 0.033  # filament of a usual bead per mm


def _strokes(*steps_mm: tuple[float, ...], speed: float = 25.0, flow: float = 1.0) -> Moves:
    """Strokes along X with steps of given lengths."""
    steps = [np.array([0.0, *lengths]) for lengths in steps_mm]
    ways = [np.column_stack([np.cumsum(row), np.zeros((len(row), 2)), flow * PER_MM * row]) for row in steps]
    return Moves(np.concatenate(ways), np.array([[0.0, len(row), speed, 0.45, np.nan, np.inf] for row in steps]))


def _layer(*kinds: Kind) -> Layer:
    line = np.array([[0.0, 0.0], [9.0, 0.0]])
    return Layer.of(0.1, 0.2, tuple(Path(kind, line, 0.45, 25.0, 1.0, np.zeros((0, 2)), False) for kind in kinds), 0.3)


def test_the_filament_is_spread_over_the_first_stretch_and_then_all_is_as_usual() -> None:
    strokes = _strokes((5.0, 15.0, 30.0), (40.0,))
    assert run_in(strokes, _layer(Kind.INFILL, Kind.INFILL), 0.3, load()) == pytest.approx(0.3)
    thicker = PER_MM + 0.3 / RUN_MM
    assert strokes.ways[:, 3] == pytest.approx([0.0, 5 * thicker, 15 * thicker, 30 * PER_MM, 0.0, 40 * PER_MM])


@pytest.mark.parametrize("flow", [1.0, 1.24])  # outer beads with nothing over them bulge, and more so if they are narrow
def test_no_stroke_takes_more_than_half_too_much_and_the_next_one_takes_the_rest(flow: float) -> None:
    strokes = _strokes((5.0,), (40.0,), flow=flow)
    assert run_in(strokes, _layer(Kind.INFILL, Kind.INFILL), 0.4, load()) == pytest.approx(0.4)
    needed_mm = 5 * (0.2 * (0.45 - 0.2) + pi * 0.1**2) / (pi * 1.75**2 / 4)
    assert strokes.ways[1, 3] == pytest.approx(1.5 * needed_mm)
    assert strokes.ways[3, 3] == pytest.approx(flow * 45 * PER_MM + 0.4 - 1.5 * needed_mm)
    assert run_in(_strokes((5.0,), flow=flow), _layer(Kind.INFILL), 0.4, load()) == pytest.approx(
        1.5 * needed_mm - flow * 5 * PER_MM
    )


def test_an_outer_wall_takes_nothing_where_the_layer_has_anything_inside() -> None:
    for kinds, more in (((Kind.OUTER_WALL, Kind.INFILL), [0.0, 0.4]), ((Kind.OUTER_WALL,), [0.4])):
        strokes = _strokes(*((40.0,) for _ in kinds))
        assert run_in(strokes, _layer(*kinds), 0.4, load()) == pytest.approx(0.4)
        assert strokes.ways[1::2, 3] - 40.0 * PER_MM == pytest.approx(more)


def test_priming_is_no_faster_than_the_hot_end_melts() -> None:
    profile: Profile = load(settings=["material.volumetric_limit_mm3_s=2"])
    strokes = _strokes((20.0,), speed=25.0)
    run_in(strokes, _layer(Kind.INFILL), 0.4, profile)
    assert strokes.ways[1, 3] / 20.0 * strokes.rows[0, SPEED] * pi * 1.75**2 / 4 == pytest.approx(2.0)


def test_a_part_on_plastic_begins_inside_with_its_skin() -> None:
    keys = load(settings=BARE)
    base, top = cut(box(20, 20, 12), ((0, 0, 1), 6.0))
    first, second = slice_part(top, keys, [base]).layers[:2]
    assert first.paths[0].kind is Kind.SKIN
    assert second.paths[0].kind is not Kind.SKIN


@pytest.mark.parametrize("kinds", [(Kind.OUTER_WALL, Kind.INNER_WALL), (Kind.SUPPORT, Kind.INFILL)])
def test_a_layer_that_begins_with_support_or_has_nothing_inside_keeps_its_order(kinds: tuple[Kind, ...]) -> None:
    line = np.array([[0.0, 0.0], [9.0, 0.0]])
    ranks = {Kind.SUPPORT: -1000, Kind.INFILL: 3}
    beads = [Bead(kind, line, 0.45, ranks.get(kind, 0)) for kind in kinds]
    assert [bead.kind for bead in begin_inside(beads)] == list(kinds)


def test_outer_walls_on_plastic_come_last_in_their_layer_and_above_it_walls_come_first() -> None:
    keys = load(settings=BARE)
    base, top = cut(box(20, 20, 12), ((0, 0, 1), 6.0))
    first, second = ([path.kind for path in layer.paths] for layer in slice_part(top, keys, [base]).layers[:2])
    assert first[-1] is Kind.OUTER_WALL
    assert Kind.SKIN not in first[first.index(Kind.OUTER_WALL) :]
    assert second.index(Kind.OUTER_WALL) < len(second) - 1
