"""Seam: where a wall that runs round begins and ends."""

import numpy as np
from numba import njit

from mdp.mesh import Floats

CORNER_MM = 20.0  # a right-angled inner corner is worth this much distance to the rear
LEAST_CORNER = 0.5  # sine of the turn from which on a vertex hides a seam


@njit(cache=True)
def _seam(loop: Floats) -> int:
    """Inner corners first, then the rear (+y): both stay in place from layer to layer. Ties go to the least x."""
    best, at = -1e300, 0
    n = len(loop)
    for i in range(n):
        ax, ay = loop[i, 0] - loop[i - 1, 0], loop[i, 1] - loop[i - 1, 1]
        bx, by = loop[(i + 1) % n, 0] - loop[i, 0], loop[(i + 1) % n, 1] - loop[i, 1]
        length = np.hypot(ax, ay) * np.hypot(bx, by)
        turn = (ax * by - ay * bx) / length if length > 0.0 else 0.0
        score = loop[i, 1] - 1e-3 * loop[i, 0] - (CORNER_MM * turn if turn < -LEAST_CORNER else 0.0)
        if score > best:
            best, at = score, i
    return at


def seamed(loop: Floats) -> Floats:
    """The loop (n, 2), solid on its left, closed and begun at its seam."""
    at = _seam(loop)
    return np.concatenate([loop[at:], loop[: at + 1]])
