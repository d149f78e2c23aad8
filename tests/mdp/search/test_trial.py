"""Trial planes of the user: figures equal to those of real cuts, whatever was tried before, and the reason of each refusal."""

import manifold3d as m3
import numpy as np
import pytest

from mdp.mesh import Mesh
from mdp.overhang import UP
from mdp.plane import Plane
from mdp.search.plan_file import PlanFile, PlannedPart
from mdp.search.search import SearchRequest, cut_by_plan
from mdp.search.trial import Trials
from mdp.zone import Zone, Zones
from profiles.messages import terminal_words
from profiles.profile import load
from tests.shapes import box, hollow_tee, standing, tee

PROFILE = load(settings=["search.directions=60"])
ARMS = (Plane(np.array([1.0, 0.0, 0.0]), 8.0), Plane(np.array([-1.0, 0.0, 0.0]), 8.0))


def trials(mesh: Mesh) -> Trials:
    return Trials(mesh, PROFILE)


def test_figures_are_those_of_the_cuts_themselves() -> None:
    mesh, tried = tee(), trials(tee()).attempt(ARMS)
    plan = PlanFile("", parts=tuple(PlannedPart(tuple(plane.normal.tolist()), plane.offset_mm) for plane in ARMS))
    cut = cut_by_plan(mesh, "tee", PROFILE, SearchRequest(plan=plan))
    assert [part.volume_mm3 for part in tried.parts if part] == pytest.approx([part.volume_mm3 for part in cut.parts[1:]])
    assert tried.seam_mm == pytest.approx(sum(part.rim_mm for part in tried.parts if part)) == pytest.approx(cut.seam_mm)
    assert cut.chosen is not None
    assert tried.support_area_mm2 == pytest.approx(cut.chosen.support_area_mm2)


def test_figures_on_a_pedestal_are_those_of_the_cuts_too() -> None:
    lifted = PROFILE.model_copy(update={"search": PROFILE.search.model_copy(update={"pedestal_mm": 12.0})})
    low = Plane(np.array([0.0, 0.0, 1.0]), 16.0)  # 4 mm above the pedestal
    tried = Trials(tee(), lifted).attempt((low,))
    cut = cut_by_plan(tee(), "tee", lifted, SearchRequest(plan=PlanFile("", parts=(PlannedPart((0.0, 0.0, 1.0), 16.0),))))
    assert [part.volume_mm3 for part in tried.parts if part] == pytest.approx([100.0 * 26.0 + 400.0 * 10.0])
    assert tried.seam_mm == pytest.approx(cut.seam_mm) == pytest.approx(40.0)
    assert cut.chosen is not None
    assert tried.support_area_mm2 == pytest.approx(cut.chosen.support_area_mm2) == pytest.approx(300.0)


def test_intersecting_cuts_have_their_own_figures() -> None:
    leaning = [((1.0, 0.0, 0.5), 12.0), ((-1.0, 0.0, 0.8), 16.0), ((0.0, 0.3, 1.0), 24.0)]
    planes = [Plane(np.array(normal) / np.linalg.norm(normal), offset_mm) for normal, offset_mm in leaning]
    tried = trials(tee()).attempt(planes)
    plan = PlanFile("", parts=tuple(PlannedPart(tuple(plane.normal.tolist()), plane.offset_mm) for plane in planes))
    cut = cut_by_plan(tee(), "tee", PROFILE, SearchRequest(plan=plan))
    assert [part.volume_mm3 for part in tried.parts if part] == pytest.approx([part.volume_mm3 for part in cut.parts[1:]])
    assert [part.support_mm2 for part in tried.parts if part] == pytest.approx([part.risky_area_mm2 for part in cut.parts[1:]])
    assert (tried.support_area_mm2, tried.seam_mm) == pytest.approx((cut.residual_area_mm2, cut.seam_mm))


def test_figures_come_at_once_and_what_a_later_cut_may_forbid_when_there_is_time() -> None:
    floating = Plane(np.array([0.0, 0.0, 1.0]), 12.0)
    moved = trials(tee())
    at_once = moved.attempt((floating, ARMS[1]), most_cuts=0)
    assert (at_once.unchecked, at_once.rejected, moved.attempt((floating, ARMS[1])).unchecked) == (1, "", 0)
    assert at_once.parts == moved.attempt((floating, ARMS[1])).parts


