"""Cuts that separate single limbs: found by the search, kept in plans, made by the user, and refused if the head would hit
standing plastic."""

from dataclasses import replace
from functools import cache
from pathlib import Path

import manifold3d as m3
import numpy as np
import pytest

from mdp.cost.symmetry import find_mirrors
from mdp.cut import solid_of
from mdp.decomposition import Decomposition
from mdp.mesh import Mesh
from mdp.search.plan_file import PlanFile, PlannedPart, plan_of, planned_parts
from mdp.search.plan_reading import read_plan
from mdp.search.plan_writing import plan_text
from mdp.search.polish import make_regular
from mdp.search.problem import Problem
from mdp.search.search import SearchRequest, cut_by_plan, decompose
from mdp.search.trial import Trials
from profiles.errors import PlanError
from profiles.profile import Profile, load
from tests import shapes
from tests.limbs import limb

ALONG = (0.84, 0.0, (1.0 - 0.84**2) ** 0.5)
TIP = (27.0, 0.0, 54.0)  # at the end of the bar
BAR = PlannedPart(ALONG, 38.0, limbs_mm=(TIP,))  # the plane leaves the post above its foot


def _profile(**search: object) -> Profile:
    profile = load(settings=["search.directions=200"])
    return profile.model_copy(update={"search": profile.search.model_copy(update=search)})


def _by_hand(mesh: Mesh, part: PlannedPart) -> Decomposition:
    return cut_by_plan(mesh, "bar", _profile(), SearchRequest(plan=PlanFile("plan.toml", parts=(part,))))


@cache
def _searched() -> Decomposition:
    """The search's decomposition of the bar beside the tower, computed once for all tests."""
    return decompose(shapes.bar_beside_a_tower(), "bar", _profile())


def test_a_bar_beside_a_tower_is_cut_off_alone_if_no_half_space_is_worth_it() -> None:
    whole, limbs = decompose(shapes.bar_beside_a_tower(), "bar", _profile(single_limb=False)), _searched()
    assert len(whole.parts) == 1
    assert [part.base.limbs_mm is None for part in limbs.parts] == [True, False]
    assert limbs.cost_mm2 < 0.95 * whole.cost_mm2
    assert limbs.parts[1].mesh.bounds_mm[1, 0] == pytest.approx(27.0)
    assert limbs.parts[0].mesh.bounds_mm[1, 2] == pytest.approx(75.0)  # the tower remains


@pytest.mark.parametrize("terms", [{"objective": "risky"}, {"method": "published"}])
def test_the_papers_terms_know_no_limbs(terms: dict[str, object]) -> None:
    found = decompose(shapes.bar_beside_a_tower(), "bar", _profile(**terms))
    assert all(part.base.limbs_mm is None for part in found.parts)


def test_a_plan_brings_back_the_same_limb(tmp_path: Path) -> None:
    mesh, found = shapes.bar_beside_a_tower(), _searched()
    (tmp_path / "plan.toml").write_text(plan_text(plan_of(found)))
    plan = read_plan(tmp_path / "plan.toml")
    again = cut_by_plan(mesh, "bar", _profile(), SearchRequest(plan=plan))
    assert again.cost_mm2 == pytest.approx(found.cost_mm2)
    assert [part.volume_mm3 for part in again.parts] == pytest.approx([part.volume_mm3 for part in found.parts])
    assert list(map(planned_parts, plan.front)) == list(map(planned_parts, plan_of(again).front))


def test_a_limb_by_hand_is_the_piece_above_the_plane_nearest_to_its_point() -> None:
    mesh = shapes.bar_beside_a_tower()
    on_its_end = _by_hand(mesh, BAR).parts[1]
    on_its_side = _by_hand(mesh, replace(BAR, limbs_mm=((20.0, -6.0, 52.0),))).parts[1]
    assert on_its_end.volume_mm3 == pytest.approx(on_its_side.volume_mm3)
    assert on_its_end.mesh.bounds_mm[0, 2] == pytest.approx(48.0)


def test_a_point_outside_every_piece_is_refused_with_its_distance() -> None:
    with pytest.raises(PlanError, match="no piece above its plane lies at 27, 0, 70: the nearest one is 10 mm away"):
        _by_hand(shapes.bar_beside_a_tower(), replace(BAR, limbs_mm=((27.0, 0.0, 70.0),)))


def test_a_point_far_from_the_only_piece_above_the_plane_is_refused_too() -> None:
    above_the_bar = PlannedPart((0.0, 0.0, 1.0), 60.0, limbs_mm=((-900.0, 500.0, 700.0),))
    with pytest.raises(PlanError, match="no piece above its plane lies at -900, 500, 700"):
        _by_hand(shapes.bar_beside_a_tower(), above_the_bar)


