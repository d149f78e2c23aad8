"""The cost of a cut: its rim against exact sections, feather edges, faces that are free or hidden, and cuts that do not pay."""

import numpy as np
import pytest
import trimesh
from hypothesis import given, settings
from hypothesis import strategies as st

from mdp.cost.cost import CostTerms, SeamPlaces, origin_of, piece_of
from mdp.cost.forecast import Forecast
from mdp.cut import Solid, above, below, mesh_of, solid_of
from mdp.decomposition import Decomposition
from mdp.mesh import Floats, Mesh
from mdp.overhang import risky_upright, threshold
from mdp.plane import Plane
from mdp.search.search import decompose
from mdp.support_need.need import MADE_BY_A_CUT
from mdp.sweep.crossing import Rim, measure_rim
from mdp.sweep.sweep import Gains, Remainder, gains
from profiles.profile import load
from tests import shapes
from tests.mdp.solids import random_solid

ANGLE_DEG = 45.0
LEAN = st.tuples(st.floats(0.0, 80.0), st.floats(0.0, 360.0))


def _direction(lean: tuple[float, float]) -> Floats:
    angle, turn = np.radians(lean)
    return np.array([np.sin(angle) * np.cos(turn), np.sin(angle) * np.sin(turn), np.cos(angle)])


def _remainder(mesh: Mesh, weights: Floats, feather: float) -> Remainder:
    return Remainder(mesh, risky_upright(mesh, ANGLE_DEG), weights, feather)


def _swept(mesh: Mesh, direction: Floats, feather: float = 0.0) -> Gains:
    return gains(_remainder(mesh, np.ones(len(mesh.faces)), feather), direction[None], 1.0, threshold(ANGLE_DEG))


def _places(mesh: Mesh, hidden_share: float = 1.0) -> tuple[SeamPlaces, Solid]:
    """Seam weights on a model, and its solid."""
    solid = solid_of(mesh)
    sets = (f"search.hidden_seam_share={hidden_share}", "search.feature_mm2=0", "search.feature_weight=1")
    return SeamPlaces.of(mesh, solid, load(settings=sets).search), solid


def _seam(places: SeamPlaces, solid: Solid, plane: Plane, feather: float = 0.0) -> Rim:
    return measure_rim(mesh_of(solid), places.weights(places.piece(solid)), plane, feather)


def _section_mm(mesh: Mesh, plane: Plane) -> float:
    """Length of the outline of a section, by trimesh."""
    model = trimesh.Trimesh(mesh.vertices, mesh.faces, process=False)
    lines = trimesh.intersections.mesh_plane(model, plane.normal, plane.normal * plane.offset_mm)
    return float(np.linalg.norm(lines[:, 0] - lines[:, 1], axis=1).sum())


@settings(max_examples=25, deadline=None)  # the first call compiles
@given(st.integers(0, 50), LEAN)
def test_the_rim_at_every_offset_is_the_outline_of_the_section(seed: int, lean: tuple[float, float]) -> None:
    mesh, direction = random_solid(seed), _direction(lean)
    swept = _swept(mesh, direction)
    for column in range(0, int(swept.columns[0]), 7):
        plane = Plane(direction, float(swept.first[0] + column) + 0.0)
        assert swept.rim_mm[0, column] == pytest.approx(_section_mm(mesh, plane), rel=1e-6, abs=1e-5)


@pytest.mark.parametrize(("lean_deg", "weight"), [(60.0, 1.0), (45.0, 1.0), (20.0, 1.0 + 0.5 * (2.747477 - 1.732051))])
def test_a_rim_counts_more_where_face_and_plane_meet_at_a_small_angle(lean_deg: float, weight: float) -> None:
    wedge = mesh_of(below(solid_of(shapes.box(20.0, 20.0, 40.0)), Plane(_direction((lean_deg, 0.0)), 15.0)))
    plane = Plane(np.array([0.0, 0.0, 1.0]), 14.0)
    leaning = _seam(*_places(wedge), plane, 0.5)
    assert leaning.weighted_mm - leaning.length_mm == pytest.approx(
        (weight - 1.0) * 20.0, abs=1e-4
    )  # one of the rim's four sides


