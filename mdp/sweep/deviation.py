"""Deviation: how far places lie from a surface, over a tree of boxes."""

import numpy as np

from mdp.kernels.arrays import ints
from mdp.kernels.kernel import kernel, no_nrt
from mdp.kernels.threads import in_threads
from mdp.mesh import Floats, Mesh
from mdp.sweep.rays import DEPTH, LEAF_FACES, TriangleTree, triangle_tree


def distances_mm(surface: Mesh, places: Floats, reach_mm: float) -> Floats:
    """(n,) how far places (n, 3) lie from a mesh whose faces are in spatial order, reach_mm for those that lie farther, mm."""
    found = np.empty(len(places))
    in_threads(_nearest, len(places), triangle_tree(surface), places, reach_mm * reach_mm, found)
    return np.sqrt(found)


@kernel
def _nearest(begin: int, end: int, tree: TriangleTree, places: Floats, reach_2: float, out: Floats) -> None:
    """The squared distance of each place from the surface, at most reach_2."""
    vertices, faces, leaves = tree.vertices, tree.faces, len(tree.low) // 2
    stack = ints(DEPTH, 1)
    for k in range(begin, end):
        place, least = places[k], reach_2
        stack[0], top = 1, 1
        while top > 0:
            top -= 1
            node = stack[top]
            if _from_box(tree, node, place) >= least:
                continue
            if node < leaves:
                nearer = int(_from_box(tree, 2 * node + 1, place) < _from_box(tree, 2 * node, place))
                stack[top] = 2 * node + 1 - nearer
                stack[top + 1] = 2 * node + nearer
                top += 2
                continue
            first = (node - leaves) * LEAF_FACES
            for f in range(first, min(first + LEAF_FACES, len(faces))):
                least = min(least, _from_face(vertices[faces[f, 0]], vertices[faces[f, 1]], vertices[faces[f, 2]], place))
        out[k] = least


@no_nrt
def _from_box(tree: TriangleTree, node: int, place: Floats) -> float:
    """Squared distance of a place from a node's box."""
    total = 0.0
    for axis in range(3):
        off = max(0.0, tree.low[node, axis] - place[axis], place[axis] - tree.high[node, axis])
        total += off * off
    return total


@no_nrt
def _from_face(p: Floats, q: Floats, r: Floats, place: Floats) -> float:
    """Squared distance of a place from a triangle: from its plane where the place lies over it, else from its nearest edge."""
    ux, uy, uz = q[0] - p[0], q[1] - p[1], q[2] - p[2]
    vx, vy, vz = r[0] - p[0], r[1] - p[1], r[2] - p[2]
    x, y, z = place[0] - p[0], place[1] - p[1], place[2] - p[2]
    nx, ny, nz = uy * vz - uz * vy, uz * vx - ux * vz, ux * vy - uy * vx
    size = nx * nx + ny * ny + nz * nz
    if size > 0.0:
        # Barycentric coordinates of the place's shadow on the plane.
        b = ((y * vz - z * vy) * nx + (z * vx - x * vz) * ny + (x * vy - y * vx) * nz) / size
        c = ((uy * z - uz * y) * nx + (uz * x - ux * z) * ny + (ux * y - uy * x) * nz) / size
        if b >= 0.0 and c >= 0.0 and b + c <= 1.0:
            height = x * nx + y * ny + z * nz
            return float(height * height / size)
    return min(_from_edge(p, q, place), _from_edge(q, r, place), _from_edge(r, p, place))


@no_nrt
def _from_edge(p: Floats, q: Floats, place: Floats) -> float:
    """Squared distance of a place from a line between two points."""
    along, length = 0.0, 0.0
    for axis in range(3):
        along += (place[axis] - p[axis]) * (q[axis] - p[axis])
        length += (q[axis] - p[axis]) * (q[axis] - p[axis])
    share = min(1.0, max(0.0, along / length)) if length > 0.0 else 0.0
    total = 0.0
    for axis in range(3):
        off = place[axis] - p[axis] - share * (q[axis] - p[axis])
        total += off * off
    return float(total)
