"""Fan, layer time and the speeds that depend on the bead."""

import manifold3d as m3
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from profiles.profile import load
from slicer.bead import Bead
from slicer.paths import NUMBER, Kind
from slicer.slice import slice_part
from slicer.strokes.speed import LEAST_GAIN_S, fan_share, steady, stroke_accelerations, travel_time_s
from slicer.strokes.strokes import strokes_of
from tests.shapes import box, from_manifold
from tests.slicer.hand import cut, of_kind, profile, whole

FANS = ("material.fan=1", "material.fan_least=0.4", "process.least_layer_time_s=10", "material.fan_layer_time_s=40")


@pytest.mark.parametrize(("time_s", "fan"), [(3, 1.0), (10, 1.0), (25, 0.7), (40, 0.4), (500, 0.4)])
def test_the_fan_falls_evenly_with_the_layer_time(time_s: float, fan: float) -> None:
    chosen = load(settings=FANS)
    assert fan_share(chosen.material, chosen.process, time_s) == pytest.approx(fan)


def test_a_material_without_a_fan_never_gets_one() -> None:
    chosen = load(settings=["material.fan=0"])
    assert fan_share(chosen.material, chosen.process, 1.0) == 0.0


def test_small_layers_are_blown_on_harder_than_large_ones() -> None:
    small, large = (slice_part(whole(box(size, size, 3)), profile()).layers[8].fan for size in (6, 60))
    assert small == 1.0
    assert profile().material.fan_least <= large < 0.8


def test_the_fan_is_off_in_the_first_layers_on_the_plate_but_only_in_the_first_on_plastic() -> None:
    chosen = profile("material.fan_off_layers=3")
    base, top = (slice_part(part, chosen) for part in cut(box(10, 10, 6), ((0.0, 0.0, 1.0), 3.0)))
    assert [layer.fan > 0 for layer in base.layers[:5]] == [False, False, False, True, True]
    assert [layer.fan > 0 for layer in top.layers[:4]] == [False, True, True, True]


def test_the_fan_rises_evenly_to_its_full_layer() -> None:
    chosen = profile("material.fan_off_layers=1", "material.fan_full_layer=4", "material.fan_least=1")
    base, top = (slice_part(part, chosen) for part in cut(box(10, 10, 6), ((0.0, 0.0, 1.0), 3.0)))
    assert [layer.fan for layer in base.layers[:6]] == pytest.approx([0, 1 / 3, 2 / 3, 1, 1, 1], abs=0.026)
    assert {layer.fan for layer in top.layers[3:]} == {1.0}


def test_bridges_have_their_own_fan_speed() -> None:
    wall, roof = m3.Manifold.cube((5, 8, 6)), m3.Manifold.cube((20, 8, 4)).translate((0, 0, 6))
    arch = from_manifold(wall + wall.translate((15, 0, 0)) + roof)
    sliced = slice_part(whole(arch), profile("process.support=none", "material.fan_bridge=0.9", "material.fan_least=0.2"))
    bridges = of_kind(sliced, Kind.BRIDGE)
    assert bridges
    assert {path.fan for path in bridges} == {0.9}
    assert {path.fan for path in of_kind(sliced, Kind.INFILL)} == {None}


def test_small_holes_are_printed_slowly_and_large_outlines_are_not() -> None:
    walls = {}
    for size in (4, 30):
        sliced = slice_part(whole(box(size, size, 2)), profile("process.least_layer_time_s=0"))
        walls[size] = {path.speed_mm_s for path in sliced.layers[5].paths if path.kind is Kind.INNER_WALL}
    chosen = profile().process
    assert walls[4] == {chosen.small_wall_speed_mm_s}
    assert walls[30] == {chosen.inner_wall_speed_mm_s}


@pytest.mark.parametrize("size", [3, 8, 15, 40])
def test_a_layer_takes_its_least_time_unless_all_is_at_the_least_speed(size: float) -> None:
    chosen = profile("process.least_layer_time_s=8", "process.travel_speed_mm_s=2000")
    for layer in slice_part(whole(box(size, size, 2)), chosen).layers[1:]:
        time_s = sum(path.length_mm / path.speed_mm_s for path in layer.paths)
        slowest = np.allclose([path.speed_mm_s for path in layer.paths], chosen.process.least_speed_mm_s)
        assert time_s >= 0.97 * 8 or slowest


def test_travels_last_as_long_as_their_ways_with_a_pull_back_and_a_push_for_each_retraction() -> None:
    keys = profile("material.retract_mm=2", "material.retract_speed_mm_s=40", "process.travel_speed_mm_s=100")
    lines = [np.array([[x, 0.0], [x + 10.0, 0.0]]) for x in (0.0, 20.0, 36.0)]
    beads = [Bead(Kind.INFILL, line, 0.45, 3) for line in lines]
    round_about = {1: np.array([[10.0, 5.0], [20.0, 5.0]])}  # 5, 10 and 5 mm to the second line, 6 mm to the third
    strokes = strokes_of(beads, np.array([False, True, False]), round_about, 0.0)
    assert travel_time_s(strokes, keys) == pytest.approx(26.0 / 100.0 + 2.0 * 2.0 / 40.0)


def test_support_is_accelerated_as_infill_and_overhanging_walls_as_bridges() -> None:
    keys = profile(
        "process.acceleration_mm_s2=1000", "process.infill_acceleration_mm_s2=2000", "process.bridge_acceleration_mm_s2=500"
    )
    found = stroke_accelerations(keys, False)
    kinds = (Kind.INFILL, Kind.SUPPORT, Kind.SUPPORT_INTERFACE, Kind.BRIDGE, Kind.OVERHANG, Kind.SKIN, Kind.OUTER_WALL)
    assert [found[NUMBER[kind]] for kind in kinds] == [2000.0, 2000.0, 2000.0, 500.0, 500.0, 1000.0, 1000.0]


def test_a_short_stretch_between_slower_ones_is_no_faster_than_the_faster_of_them() -> None:
    assert steady(np.array([30.0, 60.0, 40.0]), np.array([90.0, 5.0, 90.0])).tolist() == [30.0, 40.0, 40.0]
    assert steady(np.array([30.0, 60.0, 40.0]), np.array([90.0, 50.0, 90.0])).tolist() == [30.0, 60.0, 40.0]


def test_a_short_step_between_a_slower_and_a_faster_stretch_is_as_slow_as_the_slower_one() -> None:
    assert steady(np.array([20.0, 35.0, 40.0]), np.array([90.0, 4.0, 90.0])).tolist() == [20.0, 20.0, 40.0]
    assert steady(np.array([40.0, 35.0, 20.0]), np.array([90.0, 5.0, 90.0])).tolist() == [40.0, 35.0, 20.0]  # it saves 0.107 s


@given(st.lists(st.tuples(st.sampled_from([15.0, 25.0, 40.0, 60.0, 80.0]), st.floats(0.05, 60.0)), min_size=1, max_size=40))
def test_no_stroke_gets_faster_and_every_change_that_is_left_out_costs_next_to_no_time(rows: list[tuple[float, float]]) -> None:
    asked, lengths = np.array(rows).T
    steadied = steady(asked, lengths)
    assert (steadied <= asked).all()
    left_out = np.count_nonzero(np.diff(asked)) - np.count_nonzero(np.diff(steadied))
    assert (lengths / steadied).sum() - (lengths / asked).sum() <= LEAST_GAIN_S * left_out + 1e-9
    assert steady(steadied, lengths).tolist() == steadied.tolist()