@pytest.mark.parametrize(("lean_deg", "feathered_mm"), [(60.0, 0.0), (21.0, 0.0), (19.0, 20.0), (10.0, 20.0)])
def test_an_edge_below_20_degrees_is_a_feather_edge(lean_deg: float, feathered_mm: float) -> None:
    wedge = mesh_of(below(solid_of(shapes.box(20.0, 20.0, 40.0)), Plane(_direction((lean_deg, 0.0)), 15.0)))
    assert _seam(*_places(wedge), Plane(np.array([0.0, 0.0, 1.0]), 15.0)).feathered_mm == pytest.approx(feathered_mm, abs=1e-4)


def test_a_face_that_an_earlier_cut_laid_open_carries_no_seam() -> None:
    first, second = Plane(np.array([0.0, 0.0, 1.0]), 10.0), Plane(np.array([1.0, 0.0, 0.0]), 0.0)
    places, whole = _places(shapes.box(20.0, 20.0, 30.0))
    assert _seam(places, whole, second).length_mm == pytest.approx(20.0 + 30.0 + 30.0)  # the side on the build plate is free
    assert _seam(places, below(whole, first), second).length_mm == pytest.approx(10.0 + 10.0)


def test_a_seam_along_a_crease_counts_less_than_one_away_from_it() -> None:
    places, branch = _places(shapes.tee(), hidden_share=0.4)  # a bar on a stem; its underside is at 30 mm
    crease, stem = (_seam(places, branch, Plane(np.array([0.0, 0.0, 1.0]), z)) for z in (29.9, 15.0))
    assert crease.length_mm == stem.length_mm == pytest.approx(40.0)
    assert 0.4 * 40.0 <= crease.weighted_mm < stem.weighted_mm <= 40.0


@settings(max_examples=30, deadline=None)
@given(st.integers(0, 50), LEAN, st.floats(2.0, 30.0))
def test_the_seam_of_one_plane_is_the_sweep_s_rim(seed: int, lean: tuple[float, float], offset_mm: float) -> None:
    mesh, plane = random_solid(seed), Plane(_direction(lean), offset_mm)
    places, solid = _places(mesh, hidden_share=0.4)
    remainder = _remainder(mesh_of(solid), places.weights(places.piece(solid)), 0.5)
    swept = gains(remainder, plane.normal[None], offset_mm, threshold(ANGLE_DEG))
    column = 1 - int(swept.first[0])
    if 0 <= column < swept.columns[0]:
        assert swept.rim_mm[0, column] == pytest.approx(_seam(places, solid, plane, 0.5).weighted_mm, rel=1e-9, abs=1e-9)


@settings(max_examples=30, deadline=None)
@given(st.lists(st.tuples(LEAN, st.floats(5.0, 35.0)), min_size=1, max_size=4))
def test_the_forecast_counts_every_seam_as_it_is_after_cutting(leans: list[tuple[tuple[float, float], float]]) -> None:
    places, rest = _places(shapes.branch(), hidden_share=0.4)
    mesh, terms = mesh_of(rest), CostTerms(ANGLE_DEG, False, seam_mm=0.6, feather=0.5)
    planes = [Plane(_direction(lean), offset_mm) for lean, offset_mm in leans]
    with_seams = Forecast.of(_remainder(mesh, places.weights(places.piece(rest)), 0.5), terms).left_mm2(planes)
    without = Forecast.of(Remainder(mesh, risky_upright(mesh, ANGLE_DEG)), CostTerms(ANGLE_DEG, False)).left_mm2(planes)
    seams_mm = 0.0
    for plane in planes:
        seams_mm += _seam(places, rest, plane, 0.5).weighted_mm
        rest = below(rest, plane)
        if rest.is_empty():
            break
    assert with_seams - without == pytest.approx(0.6 * seams_mm, rel=1e-6, abs=1e-4)


