"""Sweep: every offset of a direction evaluated in one pass over the faces, nothing is cut.

For a unit direction d let h = vertex . d. A face adds a piecewise quadratic in the offset c to "area above c", weighted
with 1 (risky areas) or with n . d: by the divergence theorem the n . d-weighted area above c is the cross-section at c and
its first moment about c the volume above c. Faces wholly above an offset go into suffix sums, faces that cross sampled
offsets are added where they cross. Cost: vertices + faces + crossings.

Whether the solid below an offset hangs together with the platform: every vertex belongs to the basin of the lowest vertex
that is reached from it by walking down, and two basins join at the first edge between them, in the order of the offsets.
A lowest vertex around which solid lies beneath is the floor of a void or bowl, not a floating piece: it is joined to its
anchor, the surface that a ray into the solid meets, which lies lower. Solids join only where surfaces join, so the count
of pieces is exact for the solid, closed voids and handles included.
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

    up_mm2: risky area above the plane when printing straight up; residual_mm2: risky area above it when printing along the
    direction; section_mm2: cross-section; volume_mm3: volume above; lowest_mm: least z of what lies above, exact where it is
    below the direction's watched height, some greater number elsewhere; fragile_mm: distance to the nearest surface that the
    plane would cut into a sliver; pieces: components of the solid below that do not reach the platform.
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
        """(e, 2) int32: the vertices of every edge, near edges near each other."""
        starts, ends = self.mesh.faces.reshape(-1), self.mesh.faces[:, [1, 2, 0]].reshape(-1)
        once = starts < ends
        table: Ints = np.ascontiguousarray(np.stack([starts[once], ends[once]], axis=1))
        return table

    @cached_property
    def rising_edges(self) -> Ints:
        """(e, 2) int32: the edges, those with the lowest end first."""
        order = np.argsort(self.mesh.vertices[self.edges, 2].min(axis=1), kind="stable")
        return self.edges[order]

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


def sweep(surface: Surface, directions: Floats, step_mm: float, risky_below: float, watched_mm: Floats | None = None) -> Sweep:
    """Evaluate all offsets of (k, 3) unit directions; risky_below is overhang.threshold of the self-supporting angle.

    watched_mm (k,): the height below which the least z of a part matters; absent: all heights.
    """
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
        surface.rising_edges,
        surface.vertex_normals,
        surface.anchors,
        np.ascontiguousarray(directions),
        np.full(len(directions), np.inf) if watched_mm is None else watched_mm,
        step_mm,
        columns,
        risky_below,
    )
    return Sweep(*results)


@njit(cache=True, parallel=True)
def _sweep(  # type: ignore[no-untyped-def]
    vertices, faces, areas, normals, risky, edges, rising, vertex_normals, anchor, directions, watched, step, columns, risky_below
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
            faces, areas, normals, risky, d, heights, bins, begin, n, step, risky_below,
            up[row], residual[row], section[row], volume[row],
        )  # fmt: skip
        _find_lowest(vertices, rising, heights, bins, begin, n, step, watched[row], lowest[row])
        _find_slivers(vertex_normals, d, heights, bins, begin, n, step, fragile[row])
        _count_pieces(vertices, faces, edges, vertex_normals, anchor, d, heights, bins, n, pieces[row])
    return first, count, up, residual, section, volume, lowest, fragile, pieces


@njit(cache=True)
def _sum_faces(  # type: ignore[no-untyped-def]
    faces, areas, normals, risky, d, heights, bins, begin, n, step, risky_below, up, residual, section, volume
):
    """Areas, cross-section and volume above each offset. bins[v]: how many offsets lie below vertex v."""
    whole, crossing = np.zeros((n + 1, 4)), np.zeros((n, 4))
    for f in range(len(faces)):
        i, j, m = faces[f, 0], faces[f, 1], faces[f, 2]
        a, b, c = heights[i], heights[j], heights[m]
        h0, h2 = min(a, b, c), max(a, b, c)
        h1 = max(min(a, b), min(max(a, b), c))
        below, above = min(bins[i], bins[j], bins[m]), max(bins[i], bins[j], bins[m])
        area = areas[f]
        slope = normals[f, 0] * d[0] + normals[f, 1] * d[1] + normals[f, 2] * d[2]
        up_area = area if risky[f] else 0.0
        residual_area = area if slope < risky_below else 0.0
        leaning = slope * area
        mean = (h0 + h1 + h2) / 3.0
        whole[below, 0] += up_area
        whole[below, 1] += residual_area
        whole[below, 2] += leaning
        whole[below, 3] += leaning * mean
        if below == above:
            continue
        lower, upper = (h1 - h0) * (h2 - h0), (h2 - h1) * (h2 - h0)
        lower = 1.0 / lower if lower > 0.0 else 0.0
        upper = 1.0 / upper if upper > 0.0 else 0.0
        for column in range(below, above):
            c = (begin + column) * step
            if c < h1:
                under = (c - h0) * (c - h0) * lower
                share = 1.0 - under
                moment = mean - c + under * (c - h0) / 3.0
            else:
                share = (h2 - c) * (h2 - c) * upper
                moment = share * (h2 - c) / 3.0
            crossing[column, 0] += up_area * share
            crossing[column, 1] += residual_area * share
            crossing[column, 2] += leaning * share
            crossing[column, 3] += leaning * moment
    for column in range(n - 1, -1, -1):
        if column < n - 1:
            for kind in range(4):
                whole[column + 1, kind] += whole[column + 2, kind]
        up[column] = crossing[column, 0] + whole[column + 1, 0]
        residual[column] = crossing[column, 1] + whole[column + 1, 1]
        section[column] = crossing[column, 2] + whole[column + 1, 2]
        volume[column] = crossing[column, 3] + whole[column + 1, 3] - (begin + column) * step * whole[column + 1, 2]


@njit(cache=True)
def _find_lowest(vertices, edges, heights, bins, begin, n, step, watched, lowest):  # type: ignore[no-untyped-def]
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
def _count_pieces(vertices, faces, edges, vertex_normals, anchor, d, heights, bins, n, pieces):  # type: ignore[no-untyped-def]
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
        if basin[v] != v or anchor[v] < 0:
            continue
        if vertex_normals[v, 0] * d[0] + vertex_normals[v, 1] * d[1] + vertex_normals[v, 2] * d[2] <= 0.0:
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
    order, place = np.empty(many, np.int32), starts.copy()
    for k in range(many):
        b = joins[k, 2]
        order[place[b]] = k
        place[b] += 1
    _join(basin, grounded_at, joins, order, starts, bins, n, pieces)


@njit(cache=True)
def _join(basin, grounded_at, joins, order, starts, bins, n, pieces):  # type: ignore[no-untyped-def]
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
            k = order[at]
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
