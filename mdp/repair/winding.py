"""Winding: pairs of half-edges, and consistent orientation of the faces of a patch."""

import numpy as np

from mdp.formats.surface import Surface
from mdp.mesh import Floats, Indices, crosses_of
from mdp.repair.weld import drop_unused_vertices
from mdp.topology.components import connected_components
from mdp.topology.edges import Edges, edges_of
from profiles.errors import MeshError


def pair_half_edges(surface: Surface, edges: Edges) -> Indices:
    """(k, 2) pairs of half-edges; where more than two faces meet in an edge, neighbours around it.

    Oppositely wound neighbours come first, and the nearest in angle before others, so that bodies that only touch stay separate.
    """
    order, runs = edges.by_edge
    pairs = [edges.twins]
    for number in np.flatnonzero(edges.counts > 2):
        around = order[runs[number] : runs[number + 1]]
        neighbours = _match_around_edge(_angles(surface, edges, around), edges.forward[around])
        pairs.append(around[neighbours])
    return np.concatenate(pairs)


def _angles(surface: Surface, edges: Edges, around: Indices) -> Floats:
    """(k,) directions of the faces about their common edge, radians."""
    first = around[0]
    start, end = surface.vertices[edges.starts[first]], surface.vertices[edges.ends[first]]
    opposite = surface.vertices[surface.faces[around // 3, (around % 3 + 2) % 3]] - start
    axis = (end - start) / (np.linalg.norm(end - start) or 1.0)
    across = opposite - np.outer(opposite @ axis, axis)
    x = across[np.argmax(np.linalg.norm(across, axis=1))]
    y = np.cross(axis, x)
    directions: Floats = np.arctan2(across @ y, across @ x)
    return directions


def _match_around_edge(angles: Floats, forward: object) -> Indices:
    """(k // 2, 2) pairs of neighbours around an edge."""
    directions = np.asarray(forward)
    ring = [int(k) for k in np.lexsort((directions, angles))]
    pairs = []
    while len(ring) >= 2:
        ring_on = ring[1:] + ring[:1]
        gaps = [
            (bool(directions[a] == directions[b]), float((angles[b] - angles[a]) % (2 * np.pi)), at)
            for at, (a, b) in enumerate(zip(ring, ring_on, strict=True))
        ]
        at = min(gaps)[2]
        a, b = ring[at], ring_on[at]
        pairs.append((a, b))
        ring = [k for k in ring if k not in (a, b)]
    return np.array(pairs, dtype=np.int64).reshape(-1, 2)


def orient_faces(surface: Surface) -> Surface:
    """Wind the faces of every patch consistently, like most of its area.

    Raises MeshError if a patch is a one-sided sheet.
    """
    edges = edges_of(surface.faces)
    if not len(edges.unbalanced):
        return surface
    surface = Surface(surface.vertices, _turn_faces(surface, edges, edges.twins, strict=True))
    edges = edges_of(surface.faces)
    if not (edges.counts > 2).any():
        return surface
    return Surface(surface.vertices, _turn_faces(surface, edges, pair_half_edges(surface, edges), strict=False))


def _turn_faces(surface: Surface, edges: Edges, pairs: Indices, strict: bool) -> Indices:
    """Faces turned over so that the pairs agree: components of the two-sheeted cover with nodes (face, kept or turned)."""
    m = len(surface.faces)
    a, b = pairs[:, 0] // 3, pairs[:, 1] // 3
    clash = edges.forward[pairs[:, 0]] == edges.forward[pairs[:, 1]]
    if not clash.any():
        return surface.faces
    cover = connected_components(2 * m, np.concatenate([a, a + m]), np.concatenate([b + m * clash, b + m * ~clash]))
    one_sided = cover[:m] == cover[m:]
    if one_sided.any():
        if strict:
            face = int(np.flatnonzero(one_sided)[0])
            where = surface.vertices[surface.faces[face]].mean(axis=0)
            raise MeshError(
                f"is not orientable: {int(one_sided.sum())} faces form a one-sided sheet, one of them near {format_point(where)}"
            )
        return surface.faces
    area = np.linalg.norm(crosses_of(surface.vertices, surface.faces), axis=1)
    weight = np.bincount(cover[:m], area, minlength=2 * m) - np.bincount(cover[m:], area, minlength=2 * m)
    turn = weight[cover[:m]] < 0
    tie = (weight[cover[:m]] == 0) & (cover[:m] > cover[m:])
    return np.where((turn | tie)[:, None], surface.faces[:, ::-1], surface.faces)


def split_touching_fans(surface: Surface) -> Surface:
    """Duplicate vertices so that every fan of faces connected over paired edges has its own.

    Edges shared by more than two faces become edges of two faces each, unless the faces are connected at both ends anyway.
    """
    edges = edges_of(surface.faces)
    if not (edges.counts > 2).any():
        return surface
    pairs = pair_half_edges(surface, edges)
    first, second = pairs[:, 0], pairs[:, 1]
    same = edges.starts[first] == edges.starts[second]
    corners = connected_components(
        surface.faces.size,
        np.concatenate([first, _next(first)]),
        np.concatenate([np.where(same, second, _next(second)), np.where(same, _next(second), second)]),
    )
    corner, vertex_of = np.unique(corners, return_inverse=True)
    return drop_unused_vertices(Surface(surface.vertices[surface.faces.ravel()[corner]], vertex_of.reshape(-1, 3)))


def split_shared_edges(surface: Surface) -> Surface:
    """Split edges shared by more than two faces: all pairs but one get a new vertex within the edge."""
    while True:
        edges = edges_of(surface.faces)
        if not (edges.counts > 2).any():
            return surface
        pairs = pair_half_edges(surface, edges)
        shared = edges.edge[pairs[:, 0]]
        touched: set[int] = set()
        paired_once: set[int] = set()
        for pair, edge in zip(pairs, shared, strict=True):
            if edges.counts[edge] > 2 and edge in paired_once and not touched & set((pair // 3).tolist()):
                touched |= set((pair // 3).tolist())
                surface = _split_pair(surface, edges, pair)
            paired_once.add(edge)


def _split_pair(surface: Surface, edges: Edges, pair: Indices) -> Surface:
    """Halve the two faces of a pair of half-edges by a new vertex in the middle of their edge."""
    middle = surface.vertices[[edges.starts[pair[0]], edges.ends[pair[0]]]].mean(axis=0)
    faces = np.concatenate([surface.faces, surface.faces[pair // 3]])
    for row, half_edge in enumerate(pair.tolist()):
        faces[half_edge // 3, (half_edge + 1) % 3] = len(surface.vertices)
        faces[len(surface.faces) + row, half_edge % 3] = len(surface.vertices)
    return Surface(np.concatenate([surface.vertices, middle[None]]), faces)


def _next(half_edges: Indices) -> Indices:
    return half_edges - half_edges % 3 + (half_edges + 1) % 3


def format_point(position: Floats) -> str:
    """A position in the form for messages."""
    return "({:.4g}, {:.4g}, {:.4g})".format(*position)
