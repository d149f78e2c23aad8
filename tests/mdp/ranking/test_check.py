"""Reasons why a plane cannot cut, against its exact cut: every criterion tested on the solids, the first that applies."""

import manifold3d as m3
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mdp.cost.cost import CostTerms
from mdp.cut import cut, mesh_of, solid_of
from mdp.directions.unit_vectors import spread
from mdp.mesh import Mesh
from mdp.overhang import risky_upright
from mdp.plane import Plane
from mdp.ranking.candidates import REASONS, Bounds, Reason, bounds_of, check, count_rejected, plate_disc, score_candidates
from mdp.sweep.sweep import Remainder
from profiles.profile import load
from tests.mdp.solids import random_solid
from tests.shapes import tee

PROFILE = load(settings=["search.clearance=false", "search.offset_step_mm=2", "search.least_interface_mm2=20"])
SEARCH = PROFILE.search
TERMS = CostTerms(45.0, False)


def limits_for(mesh: Mesh, count: int) -> Bounds:
    return bounds_of(spread(count, 0.15)[1:], mesh, PROFILE, plate_disc(mesh, SEARCH))


def reasons(mesh: Mesh, limits: Bounds, row: int, offset_mm: float) -> list[Reason]:
    """All reasons of the exact cut against a plane, in order of priority."""
    plane = Plane(limits.directions[row], offset_mm)
    above, below = cut(solid_of(mesh), plane)
    pieces = [piece for piece in above.decompose() if piece.volume() > 0.0]
    high = [p for p in pieces if plane.heights_mm(mesh_of(p).vertices).max() >= SEARCH.least_interface_mm2**0.5]
    areas = [_base_mm2(piece, plane) for piece in (high or [above])]
    loose = [piece for piece in below.decompose() if piece.volume() > 0.0 and piece.bounding_box()[2] > 0.3]
    against = {
        Reason.PLATFORM: offset_mm < limits.least_offset_mm[row],
        Reason.FLOATING: bool(loose),
        Reason.VOLUME: above.volume() < limits.least_volume_mm3,
        Reason.INTERFACE: not loose and min(areas) < SEARCH.least_interface_mm2,
    }
    return [reason for reason, holds in against.items() if holds]


def _base_mm2(part: m3.Manifold, plane: Plane) -> float:
    mesh = mesh_of(part)
    return float(mesh.areas_mm2[(np.abs(plane.heights_mm(mesh.vertices)) < 1e-7)[mesh.faces].all(axis=1)].sum())


@settings(max_examples=5)
@given(st.integers(0, 50))
def test_a_plane_is_refused_for_the_first_reason_that_its_cut_gives(seed: int) -> None:
    mesh = random_solid(seed)
    limits, remainder = limits_for(mesh, 6), Remainder(mesh, risky_upright(mesh, 45.0))
    for row, direction in enumerate(limits.directions):
        heights = mesh.vertices @ direction
        offsets = 2.0 * np.arange(np.ceil(heights.min() / 2.0), np.ceil(heights.max() / 2.0))
        checked = check(remainder, limits, 2.0, np.full(len(offsets), row, np.int32), offsets)
        for offset, reason in zip(offsets.tolist(), checked.reason.tolist(), strict=True):
            if np.abs(heights - offset).min() < 1e-6:
                continue  # a face in the plane belongs to either side
            expected = reasons(mesh, limits, row, offset)
            assert reason in ((expected[0],) if expected else (Reason.FEASIBLE, Reason.FRAGILE))


def test_every_candidate_is_counted_under_one_reason_and_what_gains_too_little_is_not_scored() -> None:
    mesh = tee()
    limits, remainder = limits_for(mesh, 60), Remainder(mesh, risky_upright(mesh, 45.0))
    scored = score_candidates(remainder, limits, TERMS, 50.0)
    counts = count_rejected(scored, 50.0, lambda _: False)
    assert sum(counts.values()) == scored.evaluated
    assert set(counts) == {Reason.FEASIBLE, *REASONS}
    assert (scored.gain_mm2 >= 50.0).all()
    feasible = check(remainder, limits, 2.0, scored.direction, scored.offset_mm).reason == Reason.FEASIBLE
    assert counts[Reason.FEASIBLE] == feasible.sum() > 0
    weak = count_rejected(scored, 50.0, lambda _: True)
    assert (weak[Reason.FEASIBLE], weak[Reason.WEAK]) == (0, counts[Reason.FEASIBLE])


@pytest.mark.parametrize(("least_mm2", "scored"), [(-np.inf, True), (1e9, False)])
def test_the_least_gain_of_a_cut_decides_which_candidates_are_scored(least_mm2: float, scored: bool) -> None:
    mesh = tee()
    found = score_candidates(Remainder(mesh, risky_upright(mesh, 45.0)), limits_for(mesh, 10), TERMS, least_mm2)
    assert (len(found.gain_mm2) > 0) == scored
    assert found.evaluated > 0
