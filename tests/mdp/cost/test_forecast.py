"""Forecast: the area that planes would leave risky, summed without cutting, against the area left after cutting."""

import manifold3d as m3
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mdp.cost.cost import CostTerms, needing_upright
from mdp.cost.forecast import Forecast
from mdp.cut import above, cut, mesh_of, solid_of
from mdp.mesh import Mesh
from mdp.overhang import Mask, facing_down, risky_upright, threshold
from mdp.plane import Plane
from mdp.search.front import front_row
from mdp.search.parts import make_parts
from mdp.search.problem import Problem
from mdp.support_need.need import ModelPieces, SupportNeed
from mdp.support_need.patches import UNSUPPORTABLE
from mdp.sweep.sweep import Remainder, gains
from profiles.profile import load
from tests import shapes
from tests.mdp.solids import area_vectors_above, random_direction, random_solid
from tests.shapes import standing

ANGLE_DEG = 45.0


def _surface(mesh: Mesh) -> Forecast:
    return Forecast.of(Remainder(mesh, risky_upright(mesh, ANGLE_DEG)), CostTerms(ANGLE_DEG, False))


def _cut_and_summed(mesh: Mesh, planes: list[Plane]) -> float:
    """Risky area of the parts after actual cuts, without the faces that cuts create."""
    total, below = 0.0, solid_of(mesh)
    for position, plane in enumerate(planes):
        above, below = cut(below, plane)
        part = mesh_of(above)
        total += part.areas_mm2[facing_down(part, plane.normal, ANGLE_DEG) & ~_in_planes(part, planes[: position + 1])].sum()
    rest = mesh_of(below)
    return float(total + rest.areas_mm2[risky_upright(rest, ANGLE_DEG) & ~_in_planes(rest, planes)].sum())


def _in_planes(mesh: Mesh, planes: list[Plane]) -> Mask:
    heights = [np.abs(plane.heights_mm(mesh.vertices)[mesh.faces]).max(axis=1) < 1e-7 for plane in planes]
    lying: Mask = np.any(heights, axis=0)
    return lying


def _leaning(angle_deg: float, turn_deg: float, offset_mm: float) -> Plane:
    angle, turn = np.radians(angle_deg), np.radians(turn_deg)
    return Plane(np.array([np.sin(angle) * np.cos(turn), np.sin(angle) * np.sin(turn), np.cos(angle)]), offset_mm)


@given(
    st.lists(st.tuples(st.floats(0.0, 79.0), st.floats(0.0, 360.0), st.floats(5.0, 35.0)), min_size=1, max_size=5),
    st.sampled_from([shapes.tee, shapes.branch, shapes.ball, shapes.bowl]),
)
@settings(max_examples=60, deadline=None)
def test_the_forecast_is_what_cutting_leaves(leans: list[tuple[float, float, float]], shape: type) -> None:
    planes = [_leaning(*lean) for lean in leans]
    assert _surface(shape()).left_mm2(planes) == pytest.approx(_cut_and_summed(shape(), planes), abs=1e-6)


def test_without_planes_the_forecast_is_the_risky_area_of_the_upright_model() -> None:
    assert _surface(shapes.tee()).left_mm2([]) == pytest.approx(300.0)  # the undersides of a 40 x 10 bar on a 10 x 10 stem


def test_a_plane_above_everything_changes_nothing() -> None:
    assert _surface(shapes.tee()).left_mm2([_leaning(20.0, 0.0, 100.0)]) == pytest.approx(300.0)


def test_one_leaning_plane_makes_one_side_of_a_tee_safe() -> None:
    beside_the_stem = _leaning(80.0, 0.0, 5.0 * np.sin(np.radians(80.0)) + 30.0 * np.cos(np.radians(80.0)))
    assert _surface(shapes.tee()).left_mm2([beside_the_stem]) == pytest.approx(150.0)


PROFILE = load(settings=["search.clearance=false"])
WEIGHT = PROFILE.search.unsupportable_weight


def cap_on_a_stem() -> Mesh:
    """A round cap on a stem, with a cross hole so that a crown supports itself."""
    cap = m3.Manifold.sphere(20, 48).translate((0, 0, 34))
    drill = m3.Manifold.cylinder(60, 3, 3, 32, True).rotate((90, 0, 0)).translate((0, 0, 36))
    return standing(m3.Manifold.cylinder(20, 8, 8, 48) + cap - drill)


