"""User zones in a search: regions without support, and faces around a point."""

import pytest
from manifold3d import Manifold

from mdp.decomposition import Decomposition
from mdp.mesh import Mesh
from mdp.search.plan_file import PlanFile, PlannedPart
from mdp.search.search import SearchRequest, cut_by_plan, decompose
from mdp.zone import AnyZone, Grown, Zone, Zones
from profiles.errors import PlanError
from profiles.profile import load
from tests import shapes

DEAR_SEAMS = load(machine="generic_ac", settings=("search.directions=200", "search.seam_mm=8", "search.hidden_seam_share=0.5"))
UNDER_AN_ARM = Grown((-12.0, 0.0, 30.0), 1.0)
ARM_BOX = Zone((-25.0, -10.0, 25.0), (-5.5, 10.0, 35.0))


def _search(mesh: Mesh, **zones: tuple[AnyZone, ...]) -> Decomposition:
    return decompose(mesh, "shape", DEAR_SEAMS, SearchRequest(plan=PlanFile("mine.toml", zones=Zones(**zones))))


@pytest.mark.parametrize("zone", [UNDER_AN_ARM, ARM_BOX])
def test_a_zone_without_support_is_cut_so_that_it_needs_none(zone: AnyZone) -> None:
    tee = shapes.tee()
    assert len(_search(tee).parts) == 1
    parts = _search(tee, no_support=(zone,)).parts
    hanging = [float(part.mesh.areas_mm2[part.needing & part.no_support.touched(part.mesh)].sum()) for part in parts]
    assert (len(parts) > 1, sum(hanging)) == (True, 0.0)


def test_area_in_a_zone_without_support_costs_a_hundredfold_and_is_reported_once() -> None:
    tee = shapes.tee()
    marked = cut_by_plan(
        tee, "shape", DEAR_SEAMS, SearchRequest(plan=PlanFile("mine.toml", zones=Zones(no_support=(UNDER_AN_ARM,))))
    )
    free = cut_by_plan(tee, "shape", DEAR_SEAMS, SearchRequest(plan=PlanFile("mine.toml")))
    assert marked.cost_mm2 - free.cost_mm2 == pytest.approx(99 * 150.0)
    assert marked.front[0].support_area_mm2 == pytest.approx(free.front[0].support_area_mm2)
    assert marked.residual_area_mm2 == free.residual_area_mm2 == pytest.approx(300.0)


def test_a_bridge_marked_for_support_counts_as_needing_it() -> None:
    posts = Manifold.cube((6, 10, 15)) + Manifold.cube((6, 10, 15)).translate((10, 0, 0))
    gate = shapes.standing(posts + Manifold.cube((16, 10, 5)).translate((0, 0, 15)))
    under = Zone((-1.9, -9.0, 14.0), (1.9, 9.0, 16.0))
    marked = cut_by_plan(gate, "gate", DEAR_SEAMS, SearchRequest(plan=PlanFile("mine.toml", zones=Zones(support=(under,)))))
    free = cut_by_plan(gate, "gate", DEAR_SEAMS, SearchRequest(plan=PlanFile("mine.toml")))
    assert (free.residual_area_mm2, marked.residual_area_mm2) == (0.0, pytest.approx(4 * 10))


def test_no_plane_passes_through_the_faces_around_a_point_that_stay_whole() -> None:
    plan = PlanFile("mine.toml", parts=(PlannedPart((0.0, 0.0, 1.0), 35.0),), zones=Zones(keep=(Grown((-20.0, 0.0, 33.0), 1.0),)))
    with pytest.raises(PlanError, match=r"would pass through zone 1 of \[\[keep\]\], which stays whole"):
        cut_by_plan(shapes.tee(), "shape", DEAR_SEAMS, SearchRequest(plan=plan))


def test_a_point_far_from_the_model_is_refused_with_its_distance() -> None:
    plan = PlanFile("mine.toml", zones=Zones(no_seam=(ARM_BOX, Grown((0.0, 0.0, 52.5), 1.0))))
    told = r"^plan mine.toml: no_seam 2: point_mm is \[0, 0, 52.5\], 12.5 mm from shape: up to 1 is allowed$"
    with pytest.raises(PlanError, match=told):
        cut_by_plan(shapes.tee(), "shape", DEAR_SEAMS, SearchRequest(plan=plan))


def test_the_marks_of_a_model_are_found_on_its_parts() -> None:
    plan = PlanFile(
        "mine.toml", parts=(PlannedPart((0.0, 0.0, 1.0), 35.0),), zones=Zones(no_seam=(Grown((0.0, 5.0, 20.0), 1.0),))
    )
    parts = cut_by_plan(shapes.tee(), "shape", DEAR_SEAMS, SearchRequest(plan=plan)).parts
    areas = [float(part.mesh.areas_mm2[part.no_seam.touched(part.mesh)].sum()) for part in parts]
    assert areas == pytest.approx([300.0 + 200.0, 200.0])
