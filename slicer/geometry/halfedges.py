"""Half-edges: which triangle lies across an edge; half-edge 3 f + k runs from vertex k to vertex k + 1 of triangle f."""

import numpy as np
from numpy.typing import NDArray

from mdp.kernels.arrays import ints
from mdp.kernels.kernel import kernel
from mdp.mesh import Ints


def opposites(faces: Ints) -> Ints:
    """(3 m,) for every half-edge of (m, 3) triangles the opposite one; -1 on a border.

    The half-edges of an edge with more than two triangles are paired in the order of their triangles.
    """
    tails = faces.ravel().astype(np.int64)
    heads = faces[:, [1, 2, 0]].ravel().astype(np.int64)
    span = int(tails.max(initial=0)) + 1
    keys = np.minimum(tails, heads) * span + np.maximum(tails, heads)
    paired: Ints = _paired(np.argsort(keys, kind="stable"), keys, tails < heads)
    return paired


@kernel
def _paired(order: NDArray[np.int64], keys: NDArray[np.int64], forward: NDArray[np.bool_]) -> Ints:
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
