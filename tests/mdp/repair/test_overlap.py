"""Bodies that pass through themselves, counted once where that can be told apart."""

import manifold3d as m3
import numpy as np

from mdp.repair.repair import resolve_overlap


def test_a_body_tangled_everywhere_is_given_up_before_its_union_fills_the_memory() -> None:
    mesh = m3.Manifold.sphere(10.0, 48).to_mesh()
    vertices = np.random.default_rng(0).permutation(np.array(mesh.vert_properties[:, :3], float))
    assert resolve_overlap(m3.Manifold(m3.Mesh64(vertices, np.array(mesh.tri_verts, np.uint64)))) is None


def test_a_body_that_does_not_pass_through_itself_stays() -> None:
    block = m3.Manifold.cube((10.0, 20.0, 30.0))
    resolved = resolve_overlap(block)
    assert resolved is not None
    assert (resolved.num_tri(), resolved.volume()) == (12, 6000.0)