def test_a_limb_that_is_cut_off_already_is_not_taken_for_another_one() -> None:
    twice = PlanFile("plan.toml", parts=(BAR, BAR))
    with pytest.raises(PlanError, match="part 2 cannot be cut off: no piece above its plane lies at 27, 0, 54"):
        cut_by_plan(shapes.bar_beside_a_tower(), "bar", _profile(), SearchRequest(plan=twice))


def test_a_trial_refuses_a_limb_that_would_leave_something_in_the_air() -> None:
    frame = m3.Manifold.cube((80, 40, 4)) + m3.Manifold.cube((8, 8, 40)) + m3.Manifold.cube((8, 8, 40)).translate((72, 0, 0))
    frame += m3.Manifold.cube((30, 8, 8)).translate((0, 0, 34)) + m3.Manifold.cube((8, 8, 10)).translate((22, 0, 25))
    hook = shapes.from_manifold(frame)  # the end of the hook hangs below the plane
    plane = PlannedPart((0.0, 0.0, 1.0), 30.0, limbs_mm=((0.0, 0.0, 42.0),)).plane
    assert plane is not None
    trial = Trials(hook, _profile(nozzle_load_n=0.0, fragile_mm=0.0)).attempt([plane])
    assert "would not stand on the build plate" in trial.rejected


def test_a_limb_too_near_to_a_tower_is_refused_and_the_place_of_the_tower_is_shown() -> None:
    mesh = shapes.bar_beside_a_tower(gap=2.0)
    with pytest.raises(PlanError, match="the head would meet the print beside it"):
        _by_hand(mesh, BAR)
    trial = Trials(mesh, _profile()).attempt([plane for plane in (BAR.plane,) if plane is not None])
    assert trial.obstacle is not None
    assert np.array(trial.obstacle.places_mm)[:, 1].min() > 7.9


def test_a_limb_may_be_cut_off_in_the_plane_of_the_slab_under_the_others() -> None:
    mesh = shapes.bar_beside_a_tower(gap=27.0)
    at_the_plate = PlannedPart((0.0, 0.0, 1.0), 4.0, limbs_mm=((0.0, 33.0, 75.0),))
    anything = _profile(fragile_mm=0.0, clearance=False)
    parts = cut_by_plan(mesh, "bar", anything, SearchRequest(plan=PlanFile("plan.toml", parts=(at_the_plate,)))).parts
    assert parts[1].volume_mm3 == pytest.approx(12 * 12 * 71)


def test_a_limb_that_begins_too_near_to_the_table_is_refused_with_the_head_that_would_touch_it() -> None:
    plate = m3.Manifold.cube((80, 80, 4), True).translate((0, 0, 2)) + m3.Manifold.cube((12, 12, 20)).translate((-25, -6, 0))
    low = plate + m3.Manifold.cube((41, 12, 8)).translate((-14, -6, 6)) + m3.Manifold.cube((6, 6, 40)).translate((20, 34, 0))
    bar = PlannedPart(ALONG, 0.0, limbs_mm=((27.0, 0.0, 10.0),)).plane
    assert bar is not None
    trial = Trials(shapes.from_manifold(low), _profile()).attempt([bar])
    assert "would meet the table" in trial.rejected
    assert trial.obstacle is not None
    assert trial.obstacle.touch is not None


def test_a_limb_out_of_reach_is_refused_for_that_and_not_for_its_neighbours() -> None:
    profile, limits = _profile(), {"limits_mm": (-20.0, 20.0)}
    axes = {axis: getattr(profile.machine, axis).model_copy(update=limits) for axis in ("x", "y")}
    narrow = profile.model_copy(update={"machine": profile.machine.model_copy(update=axes)})
    with pytest.raises(PlanError, match="would go from"):
        cut_by_plan(shapes.bar_beside_a_tower(), "bar", narrow, SearchRequest(plan=PlanFile("p", parts=(BAR,))))


def test_a_point_at_the_foot_of_a_limb_means_that_limb() -> None:
    foot = PlannedPart((0.0, 0.0, 1.0), 40.0, limbs_mm=((-6.0, 33.0, 40.0),))
    anything = _profile(fragile_mm=0.0, clearance=False)
    parts = cut_by_plan(
        shapes.bar_beside_a_tower(gap=27.0), "bar", anything, SearchRequest(plan=PlanFile("p", parts=(foot,)))
    ).parts
    assert parts[1].volume_mm3 == pytest.approx(12 * 12 * 35)


