import manifold3d as m3
import numpy as np

from mdp.mesh import Floats, Mesh
from mdp.sweep.facets import Layout
from mdp.sweep.sweep import Remainder
from tests import shapes


def _bumpy_ball(seed: int) -> Mesh:
    """A finely meshed ball with waves on it."""
    ball = shapes.from_manifold(m3.Manifold.sphere(10.0, 96))
    waves = np.sin(ball.vertices @ np.random.default_rng(seed).normal(0.0, 0.6, (3, 3))).sum(axis=1)
    return Mesh(ball.vertices * (1.0 + 0.05 * waves[:, None]), ball.faces)


def _layout(mesh: Mesh) -> Layout:
    return Remainder(mesh, np.zeros(len(mesh.faces), bool)).layout


def _turns(layout: Layout, heights: Floats) -> list[int]:
    """The number of changes between higher and lower neighbours around each vertex."""
    starts, neighbours = layout.starts, layout.neighbours
    rings = [neighbours[starts[v] : starts[v + 1]] for v in range(len(heights))]
    lower = [heights[ring] < heights[v] for v, ring in enumerate(rings)]
    return [int((side != np.roll(side, 1)).sum()) for side in lower]


def test_a_vertex_leaning_more_than_its_flatness_is_regular() -> None:
    layout = _layout(_bumpy_ball(1))
    for direction in np.random.default_rng(2).normal(size=(5, 3)):
        direction = direction / np.linalg.norm(direction)
        turns = np.array(_turns(layout, direction @ layout.faces.points))
        regular = np.abs(direction @ layout.vertex_normals) < layout.flatness
        assert regular.mean() > 0.8
        assert (turns[regular] == 2).all()


def test_neighbours_form_a_ring_joined_by_faces() -> None:
    layout = _layout(shapes.branch())
    starts, neighbours = layout.starts, layout.neighbours
    corners = {frozenset(face) for face in layout.triangles.faces.tolist()}
    for v in range(len(layout.triangles.vertices)):
        ring = neighbours[starts[v] : starts[v + 1]].tolist()
        assert all(frozenset((v, a, b)) in corners for a, b in zip(ring, ring[1:] + ring[:1], strict=True))


def test_laying_out_moves_vertices_and_faces_but_not_the_surface() -> None:
    mesh = shapes.tee()
    risky = np.arange(len(mesh.faces)) < 5
    facets = Remainder(mesh, risky).facets
    assert facets.mesh.volume_mm3 == mesh.volume_mm3
    assert sorted(facets.mesh.areas_mm2[facets.faces.risky]) == sorted(mesh.areas_mm2[risky])
