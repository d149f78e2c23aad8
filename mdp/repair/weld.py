"""Weld: merge coincident vertices, first exactly, then along open edges within a small distance."""

from itertools import pairwise

import numpy as np

from mdp.formats.surface import Surface
from mdp.mesh import Indices
from mdp.topology.components import connected_components
from mdp.topology.edges import edges_of

# direction along which vertices are sorted; no common direction of a model is square to it
SKEW = np.array([0.5773, 0.6841, 0.4459])


def merge_vertices(surface: Surface) -> Surface:
    """Merge equal vertices, in order of first use, and drop the faces that collapse."""
    vertices = surface.vertices + 0.0  # -0.0 and 0.0 are equal
    order = np.lexsort(vertices.T)
    fresh = np.ones(len(vertices), dtype=bool)
    fresh[1:] = (vertices[order[1:]] != vertices[order[:-1]]).any(axis=1)
    merged = np.empty(len(vertices), dtype=np.int64)
    merged[order] = np.cumsum(fresh) - 1
    return drop_unused_vertices(Surface(vertices[order[fresh]], drop_collapsed_faces(merged[surface.faces])))


def merge_rim_vertices(surface: Surface, distance: float) -> Surface:
    """Merge the vertices of open edges that lie within a distance of each other."""
    edges = edges_of(surface.faces)
    odd = edges.counts[edges.edge] % 2 == 1
    rim = np.unique(np.concatenate([edges.starts[odd], edges.ends[odd]]))
    rim = rim[np.argsort(surface.vertices[rim] @ SKEW, kind="stable")]
    points = surface.vertices[rim]
    along = points @ SKEW
    near: list[tuple[Indices, Indices]] = []
    for step in range(1, len(rim)):
        close = np.flatnonzero(along[step:] - along[:-step] <= distance)
        if not len(close):
            break
        close = close[np.linalg.norm(points[close + step] - points[close], axis=1) <= distance]
        near.append((rim[close], rim[close + step]))
    if not near:
        return surface
    merged = connected_components(len(surface.vertices), *(np.concatenate(side) for side in zip(*near, strict=True)))
    return drop_unused_vertices(Surface(surface.vertices, drop_collapsed_faces(merged[surface.faces])))


def split_rim_edges(surface: Surface, distance: float) -> Surface:
    """Split open edges at the vertices of other open edges within a distance of them.

    Faces that share an edge in space but not its corners, as in CAD files, then match corner by corner.
    """
    while True:
        edges = edges_of(surface.faces)
        rim = np.flatnonzero(edges.counts[edges.edge] % 2 == 1)
        vertices = np.unique(np.concatenate([edges.starts[rim], edges.ends[rim]]))
        vertices = vertices[np.argsort(surface.vertices[vertices] @ SKEW, kind="stable")]
        along = surface.vertices[vertices] @ SKEW
        split: dict[int, list[tuple[int, int, int]]] = {}
        for half_edge in rim.tolist():
            if half_edge // 3 not in split:  # one edge of a face at a time
                start, end = int(edges.starts[half_edge]), int(edges.ends[half_edge])
                low, high = np.sort(surface.vertices[[start, end]] @ SKEW).tolist()
                near = vertices[slice(*np.searchsorted(along, (low - distance, high + distance)))]
                apex = int(surface.faces[half_edge // 3, (half_edge + 2) % 3])
                between = _between(surface, start, end, near[~np.isin(near, (start, end, apex))], distance)
                chain = [start, *between, end]
                if between:
                    split[half_edge // 3] = [(a, b, apex) for a, b in pairwise(chain)]
        if not split:
            return surface
        whole = np.ones(len(surface.faces), dtype=bool)
        whole[list(split)] = False
        pieces = np.array([piece for fan in split.values() for piece in fan], dtype=np.int64)
        surface = Surface(surface.vertices, np.concatenate([surface.faces[whole], pieces]))


def _between(surface: Surface, start: int, end: int, near: Indices, distance: float) -> list[int]:
    """The vertices near an edge and not near its ends, in order along the edge."""
    origin, way = surface.vertices[start], surface.vertices[end] - surface.vertices[start]
    length = float(np.linalg.norm(way))
    if length <= 2.0 * distance:
        return []
    steps = (surface.vertices[near] - origin) @ way / length
    away = np.linalg.norm(surface.vertices[near] - origin - np.outer(steps, way / length), axis=1)
    on_edge = np.flatnonzero((away <= distance) & (steps > distance) & (steps < length - distance))
    ordered: list[int] = near[on_edge[np.argsort(steps[on_edge], kind="stable")]].tolist()
    return ordered


def drop_collapsed_faces(faces: Indices) -> Indices:
    """The faces with three different corners."""
    a, b, c = faces.T
    proper: Indices = faces[(a != b) & (b != c) & (c != a)]
    return proper


def drop_unused_vertices(surface: Surface) -> Surface:
    """Remove unused vertices; the others in order of first use."""
    used, first, sorted_row = np.unique(surface.faces.ravel(), return_index=True, return_inverse=True)
    order = np.argsort(first)
    rank = np.empty_like(order)
    rank[order] = np.arange(len(order))
    return Surface(surface.vertices[used[order]], rank[sorted_row].reshape(-1, 3))
