"""Overhangs of each layer against closed formulas, and against the search's support need."""

from dataclasses import replace

import manifold3d as m3
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mdp.mesh import Mesh
from mdp.overhang import risky_upright
from mdp.support_need.need import needs_support
from mdp.zone import Marked, Zone
from slicer.geometry.polygons import Polygons
from slicer.overhangs import Overhang, find_overhangs
from slicer.sectioning import section_part
from slicer.support.support import drop_small, seen_from_above
from tests.shapes import ball, branch, standing, tee
from tests.slicer.hand import cut, profile, whole

CUBE, CONE = m3.Manifold.cube, m3.Manifold.cylinder
CORNERS = 96  # of round solids
LAYER_MM = 0.2


def overhangs_of(mesh: Mesh, *keys: str) -> list[Overhang]:
    return find_overhangs(section_part(whole(mesh), profile(*keys)))


def table(span_mm: float, depth_mm: float) -> Mesh:
    """A plate of 2 mm over two posts, its underside 10 mm high."""
    post = CUBE((5, depth_mm, 10))
    return standing(post + post.translate((5 + span_mm, 0, 0)) + CUBE((10 + span_mm, depth_mm, 2)).translate((0, 0, 10)))


def gallows(reach_mm: float, depth_mm: float) -> Mesh:
    """A post with an arm to one side, its underside 20 mm high."""
    return standing(CUBE((8, depth_mm, 20)) + CUBE((8 + reach_mm, depth_mm, 4)).translate((0, 0, 20)))


def funnel(angle_deg: float, foot_mm: float) -> Mesh:
    """A cone on its tip, 6 mm high, whose sides overhang by an angle from upright; foot_mm: radius at the build plate."""
    return standing(CONE(6, foot_mm, foot_mm + 6 * np.tan(np.radians(angle_deg)), CORNERS))


def disc_mm2(radius_mm: float) -> float:
    return float(0.5 * CORNERS * np.sin(2 * np.pi / CORNERS) * radius_mm**2)


def hanging_mm2(overhangs: list[Overhang]) -> dict[int, float]:
    """Overhanging area by layer, for the layers that have any."""
    return {i: overhang.hanging.area() for i, overhang in enumerate(overhangs) if not overhang.hanging.is_empty()}


@settings(max_examples=12, deadline=None)
@given(st.floats(4.0, 29.9), st.floats(3.0, 20.0))
def test_a_deck_between_posts_is_one_bridge_along_the_span_in_the_layer_over_the_gap(span_mm: float, depth_mm: float) -> None:
    overhangs = overhangs_of(table(span_mm, depth_mm))
    bridges = {i: overhang.bridges for i, overhang in enumerate(overhangs) if overhang.bridges}
    assert list(bridges) == [round(10 / LAYER_MM)]
    ((bridge,),) = bridges.values()
    assert bridge.hanging.area() == pytest.approx(span_mm * depth_mm, rel=0.002)
    assert np.sin(np.radians(bridge.angle_deg)) == pytest.approx(0.0, abs=1e-6)
    assert bridge.longest_mm == pytest.approx(span_mm, abs=0.01)
    assert hanging_mm2(overhangs) == {}


@settings(max_examples=8, deadline=None)
@given(st.floats(30.5, 60.0), st.floats(3.0, 20.0))
def test_a_deck_farther_than_bridges_carry_hangs_all_between_its_posts_unless_there_is_no_support(
    span_mm: float, depth_mm: float
) -> None:
    layer = round(10 / LAYER_MM)
    overhangs = overhangs_of(table(span_mm, depth_mm))
    assert hanging_mm2(overhangs) == {layer: pytest.approx(span_mm * depth_mm, rel=0.002)}
    assert overhangs[layer].bridges == ()
    alone = overhangs_of(table(span_mm, depth_mm), "process.support=none")
    assert hanging_mm2(alone) == {}
    assert sum(bridge.hanging.area() for bridge in alone[layer].bridges) == pytest.approx(span_mm * depth_mm, rel=0.002)


@settings(max_examples=12, deadline=None)
@given(st.floats(2.0, 40.0), st.floats(3.0, 20.0))
def test_a_cantilever_hangs_as_far_as_it_reaches_in_its_lowest_layer_alone(reach_mm: float, depth_mm: float) -> None:
    overhangs = overhangs_of(gallows(reach_mm, depth_mm))
    assert hanging_mm2(overhangs) == {round(20 / LAYER_MM): pytest.approx(reach_mm * depth_mm, rel=0.002)}
    assert all(overhang.bridges == () for overhang in overhangs)


def test_a_cantilever_of_two_lines_is_a_ledge_that_carries_itself() -> None:
    overhangs = overhangs_of(gallows(0.8, 12.0))
    assert hanging_mm2(overhangs) == {}
    assert overhangs[round(20 / LAYER_MM)].ledges.area() == pytest.approx(0.8 * 12.0, rel=0.002)


@settings(max_examples=12, deadline=None)
@given(st.floats(46.0, 80.0), st.floats(3.0, 12.0))
def test_every_layer_of_a_flat_cone_hangs_by_the_ring_that_it_is_wider_than_the_one_below(
    angle_deg: float, foot_mm: float
) -> None:
    overhangs = overhangs_of(funnel(angle_deg, foot_mm))
    middles_mm = LAYER_MM * (np.arange(len(overhangs)) + 0.5)
    discs = np.array([disc_mm2(foot_mm + z_mm * np.tan(np.radians(angle_deg))) for z_mm in middles_mm])
    assert [overhang.hanging.area() for overhang in overhangs[1:]] == pytest.approx(np.diff(discs), rel=0.02, abs=0.05)


