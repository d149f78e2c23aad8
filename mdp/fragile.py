"""Fragile: how near a plane comes to what it would leave too thin to print, or to what is thin already (kernels of the sweep).

A surface nearly level with the plane and close to it becomes a sliver. A fin, a bridge or a plate is thin by itself: a plane
through it leaves an interface no wider than it is thick. A face is thin when a ray from its middle into the solid soon meets one
that looks the other way; near an acute edge the other face looks aside, that is no thin wall.
"""

import numpy as np
from numba import njit, prange

from mdp.rays import first_hit
from mdp.sums import BLOCK, column_over, dot

SLIVER_COSINE = 0.92  # a surface within 23 degrees of the plane is cut into a sliver when the plane comes too near
OPPOSITE_COSINE = 0.8  # two faces of one wall or rod look opposite ways, within 37 degrees


@njit(cache=True)
def find_slivers(corners, normals, d, heights, n, step, fragile):  # type: ignore[no-untyped-def]
    """Distance from each offset up to the next corner of a face looking along d, down to the next of one looking against it."""
    above, below, cosines = np.full(n + 1, np.inf), np.full(n + 1, -np.inf), np.empty(BLOCK)
    for begin in range(0, corners.shape[1], BLOCK):
        end = min(begin + BLOCK, corners.shape[1])
        dot(normals[0, begin:end], normals[1, begin:end], normals[2, begin:end], d[0], d[1], d[2], cosines[: end - begin])
        for f in range(begin, end):
            cosine = cosines[f - begin]
            if abs(cosine) > SLIVER_COSINE:
                for k in range(3):
                    height = heights[corners[k, f]]
                    b = min(column_over(height), n)
                    if cosine < 0.0:
                        below[b] = max(below[b], height)
                    elif b > 0:
                        above[b - 1] = min(above[b - 1], height)
    nearest = np.inf
    for column in range(n - 1, -1, -1):
        nearest = min(nearest, above[column])
        fragile[column] = (nearest - column) * step
    nearest = -np.inf
    for column in range(n):
        nearest = max(nearest, below[column])
        fragile[column] = min(fragile[column], (column - nearest) * step)


@njit(cache=True, parallel=True)
def thin_faces(vertices, faces, normals, low, high, thickness):  # type: ignore[no-untyped-def]
    """(m,) whether the solid is thinner than `thickness` mm under the middle of a face. low, high: boxes over the faces."""
    thin = np.zeros(len(faces), np.bool_)
    for f in prange(len(faces)):
        middle = (vertices[faces[f, 0]] + vertices[faces[f, 1]] + vertices[faces[f, 2]]) / 3.0
        thin[f] = first_hit(middle, -normals[f], thickness, -1, OPPOSITE_COSINE, vertices, faces, normals, low, high) >= 0
    return thin


@njit(cache=True)
def find_thin(corners, thin, heights, n, step, distance):  # type: ignore[no-untyped-def]
    """Distance from each offset to the nearest thin face, 0 where the plane goes through one; thin: numbers of the faces."""
    above, below, through = np.full(n + 1, np.inf), np.full(n + 1, -np.inf), np.zeros(n + 1, np.int32)
    for f in thin:
        a, b, c = heights[corners[0, f]], heights[corners[1, f]], heights[corners[2, f]]
        low, high = min(a, b, c), max(a, b, c)
        first, last = min(column_over(low), n), min(column_over(high), n)
        through[first] += 1
        through[last] -= 1
        below[last] = max(below[last], high)
        if first > 0:
            above[first - 1] = min(above[first - 1], low)
    nearest = np.inf
    for column in range(n - 1, -1, -1):
        nearest = min(nearest, above[column])
        distance[column] = (nearest - column) * step
    nearest, open_faces = -np.inf, 0
    for column in range(n):
        nearest = max(nearest, below[column])
        open_faces += through[column]
        distance[column] = 0.0 if open_faces > 0 else min(distance[column], (column - nearest) * step)
