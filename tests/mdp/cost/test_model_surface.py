"""Model surface: faces of what cuts leave are traced back to those of the model."""

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from mdp.cost.cost import origin_of, piece_of
from mdp.cut import above, below, solid_of
from mdp.plane import Plane
from mdp.support_need.need import MADE_BY_A_CUT
from tests import shapes


@given(st.floats(0.0, 6.28), st.floats(0.3, 1.5), st.floats(-3.0, 3.0))
@settings(max_examples=20, deadline=None)
def test_a_piece_lies_on_its_source_and_what_has_none_lies_in_a_cut(turn: float, rise: float, shift_mm: float) -> None:
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
    assert (other.sources == MADE_BY_A_CUT).all()  # another solid of the same mesh is another model
    own = solid_of(mesh)
    assert (piece_of(own, origin_of(own)).sources >= 0).all()
