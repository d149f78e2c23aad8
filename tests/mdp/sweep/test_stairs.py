"""Stair-stepping in the sweep, the forecast and the search, against clipped faces and parts after real cuts."""

from math import cos, radians

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mdp.cost.cost import CostTerms
from mdp.cost.forecast import Forecast
from mdp.cut import cut, mesh_of, solid_of
from mdp.decomposition import Decomposition
from mdp.mesh import Floats, Mesh
from mdp.overhang import LEVEL_COSINE, risky_upright, threshold
from mdp.plane import UP, Plane
from mdp.search.search import decompose
from mdp.sweep.sweep import Remainder, gains
from profiles.profile import load
from tests import shapes
from tests.mdp.solids import area_vectors_above, random_direction, random_solid

WEIGHT, STEP_MM = 0.15, 1.7
SPHERE = st.tuples(st.integers(1, 999), st.integers(1, 999))


def steps_mm2(areas_mm2: Floats, cosines: Floats) -> float:
    """Areas times the height of their steps in layers."""
    return float(sum(area * abs(cosine) for area, cosine in zip(areas_mm2, cosines, strict=True) if abs(cosine) < LEVEL_COSINE))


@settings(max_examples=12, deadline=None)
@given(st.integers(0, 50), SPHERE)
def test_the_sweep_counts_the_steps_of_every_face_above_a_plane(seed: int, place: tuple[int, int]) -> None:
    mesh, direction = random_solid(seed), random_direction(*place)
    weights = np.random.default_rng(seed).choice([0.0, WEIGHT], len(mesh.faces))
    remainder = Remainder(mesh, risky_upright(mesh, 45.0), np.ones(len(mesh.faces)), stair_weights=weights)
    swept = gains(remainder, direction[None], STEP_MM, threshold(45.0))
    assert remainder.stairs_mm2 == pytest.approx(steps_mm2(mesh.areas_mm2 * weights, mesh.normals[:, 2]))
    for column in range(int(swept.columns[0])):
        plane = Plane(direction, float(swept.offsets_mm(STEP_MM)[0, column]))
        areas = np.linalg.norm(area_vectors_above(mesh, plane), axis=1) * weights
        assert swept.stairs_up_mm2[0, column] == pytest.approx(steps_mm2(areas, mesh.normals[:, 2]), abs=1e-8)
        assert swept.stairs_mm2[0, column] == pytest.approx(steps_mm2(areas, mesh.normals @ direction), abs=1e-8)


@pytest.mark.parametrize(("lean_deg", "steps"), [(0.0, 0.0), (0.5, 0.0), (2.0, cos(radians(2.0))), (45.0, 0.5**0.5), (90.0, 0.0)])
def test_steps_are_highest_on_nearly_level_faces_and_absent_on_level_and_upright_ones(lean_deg: float, steps: float) -> None:
    turn = radians(lean_deg)
    direction = np.array([[np.sin(turn), 0.0, np.cos(turn)]])
    top = Mesh(np.array([[0.0, 0, 0], [10, 0, 0], [0, 10, 0]]), np.array([[0, 1, 2]]))
    remainder = Remainder(top, np.zeros(1, np.bool_), np.ones(1), stair_weights=np.ones(1))
    below = gains(remainder, direction, 0.001, -2.0)
    assert below.stairs_mm2.max(initial=0.0) == pytest.approx(50.0 * steps, rel=0.01)


def cut_by_hand(mesh: Mesh, planes: list[Plane]) -> float:
    """Stair-stepping of the parts after cutting, without the faces in the cut planes."""
    total_mm2, rest = 0.0, solid_of(mesh)
    planes = [*planes, Plane(UP, -1.0)]
    for position, plane in enumerate(planes):
        above, rest = cut(rest, plane)
        part = mesh_of(above)
        heights = [np.abs(earlier.heights_mm(part.vertices)[part.faces]).max(axis=1) for earlier in planes[: position + 1]]
        own = np.min(heights, axis=0) > 1e-7
        total_mm2 += steps_mm2(part.areas_mm2[own], (part.normals @ plane.normal)[own])
    return total_mm2


@settings(max_examples=30, deadline=None)
@given(st.lists(st.tuples(SPHERE, st.floats(5.0, 35.0)), min_size=1, max_size=4), st.sampled_from([shapes.branch, shapes.ball]))
def test_the_forecast_counts_the_stairs_that_the_parts_have_after_cutting(
    leans: list[tuple[tuple[int, int], float]], shape: type
) -> None:
    mesh = shape()
    planes = [Plane(random_direction(*place), offset_mm) for place, offset_mm in leans]
    risky, ones = risky_upright(mesh, 45.0), np.ones(len(mesh.faces))
    plain, stairs = (Remainder(mesh, risky, ones, stair_weights=weights) for weights in (None, WEIGHT * ones))
    terms = CostTerms(45.0, False, seam_mm=0.8, stair_weight=WEIGHT)
    counted_mm2 = Forecast.of(stairs, terms).left_mm2(planes) - Forecast.of(plain, terms).left_mm2(planes)
    assert counted_mm2 == pytest.approx(WEIGHT * cut_by_hand(mesh, planes), abs=1e-6)


def found(mesh: Mesh, *given_settings: str) -> Decomposition:
    return decompose(mesh, "mesh", load(settings=["search.directions=200", f"search.stair_weight={WEIGHT}", *given_settings]))


@pytest.mark.parametrize("layer_mm", [0.1, 0.2])
def test_every_row_of_a_front_has_the_stairs_of_its_parts_by_layer_height(layer_mm: float) -> None:
    mesh = shapes.branch()
    rows = found(mesh, f"process.layer_height_mm={layer_mm}").front
    assert len(rows) > 1
    for row in rows:
        stairs_mm2 = WEIGHT * layer_mm / 0.2 * cut_by_hand(mesh, list(row.planes))
        assert row.stairs_mm2 == pytest.approx(stairs_mm2, rel=1e-6, abs=1e-6)


def test_dear_stairs_keep_a_model_whole_that_would_be_cut_without_them() -> None:
    mesh = shapes.branch()
    assert len(found(mesh, "search.stair_weight=0").parts) == 2
    whole, parted = found(mesh, "search.stair_weight=10").front[:2]
    assert whole.stairs_mm2 - parted.stairs_mm2 == pytest.approx(
        10.0 * (cut_by_hand(mesh, []) - cut_by_hand(mesh, list(parted.planes))), rel=1e-6
    )


@pytest.mark.parametrize("setting", ["search.objective=risky", "search.method=published", "search.seam_mm=0"])
def test_the_paper_s_terms_know_no_stairs(setting: str) -> None:
    assert all(row.stairs_mm2 == 0.0 for row in found(shapes.tee(), setting).front)
