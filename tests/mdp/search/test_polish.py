"""Polish: a sequence of cuts made shorter and cheaper."""

import manifold3d as m3
import numpy as np
import pytest

from mdp.cost.symmetry import find_mirrors
from mdp.cut import cut, mesh_of, solid_of
from mdp.mesh import Floats
from mdp.overhang import risky_above, risky_upright
from mdp.plane import Plane
from mdp.ranking.node import Node
from mdp.search.polish import make_regular, polish
from mdp.search.problem import Problem
from mdp.search.search import SearchRequest, decompose
from profiles.profile import load
from tests import shapes

ANGLE_DEG = 20.0
ALONG_X = np.array([np.cos(np.radians(15.0)), 0.0, np.sin(np.radians(15.0))])


def _problem(*settings: str) -> Problem:
    """A tee whose undersides are safe only along directions less than 20 degrees above the horizon: one cut per side."""
    steep = (
        f"process.self_supporting_angle_deg={ANGLE_DEG}",
        "search.objective=risky",
        "search.clearance=false",
        "search.directions=200",
    )
    return Problem(shapes.tee(), load(settings=(*steep, *settings)))


def _after(problem: Problem, *planes: Plane) -> Node:
    node = problem.replay(problem.root, planes)
    assert node is not None
    return node


def _through(height_mm: float, x_mm: float, normal: Floats = ALONG_X) -> Plane:
    return Plane(normal, float(normal @ [x_mm, 0.0, height_mm]))


def test_a_plane_moves_to_where_less_stays_risky() -> None:
    problem = _problem("search.most_parts=2")
    far_out = _after(problem, _through(30.0, 9.0))
    better = polish(problem, far_out)
    assert far_out.cost_mm2 == pytest.approx(300.0 - 110.0, abs=1.0)
    assert better.cost_mm2 == pytest.approx(150.0, abs=3.0)
    assert len(better.cuts) == 1


def test_a_cut_that_saves_nothing_is_left_out() -> None:
    problem = _problem("search.most_parts=3")
    twice = _after(problem, _through(30.0, 12.0), _through(30.0, 5.2))
    once = polish(_problem("search.most_parts=2"), twice)
    assert len(twice.cuts) == 2
    assert len(once.cuts) == 1
    assert once.cost_mm2 <= twice.cost_mm2


def test_further_cuts_are_added_if_they_pay_off() -> None:
    problem = _problem("search.most_parts=4")
    one_side = _after(problem, _through(30.0, 5.2))
    both = polish(problem, one_side)
    assert len(both.cuts) == 2
    assert both.cost_mm2 < 10.0


@pytest.mark.parametrize("x_mm", [5.2, 7.0, 12.0])
def test_every_cut_of_the_result_leaves_one_standing_solid_and_the_cost_is_what_exact_cuts_leave(x_mm: float) -> None:
    problem = _problem()
    polished = polish(problem, _after(problem, _through(30.0, x_mm)))
    rest, risky_mm2 = solid_of(shapes.tee()), 0.0
    for base in (each.base for each in polished.cuts):
        above, rest = cut(rest, base)
        part = mesh_of(above)
        risky_mm2 += part.areas_mm2[risky_above(part, base, ANGLE_DEG)].sum()
        assert above.volume() > 1.0
        assert [piece.bounding_box()[2] for piece in rest.decompose()] == [0.0]
    remaining = mesh_of(rest)
    risky_mm2 += remaining.areas_mm2[risky_upright(remaining, ANGLE_DEG)].sum()
    assert len(polished.cuts) >= 1
    assert polished.cost_mm2 == pytest.approx(risky_mm2, abs=1e-6)


def test_a_time_limit_of_nothing_leaves_all_as_it_is() -> None:
    problem = _problem("search.time_limit_s=0")
    node = _after(problem, _through(30.0, 9.0))
    assert polish(problem, node).cost_mm2 == node.cost_mm2


def test_a_plane_almost_through_the_origin_is_refused_and_one_through_it_is_evaluated() -> None:
    problem = _problem()
    beside, through = Plane(ALONG_X, 1e-17), Plane(ALONG_X, 0.0)
    assert not problem.allowed(problem.root, beside)
    assert not problem.allowed(problem.root, through)  # it would cut at the build plate
    assert problem.allowed(problem.root, _through(30.0, 9.0))


def _leaning(x: float, y: float) -> Floats:
    """A unit normal some 15 degrees above the horizon."""
    normal = np.array([x, y, np.sin(np.radians(15.0))])
    return normal / np.linalg.norm(normal)


def test_nearly_symmetric_cuts_of_a_symmetric_model_become_symmetric() -> None:
    problem = _problem("search.objective=scar")
    askew = [_through(30.0, 5.5, _leaning(0.96, 0.05)), _through(30.0, -5.7, _leaning(-0.95, 0.02))]
    node = _after(problem, *askew)
    even = make_regular(problem, node, find_mirrors(problem.mesh))
    first, second = (cut.base for cut in even.cuts)
    assert second.normal == pytest.approx(first.normal * [-1.0, 1.0, 1.0])  # mirror images of each other across x
    assert second.offset_mm == pytest.approx(first.offset_mm)
    assert first.normal[1] == pytest.approx(0.0)  # and each symmetric across y
    assert even.cost_mm2 <= 1.01 * node.cost_mm2


def test_a_slightly_oblique_cut_is_aligned_with_flats_at_no_cost() -> None:
    problem = _problem("search.objective=scar")
    askew = np.array([0.98, 0.04, 0.3])
    node = _after(problem, _through(30.0, 9.0, askew / np.linalg.norm(askew)))
    along = make_regular(problem, node, [])
    assert along.cost_mm2 <= 1.01 * node.cost_mm2
    assert problem.flats.share_along(along.cuts[0].base.normal[None]) > problem.flats.share_along(node.cuts[0].base.normal[None])


def test_a_cut_near_a_neck_moves_to_the_neck() -> None:
    """A column of 20 mm that narrows to 10 mm at a height of 30 mm, cut askew 2 mm above that."""
    profile = [(0.0, 0.0), (10.0, 0.0), (10.0, 20.0), (5.0, 30.0), (10.0, 40.0), (10.0, 60.0), (0.0, 60.0)]
    waisted = mesh_of(m3.CrossSection([profile]).revolve(64))
    problem = Problem(waisted, load(settings=["search.clearance=false", "search.directions=200"]))
    askew = np.array([np.sin(np.radians(4.0)), 0.0, np.cos(np.radians(4.0))])
    node = _after(problem, _through(32.0, 0.0, askew))
    base = make_regular(problem, node, []).cuts[0].base
    assert base.offset_mm == pytest.approx(30.0, abs=0.1)
    assert base.normal == pytest.approx([0.0, 0.0, 1.0], abs=0.02)


def test_the_plane_at_a_concave_edge_costs_no_more_than_the_best_of_a_grid() -> None:
    """The round arm of a post is cut along the post, where the plane can lean about an end of the cut."""
    profile = load(settings=["search.directions=300"])
    problem, tried = Problem(shapes.branch(), profile), []
    for elevation_rad in np.radians([0.0, 3.0, 6.0, 9.0]):
        normal = np.array([np.cos(elevation_rad), 0.0, np.sin(elevation_rad)])
        nodes = [problem.replay(problem.root, [Plane(normal, offset_mm)]) for offset_mm in np.arange(-6.0, 6.0, 0.5)]
        tried += [node.cost_mm2 for node in nodes if node is not None]
    assert decompose(shapes.branch(), "branch", profile, SearchRequest(parts=2)).cost_mm2 <= min(tried)
