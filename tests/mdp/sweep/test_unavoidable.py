import numpy as np
import pytest

from mdp.overhang import UP, risky_upright, threshold
from mdp.ranking.candidates import directions
from mdp.ranking.features import features
from mdp.search.problem import Problem
from mdp.sweep.sweep import Remainder, unavoidable_faces
from profiles.profile import load
from tests import shapes

SETTINGS = ("search.directions=200", "search.objective=risky", "search.clearance=false")


def _lost(least_offset_mm: float) -> tuple[Remainder, np.ndarray]:
    mesh, chosen = shapes.tee(), directions(load().search)
    remainder = Remainder(mesh, risky_upright(mesh, 45.0))
    least = np.full(len(chosen), least_offset_mm)
    return remainder, unavoidable_faces(remainder, chosen, least, threshold(45.0))


def test_free_planes_save_every_overhang_and_forbidden_ones_none() -> None:
    assert not _lost(-np.inf)[1].any()
    remainder, lost = _lost(np.inf)
    assert (lost == remainder.facets.faces.risky).all()


@pytest.mark.parametrize("shape", ["tee", "branch", "ball"])
def test_the_faces_that_are_lost_are_those_that_a_plain_search_over_all_directions_finds(shape: str) -> None:
    problem = Problem(getattr(shapes, shape)(), load(settings=SETTINGS))
    remainder, limits = problem.root.remainder, problem.limits
    facets = remainder.facets
    middles = facets.mesh.vertices[facets.mesh.faces].mean(axis=1)
    carried = facets.mesh.normals @ limits.directions.T >= threshold(45.0)
    saved = (carried & (middles @ limits.directions.T > limits.least_offset_mm)).any(axis=1)
    lost = unavoidable_faces(remainder, limits.directions, limits.least_offset_mm, threshold(45.0))
    assert (lost == (facets.faces.risky & ~saved)).all()


def test_unavoidable_support_is_split_by_a_plane_and_bounds_every_cost() -> None:
    problem = Problem(shapes.ball(), load(settings=(*SETTINGS, "search.count_platform_faces=true")))
    table = problem.table(problem.root, described=True)
    rows = np.arange(len(table.reason), dtype=np.int32)
    columns = ("hopeless", "hopeless_left", "wasted", "M6")
    above, below, wasted, residual = features(table, rows, columns).T
    total = table.scored.unavoidable_here_mm2 / table.model.risky_mm2
    assert above + below == pytest.approx(np.full(len(rows), total))
    assert above + wasted == pytest.approx(residual)
    assert (wasted >= -1e-9).all()
    assert 0.0 < total < 1.0


def test_the_loss_of_a_cut_is_wasted_unavoidable_or_its_seam() -> None:
    problem = Problem(shapes.branch(), load(settings=(*SETTINGS, "search.seam_mm=0.8", "search.objective=scar")))
    table = problem.table(problem.root, described=True)
    rows = np.arange(len(table.reason), dtype=np.int32)
    wasted, unavoidable, seam, lost = features(table, rows, ("wasted", "hopeless", "seam", "M6")).T
    assert wasted + unavoidable + seam == pytest.approx(lost)
    assert seam.min() > 0.0


def test_a_direction_straight_up_saves_nothing_that_overhangs() -> None:
    mesh = shapes.tee()
    remainder = Remainder(mesh, risky_upright(mesh, 45.0))
    lost = unavoidable_faces(remainder, UP[None], np.array([-np.inf]), threshold(45.0))
    assert (lost == remainder.facets.faces.risky).all()
