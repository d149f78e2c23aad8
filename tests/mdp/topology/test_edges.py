"""Edges of any faces, oriented or not, counted one by one; faces across edges; growing sets, against a graph."""

from collections import Counter
from itertools import pairwise

import networkx as nx
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numba import njit

from mdp.mesh import Ints, Mesh
from mdp.topology import components
from mdp.topology.components import vertex_components
from mdp.topology.edges import edges_of, flat_places, link, opposites
from tests.mdp.solids import random_solid
from tests.shapes import box, hollow, tee

triangles = st.lists(st.permutations(range(7)).map(lambda order: order[:3]), max_size=14)


def runs(corners: list[list[int]]) -> list[tuple[int, int]]:
    """The half-edges of all faces."""
    return [(face[k], face[(k + 1) % 3]) for face in corners for k in range(3)]


@given(triangles)
def test_an_edge_counts_its_faces_and_is_balanced_if_both_directions_are_equal(
    corners: list[list[int]],
) -> None:
    half = runs(corners)
    edges = edges_of(np.array(corners, np.int64).reshape(-1, 3))
    assert list(zip(edges.starts.tolist(), edges.ends.tolist(), strict=True)) == half
    many, ways = Counter(frozenset(run) for run in half), Counter(half)
    assert len(edges.counts) == len(many)
    assert [int(n) for n in edges.counts[edges.edge]] == [many[frozenset(run)] for run in half]
    tilted = [ways[a, b] != ways[b, a] for a, b in half]
    assert np.isin(edges.edge, edges.unbalanced).tolist() == tilted
    assert edges.forward.tolist() == [a < b for a, b in half]


@given(triangles)
def test_half_edges_by_edge_are_each_there_once_and_twins_are_the_two_of_an_edge_with_two_faces(corners: list[list[int]]) -> None:
    half = runs(corners)
    edges = edges_of(np.array(corners, np.int64).reshape(-1, 3))
    order, bounds = edges.by_edge
    assert sorted(order.tolist()) == list(range(len(half)))
    shared = [order[a:b].tolist() for a, b in pairwise(bounds)]
    assert all(len({frozenset(half[h]) for h in halves}) == 1 and halves == sorted(halves) for halves in shared)
    assert edges.twins.tolist() == [halves for halves in shared if len(halves) == 2]


@given(triangles)
def test_connected_vertices_equal_those_of_a_graph_library(corners: list[list[int]]) -> None:
    whole = nx.Graph(runs(corners))
    whole.add_nodes_from(range(7))
    least = {v: min(component) for component in nx.connected_components(whole) for v in component}
    assert vertex_components(7, np.array(corners, np.int64).reshape(-1, 3)).tolist() == [least[v] for v in range(7)]


@njit
def _joined(size: int, pairs: Ints) -> Ints:
    parent = components.singletons(size)
    for k in range(len(pairs)):
        components.join(parent, pairs[k, 0], pairs[k, 1])
    for member in range(size):
        parent[member] = components.root(parent, member)
    return parent


@given(st.lists(st.tuples(st.integers(0, 19), st.integers(0, 19)), max_size=30))
def test_sets_that_were_joined_are_known_by_their_least_member(pairs: list[tuple[int, int]]) -> None:
    whole = nx.Graph(pairs)
    whole.add_nodes_from(range(20))
    least = {v: min(component) for component in nx.connected_components(whole) for v in component}
    assert _joined(20, np.array(pairs, np.int32).reshape(-1, 2)).tolist() == [least[v] for v in range(20)]


@pytest.mark.parametrize(("mesh", "shells"), [(box(), 1), (hollow(), 2)])
def test_a_void_is_a_separate_shell(mesh: Mesh, shells: int) -> None:
    assert len(set(vertex_components(len(mesh.vertices), mesh.faces).tolist())) == shells
    assert len(edges_of(mesh.faces.astype(np.int64)).unbalanced) == 0


def test_a_closed_surface_has_the_edges_of_euler_s_formula_and_one_with_a_hole_has_a_border() -> None:
    mesh = random_solid(6)
    edges = edges_of(mesh.faces.astype(np.int64))
    assert len(edges.counts) * 2 == len(mesh.faces) * 3
    genus_term = len(mesh.vertices) - len(edges.counts) + len(mesh.faces)
    assert genus_term % 2 == 0
    opened = opposites(mesh.faces[1:])
    assert (opened < 0).sum() == len(edges_of(mesh.faces[1:].astype(np.int64)).unbalanced) == 3


def test_no_faces_have_no_neighbours() -> None:
    nothing = np.zeros((0, 3), np.int32)
    assert opposites(nothing).tolist() == []
    surface = link(Mesh(np.zeros((2, 3)), nothing))
    assert (surface.neighbours.shape, surface.starts.tolist()) == ((0, 3), [0, 0, 0])


@given(triangles)
def test_half_edges_are_paired_with_opposite_ones_in_face_order(corners: list[list[int]]) -> None:
    across, half = opposites(np.array(corners, np.int32).reshape(-1, 3)), runs(corners)
    for a, b in set(half):
        there, back = ([h for h, run in enumerate(half) if run == ends] for ends in ((a, b), (b, a)))
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
