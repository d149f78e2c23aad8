"""Linked faces: a surface with the face on the other side of every edge."""

from typing import NamedTuple

import numpy as np

from mdp.kernels.arrays import ints
from mdp.kernels.kernel import kernel
from mdp.mesh import Floats, Ints, Mesh

NO_FACE = -1
FLAT_COSINE = 1.0 - 1e-9  # of the normals of neighbours in one flat place: some 0.003 degrees


class LinkedFaces(NamedTuple):
    """A surface of m faces and n vertices: vertices (3, n), faces (m, 3), unit normals (3, m), areas (m,), neighbours (m, 3): the
    face across the edge from corner k to the next one, NO_FACE where there is none; the vertices next to v are
    around[starts[v] : starts[v + 1]]."""

    vertices: Floats
    faces: Ints
    normals: Floats
    areas_mm2: Floats
    neighbours: Ints
    starts: Ints
    around: Ints


def link(mesh: Mesh) -> LinkedFaces:
    """A mesh with its neighbours. Of more than two faces at an edge, those that it runs through in the other sense are taken as
    they come."""
    begins, ends = mesh.faces.astype(np.int64).reshape(-1), mesh.faces[:, [1, 2, 0]].astype(np.int64).reshape(-1)
    size = len(mesh.vertices)
    along, against = begins * size + ends, ends * size + begins
    order = np.argsort(along, kind="stable")
    sorted_along = along[order]
    at = np.minimum(np.searchsorted(sorted_along, against), len(along) - 1)
    across = np.where(sorted_along[at] == against, order[at] // 3, NO_FACE)
    return LinkedFaces(
        vertices=np.ascontiguousarray(mesh.vertices.T),
        faces=mesh.faces,
        normals=np.ascontiguousarray(mesh.normals.T),
        areas_mm2=mesh.areas_mm2,
        neighbours=across.reshape(-1, 3).astype(np.int32),
        starts=np.searchsorted(begins[order], np.arange(size + 1)).astype(np.int32),
        around=ends[order].astype(np.int32),
    )


@kernel
def flat_places(surface: LinkedFaces) -> Ints:
    """(m,) the number of the flat place that each face belongs to with its neighbours."""
    normals, count = surface.normals, len(surface.faces)
    place, queue = ints(count, -1), ints(count, 0)
    for seed in range(count):
        size, at = 0, 0
        if place[seed] < 0:
            queue[0], place[seed], size = seed, seed, 1
        while at < size:
            f = queue[at]
            for k in range(3):
                g = surface.neighbours[f, k]
                if g >= 0 and place[g] < 0:
                    cosine = normals[0, f] * normals[0, g] + normals[1, f] * normals[1, g] + normals[2, f] * normals[2, g]
                    if cosine > FLAT_COSINE:
                        queue[size], place[g] = g, seed
                        size += 1
            at += 1
    return place