def test_earlier_trials_change_nothing() -> None:
    moving, moved = trials(tee()), [(Plane(ARMS[0].normal, 8.0 + 0.25 * k), ARMS[1]) for k in (3, 1, 4, 1, 5)]
    assert [moving.attempt(planes) for planes in moved] == [trials(tee()).attempt(planes) for planes in moved]
    assert moving.attempt(ARMS[::-1]) == trials(tee()).attempt(ARMS[::-1])


def test_the_plane_that_cannot_be_cut_is_named_with_the_reason() -> None:
    outside = Plane(np.array([1.0, 0.0, 0.0]), 25.0)
    tried = trials(tee()).attempt((outside, ARMS[1]))
    assert (tried.rejected_part, tried.support_area_mm2) == (2, None)
    assert "misses the model" in tried.rejected
    assert tried.parts[0] is None
    assert tried.parts[1] is not None


def test_a_plane_that_misses_a_model_too_tall_for_the_machine_marks_nothing() -> None:
    below = Plane(np.array([0.0, 0.0, 1.0]), -5.0)
    tried = trials(box(10.0, 10.0, 900.0)).attempt((below,))
    assert ("misses the model" in tried.rejected, tried.obstacle) == (True, None)


def test_no_plane_at_all_is_the_model_in_one_piece() -> None:
    tried = trials(tee()).attempt(())
    assert (tried.parts, tried.rejected, tried.seam_mm) == ((), "", 0.0)
    assert tried.support_area_mm2 == pytest.approx(300.0)  # the undersides of both arms, 15 by 10 mm


@pytest.mark.parametrize(("lean_deg", "edge_deg"), [(0.0, 90.0), (30.0, 60.0), (60.0, 30.0)])
def test_the_edge_of_a_cut_is_as_sharp_as_it_leans_against_the_wall(lean_deg: float, edge_deg: float) -> None:
    lean = np.radians(lean_deg)
    plane = Plane(np.array([np.sin(lean), 0.0, np.cos(lean)]), 50.0 * float(np.cos(lean)))
    part = trials(box(10.0, 10.0, 100.0)).attempt([plane]).parts[0]
    assert part is not None
    assert part.edge_deg == pytest.approx(edge_deg)


def test_a_collision_of_head_and_table_is_shown_at_the_lowest_point_of_the_part() -> None:
    leaning, machine = Plane(np.array([0.8, 0.0, 0.6]), 12.0), PROFILE.machine
    tried = trials(box()).attempt((leaning,))
    assert tried.obstacle is not None
    touch = tried.obstacle.touch
    assert touch is not None
    assert f"the head's {touch.body} would meet the table" in tried.rejected
    assert np.array(touch.rotation) @ leaning.normal == pytest.approx([0.0, 0.0, 1.0], abs=1e-9)
    assert touch.tip_mm[::2] == pytest.approx((10.0, 4.0 / 0.6))  # where the plane leaves the wall
    silhouette = [touch.tip_mm[2] + height * 0.6 - radius * 0.8 for radius, height in machine.head.silhouette_mm]
    assert min(silhouette) < machine.clearance_mm
    assert touch.touched_mm[2] == 0.0


def test_a_floating_piece_is_marked_at_its_lowest_point() -> None:
    tried = trials(tee()).attempt((Plane(np.array([0.8, 0.0, 0.6]), 12.0),))
    assert "would not stand on the build plate" in tried.rejected
    assert tried.obstacle is not None
    ((x, _, z),) = tried.obstacle.places_mm
    assert (x, z) == (-20.0, 30.0)


def test_a_void_is_not_marked_as_floating() -> None:
    tried = trials(hollow_tee()).attempt((Plane(np.array([0.8, 0.0, 0.6]), 13.0),))  # the void at -x reaches up to 12.6 mm
    assert "would not stand on the build plate" in tried.rejected
    assert tried.obstacle is not None
    assert [place[2] for place in tried.obstacle.places_mm] == [30.0]


