"""Edges of a surface: half-edges and their undirected edges, and a surface with the adjacent face over every edge, for kernels.

Half-edge 3 f + k runs from corner k of face f to the next corner.
"""

from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from mdp.kernels.arrays import ints
from mdp.kernels.kernel import kernel
from mdp.mesh import Floats, Indices, Ints, Mesh
from mdp.topology.components import connected_components

Flags = NDArray[np.bool_]
FLAT_COSINE = 1.0 - 1e-9  # cosine between the normals of neighbours in one flat region: some 0.003 degrees


@dataclass(frozen=True, eq=False)
class Edges:
    """starts, ends: (3 m,) vertices of the half-edges; edge: (3 m,) number of the undirected edge of each."""

    starts: Indices
    ends: Indices
    edge: Indices

    @cached_property
    def counts(self) -> Indices:
        """(edges,) number of faces at each edge."""
        return np.bincount(self.edge)

    @cached_property
    def forward(self) -> Flags:
        """(3 m,) whether the half-edge runs from its lower to its higher vertex."""
        return self.starts < self.ends

    @cached_property
    def unbalanced(self) -> Indices:
        """Numbers of the edges that are not traversed equally often in both directions."""
        net = np.bincount(self.edge, np.where(self.forward, 1, -1))
        return np.flatnonzero(net)

    @cached_property
    def by_edge(self) -> tuple[Indices, Indices]:
        """Half-edges sorted by edge, and the start of each edge's run (edges + 1 positions)."""
        return np.argsort(self.edge, kind="stable"), np.concatenate([[0], np.cumsum(self.counts)])

    @cached_property
    def twins(self) -> Indices:
        """(k, 2) half-edges of the edges that exactly two faces share."""
        order, runs = self.by_edge
        firsts = runs[:-1][self.counts == 2]
        return np.stack([order[firsts], order[firsts + 1]], axis=1)


def edges_of(faces: Indices) -> Edges:
    """The edges of (m, 3) faces."""
    starts, ends = faces.ravel(), np.roll(faces, -1, axis=1).ravel()
    low, high = np.minimum(starts, ends), np.maximum(starts, ends)
    _, edge = np.unique(low * (int(faces.max(initial=0)) + 1) + high, return_inverse=True)
    return Edges(starts, ends, edge)


def opposites(faces: Ints | Indices) -> Ints:
    """(3 m,) the opposite half-edge, on the adjacent face, of every half-edge of (m, 3) faces; -1 on a border.

    The half-edges of an edge with more than two faces are paired in the order of their faces.

    >>> opposites(np.array([[0, 1, 2], [2, 1, 3]]))
    array([-1,  3, -1,  1, -1, -1], dtype=int32)
    """
    starts, ends = faces.ravel().astype(np.int64), faces[:, [1, 2, 0]].ravel().astype(np.int64)
    keys = np.minimum(starts, ends) * (int(starts.max(initial=0)) + 1) + np.maximum(starts, ends)
    return _paired(np.argsort(keys, kind="stable"), keys, starts < ends)


@kernel
def _paired(order: Indices, keys: Indices, forward: NDArray[np.bool_]) -> Ints:
    """Pair the half-edges of every key. order: half-edges sorted by key."""
    paired: Ints = ints(len(keys), -1)
    start = 0
    while start < len(order):
        end = start
        while end < len(order) and keys[order[end]] == keys[order[start]]:
            end += 1
        for a in range(start, end):
            for b in range(a + 1, end):
                p, q = order[a], order[b]
                if paired[p] < 0 and paired[q] < 0 and forward[p] != forward[q]:
                    paired[p], paired[q] = q, p
        start = end
    return paired


class LinkedFaces(NamedTuple):
    """A surface of m faces and n vertices: vertices (3, n), faces (m, 3), unit normals (3, m), areas (m,), neighbours (m, 3): the
    adjacent face over the edge from corner k to the next one, negative if there is none; the neighbours of vertex v are
    around[starts[v] : starts[v + 1]].
    """

    vertices: Floats
    faces: Ints
    normals: Floats
    areas_mm2: Floats
    neighbours: Ints
    starts: Ints
    around: Ints


def link(mesh: Mesh) -> LinkedFaces:
    """A mesh with the neighbours of its faces and vertices."""
    begins, ends = mesh.faces.ravel(), np.roll(mesh.faces, -1, axis=1).ravel()
    order = np.lexsort((ends, begins))
    return LinkedFaces(
        vertices=np.ascontiguousarray(mesh.vertices.T),
        faces=mesh.faces,
        normals=np.ascontiguousarray(mesh.normals.T),
        areas_mm2=mesh.areas_mm2,
        neighbours=opposites(mesh.faces).reshape(-1, 3) // 3,
        starts=np.searchsorted(begins[order], np.arange(len(mesh.vertices) + 1)).astype(np.int32),
        around=ends[order],
    )


def flat_places(surface: LinkedFaces) -> Ints:
    """(m,) the least face of each face's flat region."""
    face, corner = np.nonzero(surface.neighbours >= 0)
    across, (x, y, z) = surface.neighbours[face, corner], surface.normals
    flat = x[face] * x[across] + y[face] * y[across] + z[face] * z[across] > FLAT_COSINE
    return connected_components(len(surface.faces), face[flat], across[flat]).astype(np.int32)