def _decompose(mesh: Mesh, *settings_: str) -> Decomposition:
    return decompose(mesh, "shape", load(settings=("search.directions=200", *settings_)))


def test_a_cut_whose_seam_outweighs_its_savings_is_not_made() -> None:
    assert len(_decompose(shapes.branch(), "search.seam_mm=100").parts) == 1
    assert len(_decompose(shapes.branch(), "search.seam_mm=0.6").parts) == 2


def test_with_a_seam_width_of_zero_the_objective_is_that_of_the_paper() -> None:
    ours, paper = (_decompose(shapes.tee(), setting) for setting in ("search.seam_mm=0", "search.objective=risky"))
    assert [part.base.offset_mm for part in ours.parts] == [part.base.offset_mm for part in paper.parts]
    assert ours.residual_area_mm2 == paper.residual_area_mm2


@pytest.mark.parametrize("shape", ["tee", "branch", "bowl"])
def test_every_row_of_the_front_says_what_its_parts_cost(shape: str) -> None:
    decomposition = _decompose(getattr(shapes, shape)())
    rows = decomposition.front
    assert [row.parts for row in rows] == list(range(1, len(rows) + 1))
    assert rows[0].support_area_mm2 == pytest.approx(decomposition.risky_area_mm2)
    assert rows[0].cost_mm2 == pytest.approx(rows[0].support_area_mm2 + rows[0].stairs_mm2)
    (chosen,) = (row for row in rows if row.chosen)
    assert chosen.parts == len(decomposition.parts)
    assert chosen.support_area_mm2 == pytest.approx(decomposition.residual_area_mm2, abs=1e-6)
    assert chosen.cost_mm2 <= min(row.cost_mm2 for row in rows) * 1.01


@given(st.floats(0.0, 6.28), st.floats(0.3, 1.5), st.floats(-3.0, 3.0))
@settings(max_examples=20, deadline=None)
def test_a_face_is_on_its_source_face_or_in_a_cut(turn: float, rise: float, shift_mm: float) -> None:
    mesh = shapes.branch()
    solid = solid_of(mesh)
    middle = mesh.bounds_mm.mean(axis=0)
    normals = [np.array([np.cos(a) * np.cos(rise), np.sin(a) * np.cos(rise), np.sin(rise)]) for a in (turn, turn + 2.0)]
    planes = [Plane(normal, float(normal @ middle) + shift_mm) for normal in normals]
    piece = above(below(solid, planes[0]), planes[1])
    if piece.is_empty():
        return
    traced = piece_of(piece, origin_of(solid))
    sources, left = traced.sources, traced.mesh
    of_model = sources != MADE_BY_A_CUT
    assert np.einsum("ij,ij->i", left.normals[of_model], mesh.normals[sources[of_model]]).min() > 1.0 - 1e-9
    corners = left.vertices[left.faces]
    first = mesh.vertices[mesh.faces[sources[of_model], 0]]
    assert np.abs(np.einsum("ijk,ik->ij", corners[of_model] - first[:, None], left.normals[of_model])).max() < 1e-9
    heights = np.stack([np.abs(plane.heights_mm(left.vertices))[left.faces].max(axis=1) for plane in planes])
    assert (heights.min(axis=0) < 1e-6)[~of_model].all()


def test_the_whole_model_is_its_own_source() -> None:
    mesh = shapes.box()
    other = piece_of(solid_of(mesh), origin_of(solid_of(mesh)))
    assert (other.sources == MADE_BY_A_CUT).all()  # another solid of an equal mesh is another model
    own = solid_of(mesh)
    assert (piece_of(own, origin_of(own)).sources >= 0).all()