def test_the_neck_is_that_of_what_the_parts_printed_later_leave() -> None:
    tried, thick = trials(tee()), Plane(np.array([0.0, 0.0, 1.0]), 29.0)
    assert tried.neck((thick, ARMS[0], ARMS[1]), 2, 5.0) is None
    assert tried.neck((Plane(np.array([1.0, 0.0, 0.0]), 50.0), thick), 2, 5.0) is None


def test_a_sliver_is_marked_on_the_surface_that_it_would_be_cut_off() -> None:
    tried = trials(tee()).attempt((Plane(np.array([0.0, 0.0, 1.0]), 39.8),))
    assert "a sliver 0.2 mm thin" in terminal_words(tried.rejected)
    assert tried.obstacle is not None
    assert tried.obstacle.places_mm[0][2] == 40.0


@pytest.mark.parametrize(("wanted_mm", "nearest_mm"), [(30.0, 29.9), (0.05, 0.3), (60.0, 39.6), (20.0, 20.0)])
def test_a_plane_is_shifted_to_the_nearest_place_where_it_can_be_cut(wanted_mm: float, nearest_mm: float) -> None:
    up = np.array([0.0, 0.0, 1.0])
    nearest = trials(tee()).nearest([Plane(up, wanted_mm)], 2)
    assert nearest is not None
    assert (nearest.normal.tolist(), nearest.offset_mm) == ([0.0, 0.0, 1.0], pytest.approx(nearest_mm))


@pytest.mark.parametrize("wanted_mm", [23.0, 20.0, 18.0])
def test_a_plane_dragged_past_its_neighbour_is_placed_just_behind_it(wanted_mm: float) -> None:
    up = np.array([0.0, 0.0, 1.0])
    nearest = trials(box(10.0, 10.0, 100.0)).nearest((Plane(up, 24.0), Plane(up, wanted_mm)), 3)
    assert nearest is not None
    assert (nearest.normal.tolist(), 24.0 < nearest.offset_mm < 24.6) == ([0.0, 0.0, 1.0], True)


def test_the_nearest_plane_is_tilted_if_no_level_one_can_be_cut() -> None:
    outline = [(0, 0), (40, 0), *((40 - 0.5 * k, 0.25 * (k + step)) for k in range(40) for step in (0, 1)), (0, 10)]
    stairs = standing(m3.Manifold.extrude(m3.CrossSection([outline]), 20).rotate((90, 0, 0)))
    tried = Trials(stairs, PROFILE)  # no step is as high as search.fragile_mm
    level = Plane(np.array([0.0, 0.0, 1.0]), 5.0)
    nearest = tried.nearest([level], 2)
    assert nearest is not None
    assert nearest.normal[2] < 1.0
    assert tried.attempt([nearest]).rejected == ""


def test_no_position_helps_if_other_planes_are_refused() -> None:
    outside = Plane(np.array([1.0, 0.0, 0.0]), 25.0)
    assert trials(tee()).nearest((Plane(np.array([0.0, 0.0, 1.0]), 30.0), outside), 2) is None


def test_a_disregarded_plane_below_the_model_leaves_it_to_the_other_planes() -> None:
    below = Plane(UP, -5.0)
    tried = trials(tee())
    tried.set_aside([below])
    assert tried.attempt((Plane(UP, 20.0), below)).rejected == ""


def test_a_disregarded_plane_is_still_cut_for_the_planes_after_it() -> None:
    plane, higher = Plane(UP, 20.0), Plane(UP, 27.0)
    kept = Trials(tee(), PROFILE, Zones(keep=(Zone((-2.0, -2.0, 26.0), (2.0, 2.0, 28.0)),)))
    assert (
        terminal_words(kept.attempt((plane, higher)).rejected)
        == "its plane would pass through zone 1 of [[keep]], which stays whole"
    )
    kept.set_aside([higher])
    tried, free = kept.attempt((plane, higher)), Trials(tee(), PROFILE).attempt((plane, higher))
    assert (tried.rejected, tried.parts) == ("", free.parts)
    kept.set_aside([])
    assert kept.attempt((plane, higher)).rejected_part == 3
