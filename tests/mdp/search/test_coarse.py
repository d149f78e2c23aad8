"""Coarse copy: a finely meshed model is searched on a simplified copy, cut itself, and costs about as much as in its own
search."""

from collections.abc import Sequence

import manifold3d as m3
import numpy as np
import pytest
import trimesh

from mdp.cut import mesh_of, simplify, solid_of
from mdp.decomposition import Decomposition, Part
from mdp.mesh import Floats, Mesh
from mdp.plane import Plane
from mdp.search.by_hand import Rejection, cut_near, try_planes
from mdp.search.coarse import coarse_copy
from mdp.search.front import Weights
from mdp.search.orient import orient_and_decompose
from mdp.search.plan_file import PlanFile, PlannedPart
from mdp.search.problem import Problem
from mdp.search.search import SearchRequest, decompose
from mdp.zone import NO_ZONES, Painted, Zone, Zones
from profiles.profile import Profile, load
from tests import shapes

LAYER_MM = 0.2


def _profile(faces: int, *settings: str) -> Profile:
    return load(settings=("search.directions=100", f"search.simplify_faces={faces}", *settings))


def _fine(bumps_mm: float = 0.02, edges_mm: float = 0.7) -> Mesh:
    """A post with a leaning arm and a wavy surface, about 30,000 faces; edges_mm: longest edges before the waves are applied."""

    def wavy(points: Floats) -> Floats:
        waves: Floats = bumps_mm * np.sin(2.0 * points[:, [1, 2, 0]])
        return points + waves

    arm = m3.Manifold.cylinder(35, 5, 5, 48).rotate((0, 60, 0)).translate((0, 0, 25))
    solid = m3.Manifold.cylinder(40, 8, 8, 48) + arm
    return shapes.standing(solid.refine_to_length(edges_mm).warp_batch(wavy).trim_by_plane((0.0, 0.0, 1.0), 0.1))


@pytest.fixture(scope="module")
def fine() -> Mesh:
    return _fine()


def test_the_copy_has_fewer_faces_and_deviates_by_less_than_a_layer(fine: Mesh) -> None:
    copy = coarse_copy(fine, _profile(2000), NO_ZONES)
    assert copy is not None
    assert len(copy.faces) < 0.5 * len(fine.faces)
    assert max(_farthest_mm(fine, copy), _farthest_mm(copy, fine)) < LAYER_MM


def test_the_coarsest_copy_is_one_that_keeps_half_the_faces_a_model_may_have(fine: Mesh) -> None:
    least = len(simplify(fine, 0.5 * LAYER_MM).faces)
    few, many = (coarse_copy(fine, _profile(most), NO_ZONES) for most in (2 * least + 2, 2 * least - 2))
    assert few is not None
    assert many is not None
    assert len(many.faces) == least < len(few.faces)


