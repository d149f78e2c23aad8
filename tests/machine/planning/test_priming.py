"""What oozed while the table turned is made up for inside, along a stroke, within what the hot end melts."""

from dataclasses import replace
from math import pi

import numpy as np
import pytest

from machine.planning.moves import Stroke
from machine.planning.priming import RUN_MM, run_in
from machine.planning.travel import Tip
from mdp.pose import Pose
from profiles.profile import Profile, load
from slicer.bead import Bead
from slicer.interface.interlock import begin_inside
from slicer.paths import Kind, Layer, Path
from slicer.slice import slice_part
from tests.shapes import box
from tests.slicer.hand import BARE, cut

PER_MM = 0.033  # filament of a usual bead


def _tip(run_in_mm: float = 0.4) -> Tip:
    return Tip(np.zeros(3), Pose(0.0, 0.0), run_in_mm=run_in_mm)


def _stroke(kind: Kind, *steps_mm: float, speed: float = 25.0) -> Stroke:
    x = np.concatenate([[0.0], np.cumsum(steps_mm)])
    points = np.column_stack([x, np.zeros((len(x), 2))])
    return Stroke(kind, points, PER_MM * np.array(steps_mm), speed, 0.45)


def _layer(*kinds: Kind) -> Layer:
    line = np.array([[0.0, 0.0], [9.0, 0.0]])
    return Layer.of(0.1, 0.2, tuple(Path(kind, line, 0.45, 25.0, 1.0, np.zeros((0, 2)), False) for kind in kinds), 0.3)


def test_the_filament_is_spread_over_the_first_stretch_and_then_all_is_as_usual() -> None:
    tip = _tip(0.3)
    stroke = run_in(_stroke(Kind.INFILL, 5.0, 15.0, 30.0), _layer(Kind.INFILL), tip, load())
    assert stroke.filament_mm == pytest.approx([5 * (PER_MM + 0.3 / RUN_MM), 15 * (PER_MM + 0.3 / RUN_MM), 30 * PER_MM])
    assert tip.run_in_mm == 0.0


@pytest.mark.parametrize("flow", [1.0, 1.24])  # outer beads that nothing covers bulge, the more so the narrower they are
def test_no_stroke_takes_more_than_half_too_much_and_the_next_one_takes_the_rest(flow: float) -> None:
    tip, stroke = _tip(), _stroke(Kind.INFILL, 5.0)
    stroke = replace(stroke, filament_mm=flow * stroke.filament_mm)
    short = run_in(stroke, _layer(Kind.INFILL), tip, load())
    needed_mm = 5 * (0.2 * (0.45 - 0.2) + pi * 0.1**2) / (pi * 1.75**2 / 4)
    assert short.filament_mm == pytest.approx([1.5 * needed_mm])
    assert tip.run_in_mm == pytest.approx(0.4 - 1.5 * needed_mm + flow * 5 * PER_MM)


def test_an_outer_wall_takes_nothing_where_the_layer_has_anything_inside() -> None:
    for kinds, more in (((Kind.OUTER_WALL, Kind.INFILL), 0.0), ((Kind.OUTER_WALL,), 0.4)):
        tip, wall = _tip(), _stroke(Kind.OUTER_WALL, 40.0)
        run = run_in(wall, _layer(*kinds), tip, load())
        assert run.filament_mm.sum() - wall.filament_mm.sum() == pytest.approx(more)


def test_it_goes_no_faster_than_the_hot_end_melts() -> None:
    profile: Profile = load(settings=["material.volumetric_limit_mm3_s=2"])
    stroke = run_in(_stroke(Kind.INFILL, 20.0, speed=25.0), _layer(Kind.INFILL), _tip(), profile)
    rate = stroke.filament_mm[0] / 20.0 * stroke.speed_mm_s * pi * 1.75**2 / 4
    assert rate == pytest.approx(2.0)


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
