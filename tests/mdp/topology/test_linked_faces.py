"""Faces across edges, held against a search through all faces."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from mdp.mesh import Ints, Mesh
from mdp.topology.edges import edges_of, flat_places, link, opposites
from tests.mdp.solids import random_solid
from tests.shapes import box, tee

triangles = st.lists(st.permutations(range(7)).map(lambda order: order[:3]), min_size=1, max_size=14)


def half_edges(faces: Ints) -> list[tuple[int, int]]:
    return [(int(face[k]), int(face[(k + 1) % 3])) for face in faces for k in range(3)]


@given(triangles)
def test_half_edges_are_paired_with_those_that_run_the_other_way_in_the_order_of_their_faces(corners: list[list[int]]) -> None:
    faces = np.array(corners, dtype=np.int32)
    across, runs = opposites(faces), half_edges(faces)
    for a, b in set(runs):
        there, back = ([h for h, run in enumerate(runs) if run == ends] for ends in ((a, b), (b, a)))
        both = min(len(there), len(back))
        assert across[there].tolist() == back[:both] + [-1] * (len(there) - both)


@pytest.mark.parametrize("seed", range(4))
def test_on_a_closed_solid_every_edge_has_two_faces(seed: int) -> None:
    faces = random_solid(seed).faces
    across = opposites(faces)
    assert np.array_equal(across[across], np.arange(len(across)))
    twins = edges_of(faces.astype(np.int64)).twins
    assert np.array_equal(np.sort(across[twins], axis=1), np.sort(twins, axis=1))


def test_a_linked_surface_knows_the_faces_and_vertices_next_to_each() -> None:
    surface, mesh = link(random_solid(3)), random_solid(3)
    for f, face in enumerate(mesh.faces.tolist()):
        for k in range(3):
            neighbour = mesh.faces[surface.neighbours[f, k]].tolist()
            assert neighbour != face
            assert {face[k], face[(k + 1) % 3]} <= set(neighbour)
    for v in range(0, len(mesh.vertices), 7):
        around = set(mesh.faces[(mesh.faces == v).any(axis=1)].ravel().tolist()) - {v}
        assert set(surface.around[surface.starts[v] : surface.starts[v + 1]].tolist()) == around


@pytest.mark.parametrize(("mesh", "flat"), [(box(), 6), (tee(), 10)])
def test_flat_places_are_the_sides_of_a_box_and_of_a_tee(mesh: Mesh, flat: int) -> None:
    places = flat_places(link(mesh))
    assert len(set(places.tolist())) == flat
    for number in set(places.tolist()):
        assert np.ptp(mesh.normals[places == number], axis=0) == pytest.approx(0.0)
