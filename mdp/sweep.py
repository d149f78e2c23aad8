"""Sweep: every offset of a direction evaluated in one pass over the faces, nothing is cut.

For a unit direction d let h = vertex . d. A face adds a piecewise quadratic in the offset c to "area above c", weighted
with 1 (risky areas) or with n . d: by the divergence theorem the n . d-weighted area above c is the cross-section at c and
its first moment about c the volume above c. Faces wholly above an offset go into suffix sums, faces that cross sampled
offsets are added where they cross. Cost: vertices + faces + crossings.

Whether the solid below an offset hangs together with the platform is a union-find over the mesh edges in the order of the
offsets. An edge that is the longest step of a neighbouring face (its ends are the face's lowest and highest vertex) is
implied by the other two and left out. A lowest vertex around which solid lies beneath is the floor of a void or bowl, not
a floating piece: it is joined to its anchor, the surface that a ray into the solid meets, which lies lower. Solids join
only where surfaces join, so the count of pieces is exact for the solid, closed voids and handles included.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numba import njit, prange

from mdp.mesh import Floats, Ints, Mesh
from mdp.overhang import PLATFORM_TOLERANCE_MM, Mask
from mdp.rays import anchors

FRAGILE_COSINE = 0.92  # a surface within 23 degrees of the plane is cut into a sliver when the plane comes too near


@dataclass(frozen=True, eq=False)
class Sweep:
    """Values for each of k directions (rows) and its offsets c = (first + column) * step; columns beyond count are unused.

    up_mm2: risky area above the plane when printing straight up; residual_mm2: risky area above it when printing along
    the direction; section_mm2: cross-section; volume_mm3: volume above; lowest_mm: least z of what lies above;
    fragile_mm: distance to the nearest surface that the plane would cut into a sliver; pieces: components of the solid
    below that do not reach the platform.
    """

    first: Ints
    count: Ints
    up_mm2: Floats
    residual_mm2: Floats
    section_mm2: Floats
    volume_mm3: Floats
    lowest_mm: Floats
    fragile_mm: Floats
    pieces: Ints


@dataclass(frozen=True, eq=False)
class Surface:
    """What the sweep needs to know of a solid, made once for all directions."""

    mesh: Mesh
    risky: Mask

    @cached_property
    def edges(self) -> Ints:
        """(e, 4) int32: the two vertices of every edge and the two vertices opposite to it."""
        faces = self.mesh.faces
        starts, ends, opposite = (faces[:, order].reshape(-1) for order in ([0, 1, 2], [1, 2, 0], [2, 0, 1]))
        low, high = np.minimum(starts, ends).astype(np.int64), np.maximum(starts, ends)
        order = np.argsort(low * len(self.mesh.vertices) + high, kind="stable")
        pairs = order.reshape(-1, 2)
        table: Ints = np.stack([starts[pairs[:, 0]], ends[pairs[:, 0]], opposite[pairs[:, 0]], opposite[pairs[:, 1]]], axis=1)
        return np.ascontiguousarray(table[np.argsort(table[:, 0], kind="stable")], dtype=np.int32)

    @cached_property
    def vertex_normals(self) -> Floats:
        """(n, 3) unit angle-weighted normals; their sign tells on which side of a vertex the solid lies (Baerentzen, Aanaes)."""
        corners = self.mesh.vertices[self.mesh.faces]
        total = np.zeros((len(self.mesh.vertices), 3))
        for k in range(3):
            a = corners[:, (k + 1) % 3] - corners[:, k]
            b = corners[:, (k + 2) % 3] - corners[:, k]
            angle = np.arctan2(np.linalg.norm(np.cross(a, b), axis=1), np.einsum("ij,ij->i", a, b))
            for axis in range(3):
                total[:, axis] += np.bincount(self.mesh.faces[:, k], angle * self.mesh.normals[:, axis], len(total))
        lengths = np.linalg.norm(total, axis=1, keepdims=True)
        return total / np.where(lengths > 0, lengths, 1.0)

    @cached_property
    def anchors(self) -> Ints:
        """(n,) the face met from each vertex into the solid, -1 where none is."""
        return anchors(self.mesh, -self.vertex_normals)


def sweep(surface: Surface, directions: Floats, step_mm: float, risky_below: float) -> Sweep:
    """Evaluate all offsets of (k, 3) unit directions; risky_below is overhang.threshold of the self-supporting angle."""
    mesh = surface.mesh
    reach = 0.5 * float(np.linalg.norm(mesh.bounds_mm[1] - mesh.bounds_mm[0]))
    columns = int(2.0 * reach / step_mm) + 3
    results = _sweep(
        mesh.vertices,
        mesh.faces,
        mesh.areas_mm2,
        mesh.normals,
        surface.risky,
        surface.edges,
        surface.vertex_normals,
        surface.anchors,
        np.ascontiguousarray(directions),
        step_mm,
        columns,
        risky_below,
    )
    return Sweep(*results)


@njit(cache=True, parallel=True)
def _sweep(  # type: ignore[no-untyped-def]
    vertices, faces, areas, normals, risky, edges, vertex_normals, anchor, directions, step, columns, risky_below
):
    k = len(directions)
    first, count = np.zeros(k, np.int32), np.zeros(k, np.int32)
    up, residual = np.zeros((k, columns)), np.zeros((k, columns))
    section, volume = np.zeros((k, columns)), np.zeros((k, columns))
    lowest, fragile = np.full((k, columns), np.inf), np.full((k, columns), np.inf)
    pieces = np.zeros((k, columns), np.int32)
    for row in prange(k):
        d = directions[row]
        heights = np.empty(len(vertices))
        least, most = np.inf, -np.inf
        for v in range(len(vertices)):
            h = vertices[v, 0] * d[0] + vertices[v, 1] * d[1] + vertices[v, 2] * d[2]
            heights[v] = h
            least, most = min(least, h), max(most, h)
        begin = int(np.floor(least / step)) + 1
        n = max(int(np.ceil(most / step)) - begin, 0)
        first[row], count[row] = begin, n
        if n == 0:
            continue
        bins = np.empty(len(vertices), np.int32)
        for v in range(len(vertices)):
            bins[v] = min(max(int(np.ceil(heights[v] / step)) - begin, 0), n)
        _sum_faces(
            vertices, faces, areas, normals, risky, d, heights, bins, begin, n, step, risky_below,
            up[row], residual[row], section[row], volume[row], lowest[row],
        )  # fmt: skip
        _find_slivers(vertex_normals, d, heights, bins, begin, n, step, fragile[row])
        _count_pieces(vertices, faces, edges, vertex_normals, anchor, d, heights, bins, n, pieces[row])
    return first, count, up, residual, section, volume, lowest, fragile, pieces


@njit(cache=True)
def _sum_faces(  # type: ignore[no-untyped-def]
    vertices, faces, areas, normals, risky, d, heights, bins, begin, n, step, risky_below,
    up, residual, section, volume, lowest,
):  # fmt: skip
    """Areas, cross-section, volume and lowest point above each offset. bins[v]: how many offsets lie below vertex v."""
    whole = np.zeros((4, n))
    for v in range(len(vertices)):
        b = bins[v]
        if b > 0:
            lowest[b - 1] = min(lowest[b - 1], vertices[v, 2])
    for f in range(len(faces)):
        i, j, m = faces[f, 0], faces[f, 1], faces[f, 2]
        if heights[i] > heights[j]:
            i, j = j, i
        if heights[j] > heights[m]:
            j, m = m, j
        if heights[i] > heights[j]:
            i, j = j, i
        area = areas[f]
        slope = normals[f, 0] * d[0] + normals[f, 1] * d[1] + normals[f, 2] * d[2]
        up_area = area if risky[f] else 0.0
        residual_area = area if slope < risky_below else 0.0
        h0, h1, h2 = heights[i], heights[j], heights[m]
        mean = (h0 + h1 + h2) / 3.0
        below, above = bins[i], bins[m]
        if below > 0:
            whole[0, below - 1] += up_area
            whole[1, below - 1] += residual_area
            whole[2, below - 1] += slope * area
            whole[3, below - 1] += slope * area * mean
        for column in range(below, above):
            c = (begin + column) * step
            if c < h1:
                under = (c - h0) * (c - h0) / ((h1 - h0) * (h2 - h0))
                share = 1.0 - under
                moment = mean - c + under * (c - h0) / 3.0
                z = vertices[i, 2] + (vertices[j, 2] - vertices[i, 2]) * (c - h0) / (h1 - h0)
            elif h2 > h1:
                share = (h2 - c) * (h2 - c) / ((h2 - h1) * (h2 - h0))
                moment = share * (h2 - c) / 3.0
                z = vertices[j, 2] + (vertices[m, 2] - vertices[j, 2]) * (c - h1) / (h2 - h1)
            else:
                share, moment, z = 0.0, 0.0, vertices[m, 2]
            z_long = vertices[i, 2] + (vertices[m, 2] - vertices[i, 2]) * (c - h0) / (h2 - h0)
            lowest[column] = min(lowest[column], z, z_long)
            up[column] += up_area * share
            residual[column] += residual_area * share
            section[column] += slope * area * share
            volume[column] += slope * area * moment
    for column in range(n - 1, -1, -1):
        if column < n - 1:
            for kind in range(4):
                whole[kind, column] += whole[kind, column + 1]
            lowest[column] = min(lowest[column], lowest[column + 1])
        up[column] += whole[0, column]
        residual[column] += whole[1, column]
        section[column] += whole[2, column]
        volume[column] += whole[3, column] - (begin + column) * step * whole[2, column]


@njit(cache=True)
def _find_slivers(vertex_normals, d, heights, bins, begin, n, step, fragile):  # type: ignore[no-untyped-def]
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
def _count_pieces(vertices, faces, edges, vertex_normals, anchor, d, heights, bins, n, pieces):  # type: ignore[no-untyped-def]
    """Components below each offset that do not reach the platform."""
    size = len(vertices)
    joins = np.empty((len(edges) + size, 2), np.int32)
    starts = np.zeros(n + 2, np.int32)
    has_lower = np.zeros(size, np.bool_)
    many = 0
    for e in range(len(edges)):
        low, high = edges[e, 0], edges[e, 1]
        if _higher(heights, low, high):
            low, high = high, low
        has_lower[high] = True
        for side in (2, 3):
            w = edges[e, side]
            if _higher(heights, w, low) and _higher(heights, high, w):
                low = -1
                break
        if low >= 0:
            joins[many, 0], joins[many, 1] = high, low
            starts[bins[high] + 1] += 1
            many += 1
    for v in range(size):
        if has_lower[v] or anchor[v] < 0:
            continue
        if vertex_normals[v, 0] * d[0] + vertex_normals[v, 1] * d[1] + vertex_normals[v, 2] * d[2] <= 0.0:
            continue
        f = anchor[v]
        w = faces[f, 0]
        for corner in (1, 2):
            if _higher(heights, w, faces[f, corner]):
                w = faces[f, corner]
        if bins[w] <= bins[v]:
            joins[many, 0], joins[many, 1] = v, w
            starts[bins[v] + 1] += 1
            many += 1
    for b in range(n + 1):
        starts[b + 1] += starts[b]
    order, place = np.empty(many, np.int32), starts.copy()
    for k in range(many):
        b = bins[joins[k, 0]]
        order[place[b]] = k
        place[b] += 1
    _join(vertices, joins, order, starts, bins, n, pieces)


@njit(cache=True)
def _join(vertices, joins, order, starts, bins, n, pieces):  # type: ignore[no-untyped-def]
    size = len(vertices)
    parent, grounded = np.empty(size, np.int32), np.empty(size, np.bool_)
    added = np.zeros(n + 1, np.int32)
    for v in range(size):
        parent[v] = v
        grounded[v] = vertices[v, 2] <= PLATFORM_TOLERANCE_MM
        if not grounded[v]:
            added[bins[v]] += 1
    floating = 0
    for b in range(n):
        floating += added[b]
        for place in range(starts[b], starts[b + 1]):
            k = order[place]
            a, c = _root(parent, joins[k, 0]), _root(parent, joins[k, 1])
            if a != c:
                if not (grounded[a] and grounded[c]):
                    floating -= 1
                if a < c:
                    a, c = c, a
                parent[a] = c
                grounded[c] = grounded[a] or grounded[c]
        pieces[b] = floating
