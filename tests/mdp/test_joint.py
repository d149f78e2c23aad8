"""Joints: breaking forces at the far end of the body on them, against textbook beams and sums over small squares."""

from collections.abc import Sequence

import manifold3d as m3
import numpy as np
import pytest
import shapely
from hypothesis import given, settings
from hypothesis import strategies as st

from mdp.cut import Solid, mesh_of
from mdp.decomposition import Part
from mdp.joint import Joint, flaw_of, joints_of, weakest_of
from mdp.mesh import Floats
from tests.slicer.hand import cut, profile

UP = (0.0, 0.0, 1.0)
STRENGTH_MPA = 12.0  # 20 MPa across layers, times 0.6 where the plastic below is cold
PROFILE = profile("material.interlayer_strength_mpa=20", "material.cold_weld_factor=0.6")


def joints(solid: Solid, *planes: tuple[Sequence[float], float]) -> tuple[Joint, ...]:
    return joints_of(cut(mesh_of(solid), *planes), PROFILE)


def upright(outline: Floats, height_mm: float) -> Solid:
    return m3.CrossSection([outline]).extrude(height_mm)


def test_a_post_breaks_at_the_force_of_the_beam_formula() -> None:
    (joint,) = joints(m3.Manifold.cube((4.0, 6.0, 40.0), True), (UP, -10.0))
    arm = np.hypot(30.0, np.hypot(2.0, 3.0))  # to a corner of the top
    modulus = 1.0 / np.hypot(6.0 / (6.0 * 4.0**2), 6.0 / (4.0 * 6.0**2))
    assert (joint.part, joint.area_mm2, joint.arm_mm) == (2, pytest.approx(24.0), pytest.approx(arm))
    assert joint.load_n == pytest.approx(STRENGTH_MPA * modulus / arm)
    assert joint.tension_n == pytest.approx(12.0 * 24.0)


def test_a_round_post() -> None:
    (joint,) = joints(m3.Manifold.cylinder(50.0, 5.0, 5.0, 720), (UP, 10.0))
    assert joint.load_n == pytest.approx(STRENGTH_MPA * np.pi * 5.0**3 / 4.0 / np.hypot(40.0, 5.0), rel=1e-3)


L_PROFILE = np.array([(0.0, 0.0), (12.0, 0.0), (12.0, 2.0), (3.0, 2.0), (3.0, 20.0), (0.0, 20.0)])


def test_an_l_against_small_squares_pushed_in_all_directions() -> None:
    (joint,) = joints(upright(L_PROFILE, 30.0), (UP, 5.0))
    x, y = np.meshgrid(np.arange(0.05, 12.0, 0.1), np.arange(0.05, 20.0, 0.1))
    places = np.stack([x, y], axis=-1)[(x < 3.0) | (y < 2.0)]
    middle = places.mean(axis=0)
    moments = 0.01 * ((places - middle).T @ (places - middle) + len(places) * 0.01 / 12.0 * np.eye(2))
    turns = np.pi * np.arange(3600) / 3600
    most = np.abs((L_PROFILE - middle) @ np.linalg.solve(moments, np.stack([np.cos(turns), np.sin(turns)]))).max()
    arm = np.hypot(25.0, np.linalg.norm(L_PROFILE - middle, axis=1).max())
    assert joint.arm_mm == pytest.approx(arm)
    assert joint.load_n == pytest.approx(STRENGTH_MPA / most / arm, rel=1e-5)


@settings(max_examples=15, deadline=None)
@given(st.lists(st.tuples(st.floats(3.0, 20.0), st.floats(0.02, 0.3)), min_size=5, max_size=12), st.floats(0.0, 60.0))
def test_area_and_arm_of_any_star_are_those_of_shapely_however_it_leans(star: list[tuple[float, float]], lean_deg: float) -> None:
    turns = np.cumsum([step for _, step in star]) / sum(step for _, step in star) * 2.0 * np.pi
    outline = np.array([r for r, _ in star])[:, None] * np.column_stack([np.cos(turns), np.sin(turns)])
    area = shapely.Polygon(outline)
    if not area.is_valid or area.area < 5.0:
        return
    solid, lean = upright(outline, 30.0).translate((0.0, 0.0, -5.0)), np.radians(lean_deg)
    leaning = solid.rotate((0.0, lean_deg, 0.0)) ^ m3.Manifold.cube((500.0, 500.0, 500.0), True)
    (joint,) = joints(leaning, ((np.sin(lean), 0.0, np.cos(lean)), 3.0))
    arm = np.hypot(22.0, np.linalg.norm(outline - np.array(area.centroid.coords[0]), axis=1).max())
    assert (joint.area_mm2, joint.arm_mm) == (pytest.approx(area.area, rel=1e-6), pytest.approx(arm, rel=1e-6))


def test_a_tower_in_three_parts_hangs_on_its_lowest_joint() -> None:
    tower = m3.Manifold.cube((10.0, 10.0, 60.0))
    low, high = joints(tower, (UP, 40.0), (UP, 10.0))
    assert (low.part, high.part) == (2, 3)
    assert (low.arm_mm, high.arm_mm) == (
        pytest.approx(np.hypot(50.0, np.hypot(5, 5))),
        pytest.approx(np.hypot(20.0, np.hypot(5, 5))),
    )
    assert weakest_of((low, high)) is low


