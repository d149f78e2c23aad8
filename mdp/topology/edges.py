"""Edges of a surface: half-edges, and what they share.

Half-edge 3 f + k runs from corner k of face f to the next corner.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from mdp.mesh import Indices

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
