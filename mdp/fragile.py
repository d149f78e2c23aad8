"""Fragile: how near a plane comes to what it would leave too thin to print (kernels of the sweep)."""

import numpy as np
from numba import njit

from mdp.sums import column_over

SLIVER_COSINE = 0.92  # a surface within 23 degrees of the plane is cut into a sliver when the plane comes too near


@njit(cache=True)
def find_slivers(cosines, heights, n, step, fragile):  # type: ignore[no-untyped-def]
    """Distance from each offset up to the next surface facing along d and down to the next one facing against it."""
    above, below = np.full(n + 1, np.inf), np.full(n + 1, -np.inf)
    for v in range(len(heights)):
        if abs(cosines[v]) > SLIVER_COSINE:
            b = min(column_over(heights[v]), n)
            if cosines[v] < 0.0:
                below[b] = max(below[b], heights[v])
            elif b > 0:
                above[b - 1] = min(above[b - 1], heights[v])
    nearest = np.inf
    for column in range(n - 1, -1, -1):
        nearest = min(nearest, above[column])
        fragile[column] = (nearest - column) * step
    nearest = -np.inf
    for column in range(n):
        nearest = max(nearest, below[column])
        fragile[column] = min(fragile[column], (column - nearest) * step)
