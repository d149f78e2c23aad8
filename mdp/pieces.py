"""Pieces: whether the solid below each offset of a direction hangs together with the platform.

Every vertex belongs to the basin of the lowest vertex that is reached from it by walking down, and two basins join at the
first edge between them, in the order of the offsets. A lowest vertex around which solid lies beneath is the floor of a void
or bowl, not a floating piece: it is joined to its anchor, the surface that a ray into the solid meets, which lies lower.
Solids join only where surfaces join, so the count of pieces is exact for the solid, closed voids and handles included.
"""

import numpy as np
from numba import njit

from mdp.overhang import PLATFORM_TOLERANCE_MM
from mdp.rays import first_hit

UNKNOWN = -2


@njit(cache=True, inline="always")
def _root(parent, v):  # type: ignore[no-untyped-def]
    while parent[v] != v:
        parent[v] = parent[parent[v]]
        v = parent[v]
    return v


@njit(cache=True, inline="always")
def _higher(heights, a, b):  # type: ignore[no-untyped-def]
    """Strict order of the vertices: by height, ties by number."""
    return heights[a] > heights[b] or (heights[a] == heights[b] and a > b)


@njit(cache=True)
def _basins(edges, heights):  # type: ignore[no-untyped-def]
    """For every vertex the lowest vertex that walking down leads to; lowest ones lead to themselves."""
    down = np.arange(len(heights), dtype=np.int32)
    for e in range(len(edges)):
        a, b = edges[e, 0], edges[e, 1]
        upper = b + (a - b) * np.int32(heights[a] > heights[b])  # a < b decides ties; no branch to mispredict
        down[upper] = a + b - upper
    for v in range(len(down)):
        root = down[v]
        while down[root] != root:
            root = down[root]
        w = v
        while down[w] != root:
            down[w], w = root, down[w]
    return down


@njit(cache=True)
def count_pieces(  # type: ignore[no-untyped-def]
    vertices, faces, edges, vertex_normals, anchor, order, low, high, d, heights, bins, n, pieces
):
    """Components below each offset that do not reach the platform."""
    basin = _basins(edges, heights)
    size = len(vertices)
    joins = np.empty((len(edges) + size, 3), np.int32)
    starts = np.zeros(n + 2, np.int32)
    grounded_at = np.full(size, n + 1, np.int32)
    many = 0
    for e in range(len(edges)):
        a, b = basin[edges[e, 0]], basin[edges[e, 1]]
        if a != b:
            joins[many, 0], joins[many, 1] = a, b
            joins[many, 2] = max(bins[edges[e, 0]], bins[edges[e, 1]])
            many += 1
    for v in range(size):
        if vertices[v, 2] <= PLATFORM_TOLERANCE_MM:
            grounded_at[basin[v]] = min(grounded_at[basin[v]], bins[v])
        if basin[v] != v:
            continue
        if vertex_normals[v, 0] * d[0] + vertex_normals[v, 1] * d[1] + vertex_normals[v, 2] * d[2] <= 0.0:
            continue
        if anchor[v] == UNKNOWN:
            # Threads may look up the same vertex twice; the answer does not depend on the direction.
            anchor[v] = first_hit(v, vertices, faces, order, low, high, -vertex_normals[v])
        if anchor[v] < 0:
            continue
        w = faces[anchor[v], 0]
        for corner in (1, 2):
            if _higher(heights, w, faces[anchor[v], corner]):
                w = faces[anchor[v], corner]
        if bins[w] <= bins[v] and basin[w] != v:
            joins[many, 0], joins[many, 1], joins[many, 2] = v, basin[w], bins[v]
            many += 1
    for k in range(many):
        starts[joins[k, 2] + 1] += 1
    for b in range(n + 1):
        starts[b + 1] += starts[b]
    sequence, place = np.empty(many, np.int32), starts.copy()
    for k in range(many):
        b = joins[k, 2]
        sequence[place[b]] = k
        place[b] += 1
    _join(basin, grounded_at, joins, sequence, starts, bins, n, pieces)


@njit(cache=True)
def _join(basin, grounded_at, joins, sequence, starts, bins, n, pieces):  # type: ignore[no-untyped-def]
    """Join basins in the order of the offsets and count those that hang free."""
    size = len(basin)
    parent, grounded = np.arange(size, dtype=np.int32), np.zeros(size, np.bool_)
    fresh, landing = np.zeros(n + 2, np.int32), np.full(n + 2, -1, np.int32)
    following = np.full(size, -1, np.int32)
    for v in range(size):
        if basin[v] == v:
            fresh[bins[v]] += 1
            at = min(grounded_at[v], n + 1)
            following[v] = landing[at]
            landing[at] = v
    floating = 0
    for b in range(n):
        floating += fresh[b]
        for at in range(starts[b], starts[b + 1]):
            k = sequence[at]
            a, c = _root(parent, joins[k, 0]), _root(parent, joins[k, 1])
            if a != c:
                if not (grounded[a] and grounded[c]):
                    floating -= 1
                parent[max(a, c)] = min(a, c)
                grounded[min(a, c)] = grounded[a] or grounded[c]
        v = landing[b]
        while v >= 0:
            root = _root(parent, v)
            if not grounded[root]:
                grounded[root] = True
                floating -= 1
            v = following[v]
        pieces[b] = floating
