"""Pins: plastic that fills their holes exactly, holes clear of the shell and of each other, and the tip at the mouth."""

from collections.abc import Sequence
from itertools import combinations

import manifold3d as m3
import numpy as np
import pytest
import shapely
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from mdp.cut import solid_of
from mdp.decomposition import Part
from mdp.mesh import Floats
from profiles.errors import ProfileError
from profiles.part_settings import PartSettings
from profiles.profile import Profile, with_part_settings
from slicer.interface.interface import plan_pins
from slicer.paths import Kind, bead_area_mm2
from slicer.sectioning import Sections, section_part
from slicer.slice import fill_pins, slice_part
from tests.shapes import box, from_manifold
from tests.slicer.hand import BARE, cut, profile

PINS = ("process.interlock=pins", "process.most_pins=100")
UP = (0.0, 0.0, 1.0)
WIDE, DEEP, WIDTH, WALLS = 1.0, 3.0, 0.45, 3
DISC = 0.5 * 24 * np.sin(2 * np.pi / 24) * (0.5 * WIDE) ** 2  # mm2: a hole has 24 sides
CLEAR = (WALLS + 1) * WIDTH


def stacked() -> list[Part]:
    return cut(box(24, 24, 20), (UP, 10.0))


def leaning(tilt_deg: float, x: float = 20.0, y: float = 16.0) -> list[Part]:
    """A block with an arm that leans from it."""
    turn = np.radians(tilt_deg)
    arm = m3.Manifold.cube((x, y, 30.0), True).translate((0.0, 0.0, 15.0)).rotate((0.0, tilt_deg, 0.0))
    block = m3.Manifold.cube((60.0, 40.0, 24.0), True).translate((0.0, 0.0, 12.0))
    whole = block + arm.translate((0.0, 0.0, 12.0))
    return cut(from_manifold(whole.trim_by_plane((0.0, 0.0, 1.0), 0.0)), ((np.sin(turn), 0.0, np.cos(turn)), 30.0))


def sections_of(parts: Sequence[Part], own: Profile) -> list[Sections]:
    pins = plan_pins(parts, own)
    return [section_part(part, own, parts[:k], parts[k + 1 :], pins) for k, part in enumerate(parts)]


def removed_mm3(parts: Sequence[Part], *keys: str) -> float:
    """Volume that pins remove from the sections of all layers."""
    with_pins, without = (sections_of(parts, profile(*BARE, *more, *keys)) for more in (PINS, ()))
    return sum(
        float(np.dot([a.area() - b.area() for a, b in zip(bare.own, holed.own, strict=True)], bare.heights.height_mm))
        for bare, holed in zip(without, with_pins, strict=True)
    )


def poured_mm3(parts: Sequence[Part], *keys: str) -> float:
    """Volume of the beads that fill pins."""
    own = profile(*BARE, *PINS, *keys)
    area = bead_area_mm2(own.process.line_width_mm, 0.2) * own.process.interface_flow
    beads = [bead for pins in plan_pins(parts, own).values() for bead in fill_pins(pins, own, 0.2)]
    return sum(bead.length_mm * bead.flow * area for bead in beads)


def axis(part: Part, pin: Floats) -> Floats:
    """(2, 3) the ends of a pin's axis in the workpiece frame."""
    ends = np.array([[*pin[:2], part.base.offset_mm], [*pin[:2], part.base.offset_mm - DEEP]])
    return np.asarray(ends @ part.rotation)


def test_the_face_of_a_block_has_a_grid_of_pins_clear_of_its_walls() -> None:
    pins = plan_pins(stacked(), profile(*PINS))[2]
    assert sorted(set(pins[:, 0])) == pytest.approx([-8.0, -4.0, 0.0, 4.0, 8.0])
    assert len(pins) == 25
    assert pins[:, 2] == pytest.approx([DISC * DEEP] * 25)


@pytest.mark.parametrize(
    "keys", [(), ("process.layer_height_mm=0.25",), ("process.pin_depth_mm=2.1",), ("process.interface_flow=1.2",)]
)
def test_the_strokes_push_what_the_layers_below_leave_out(keys: tuple[str, ...]) -> None:
    assert poured_mm3(stacked(), *keys) == pytest.approx(removed_mm3(stacked(), *keys), rel=1e-3)
    assert poured_mm3(stacked(), *keys) > 25 * DISC * 2.0


@settings(max_examples=12, deadline=None)
@given(st.floats(1.0, 70.0), st.floats(8.0, 24.0))
def test_a_leaning_part_fills_its_holes_within_two_percent(tilt_deg: float, x: float) -> None:
    parts = leaning(tilt_deg, x)
    assume(len(plan_pins(parts, profile(*PINS))[2]))
    assert poured_mm3(parts) == pytest.approx(removed_mm3(parts), rel=0.02)


