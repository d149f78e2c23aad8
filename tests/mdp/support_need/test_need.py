"""Faces that require support: bridges, arches, ledges and spikes of known size, under a mushroom's cap, on one core and two."""

import manifold3d as m3
import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from mdp.mesh import Mesh
from mdp.overhang import facing_down, risky_upright
from mdp.ranking.candidates import directions
from mdp.support_need.descent import ANCHOR_MM
from mdp.support_need.need import SupportNeed, needs_support
from mdp.support_need.patches import NEEDS_SUPPORT, UNSUPPORTABLE
from profiles.profile import load
from tests.shapes import standing

PROCESS = load().process
UP_DEG = 45.0
TURN = st.floats(0.0, 360.0)


def needing_mm2(solid: m3.Manifold) -> float:
    """Area that needs support upright on the build plate."""
    mesh = standing(solid)
    return float(mesh.areas_mm2[risky_upright(mesh, UP_DEG) & needs_support(mesh, PROCESS, True)].sum())


def block(x: float, y: float, z: float, at: tuple[float, float, float]) -> m3.Manifold:
    return m3.Manifold.cube((x, y, z), True).translate((at[0], at[1], at[2] + z / 2))


def bridge(length: float) -> m3.Manifold:
    """A deck 8 mm wide on two pillars."""
    pillars = [block(5, 8, 12, (side * (length + 5) / 2, 0, 0)) for side in (-1, 1)]
    return block(length + 10, 8, 3, (0, 0, 10)) + pillars[0] + pillars[1]


def drilled(diameter: float) -> m3.Manifold:
    """A block with a level hole through it."""
    return block(20, 20, 20, (0, 0, 0)) - m3.Manifold.cylinder(30, diameter / 2, -1, 64, True).rotate((90, 0, 0)).translate(
        (0, 0, 10)
    )


def ledge(depth: float) -> m3.Manifold:
    return block(10, 20, 20, (0, 0, 0)) + block(2 * depth, 20, 3, (5, 0, 12))


def hanging(piece: m3.Manifold) -> m3.Manifold:
    """A table with a body hanging from its top, 20 mm over the build plate; the top is thick and bridges nothing."""
    return (
        block(4, 4, 20, (-4.8, 0, 0)) + block(4, 4, 20, (4.8, 0, 0)) + block(13.6, 4, 3, (0, 0, 20)) + piece.translate((0, 0, 20))
    )


@pytest.mark.parametrize(("length", "area"), [(5.0, 0.0), (30.0, 0.0), (31.0, 248.0)])
def test_a_level_bridge_carries_itself_up_to_the_longest_span(length: float, area: float) -> None:
    assert PROCESS.bridge_longest_mm == 30.0
    assert needing_mm2(bridge(length)) == pytest.approx(area)


def test_a_deck_over_one_pillar_is_no_bridge() -> None:
    one_sided = bridge(5.0) - block(7, 10, 10, (5, 0, 0))
    assert needing_mm2(one_sided) == pytest.approx(5.0 * 8 + 5 * 8, rel=0.1)


@pytest.mark.parametrize(("diameter", "needs"), [(4.0, False), (8.0, False), (12.0, True)])
def test_the_crown_of_a_small_level_hole_carries_itself(diameter: float, needs: bool) -> None:
    assert (needing_mm2(drilled(diameter)) > 0.0) == needs


@pytest.mark.parametrize(("depth", "area"), [(0.8, 0.0), (5.0, 100.0), (10.0, 200.0)])
def test_a_ledge_needs_support_unless_it_is_narrower_than_two_lines(depth: float, area: float) -> None:
    assert needing_mm2(ledge(depth)) == pytest.approx(area)


def test_a_section_that_begins_in_mid_air_needs_support_at_any_width() -> None:
    spike = m3.Manifold.cylinder(8, 0.7, 0.7, 24).translate((0, 0, -8))
    assert needing_mm2(hanging(spike)) == pytest.approx(np.pi * 0.49, rel=0.02)


def test_a_ridge_that_hangs_in_the_air_is_no_bank() -> None:
    shallow, deep = block(1, 4, 0.6, (0, 0, -0.5)), block(1, 4, 2.1, (0, 0, -2.0))
    assert needing_mm2(hanging(shallow)) == pytest.approx(5.6 * 4)
    assert needing_mm2(hanging(deep)) == pytest.approx(1.0 * 4)


