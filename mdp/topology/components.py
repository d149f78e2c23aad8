"""Connected components of graphs, and of a surface over its vertices.

Kernels find them by union-find: growing sets, each represented by one of its members (path halving).
"""

import numpy as np

from mdp.kernels.arrays import ints
from mdp.kernels.kernel import helper, no_nrt
from mdp.mesh import Indices, Ints


def connected_components(count: int, a: Ints | Indices, b: Ints | Indices) -> Indices:
    """(count,) the least member of the connected component of every node, for edges from a to b.

    Labels hook onto the least neighbouring label and jump to its root until nothing changes, in a few vectorised rounds.

    >>> connected_components(5, np.array([0, 3]), np.array([2, 4]))
    array([0, 1, 0, 3, 3])
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


def vertex_components(count: int, faces: Ints | Indices) -> Indices:
    """(count,) the least vertex of each vertex's connected component over (m, 3) faces."""
    return connected_components(count, faces[:, [0, 1]].ravel(), faces[:, [1, 2]].ravel())


@helper
def singletons(size: int) -> Ints:
    """The parents of `size` separate sets with one member each."""
    parent = ints(size, 0)
    for member in range(size):
        parent[member] = member
    return parent


@no_nrt
def root(parent: Ints, member: int) -> int:
    """The representative of a member's set."""
    while parent[member] != member:
        parent[member] = parent[parent[member]]
        member = parent[member]
    return member


@helper
def join(parent: Ints, a: int, b: int) -> None:
    """Join two sets; the lesser of their representatives represents both."""
    p, q = root(parent, a), root(parent, b)
    parent[max(p, q)] = min(p, q)
