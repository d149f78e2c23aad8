from types import SimpleNamespace
from typing import Any

import manifold3d as m3
import numpy as np
import pytest
import trimesh
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from mdp.cost.cost import CostTerms
from mdp.mesh import Floats, Mesh
from mdp.plane import Plane
from mdp.ranking.candidates import Reason, bounds_of, plate_disc, score_candidates
from mdp.ranking.ranking import CandidateTable, Model
from mdp.sweep.slivers import SLIVER_COSINE, least_distance_mm
from mdp.sweep.sweep import Remainder, sweep
from profiles.profile import load
from tests import shapes
from tests.mdp.solids import random_direction, random_solid

UP, SIDE = np.array([0.0, 0.0, 1.0]), np.array([1.0, 0.0, 0.0])


def _remainder(mesh: Mesh) -> Remainder:
    return Remainder(mesh, np.zeros(len(mesh.faces), bool))


def _thin(mesh: Mesh, direction: Floats, *offsets_mm: float) -> list[float]:
    """Distances of planes to the nearest thin region."""
    remainder = _remainder(mesh)
    return [remainder.thin_mm(Plane(direction, offset)) for offset in offsets_mm]


def _on_block(*pieces: m3.Manifold) -> Mesh:
    """A block of 30 x 20 x 10 mm with bodies on it."""
    return shapes.standing(sum(pieces, m3.Manifold.cube((30, 20, 10), True).translate((0, 0, 5))))


def test_a_plane_through_a_fin_is_at_no_distance_and_one_in_the_block_as_far_as_the_fin() -> None:
    fin = m3.Manifold.cube((20, 0.8, 15), True).translate((0, 0, 17.4))
    assert _thin(_on_block(fin), UP, 12.0, 20.0, 4.0) == pytest.approx([0.0, 0.0, 6.0], abs=0.11)


def test_a_plane_has_its_distance_to_a_thin_bridge() -> None:
    posts = [m3.Manifold.cube((8, 8, 20), True).translate((x, 0, 18)) for x in (-11, 11)]
    bridge = m3.Manifold.cube((22, 0.9, 0.9), True).translate((0, 0, 25))
    assert _thin(_on_block(*posts, bridge), SIDE, 0.0, 5.0, 10.0) == pytest.approx([0.0, 0.0, 3.0], abs=0.01)


@pytest.mark.parametrize(("thickness_mm", "distance_mm"), [(0.8, 3.0), (1.2, np.inf)])
def test_a_plate_is_thin_below_one_millimetre(thickness_mm: float, distance_mm: float) -> None:
    plate = _on_block(m3.Manifold.cube((50, 40, thickness_mm), True).translate((0, 0, 10 + thickness_mm / 2)))
    assert _thin(plate, UP, 7.0) == pytest.approx([distance_mm], abs=0.01)


def test_an_acute_edge_is_no_thin_wall() -> None:
    wedge = m3.Manifold.extrude(m3.CrossSection([[(0, 0), (20, 0), (0, 20)]]), 20).rotate((90, 0, 0))
    assert _thin(shapes.standing(wedge), UP, 5.0) == [np.inf]


@settings(max_examples=15)
@given(st.integers(0, 50), st.tuples(st.integers(1, 999), st.integers(1, 999)))
def test_a_plane_is_as_fragile_as_the_nearest_surface_that_it_would_cut_into_a_sliver(seed: int, place: tuple[int, int]) -> None:
    mesh, direction, step_mm = random_solid(seed), random_direction(*place), 0.7
    swept = sweep(_remainder(mesh), direction[None], step_mm)
    normals = trimesh.Trimesh(mesh.vertices, mesh.faces, process=False).vertex_normals[mesh.faces]
    leaning = np.einsum("fki,fi->fk", normals, mesh.normals)
    least = np.full(len(mesh.vertices), 1.0)
    np.minimum.at(least, mesh.faces, leaning)
    assume(np.abs(least - SLIVER_COSINE).min() > 1e-4)
    smooth = least[mesh.faces] > SLIVER_COSINE
    cosines = np.where(smooth, normals @ direction, (mesh.normals @ direction)[:, None])
    heights = (mesh.vertices @ direction)[mesh.faces]
    for column in range(int(swept.columns[0])):
        offset = (swept.first[0] + column) * step_mm
        over, under = (cosines > SLIVER_COSINE) & (heights > offset), (cosines < -SLIVER_COSINE) & (heights <= offset)
        nearest = np.abs(heights - offset)[over | under].min(initial=np.inf)
        assert swept.fragile_mm[0, column] == pytest.approx(nearest, abs=1e-9)


