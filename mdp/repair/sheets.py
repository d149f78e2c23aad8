"""Sheets: duplicate faces, and patches loosely attached to a solid."""

import numpy as np

from mdp.formats.surface import Surface
from mdp.mesh import Indices, areas_of
from mdp.repair.weld import drop_unused_vertices
from mdp.topology.components import connected_components
from mdp.topology.edges import Edges, Flags, edges_of

LOOSE_SHARE = 0.2  # share of the area; a larger loose patch may be the model itself
MOST_LOOSE = 300  # patches removed; a surface with more of them is not a solid with a small defect


def drop_duplicate_faces(surface: Surface) -> Surface:
    """Remove duplicate faces; of coinciding faces wound oppositely, remove both or one, whichever leaves fewer odd edges.

    Both go where two bodies touch in a common wall; one stays where a program wrote every face for both sides.
    """
    faces = surface.faces
    group, first, even = _groups(faces)
    if len(first) == len(faces):
        return surface
    forward, backward = np.bincount(group, even), np.bincount(group, ~even)
    representative = np.where(forward >= backward, _first_where(group, even, len(first)), _first_where(group, ~even, len(first)))
    opposed = (forward > 0) & (forward == backward)
    order = np.argsort(representative)
    remaining = representative[order][~_drop_both(faces[representative[order]], opposed[order])]
    return drop_unused_vertices(Surface(surface.vertices, faces[remaining]))


def cancel_opposite_faces(surface: Surface) -> Surface:
    """Remove pairs of coinciding faces with opposite winding; balanced edges stay balanced."""
    group, first, even = _groups(surface.faces)
    if len(first) == len(surface.faces):
        return surface
    order = np.lexsort((even, group))
    starts = np.searchsorted(group[order], np.arange(len(first) + 1))
    backward = np.bincount(group, ~even, minlength=len(first)).astype(np.int64)
    rank = np.arange(len(order)) - starts[group[order]]  # backward ones come first in a group
    pairs = np.minimum(backward, np.diff(starts) - backward)[group[order]]
    goes = np.where(even[order], rank - backward[group[order]] < pairs, rank < pairs)
    return drop_unused_vertices(Surface(surface.vertices, surface.faces[np.sort(order[~goes])]))


def _groups(faces: Indices) -> tuple[Indices, Indices, Flags]:
    """For every face: the number of its corner set, a representative face of each set, and whether it winds upwards from its
    lowest corner.
    """
    span = int(faces.max(initial=0)) + 1
    low, middle, high = np.sort(faces, axis=1).T
    key = (low * span + middle) * span + high if span < 2**21 else _rows(faces)
    _, first, group = np.unique(key, return_index=True, return_inverse=True)
    start, rows = faces.argmin(axis=1), np.arange(len(faces))
    return group, first, faces[rows, (start + 1) % 3] < faces[rows, (start + 2) % 3]


def _rows(faces: Indices) -> Indices:
    _, number = np.unique(np.sort(faces, axis=1), axis=0, return_inverse=True)
    return number.ravel()


def _first_where(group: Indices, chosen: Flags, groups: int) -> Indices:
    first = np.full(groups, len(group))
    numbers = np.flatnonzero(chosen)[::-1]
    first[group[numbers]] = numbers
    return first


def _drop_both(faces: Indices, opposed: Flags) -> Flags:
    """The opposed faces to drop, decided patch by patch: those whose removal makes more edges even than odd."""
    if not opposed.any():
        return opposed
    edges = edges_of(faces)
    twins = edges.twins // 3
    twins = twins[opposed[twins[:, 0]] == opposed[twins[:, 1]]]
    patch = connected_components(len(faces), twins[:, 0], twins[:, 1])
    flags: Flags = opposed & (_gains(edges, patch)[patch] > 0)
    return flags


def _gains(edges: Edges, patch: Indices) -> Indices:
    """For each patch, the net number of edges that become even (shared by an even number of faces) if it is removed."""
    owner = np.repeat(patch, 3)
    key, index = np.unique(owner * len(edges.counts) + edges.edge, return_inverse=True)
    count, own = edges.counts[key % len(edges.counts)], np.bincount(index)
    gains: Indices = np.bincount(key // len(edges.counts), count % 2 - (count - own) % 2, minlength=len(patch)).astype(np.int64)
    return gains


def drop_loose_sheets(surface: Surface) -> Surface:
    """Remove patches that hang on the outside of the surface or divide its inside.

    Such a patch shares edges with two faces of the rest, which is closed without it. Patches are removed one by one: first those
    with an open edge, then by area, since a wall across a solid is smaller than the parts that it divides; never a large share of
    the area.
    """
    for _ in range(MOST_LOOSE):
        edges = edges_of(surface.faces)
        if not (edges.counts % 2 * (edges.counts > 2)).any():
            return surface
        twins = edges.twins // 3
        patch = connected_components(len(surface.faces), twins[:, 0], twins[:, 1])
        area = np.bincount(patch, areas_of(surface.vertices, surface.faces), minlength=len(patch))
        loose = np.flatnonzero((_gains(edges, patch) > 0) & (area <= LOOSE_SHARE * area.sum()))
        if not len(loose):
            return surface
        open_edges = np.bincount(np.repeat(patch, 3), edges.counts[edges.edge] == 1, minlength=len(patch))
        least = loose[np.lexsort((area[loose], open_edges[loose] == 0))[0]]
        surface = drop_unused_vertices(Surface(surface.vertices, surface.faces[patch != least]))
    return surface