@settings(max_examples=8, deadline=None)
@given(st.floats(5.0, 44.9), st.floats(3.0, 12.0))
def test_a_cone_up_to_the_self_supporting_angle_hangs_nowhere(angle_deg: float, foot_mm: float) -> None:
    assert hanging_mm2(overhangs_of(funnel(angle_deg, foot_mm))) == {}


def test_a_section_that_begins_in_mid_air_overhangs_completely() -> None:
    peg = CUBE((4, 3, 8)).translate((20, 2, 14))
    overhangs = overhangs_of(standing(CUBE((8, 8, 20)) + CUBE((30, 8, 4)).translate((0, 0, 20)) + peg))
    begun, arm = round(14 / LAYER_MM), round(20 / LAYER_MM)
    assert hanging_mm2(overhangs) == {begun: pytest.approx(12.0, rel=0.002), arm: pytest.approx(22 * 8 - 12.0, rel=0.002)}


def test_a_tip_too_steep_to_need_support_hangs_where_it_gets_wide_enough_for_a_line_and_no_higher() -> None:
    slope = np.tan(np.radians(35))
    tip = CONE(6, 0.0, 6 * slope, CORNERS).translate((22, 6, 14))
    overhangs = overhangs_of(standing(CUBE((8, 12, 20)) + CUBE((30, 12, 4)).translate((0, 0, 20)) + tip))
    ((begun, mm2),) = [(i, mm2) for i, mm2 in hanging_mm2(overhangs).items() if i < round(20 / LAYER_MM)]
    assert mm2 == pytest.approx(disc_mm2((LAYER_MM * (begun + 0.5) - 14) * slope), rel=0.05)
    assert 14 < LAYER_MM * begun < 15


def test_the_first_layer_of_a_later_part_hangs_where_it_reaches_over_the_one_before() -> None:
    base, plate = cut(tee(), ((0, 0, 1), 30.0))
    overhangs = find_overhangs(section_part(plate, profile(), [base]))
    assert hanging_mm2(overhangs) == {0: pytest.approx(40 * 10 - 10 * 10, rel=0.01)}


def test_overhangs_in_a_zone_without_support_are_reported_separately() -> None:
    part = whole(tee())
    right_arm = Marked((Zone((4.5, -10.0, -1.0), (25.0, 10.0, 35.0)),))
    overhang = find_overhangs(section_part(replace(part, no_support=right_arm), profile()))[round(30 / LAYER_MM)]
    assert overhang.hanging.area() == pytest.approx(15 * 10, rel=0.002)
    assert overhang.unwanted.area() == pytest.approx(15 * 10, rel=0.002)


def test_places_are_small_by_what_all_layers_together_show_from_above() -> None:
    strip, speck = Polygons.square((1.0, 1.0)), Polygons.square((0.5, 0.5)).translate((9.0, 0.0))
    slope = [strip.translate((float(k), 0.0)) for k in range(3)]
    hanging = [slope[0] + speck, Polygons(), slope[1], slope[2]]
    assert seen_from_above(hanging).area() == pytest.approx(3.08 * 1.08 + 0.58**2)
    assert [area.area() for area in drop_small(hanging, 2.0)] == pytest.approx([1.0, 0.0, 1.0, 1.0])
    assert [area.area() for area in drop_small(hanging, 4.0)] == [0.0, 0.0, 0.0, 0.0]
    assert [area.area() for area in drop_small(hanging, 0.1)] == pytest.approx([1.25, 0.0, 1.0, 1.0])


def needed_mm2(mesh: Mesh, *keys: str) -> float:
    """Area, seen from above, that the search counts as needing support."""
    process = profile(*keys).process
    risky = risky_upright(mesh, process.self_supporting_angle_deg) & needs_support(mesh, process, True)
    return float(-(mesh.normals[risky, 2] * mesh.areas_mm2[risky]).sum())


LEVEL = {
    "a T": tee(),
    "a short table": table(20, 6),
    "a long table": table(34, 6),
    "a gallows": gallows(16, 8),
    "a mushroom": standing(CONE(20, 4, 4, CORNERS) + CONE(4, 15, 15, CORNERS).translate((0, 0, 18))),
    "a ledge": gallows(0.8, 12),
}
SLOPES = {"a flat cone": funnel(65, 5), "a steep cone": funnel(40, 5), "a ball": ball(), "a leaning arm": branch()}


@pytest.mark.parametrize("name", LEVEL)
def test_the_slicer_supports_the_level_faces_that_the_search_counts_within_one_percent(name: str) -> None:
    hanging = sum(hanging_mm2(overhangs_of(LEVEL[name])).values())
    assert hanging == pytest.approx(needed_mm2(LEVEL[name]), rel=0.01, abs=1e-6)


@pytest.mark.parametrize("name", SLOPES)
def test_slicer_and_search_agree_on_slopes_within_a_layer_at_either_end(name: str) -> None:
    """The layers cover a slope only between the middle of its lowest layer and that of its highest."""
    hanging = sum(hanging_mm2(overhangs_of(SLOPES[name])).values())
    assert hanging == pytest.approx(needed_mm2(SLOPES[name]), rel=0.08, abs=1e-6)
