"""Gains of a piece of a model in a sweep: each face clipped separately, weighted by its model, its class and the user's zones."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mdp.directions.unit_vectors import spread
from mdp.mesh import Floats, Mesh
from mdp.overhang import Mask, facing_down, risky_upright, threshold
from mdp.plane import Plane
from mdp.support_need.need import ModelPieces, SupportNeed
from mdp.support_need.patches import CARRIES_ITSELF, NEEDS_SUPPORT, UNSUPPORTABLE
from mdp.sweep.sweep import Gains, Remainder, gains, sweep
from profiles.profile import load
from tests.mdp.solids import area_vectors_above, random_direction, random_solid

PROCESS = load().process
WEIGHT, STEP_MM = 5.0, 1.7
SPHERE = st.tuples(st.integers(1, 999), st.integers(1, 999))


def pieces_of(mesh: Mesh, seed: int) -> ModelPieces:
    """Random sources: every face is a piece of some face of the model or of none, with a random area factor."""
    rng, m = np.random.default_rng(seed), len(mesh.faces)
    return ModelPieces(SupportNeed.of(mesh, PROCESS, WEIGHT), rng.integers(-1, m, m).astype(np.int32), rng.uniform(0, 9, m))


def planes_of(swept: Gains, direction: Floats) -> list[Plane]:
    return [Plane(direction, float(offset)) for offset in swept.offsets_mm(STEP_MM)[swept.used]]


@settings(max_examples=12)
@given(st.integers(0, 50), SPHERE)
def test_areas_count_as_their_faces_and_classes_say(seed: int, place: tuple[int, int]) -> None:
    mesh, direction = random_solid(seed), random_direction(*place)
    pieces, upright = pieces_of(mesh, seed), risky_upright(mesh, 45.0)
    swept = gains(Remainder(mesh, upright, pieces=pieces), direction[None], STEP_MM, threshold(45.0))
    classes, down = pieces.along(direction), facing_down(mesh, direction, 45.0)
    times = np.select([classes == CARRIES_ITSELF, classes == NEEDS_SUPPORT, classes == UNSUPPORTABLE], [0.0, 1.0, WEIGHT])
    for column, plane in enumerate(planes_of(swept, direction)):
        areas = np.linalg.norm(area_vectors_above(mesh, plane), axis=1) * pieces.counts
        assert swept.up_mm2[0, column] == pytest.approx(areas[upright].sum(), abs=1e-8)
        assert swept.residual_mm2[0, column] == pytest.approx((areas * times)[down].sum(), abs=1e-8)


def matching(mesh: Mesh, other: Mesh) -> np.ndarray:
    """Index of the equal face in another mesh."""
    middles, others = (solid.vertices[solid.faces].mean(axis=1) for solid in (mesh, other))
    return np.linalg.norm(middles[:, None] - others[None], axis=2).argmin(axis=1)


@settings(max_examples=8)
@given(st.integers(0, 50), SPHERE)
def test_unavoidable_support_is_counted_upright_and_along_directions(seed: int, place: tuple[int, int]) -> None:
    mesh, direction = random_solid(seed), random_direction(*place)
    pieces, upright = pieces_of(mesh, seed), risky_upright(mesh, 45.0)
    remainder = Remainder(mesh, upright, pieces=pieces)
    unavoidable: Mask = upright & (np.random.default_rng(seed).random(len(upright)) < 0.7)
    swept = gains(remainder, direction[None], STEP_MM, threshold(45.0), unavoidable[matching(remainder.facets.mesh, mesh)])
    lost = unavoidable & facing_down(mesh, direction, 45.0) & (pieces.along(direction) != CARRIES_ITSELF)
    plain = gains(remainder, direction[None], STEP_MM, threshold(45.0))
    assert swept.residual_mm2 == pytest.approx(plain.residual_mm2)
    assert swept.up_mm2 == pytest.approx(plain.up_mm2)
    for column, plane in enumerate(planes_of(swept, direction)):
        areas = np.linalg.norm(area_vectors_above(mesh, plane), axis=1) * pieces.counts
        assert swept.unavoidable_mm2[0, column] == pytest.approx(areas[lost].sum(), abs=1e-8)


@settings(max_examples=10)
@given(st.integers(0, 50), SPHERE)
def test_the_values_above_and_below_a_plane_add_up(seed: int, place: tuple[int, int]) -> None:
    mesh, direction = random_solid(seed), random_direction(*place)
    remainder = Remainder(mesh, risky_upright(mesh, 45.0))
    up, down = (sweep(remainder, d[None], STEP_MM) for d in (direction, -direction))
    n = int(up.columns[0])
    assert (down.columns[0], down.first[0]) == (n, -(up.first[0] + n - 1))
    assert up.volume_mm3[0, :n] + down.volume_mm3[0, :n][::-1] == pytest.approx(np.full(n, mesh.volume_mm3))
    assert up.section_mm2[0, :n] == pytest.approx(down.section_mm2[0, :n][::-1], abs=1e-6)


@settings(max_examples=10)
@given(st.integers(0, 50), SPHERE, st.floats(0.5, 20.0))
def test_below_the_watched_height_nothing_is_left_out_and_above_it_every_piece_is_measured(
    seed: int, place: tuple[int, int], watched: float
) -> None:
    mesh, direction = random_solid(seed), random_direction(*place)
    remainder = Remainder(mesh, risky_upright(mesh, 45.0))
    whole = sweep(remainder, direction[None], STEP_MM)
    partly = sweep(remainder, direction[None], STEP_MM, np.array([watched]))
    low = whole.lowest_mm < watched
    assert np.array_equal(partly.lowest_mm[low], whole.lowest_mm[low])
    assert (partly.lowest_mm[~low] >= watched).all()
    useful = ~low & (whole.pieces == 0)
    assert np.array_equal(partly.contact_area_mm2[useful], whole.contact_area_mm2[useful])


def test_all_directions_at_once_are_each_by_itself() -> None:
    mesh, directions = random_solid(4), spread(30)
    remainder = Remainder(mesh, risky_upright(mesh, 45.0), np.linspace(0, 1, len(mesh.faces)), 0.5, pieces_of(mesh, 4))
    table = gains(remainder, directions, STEP_MM, threshold(45.0))
    for k in (0, 7, 29):
        single = gains(remainder, directions[[k]], STEP_MM, threshold(45.0))
        assert all(np.array_equal(one[0], many[k]) for one, many in zip(single, table, strict=True))
    assert gains(remainder, directions[:0], STEP_MM, threshold(45.0)).up_mm2.shape[0] == 0