@given(st.integers(0, 10_000), st.tuples(st.integers(1, 999), st.integers(1, 999)))
@settings(max_examples=15, deadline=None)
def test_a_sweep_adds_up_the_weights_of_the_faces_above_every_offset(seed: int, place: tuple[int, int]) -> None:
    direction, mesh = random_direction(*place), random_solid(seed)
    pieces = ModelPieces(SupportNeed.of(mesh, PROFILE.process, WEIGHT), np.arange(len(mesh.faces), dtype=np.int32))
    weights = np.array([0.0, 1.0, WEIGHT])[pieces.along(direction)] * facing_down(mesh, direction, 45.0)
    upright = risky_upright(mesh, 45.0) & pieces.upright
    swept = gains(Remainder(mesh, upright, pieces=pieces), direction[None], 1.3, threshold(45.0))
    for column in range(0, swept.columns[0], 3):
        plane = Plane(direction, (swept.first[0] + column) * 1.3)
        areas = np.linalg.norm(area_vectors_above(mesh, plane), axis=1)
        assert swept.residual_mm2[0, column] == pytest.approx((areas * weights).sum(), rel=1e-9, abs=1e-8)
        assert swept.up_mm2[0, column] == pytest.approx(areas[upright].sum(), rel=1e-9, abs=1e-8)


@pytest.mark.parametrize("lean", [0.2, 0.5, 0.8])
def test_forecast_front_and_parts_agree_on_what_a_cut_leaves(lean: float) -> None:
    problem = Problem(cap_on_a_stem(), PROFILE)
    plane = Plane(np.array([lean, 0.0, np.sqrt(1 - lean * lean)]), 18.4)
    node = problem.cut(problem.root, plane)
    assert node is not None
    row, parts = front_row(node), make_parts(problem, node)
    assert row.support_area_mm2 == pytest.approx(sum(part.risky_area_mm2 for part in parts), rel=1e-6)
    upright_mm2 = sum(part.mesh.areas_mm2[part.needing_upright].sum() for part in parts if part.needing_upright is not None)
    assert upright_mm2 == pytest.approx(problem.root.risky_mm2, rel=1e-6)
    assert Forecast.of(problem.root.remainder, problem.terms).left_mm2([plane]) == pytest.approx(node.cost_mm2, rel=1e-6)


def test_area_over_air_costs_a_multiple_and_counts_once_as_needing_support() -> None:
    plane = Plane(np.array([0.5, 0.0, np.sqrt(0.75)]), 12.4)
    rows = []
    for weight in (1.0, 5.0):
        problem = Problem(cap_on_a_stem(), load(settings=["search.clearance=false", f"search.unsupportable_weight={weight}"]))
        node = problem.cut(problem.root, plane)
        assert node is not None
        assert problem.terms.need is not None
        rows.append(front_row(node))
    part = node.places.piece(above(problem.root.solid, plane))
    classes = problem.terms.need.pieces(part.mesh, part.sources).along(plane.normal)
    over_air_mm2 = part.mesh.areas_mm2[facing_down(part.mesh, plane.normal, 45.0) & (classes == UNSUPPORTABLE)].sum()
    assert over_air_mm2 > 50.0
    assert rows[1].cost_mm2 - rows[0].cost_mm2 == pytest.approx(4.0 * over_air_mm2)
    assert rows[1].support_area_mm2 == pytest.approx(rows[0].support_area_mm2)


def test_the_paper_s_terms_count_every_face() -> None:
    paper = load(settings=["search.objective=risky"])
    mesh = cap_on_a_stem()
    whole, ours = Problem(mesh, paper).root.risky_mm2, Problem(mesh, PROFILE).root.risky_mm2
    assert whole == pytest.approx(mesh.areas_mm2[needing_upright(mesh, paper)].sum())
    assert whole == pytest.approx(mesh.areas_mm2[risky_upright(mesh, 45.0)].sum())
    assert ours == pytest.approx(mesh.areas_mm2[needing_upright(mesh, PROFILE)].sum())
    assert ours < whole