@settings(max_examples=25, deadline=None)
@given(
    st.lists(st.tuples(st.floats(2.0, 16.0), st.floats(0.05, 0.3)), min_size=4, max_size=10),
    st.floats(-3.0, 3.0),
    st.floats(0.4, 2.5),
)
def test_no_pin_comes_near_the_outside_of_any_star(star: list[tuple[float, float]], twist: float, widening: float) -> None:
    """In a twisted, widening or narrowing prism over any star, a tube as wide as a hole with the walls around it lies inside."""
    turns = np.cumsum([step for _, step in star]) / sum(step for _, step in star) * 2.0 * np.pi
    outline = np.array([r for r, _ in star])[:, None] * np.column_stack([np.cos(turns), np.sin(turns)])
    assume(shapely.Polygon(outline).is_valid)
    solid = m3.Manifold.extrude(m3.CrossSection([outline]), 20.0, 20, 10.0 * twist, (widening, widening))
    assume(solid.status() == m3.Error.NoError and solid.volume() > 100.0)
    parts = cut(from_manifold(solid), (UP, 12.0))
    pins = plan_pins(parts, profile(*PINS))[2]
    tubes = [m3.Manifold.cylinder(DEEP, 0.5 * WIDE + CLEAR - 0.1).translate((x, y, 12.0 - DEEP)) for x, y, _ in pins]
    for tube in tubes:
        assert (tube - solid_of(parts[0].mesh)).volume() < 0.01 * tube.volume()
    for one, other in combinations(pins[:, :2], 2):
        assert np.hypot(*(one - other)) >= WIDE + 2 * WIDTH - 1e-9


def test_in_a_stem_that_narrows_below_the_cut_its_narrowest_place_counts() -> None:
    """At the depth of a hole and the walls below it, 4.8 mm under the cut of 9 mm radius, the stem's radius is 6.6 mm."""
    cone = m3.Manifold.cylinder(24.0, 3.0, 15.0, 360)
    pins = plan_pins(cut(from_manifold(cone), (UP, 12.0)), profile(*PINS, "process.pin_spacing_mm=1.9"))[2]
    farthest = np.hypot(*pins[:, :2].T).max()
    assert 6.6 - CLEAR - 0.5 * WIDE - 0.7 < farthest <= 6.6 - CLEAR - 0.5 * WIDE + 0.01


def test_pins_of_two_parts_in_one_keep_clear_of_each_other() -> None:
    """Two arms lean apart from one ridge, so that their pins would meet below it."""
    half = m3.Manifold.cube((50.0, 30.0, 60.0), True)
    left, right = (1.0, 0.0, 1.0), (-1.0, 0.0, 1.0)
    parts = cut(from_manifold(half.translate((0.0, 0.0, 30.0))), (left, 26.0), (right, 26.0))
    pins = plan_pins(parts, profile(*PINS))
    assert all(len(pins[index]) > 3 for index in (2, 3))
    own = {part.index: [axis(part, pin) for pin in pins[part.index]] for part in parts[1:]}
    apart = min(
        np.linalg.norm(a - b)
        for first in own[2]
        for second in own[3]
        for a in np.linspace(*first, 13)
        for b in np.linspace(*second, 13)
    )
    assert apart >= WIDE + CLEAR - 0.1


def test_below_and_round_a_hole_there_is_plastic_and_walls_run_round_it() -> None:
    base, top = stacked()
    lower = slice_part(base, profile(*BARE, *PINS), later=[top])
    walls = [path for layer in lower.layers for path in layer.paths if path.kind is Kind.OUTER_WALL and path.length_mm < 6.0]
    per_hole = [path for path in walls if np.hypot(*(path.points.mean(axis=0) - (4.0, 4.0))) < 0.2]
    assert len(per_hole) == 15  # 3 mm in layers of 0.2 mm
    assert [path.length_mm for path in per_hole] == pytest.approx([np.pi * (WIDE + WIDTH)] * 15, rel=0.03)
    floor = shapely.union_all([shapely.LineString(path.points).buffer(0.5 * path.width_mm) for path in lower.layers[34].paths])
    assert shapely.Point(4.0, 4.0).buffer(0.5 * WIDE).difference(floor.buffer(0.05)).area < 0.01
    open_ = shapely.union_all([shapely.LineString(path.points).buffer(0.5 * path.width_mm) for path in lower.layers[35].paths])
    assert shapely.Point(4.0, 4.0).buffer(0.4 * WIDE).intersection(open_).area == 0.0