def test_a_plane_through_a_ball_is_as_far_from_a_sliver_as_from_the_circle_where_the_ball_leans_23_degrees() -> None:
    swept = sweep(_remainder(shapes.ball(10.0, 192)), UP[None], 1.0)
    expected = [abs(abs(z - 10.0) - 10.0 * SLIVER_COSINE) for z in range(1, 20)]
    assert swept.fragile_mm[0, :19] == pytest.approx(expected, abs=0.15)


@pytest.mark.parametrize(("offset_mm", "distance_mm"), [(1.0, 2.0), (3.5, 0.0), (4.0, 0.0), (9.0, 3.0)])
def test_the_distance_of_a_plane_from_triangles_is_that_of_the_nearest_corner_or_zero(
    offset_mm: float, distance_mm: float
) -> None:
    triangles = np.array([[(0, 0, 3), (1, 0, 4), (0, 1, 5)], [(0, 0, 5), (1, 0, 6), (0, 1, 6)]], np.float64)
    assert least_distance_mm(triangles, Plane(UP, offset_mm)) == pytest.approx(distance_mm)
    assert least_distance_mm(triangles[:0], Plane(UP, offset_mm)) == np.inf


def test_only_a_sliver_forbids_a_plane_and_m5_is_less_near_a_fin_than_far_from_it() -> None:
    table = _table(_on_block(m3.Manifold.cube((20, 0.8, 15), True).translate((0, 0, 17.4))))
    rows = [int(np.flatnonzero(table.scored.offset_mm == offset_mm)[0]) for offset_mm in (5.0, 9.0, 18.0, 24.0)]
    table.check_rows(np.array(rows))
    assert table.reason[rows].tolist() == [Reason.FEASIBLE, Reason.FEASIBLE, Reason.FEASIBLE, Reason.FRAGILE]
    assert [table.fragile_mm(row) for row in rows] == pytest.approx([5.0, 1.0, 0.0, 0.0], abs=0.11)


def test_no_plane_is_in_an_overhanging_face_even_if_slivers_are_allowed() -> None:
    table = _table(shapes.tee(stem=10, height=40), fragile_mm=0.0)
    rows = [int(np.flatnonzero(table.scored.offset_mm == offset_mm)[0]) for offset_mm in (29.0, 30.0, 31.0)]
    table.check_rows(np.array(rows))
    assert table.reason[rows].tolist() == [Reason.FEASIBLE, Reason.FRAGILE, Reason.FEASIBLE]


def _table(mesh: Mesh, fragile_mm: float = 1.0) -> CandidateTable:
    """All candidates of a solid along the upright direction."""
    words = ("clearance=false", "least_interface_mm2=0", "least_volume_share=0", f"fragile_mm={fragile_mm}")
    profile = load(settings=[f"search.{word}" for word in words])
    limits = bounds_of(UP[None], mesh, profile, plate_disc(mesh, profile.search))
    terms = CostTerms(45.0, False)
    scored = score_candidates(_remainder(mesh), limits, terms, -np.inf)
    uncut: Any = SimpleNamespace(saved_mm2=0.0, residual_mm2=0.0, lost_mm2=0.0)
    return CandidateTable(scored, uncut, Model(1.0, mesh.volume_mm3, 1.0))
