"""Fragile: how near a plane comes to what it would leave too thin to print, or to what is thin already.

A surface nearly level with the plane and close to it becomes a sliver. A fin, a bridge or a plate is thin by itself: a plane
through it leaves an interface no wider than it is thick. A face is thin when a ray from its middle into the solid soon meets one
that looks the other way; near an acute edge the other face looks aside, that is no thin wall.
"""

import numpy as np

from mdp.kernel import flags, floats, inlined, kernel, part
from mdp.mesh import Floats
from mdp.plane import Plane
from mdp.rays import first_hit
from mdp.sums import column_over

THIN_MM = 1.0  # walls and rods of two lines or less are fragile where a plane crosses them
SLIVER_COSINE = 0.92  # a surface within 23 degrees of the plane is cut into a sliver when the plane comes too near
OPPOSITE_COSINE = 0.8  # two faces of one wall or rod look opposite ways, within 37 degrees


@inlined
def _note(cosine, height, n, above, below):  # type: ignore[no-untyped-def]
    b = min(column_over(height), n)
    if cosine < 0.0:
        below[b] = max(below[b], height)
    elif b > 0:
        above[b - 1] = min(above[b - 1], height)


@part
def find_slivers(cosines, flatness, sharp, corners, normals, d, heights, n, step, fragile):  # type: ignore[no-untyped-def]
    """Distance from each offset up to the next surface looking along d and down to the next one looking against it.

    Where the surface is smooth the normal of a vertex tells where it looks, at an edge or corner those of its faces do. sharp:
    numbers 3 f + k of the face corners at edges.
    """
    above, below = floats(n + 1, np.inf), floats(n + 1, -np.inf)
    for v in range(len(heights)):
        if abs(cosines[v]) > SLIVER_COSINE and flatness[v] > SLIVER_COSINE:
            _note(cosines[v], heights[v], n, above, below)
    for corner in sharp:
        f = corner // 3
        cosine = normals[0, f] * d[0] + normals[1, f] * d[1] + normals[2, f] * d[2]
        if abs(cosine) > SLIVER_COSINE:
            _note(cosine, heights[corners[corner % 3, f]], n, above, below)
    nearest = np.inf
    for column in range(n - 1, -1, -1):
        nearest = min(nearest, above[column])
        fragile[column] = (nearest - column) * step
    nearest = -np.inf
    for column in range(n):
        nearest = max(nearest, below[column])
        fragile[column] = min(fragile[column], (column - nearest) * step)


@kernel
def thin_faces(vertices, faces, normals, low, high, thickness):  # type: ignore[no-untyped-def]
    """(m,) whether the solid is thinner than `thickness` mm under the middle of a face. low, high: boxes over the faces."""
    thin, middle, ray = flags(len(faces)), floats(3, 0.0), floats(3, 0.0)
    for f in range(len(faces)):
        for axis in range(3):
            total = vertices[faces[f, 0], axis] + vertices[faces[f, 1], axis] + vertices[faces[f, 2], axis]
            middle[axis], ray[axis] = total / 3.0, -normals[f, axis]
        thin[f] = first_hit(middle, ray, thickness, -1, OPPOSITE_COSINE, vertices, faces, normals, low, high) >= 0
    return thin


def least_distance_mm(corners: Floats, plane: Plane) -> float:
    """Distance from a plane to the nearest of some triangles, (k, 3, 3) corners, 0 where it meets one, infinite for none."""
    heights = corners @ plane.normal - plane.offset_mm
    low, high = heights.min(axis=1, initial=np.inf), heights.max(axis=1, initial=-np.inf)
    return float(np.maximum(np.maximum(low, -high), 0.0).min(initial=np.inf))
