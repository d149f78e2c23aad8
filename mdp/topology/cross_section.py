"""Cross sections: the exact outlines of a closed mesh at many heights at once.

Each face that a plane crosses gives one segment, from the edge on which the face's boundary goes down through the plane to the
edge on which it goes up; the neighbour over the upward edge gives the next segment, so loops close by topology alone. A vertex
exactly in a plane counts as above it: the section of a flat top is taken from the solid below.
"""

from collections.abc import Sequence
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from mdp.kernels.arrays import ints, longs, table
from mdp.kernels.kernel import helper, kernel
from mdp.kernels.sorting import rank, sort_into_bins
from mdp.mesh import Floats, Ints, Mesh
from mdp.topology.edges import opposites
from profiles.errors import SliceError


def cross_sections(mesh: Mesh, cuts_mm: Floats) -> list[list[Floats]]:
    """The loops of the section at each cutting height (ascending, mm), (n, 2) mm, with the solid on the left of every loop.

    Raises SliceError if the mesh is not closed.

    >>> corners = np.array([[0.0, 0.0, 0.0], [4.0, 0.0, 0.0], [0.0, 4.0, 0.0], [0.0, 0.0, 4.0]])
    >>> tetrahedron = Mesh(corners, np.array([[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]]))
    >>> [loop.tolist() for loop in cross_sections(tetrahedron, np.array([1.0]))[0]]
    [[[0.0, 0.0], [3.0, 0.0], [0.0, 3.0]]]
    """
    across = opposites(mesh.faces)
    open_edges = int((across < 0).sum())
    if open_edges:
        raise SliceError(f"the mesh is not closed: {open_edges} edges have a face on one side only")
    return loops_at(mesh.vertices, mesh.faces, across, np.ascontiguousarray(cuts_mm, dtype=np.float64))


def loops_at(vertices: Floats, faces: Ints, across: Ints, cuts_mm: Floats) -> list[list[Floats]]:
    """Loops as in cross_sections, for a closed mesh with a known opposite half-edge of each half-edge (3 m,)."""
    points, ends, counts = _walk(vertices, faces, across, cuts_mm)
    ends = ends[: counts.sum()]
    loops = np.split(points, ends[:-1]) if len(ends) else []
    bounds = np.concatenate([[0], np.cumsum(counts)])
    return [[loop for loop in loops[a:b] if len(loop) > 2] for a, b in pairwise(bounds)]


@helper
def _spans(vertices: Floats, faces: Ints, cuts: Floats) -> tuple[Ints, Ints]:
    """First and last layer that each face crosses; the last is less than the first if it crosses none."""
    first, last = ints(len(faces), 0), ints(len(faces), 0)
    for f in range(len(faces)):
        a, b, c = vertices[faces[f, 0], 2], vertices[faces[f, 1], 2], vertices[faces[f, 2], 2]
        first[f] = rank(cuts, min(a, b, c), True)
        last[f] = rank(cuts, max(a, b, c), True) - 1
    return first, last


@kernel
def _walk(vertices: Floats, faces: Ints, across: Ints, cuts: Floats) -> tuple[Floats, NDArray[np.int64], NDArray[np.int64]]:
    """Points of all loops, the end of each loop in them (with unused space behind), and the number of loops in each layer."""
    first, last = _spans(vertices, faces, cuts)
    offsets, listed = sort_into_bins(first, last, len(cuts))
    points, ends = table(len(listed), 2), longs(len(listed), 0)
    counts, seen = longs(len(cuts), 0), ints(len(faces), -1)
    n = loop = 0
    for layer in range(len(cuts)):
        z = cuts[layer]
        for at in range(offsets[layer], offsets[layer + 1]):
            f = listed[at]
            if seen[f] == layer:
                continue
            while seen[f] != layer:
                seen[f] = layer
                up = 0
                for k in range(3):
                    tail, head = faces[f, k], faces[f, (k + 1) % 3]
                    below_tail, below_head = vertices[tail, 2] < z, vertices[head, 2] < z
                    if below_head and not below_tail:
                        share = (z - vertices[head, 2]) / (vertices[tail, 2] - vertices[head, 2])
                        points[n, 0] = vertices[head, 0] + share * (vertices[tail, 0] - vertices[head, 0])
                        points[n, 1] = vertices[head, 1] + share * (vertices[tail, 1] - vertices[head, 1])
                        n += 1
                    elif below_tail and not below_head:
                        up = k
                if across[3 * f + up] < 0:  # the rim of an open mesh ends the loop
                    break
                f = across[3 * f + up] // 3
            ends[loop] = n
            loop += 1
            counts[layer] += 1
    return points, ends, counts


def loop_edges(loops: Sequence[Floats]) -> Floats:
    """(n, 4) edges x0, y0, x1, y1 of closed loops (k, 2), loop by loop."""
    if not loops:
        return np.zeros((0, 4))
    out = np.empty((sum(map(len, loops)), 4))
    n = 0
    for loop in loops:
        end = n + len(loop)
        out[n:end, :2], out[n : end - 1, 2:], out[end - 1, 2:] = loop, loop[1:], loop[0]
        n = end
    return out