@settings(max_examples=15)
@given(st.floats(0.1, 3.0), TURN)
def test_a_ridge_is_an_anchor_where_it_extends_down_a_millimetre(depth: float, turn: float) -> None:
    assume(abs(depth - ANCHOR_MM) > 0.01)
    ridge = hanging(block(1, 4, depth + 0.1, (0, 0, -depth)))
    assert needing_mm2(ridge.rotate((0, 0, turn))) == pytest.approx(5.6 * 4 if depth < 1.0 else 1.0 * 4)


def test_a_very_low_deck_is_anchored_where_its_pillars_are_on_the_build_plate() -> None:
    low = m3.Manifold.cube((20, 8, 3), True).translate((0, 0, 1.5)) - m3.Manifold.cube((10, 9, 0.8), True).translate((0, 0, 0.4))
    assert needing_mm2(low) == 0.0


def test_two_undersides_that_only_rest_on_each_other_both_need_support() -> None:
    arm = block(10, 8, 20, (0, 0, 0)) + block(12, 8, 3, (11, 0, 12)) + block(2, 8, 1, (16, 0, 11.5))
    assert needing_mm2(arm) == pytest.approx(12.0 * 8)  # half a millimetre lower at the free end


@pytest.mark.parametrize(("side", "lean_deg", "area"), [(0.9, 0.0, 0.0), (1.1, 0.0, 1.21), (0.9, 40.0, 0.0), (1.1, 40.0, 1.58)])
def test_an_overhang_smaller_than_the_least_area_is_self_supporting(side: float, lean_deg: float, area: float) -> None:
    """A peg under a ceiling whose end is cut off at an angle."""
    assert PROCESS.support_least_mm2 == 1.0
    peg = block(side, side, 10, (0, 0, -8)) - block(9, 9, 9, (0, 0, -9)).rotate((lean_deg, 0, 0)).translate((0, 0, -4))
    assert needing_mm2(hanging(peg)) == pytest.approx(area, abs=0.01)


def test_a_sheet_with_nothing_at_its_rim_has_no_anchor() -> None:
    sheet = Mesh(
        np.array([(0, 0, 9), (0, 1.2, 9), (1.2, 1.2, 9), (1.2, 0, 9)], np.float64), np.array([(0, 1, 2), (0, 2, 3)], np.int32)
    )
    assert needs_support(sheet, PROCESS, True).tolist() == [True, True]


def mushroom() -> Mesh:
    """A stem under a cap with a nearly flat conical underside."""
    return standing(m3.Manifold.cylinder(20, 8, 8, 64) + m3.Manifold.cylinder(2, 8, 20, 64).translate((0, 0, 20)))


def test_a_mushrooms_cap_has_its_stem_beneath_it_on_one_side_and_air_on_the_other() -> None:
    mesh, lean = mushroom(), np.array([0.5, 0.0, np.sqrt(0.75)])
    classes = SupportNeed.of(mesh, PROCESS, 5.0).along(lean[None])[0]
    middles, cap = (
        mesh.vertices[mesh.faces].mean(axis=1),
        facing_down(mesh, lean, UP_DEG) & ~(mesh.vertices[mesh.faces, 2] < 1).any(axis=1),
    )
    near = cap & (np.abs(middles[:, 1]) < 5)
    assert set(classes[near & (middles[:, 0] > 8)]) == {NEEDS_SUPPORT}
    assert set(classes[near & (middles[:, 0] < -8)]) == {UNSUPPORTABLE}


def test_upright_the_build_plate_is_below_everything() -> None:
    mesh = mushroom()
    assert SupportNeed.of(mesh, PROCESS, 5.0).upright.all()


def test_one_core_and_two_give_the_same_classes(monkeypatch: pytest.MonkeyPatch) -> None:
    sampled, tables = directions(load().search), []
    for threads in (1, 2):
        monkeypatch.setattr("mdp.kernels.threads.THREADS", threads)
        tables.append(SupportNeed.of(standing(drilled(8.0)), PROCESS, 5.0).along(sampled))
    assert np.array_equal(*tables)
    assert np.array_equal(SupportNeed.of(standing(drilled(8.0)), PROCESS, 5.0).along(sampled[7:8])[0], tables[0][7])
