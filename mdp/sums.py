"""Sums: what a direction's offsets add up to, face by face (numba kernels of the sweep).

bins[v] is the number of offsets strictly below vertex v; offset column c lies at (begin + c) * step.
"""

import numpy as np
from numba import njit

FRAGILE_COSINE = 0.92  # a surface within 23 degrees of the plane is cut into a sliver when the plane comes too near


@njit(cache=True)
def find_heights(vertices, d, step, heights, bins):  # type: ignore[no-untyped-def]
    """Fill heights and bins of all vertices; returns the first offset's number and the count of offsets in between."""
    least, most = np.inf, -np.inf
    for v in range(len(vertices)):
        h = vertices[v, 0] * d[0] + vertices[v, 1] * d[1] + vertices[v, 2] * d[2]
        heights[v] = h
        least, most = min(least, h), max(most, h)
    begin = int(np.floor(least / step)) + 1
    n = max(int(np.ceil(most / step)) - begin, 0)
    for v in range(len(vertices)):
        bins[v] = min(max(int(np.ceil(heights[v] / step)) - begin, 0), n)
    return begin, n


@njit(cache=True, inline="always")
def _sorted(a, b, c):  # type: ignore[no-untyped-def]
    return min(a, b, c), max(min(a, b), min(max(a, b), c)), max(a, b, c)


@njit(cache=True, inline="always")
def _inverse(x):  # type: ignore[no-untyped-def]
    return 1.0 / x if x > 0.0 else 0.0


@njit(cache=True)
def sum_risks(faces, areas, normals, risky, d, heights, bins, begin, n, step, risky_below, up, residual):  # type: ignore[no-untyped-def]
    """Risky areas above each offset: printed straight up, and along d. Only the faces that are risky either way count."""
    whole, crossing = np.zeros((n + 1, 2)), np.zeros((n, 2))
    for f in range(len(faces)):
        slope = normals[f, 0] * d[0] + normals[f, 1] * d[1] + normals[f, 2] * d[2]
        if not risky[f] and slope >= risky_below:
            continue
        i, j, m = faces[f, 0], faces[f, 1], faces[f, 2]
        h0, h1, h2 = _sorted(heights[i], heights[j], heights[m])
        below, above = min(bins[i], bins[j], bins[m]), max(bins[i], bins[j], bins[m])
        up_area = areas[f] if risky[f] else 0.0
        residual_area = areas[f] if slope < risky_below else 0.0
        whole[below, 0] += up_area
        whole[below, 1] += residual_area
        if below == above:
            continue
        lower, upper = _inverse((h1 - h0) * (h2 - h0)), _inverse((h2 - h1) * (h2 - h0))
        for column in range(below, above):
            c = (begin + column) * step
            share = 1.0 - (c - h0) * (c - h0) * lower if c < h1 else (h2 - c) * (h2 - c) * upper
            crossing[column, 0] += up_area * share
            crossing[column, 1] += residual_area * share
    for column in range(n - 1, -1, -1):
        if column < n - 1:
            for kind in range(2):
                whole[column + 1, kind] += whole[column + 2, kind]
        up[column] = crossing[column, 0] + whole[column + 1, 0]
        residual[column] = crossing[column, 1] + whole[column + 1, 1]


@njit(cache=True)
def sum_volumes(faces, areas, normals, d, heights, bins, begin, n, step, section, volume):  # type: ignore[no-untyped-def]
    """Cross-section at and volume above each offset, by the divergence theorem."""
    whole, crossing = np.zeros((n + 1, 2)), np.zeros((n, 2))
    for f in range(len(faces)):
        i, j, m = faces[f, 0], faces[f, 1], faces[f, 2]
        h0, h1, h2 = _sorted(heights[i], heights[j], heights[m])
        below, above = min(bins[i], bins[j], bins[m]), max(bins[i], bins[j], bins[m])
        leaning = areas[f] * (normals[f, 0] * d[0] + normals[f, 1] * d[1] + normals[f, 2] * d[2])
        mean = (h0 + h1 + h2) / 3.0
        whole[below, 0] += leaning
        whole[below, 1] += leaning * mean
        if below == above:
            continue
        lower, upper = _inverse((h1 - h0) * (h2 - h0)), _inverse((h2 - h1) * (h2 - h0))
        for column in range(below, above):
            c = (begin + column) * step
            if c < h1:
                under = (c - h0) * (c - h0) * lower
                share = 1.0 - under
                moment = mean - c + under * (c - h0) / 3.0
            else:
                share = (h2 - c) * (h2 - c) * upper
                moment = share * (h2 - c) / 3.0
            crossing[column, 0] += leaning * share
            crossing[column, 1] += leaning * moment
    for column in range(n - 1, -1, -1):
        if column < n - 1:
            for kind in range(2):
                whole[column + 1, kind] += whole[column + 2, kind]
        section[column] = crossing[column, 0] + whole[column + 1, 0]
        volume[column] = crossing[column, 1] + whole[column + 1, 1] - (begin + column) * step * whole[column + 1, 0]


@njit(cache=True)
def find_lowest(vertices, edges, heights, bins, begin, n, step, watched, lowest):  # type: ignore[no-untyped-def]
    """Least z above each offset, among vertices and crossings of edges, lowest first, below the watched height."""
    for v in range(len(vertices)):
        b, z = bins[v], vertices[v, 2]
        if z < watched and b > 0:
            lowest[b - 1] = min(lowest[b - 1], z)
    for e in range(len(edges)):
        v, w = edges[e, 0], edges[e, 1]
        if vertices[v, 2] >= watched and vertices[w, 2] >= watched:
            break
        if bins[v] == bins[w]:
            continue
        if bins[v] > bins[w]:
            v, w = w, v
        rise = (vertices[w, 2] - vertices[v, 2]) / (heights[w] - heights[v])
        for column in range(bins[v], bins[w]):
            z = vertices[v, 2] + rise * ((begin + column) * step - heights[v])
            lowest[column] = min(lowest[column], z)
    for column in range(n - 2, -1, -1):
        lowest[column] = min(lowest[column], lowest[column + 1])


@njit(cache=True)
def find_slivers(vertex_normals, d, heights, bins, begin, n, step, fragile):  # type: ignore[no-untyped-def]
    """Distance from each offset up to the next surface facing along d and down to the next one facing against it."""
    above, below = np.full(n + 1, np.inf), np.full(n + 1, -np.inf)
    for v in range(len(heights)):
        cosine = vertex_normals[v, 0] * d[0] + vertex_normals[v, 1] * d[1] + vertex_normals[v, 2] * d[2]
        b = bins[v]
        if cosine > FRAGILE_COSINE and b > 0:
            above[b - 1] = min(above[b - 1], heights[v])
        elif cosine < -FRAGILE_COSINE:
            below[b] = max(below[b], heights[v])
    nearest = np.inf
    for column in range(n - 1, -1, -1):
        nearest = min(nearest, above[column])
        fragile[column] = nearest - (begin + column) * step
    nearest = -np.inf
    for column in range(n):
        nearest = max(nearest, below[column])
        fragile[column] = min(fragile[column], (begin + column) * step - nearest)