def test_a_part_on_two_legs_has_the_contact_area_of_both() -> None:
    """The roof stands on both legs, so each leg alone holds only itself."""
    legs = m3.Manifold.cube((4.0, 4.0, 24.0)) + m3.Manifold.cube((4.0, 4.0, 24.0)).translate((30.0, 0.0, 0.0))
    table = legs + m3.Manifold.cube((34.0, 4.0, 10.0)).translate((0.0, 0.0, 24.0)) + m3.Manifold.cube((34.0, 4.0, 2.0))
    leg, roof = joints(table, (UP, 24.0), (UP, 10.0))
    assert leg.arm_mm == pytest.approx(np.hypot(14.0, np.hypot(2, 2)))
    assert (leg.area_mm2, roof.area_mm2) == (pytest.approx(32.0), pytest.approx(32.0))


def test_two_contact_pieces_have_the_weaker_strength_and_both_areas() -> None:
    posts = m3.Manifold.cube((40.0, 8.0, 5.0)) + m3.Manifold.cube((8.0, 8.0, 30.0))
    (joint,) = joints(posts + m3.Manifold.cube((3.0, 3.0, 30.0)).translate((30.0, 0.0, 0.0)), (UP, 10.0))
    assert joint.area_mm2 == pytest.approx(64.0 + 9.0)
    assert joint.tension_n == pytest.approx(STRENGTH_MPA * 9.0)
    assert joint.load_n == pytest.approx(STRENGTH_MPA * (27.0 / 6.0 / np.sqrt(2.0)) / np.hypot(20.0, np.hypot(1.5, 1.5)))


def test_one_piece_has_no_joint() -> None:
    parts: list[Part] = cut(mesh_of(m3.Manifold.cube((5.0, 5.0, 5.0))))
    assert joints_of(parts, PROFILE) == ()
    assert weakest_of(()) is None


def sound(solid: Solid, *planes: tuple[Sequence[float], float], **search: float) -> bool:
    own = PROFILE.model_copy(update={"search": PROFILE.search.model_copy(update=search)})
    mesh = mesh_of(solid)
    return not flaw_of(mesh, cut(mesh, *planes), own)


def test_parts_are_sound_if_their_weakest_joint_bears_the_nozzle_with_the_safety_factor() -> None:
    post, plane = m3.Manifold.cube((4.0, 6.0, 40.0), True), (UP, -10.0)
    (joint,) = joints(post, plane)
    for push_n, safety, holds in ((0.99, 1.0, True), (1.01, 1.0, False), (0.5, 1.9, True), (0.5, 2.1, False)):
        assert sound(post, plane, nozzle_load_n=push_n * joint.load_n, strength_safety=safety) is holds


@pytest.mark.parametrize(("side_mm", "holds"), [(8.0, True), (18.4, True), (18.6, False), (40.0, False)])
def test_a_cut_through_more_than_15_percent_of_the_square_of_the_diameter_is_not_sound(side_mm: float, holds: bool) -> None:
    """A square of side s through a post of 40 mm: s^2 = 0.15 (2 s^2 + 1600) at 18.5 mm."""
    assert sound(m3.Manifold.cube((side_mm, side_mm, 40.0), True), (UP, 0.0)) is holds


@pytest.mark.parametrize(("height_mm", "holds"), [(5.9, False), (6.1, True)])
def test_a_first_part_of_less_than_three_twentieths_of_the_volume_is_no_foot(height_mm: float, holds: bool) -> None:
    assert sound(m3.Manifold.cube((10.0, 10.0, 40.0)), (UP, height_mm)) is holds


def test_the_papers_terms_know_no_unsound_parts() -> None:
    assert sound(m3.Manifold.cube((40.0, 40.0, 40.0), True), (UP, 0.0), seam_mm=0.0)


def test_the_share_of_the_first_part_refers_to_the_model_without_cuts_by_hand() -> None:
    mesh = mesh_of(m3.Manifold.cube((10.0, 10.0, 100.0)))
    parts = cut(mesh, (UP, 20.0), (UP, 5.0))  # 5 of 20 mm, and of 100 mm in all
    assert [not flaw_of(mesh, parts, PROFILE, by_hand) for by_hand in (0, 1)] == [False, True]


def test_a_cut_by_hand_is_not_tested_but_other_cuts_are() -> None:
    mesh = mesh_of(m3.Manifold.cube((40.0, 40.0, 40.0), True))
    parts = cut(mesh, (UP, 10.0), (UP, -10.0))
    assert [not flaw_of(mesh, parts, PROFILE, by_hand) for by_hand in (0, 1, 2)] == [False, False, True]


def test_a_flaw_names_the_part_and_what_is_wrong_with_it() -> None:
    mesh = mesh_of(m3.Manifold.cube((40.0, 40.0, 40.0), True))
    assert flaw_of(mesh, cut(mesh, (UP, 0.0)), PROFILE) == "the cut below part 2 surrounds the whole model"
    assert flaw_of(mesh, cut(mesh, (UP, -16.0)), PROFILE) == "the first part is too small to carry the others"