@pytest.mark.parametrize("keys", [(), ("process.interface_flow=1.2", "process.layer_height_mm=0.15")])
def test_the_tip_circles_in_the_mouth_before_anything_else_and_never_below_the_layer(keys: tuple[str, ...]) -> None:
    base, top = stacked()
    own = profile(*BARE, *PINS, *keys)
    pins, first = plan_pins([base, top], own)[2], slice_part(top, own, [base]).layers[0]
    middles = pins[:, :2]
    for path, mm3 in zip(first.paths[:25], first.volumes_mm3[:25], strict=True):
        away = np.hypot(*(path.points[:, None] - middles).transpose(2, 0, 1)).min(axis=1)
        mm2 = mm3 / path.length_mm
        assert (path.kind, path.below_mm) == (Kind.GAP, (0.0, 0.0))
        assert away.max() <= 0.5 * (WIDE - 0.4) + 1e-9
        assert mm2 < 4.0 * 0.4**2  # Klipper's max_extrude_cross_section
        assert path.speed_mm_s * mm2 <= own.material.volumetric_limit_mm3_s + 1e-9
    assert first.volumes_mm3[:25].sum() == pytest.approx(removed_mm3([base, top], *keys), rel=0.01)


def test_a_part_too_slender_or_too_low_below_has_no_pins() -> None:
    assert len(plan_pins(cut(box(4.4, 30, 20), (UP, 10.0)), profile(*PINS))[2]) == 0
    assert len(plan_pins(cut(box(4.8, 30, 20), (UP, 10.0)), profile(*PINS))[2]) > 3
    assert len(plan_pins(cut(box(24, 24, 20), (UP, 4.0)), profile(*PINS))[2]) == 0


@pytest.mark.parametrize("most", [1, 8, 16])
def test_a_large_face_has_no_more_than_are_wanted_spread_all_over_it(most: int) -> None:
    parts = cut(box(60, 40, 30), (UP, 15.0))
    places = plan_pins(parts, profile(*PINS, f"process.most_pins={most}"))[2][:, :2]
    assert most / 2 <= len(places) <= most
    assert places.mean(axis=0) == pytest.approx([0.0, 0.0], abs=1e-6)
    assert most == 1 or np.ptp(places[:, 0]) > 25.0


def test_no_holes_without_the_setting() -> None:
    assert plan_pins(stacked(), profile()) == {}
    assert [len(fill_pins(pins, profile(), 0.2)) for pins in plan_pins(stacked(), profile()).values()] == []


@pytest.mark.parametrize(
    ("value", "message"),
    [
        ("process.pin_depth_mm=9", "process.pin_depth_mm is 9: it must be a number from 2 to 4"),
        ("process.pin_width_nozzles=1", "process.pin_width_nozzles is 1: it must be a number from 2 to 3"),
        (
            "process.pin_spacing_mm=1.5",
            "process.pin_spacing_mm is 1.5: pins of 2.5 nozzles of 0.4 mm with a wall round each are at least 1.9 mm apart",
        ),
        ("process.interlock=nails", 'process.interlock is "nails": '),
    ],
)
def test_pins_out_of_the_nozzle_s_reach_are_refused_in_a_sentence(value: str, message: str) -> None:
    with pytest.raises(ProfileError) as refused:
        profile(*PINS, value)
    assert message in str(refused.value)


def test_a_depth_alone_asks_for_grooves_as_it_did_before_there_was_a_choice() -> None:
    given_alone = [profile(f"process.interlock_mm={depth}").process.interlock for depth in (0.2, 0)]
    assert given_alone == ["grooves", "none"]
    assert profile("process.interlock_mm=0.2", *PINS).process.interlock == "pins"
    with pytest.raises(ProfileError, match="interlock_mm is 0 mm: interlock = grooves makes grooves deeper"):
        profile("process.interlock=grooves", "process.interlock_mm=0")


@pytest.mark.parametrize("kind", ["pins", "grooves"])
def test_one_part_alone_may_be_held_by_pins_or_grooves(kind: str) -> None:
    base, top = stacked()
    of_print = profile(*BARE)
    alone = with_part_settings(of_print, [PartSettings(part=2, process={"interlock": kind})])
    for_all = profile(*BARE, f"process.interlock={kind}")
    carved = [[sections.own[-1].area() for sections in sections_of([base, top], own)] for own in (alone, for_all, of_print)]
    assert carved[0] == carved[1]
    assert carved[0][0] < carved[2][0] - 1.0


def test_only_the_part_that_asks_for_pins_has_them() -> None:
    storeys = cut(box(24, 24, 30), (UP, 20.0), (UP, 10.0))
    only_third = with_part_settings(profile(*BARE), [PartSettings(part=3, process={"interlock": "pins"})])
    planned = plan_pins(storeys, only_third)
    assert (len(planned[2]), len(planned[3]) > 0) == (0, True)