def _farthest_mm(one: Mesh, other: Mesh) -> float:
    """The greatest distance of about a hundred vertices of a mesh from another mesh."""
    triangles, places = other.vertices[other.faces], one.vertices[:: len(one.vertices) // 100]
    nearest = (trimesh.triangles.closest_point(triangles, np.tile(place, (len(triangles), 1))) - place for place in places)
    return max(float(np.linalg.norm(off, axis=1).min()) for off in nearest)


@pytest.mark.parametrize(
    "settings",
    [(40000,), (0,), (2000, "search.objective=risky"), (2000, "search.method=published")],
    ids=["few faces", "never", "the paper's terms", "the paper's search"],
)
def test_no_copy_is_made_of(fine: Mesh, settings: tuple[int, str]) -> None:
    assert coarse_copy(fine, _profile(*settings), NO_ZONES) is None


def test_a_model_is_not_copied_where_single_faces_are_marked_but_where_boxes_are(fine: Mesh) -> None:
    box = Zone((0.0, 0.0, 0.0), (5.0, 5.0, 5.0))
    assert coarse_copy(fine, _profile(2000), Zones(keep=(box,))) is not None
    assert coarse_copy(fine, _profile(2000), Zones(keep=(Painted(0xFF0000),))) is None


def test_a_copy_that_spares_few_faces_is_not_used() -> None:
    assert coarse_copy(_fine(bumps_mm=1.0), _profile(2000), NO_ZONES) is None


def test_a_search_on_the_copy_costs_about_the_same_as_on_the_model() -> None:
    fine = _fine(0.005, 1.5)  # the slopes of higher bumps count as stair-stepping, which the copy does not have
    copied, itself = (decompose(fine, "shape", _profile(faces)) for faces in (3000, 0))
    assert len(copied.parts) == len(itself.parts) == 2
    assert copied.mesh is fine
    assert sum(part.volume_mm3 for part in copied.parts) == pytest.approx(fine.volume_mm3, rel=1e-9)
    assert copied.cost_mm2 == pytest.approx(itself.cost_mm2, rel=0.02)
    assert copied.risky_area_mm2 == itself.risky_area_mm2
    assert [row.parts for row in copied.front if row.chosen] == [2]
    assert copied.chosen is not None
    assert copied.chosen.planes[0].normal.tolist() == copied.parts[1].base.normal.tolist()


def test_a_plane_by_hand_is_not_moved(fine: Mesh) -> None:
    by_hand = PlanFile("mine", parts=(PlannedPart((0.6, 0.0, 0.8), 32.0),))
    parts = decompose(fine, "shape", _profile(2000), SearchRequest(plan=by_hand)).parts
    assert ((0.6, 0.0, 0.8), 32.0) in [(tuple(part.base.normal), part.base.offset_mm) for part in parts[1:]]


def test_a_model_on_a_pedestal_is_cut_above_it(fine: Mesh) -> None:
    found = decompose(fine, "shape", _profile(2000, "search.pedestal_mm=5"))
    assert found.mesh.bounds_mm[1, 2] == pytest.approx(fine.bounds_mm[1, 2] + 5.0)
    assert len(found.parts) == 2


def test_orientations_are_compared_on_the_copy_and_searched_on_the_model() -> None:
    mesh, profile, searched = mesh_of(solid_of(shapes.tee(arm=80.0)).refine(20)), _profile(2000), []

    def search(mesh: Mesh) -> Decomposition:
        searched.append(mesh)
        return decompose(mesh, "tee", profile, SearchRequest(price=lambda parts: (100.0, 1000.0)))

    oriented = orient_and_decompose(mesh, profile, lambda profile: lambda parts: (100.0, 1000.0), search)
    assert oriented.orientation is not None
    assert [len(mesh.faces) for mesh in searched] == [len(mesh.faces)]
    assert oriented.decomposition.mesh is searched[0]


def test_the_row_that_is_chosen_is_priced_by_the_parts_of_the_model_itself(fine: Mesh) -> None:
    def faces(parts: Sequence[Part]) -> tuple[float, float]:
        return float(sum(len(part.mesh.faces) for part in parts)), 1000.0

    found = decompose(fine, "shape", _profile(2000), SearchRequest(parts=2, price=faces))
    assert found.chosen is not None
    assert found.chosen.time_s == sum(len(part.mesh.faces) for part in found.parts) > len(fine.faces)
    first, weights = found.front[0], Weights.of(_profile(2000))
    totals = [row.cost_mm2 + (weights.of_row(row) or 0.0) for row in (first, found.chosen)]
    charge = found.chosen.total_mm2 - totals[1]  # type: ignore[operator]
    assert first.total_mm2 == pytest.approx(totals[0])
    assert charge == pytest.approx(load().search.least_saving * totals[0], rel=0.1)  # of the copy's first row


def test_a_search_that_is_recorded_is_one_of_the_model_itself(fine: Mesh) -> None:
    records = list[bytes]()
    decompose(
        fine, "shape", _profile(2000, "search.directions=10", "search.beam_width=1"), SearchRequest(on_record=records.append)
    )
    assert len(records) == 1


def test_a_plane_that_leaves_a_sliver_is_moved_to_the_nearest_that_cuts() -> None:
    problem = Problem(shapes.tee(), _profile(0))
    flush = Plane(np.array([1.0, 0.0, 0.0]), 19.8)
    assert isinstance(try_planes(problem, problem.root, [flush]), Rejection)
    moved = cut_near(problem, problem.root, flush)
    assert moved is not None
    plane = moved.cuts[-1].base
    assert 0.0 < abs(plane.offset_mm - flush.offset_mm) <= 1.0
    assert plane.normal @ flush.normal > np.cos(np.radians(3.1))


def test_a_plane_that_misses_the_model_has_no_neighbour() -> None:
    problem = Problem(shapes.tee(), _profile(0))
    assert cut_near(problem, problem.root, Plane(np.array([1.0, 0.0, 0.0]), 30.0)) is None


def test_a_copy_is_searched_before_the_mesh_is_measured_and_every_phase_is_reported(fine: Mesh) -> None:
    heard: list[str] = []
    decompose(
        fine,
        "post",
        _profile(2000, "search.beam_width=2"),
        SearchRequest(
            on_stage=lambda *told: heard.append("stage"), on_phase=lambda text: heard.append(text.partition(" of ")[0])
        ),
    )
    measured = [k for k, text in enumerate(heard) if text == "measuring overhangs and seams"]
    assert heard[0].startswith("simplifying ")
    assert measured[0] < heard.index("stage") < measured[1] == len(heard) - 1
