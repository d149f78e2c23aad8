"""Cut: both halves of a solid, each computed alone."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from mdp.cut import above, below, cut, mesh_of, solid_of
from mdp.overhang import risky_above
from mdp.plane import Plane
from mdp.search.problem import Problem
from profiles.profile import load
from tests import shapes
from tests.mdp.solids import random_direction, random_solid

THOUSANDTHS = st.integers(1, 999)


@given(st.integers(0, 9), THOUSANDTHS, THOUSANDTHS, THOUSANDTHS)
def test_the_halves_are_those_that_one_split_makes(seed: int, height: int, around: int, share: int) -> None:
    mesh, normal = random_solid(seed), random_direction(height, around)
    heights = mesh.vertices @ normal
    plane = Plane(normal, float(heights.min() + share / 1000.0 * np.ptp(heights)))
    whole = solid_of(mesh)
    expected = whole.split_by_plane(tuple(float(x) for x in normal), plane.offset_mm)
    for mine, split_half in zip(cut(whole, plane), expected, strict=True):
        assert mine.volume() == pytest.approx(split_half.volume(), rel=1e-9, abs=1e-6)
        assert mine.surface_area() == pytest.approx(split_half.surface_area(), rel=1e-9, abs=1e-6)


def test_a_plane_outside_the_solid_leaves_one_half_empty() -> None:
    whole, over = solid_of(shapes.box()), Plane(np.array([0.0, 0.0, 1.0]), 1000.0)
    assert above(whole, over).is_empty()
    assert below(whole, over).volume() == pytest.approx(whole.volume())


@pytest.mark.parametrize("offset_mm", [8.0, 6.3, 11.71])
def test_overhangs_after_a_cut_are_those_of_the_part(offset_mm: float) -> None:
    problem = Problem(
        shapes.tee(), load(settings=("process.self_supporting_angle_deg=20", "search.clearance=false", "search.objective=risky"))
    )
    node = problem.cut(problem.root, Plane(np.array([0.8, 0.0, 0.6]), 18.0 + offset_mm))
    assert node is not None
    last = node.cuts[-1]
    part = mesh_of(last.part)
    risky_mm2 = part.areas_mm2[risky_above(part, last.base, problem.terms.angle_deg)].sum()
    assert last.cut_cost.residual_mm2 == pytest.approx(risky_mm2, rel=1e-9)
    assert risky_mm2 > 1.0
