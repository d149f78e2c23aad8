"""Need along many directions: one by one or all at once, mirrored, and for the faces left by cuts of a model."""

import manifold3d as m3
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mdp.cost.cost import origin_of, piece_of
from mdp.cut import below, solid_of
from mdp.directions.unit_vectors import spread
from mdp.mesh import Mesh
from mdp.overhang import UP, facing_down
from mdp.plane import Plane
from mdp.pose import unit
from mdp.support_need.need import ModelPieces, SupportNeed
from mdp.support_need.patches import CARRIES_ITSELF, NEEDS_SUPPORT, UNSUPPORTABLE
from profiles.profile import load
from tests.mdp.solids import random_solid
from tests.shapes import standing, tee

PROCESS = load().process
UP_DEG = PROCESS.self_supporting_angle_deg


def test_the_support_of_directions_does_not_depend_on_batch_or_order() -> None:
    mesh, directions = random_solid(5), spread(40)
    table = SupportNeed.of(mesh, PROCESS, 5.0).along(directions)
    asked = SupportNeed.of(mesh, PROCESS, 5.0)
    for k in (3, 36, 3, 20, 36):
        assert np.array_equal(asked.along(directions[[k]])[0], table[k])
        mirrored = directions[[k]] * (1.0, 1.0, -1.0)
        assert np.array_equal(asked.along(mirrored), SupportNeed.of(mesh, PROCESS, 5.0).along(mirrored))
    assert asked.along(np.zeros((0, 3))).shape == (0, len(mesh.faces))


@settings(max_examples=10)
@given(st.integers(0, 50), st.floats(-0.9, 0.9), st.floats(-0.9, 0.9))
def test_the_mirror_image_of_a_solid_needs_support_where_the_solid_does(seed: int, x: float, y: float) -> None:
    mesh, direction = random_solid(seed), unit([x, y, 1.0])
    image = Mesh(mesh.vertices * (-1.0, 1.0, 1.0), mesh.faces[:, ::-1].copy())
    classes, mirrored = (
        SupportNeed.of(solid, PROCESS, 5.0).along(d[None])[0] != CARRIES_ITSELF
        for solid, d in ((mesh, direction), (image, direction * (-1.0, 1.0, 1.0)))
    )
    down = facing_down(mesh, direction, UP_DEG)
    assert np.array_equal(classes[down], mirrored[down])


@pytest.mark.parametrize(("reach_mm", "over_air"), [(4.0, NEEDS_SUPPORT), (60.0, UNSUPPORTABLE)])
def test_support_leans_from_the_side_of_a_post_to_a_short_ledge_but_not_to_the_end_of_a_long_arm(
    reach_mm: float, over_air: int
) -> None:
    arm = m3.Manifold.cube((10.0 + reach_mm, 10.0, 3.0)).translate((0.0, 0.0, 15.0))
    mesh = standing(m3.Manifold.cube((10.0, 10.0, 20.0)) + arm)
    under = facing_down(mesh, UP, UP_DEG) & (mesh.vertices[mesh.faces, 2].min(axis=1) > 1.0)
    assert mesh.areas_mm2[under].sum() == pytest.approx(10.0 * reach_mm)
    assert set(SupportNeed.of(mesh, PROCESS, 5.0).along(UP[None])[0][under]) == {over_air}


def test_a_face_exposed_by_a_cut_needs_support_where_a_bridge_beside_it_does_not() -> None:
    mesh = standing(m3.Manifold.cube((20.0, 8.0, 12.0)) - m3.Manifold.cube((10.0, 9.0, 10.0)).translate((5.0, -0.5, 0.0)))
    need = SupportNeed.of(mesh, PROCESS, 5.0)
    self_carrying = np.flatnonzero(~need.upright)
    assert mesh.areas_mm2[self_carrying].sum() == pytest.approx(80.0)
    last = Mesh(mesh.vertices, np.roll(mesh.faces, -1 - self_carrying[0], axis=0))
    sources = np.array([-1, len(mesh.faces) - 1], np.int32)
    assert ModelPieces(SupportNeed.of(last, PROCESS, 5.0), sources).upright.tolist() == [True, False]


def test_a_face_that_a_cut_laid_open_needs_support_along_every_direction() -> None:
    mesh = tee()
    rest = below(solid_of(mesh), Plane(UP, 12.0))
    piece = piece_of(rest, origin_of(solid_of(mesh)))
    pieces = ModelPieces(SupportNeed.of(mesh, PROCESS, 5.0), piece.sources)
    opened = piece.mesh.normals[:, 2] > 0.999
    assert piece.mesh.areas_mm2[opened].sum() == pytest.approx(100.0)
    assert pieces.upright[opened].all()
    assert {int(c) for direction in spread(20) for c in pieces.along(direction)[opened]} == {NEEDS_SUPPORT}
