"""Edges of a surface: half-edges, what they share, and what hangs together over them.

Half-edge 3 f + k runs from corner k of face f to the next corner.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from mdp.formats.surface import Indices
from mdp.mesh import Floats

Flags = NDArray[np.bool_]


@dataclass(frozen=True, eq=False)
class Edges:
    """starts, ends: (3 m,) vertices of the half-edges; edge: (3 m,) number of the undirected edge of each."""

    starts: Indices
    ends: Indices
    edge: Indices

    @cached_property
    def counts(self) -> Indices:
        """(edges,) faces at each edge."""
        return np.bincount(self.edge)

    @cached_property
    def forward(self) -> Flags:
        """(3 m,) whether the half-edge runs from its lower to its higher vertex."""
        return self.starts < self.ends

    @cached_property
    def unbalanced(self) -> Indices:
        """Numbers of the edges that are not run through equally often either way."""
        net = np.bincount(self.edge, np.where(self.forward, 1, -1))
        return np.flatnonzero(net)

    @cached_property
    def by_edge(self) -> tuple[Indices, Indices]:
        """Half-edges sorted by edge, and where the run of each edge starts (edges + 1 places)."""
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


def connected_components(count: int, a: Indices, b: Indices) -> Indices:
    """(count,) the least member of the connected component of every node, for edges from a to b.

    Labels hook onto the least label next to them and jump to its root until nothing changes: a few vectorised rounds.
    """
    label = np.arange(count)
    while True:
        here, there = label[a], label[b]
        differ = here != there
        if not differ.any():
            return label
        a, b, here, there = a[differ], b[differ], here[differ], there[differ]
        low = np.minimum(here, there)
        np.minimum.at(label, here, low)
        np.minimum.at(label, there, low)
        while not np.array_equal(root := label[label], label):
            label = root


def normals_of(vertices: Floats, faces: Indices) -> Floats:
    """(m, 3) normals of the faces, as long as twice their areas."""
    a, b, c = (vertices[faces[:, k]] for k in range(3))
    return np.cross(b - a, c - a)


def areas_of(vertices: Floats, faces: Indices) -> Floats:
    """(m,) areas of the faces."""
    areas: Floats = 0.5 * np.linalg.norm(normals_of(vertices, faces), axis=1)
    return areas