def test_a_limb_with_many_voids_is_one_limb() -> None:
    voids = [m3.Manifold.cube((2, 2, 2)).translate((-1, 38, 20 + 7 * k)) for k in range(7)]
    hollow = shapes.from_manifold(solid_of(shapes.bar_beside_a_tower(gap=27.0)) - m3.Manifold.batch_boolean(voids, m3.OpType.Add))
    tower = PlannedPart((0.0, 0.0, 1.0), 10.0, limbs_mm=((0.0, 39.0, 75.0),))
    anything = _profile(fragile_mm=0.0, clearance=False, nozzle_load_n=0.0)
    parts = cut_by_plan(hollow, "bar", anything, SearchRequest(plan=PlanFile("p", parts=(tower,)))).parts
    assert parts[1].volume_mm3 == pytest.approx(12 * 12 * 65 - 7 * 8)


def test_a_limb_with_a_separate_end_has_its_own_figures() -> None:
    trials = Trials(shapes.bar_beside_a_tower(), _profile(nozzle_load_n=0.0, fragile_mm=0.0))
    rest, end = replace(BAR, limbs_mm=((14.0, 0.0, 50.0),)).plane, replace(BAR, offset_mm=48.0, limbs_mm=()).plane
    assert rest is not None
    assert end is not None
    trial = trials.attempt([rest, end])
    assert trial.rejected == ""
    assert [part is not None and part.volume_mm3 > 500.0 and part.rim_mm > 20.0 for part in trial.parts] == [True, True]


@pytest.mark.parametrize("limits", [{"most_parts": 1}, {"time_limit_s": 0.0}])
def test_no_limb_is_looked_for_where_no_cut_may_be_made(limits: dict[str, object]) -> None:
    assert len(decompose(shapes.bar_beside_a_tower(), "bar", _profile(**limits)).parts) == 1


def test_a_plan_with_limbs_but_without_a_plane_is_refused(tmp_path: Path) -> None:
    (tmp_path / "plan.toml").write_text("version = 1\n[[part]]\n[[part]]\nnormal = [0, 0, 1]\nlimbs_mm = [[0, 0, 1]]\n")
    with pytest.raises(PlanError, match="part 2: limbs_mm needs both normal and offset_mm"):
        read_plan(tmp_path / "plan.toml")


@pytest.mark.parametrize(
    "limbs", ["3", "[]", "[[1, 2]]", "[[0, 0, 1], [0, 0, 1], [0, 0, 1], [0, 0, 1], [0, 0, 1], [0, 0, 1], [0, 0, 1]]"]
)
def test_invalid_points_are_refused_with_the_expected_form(tmp_path: Path, limbs: str) -> None:
    text = f"version = 1\n[[part]]\n[[part]]\nnormal = [0, 0, 1]\noffset_mm = 4\nlimbs_mm = {limbs}\n"
    (tmp_path / "plan.toml").write_text(text)
    with pytest.raises(PlanError, match="part 2: limbs_mm"):
        read_plan(tmp_path / "plan.toml")


def test_a_limb_moved_by_a_trial_keeps_its_point_and_its_figures_are_those_of_the_limb() -> None:
    trials = Trials(shapes.bar_beside_a_tower(), _profile())
    plane = BAR.plane
    assert plane is not None
    trial = trials.attempt([plane])
    assert trial.rejected == ""
    forecast = trial.parts[0]
    assert forecast is not None
    assert forecast.volume_mm3 == pytest.approx(_by_hand(shapes.bar_beside_a_tower(), BAR).parts[1].volume_mm3)
    nearest = trials.nearest([replace(plane, offset_mm=plane.offset_mm - 12.0)], 2)
    assert nearest is not None
    assert nearest.limbs_mm is not None


def test_limbs_that_are_nearly_each_other_s_mirror_image_become_it() -> None:
    solid = m3.Manifold.cube((110.0, 30.0, 4.0), True).translate((0.0, 0.0, 2.0))
    for x in (-35.0, 0.0, 35.0):  # with 33 sides, no vertex is the mirror image of another
        post, cap = m3.Manifold.cylinder(20.0, 4.0, 4.0, 33), m3.Manifold.cylinder(4.0, 9.0, 9.0, 33)
        solid += post.translate((x, 0.0, 2.0)) + cap.translate((x, 0.0, 20.0))
    mesh = shapes.from_manifold(solid)
    problem = Problem(mesh, _profile())
    planes = [limb(mesh, [(x, 0.0, 24.0)], (0.0, 0.0, z)) for x, z in ((-35.0, 10.0), (35.0, 10.3))]
    node = problem.replay(problem.root, planes)
    assert node is not None
    even = make_regular(problem, node, find_mirrors(mesh))
    assert [cut.base.offset_mm for cut in even.cuts] == [10.0, 10.0]
    assert even.remainder.mesh.volume_mm3 == pytest.approx(node.remainder.mesh.volume_mm3, abs=20.0)
