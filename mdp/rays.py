"""Rays: the first face that a ray from a vertex meets, over a tree of boxes."""

import numpy as np
from numba import njit
from numpy.typing import NDArray

from mdp.mesh import Floats, Mesh

LEAF_FACES = 4
DEPTH = 64


class Tree:
    """Boxes over faces in Morton order: node k has the children 2k and 2k + 1, the leaves hold LEAF_FACES faces each."""

    def __init__(self, mesh: Mesh) -> None:
        corners = mesh.vertices[mesh.faces]
        order = np.argsort(_morton(corners.mean(axis=1)), kind="stable")
        self.faces = order.astype(np.int32)
        self.leaves = 1
        while self.leaves * LEAF_FACES < len(order):
            self.leaves *= 2
        self.low = np.full((2 * self.leaves, 3), np.inf)
        self.high = np.full((2 * self.leaves, 3), -np.inf)
        leaf = self.leaves + np.arange(len(order)) // LEAF_FACES
        np.minimum.at(self.low, leaf, corners.min(axis=1)[order])
        np.maximum.at(self.high, leaf, corners.max(axis=1)[order])
        level = self.leaves
        while level > 1:
            children = slice(level, 2 * level)
            level //= 2
            self.low[level : 2 * level] = self.low[children].reshape(level, 2, 3).min(axis=1)
            self.high[level : 2 * level] = self.high[children].reshape(level, 2, 3).max(axis=1)


def _morton(points: Floats) -> NDArray[np.uint64]:
    """Position along a space-filling curve: near points get near numbers."""
    low = points.min(axis=0)
    scale = 1023.0 / max(float((points.max(axis=0) - low).max()), 1e-12)
    cells = ((points - low) * scale).astype(np.uint64)
    code = np.zeros(len(points), dtype=np.uint64)
    for bit in range(10):
        for axis in range(3):
            code |= ((cells[:, axis] >> np.uint64(bit)) & np.uint64(1)) << np.uint64(3 * bit + axis)
    return code


@njit(cache=True, inline="always")
def _enters(low, high, node, origin, inverse, reach):  # type: ignore[no-untyped-def]
    near, far = 0.0, reach
    for axis in range(3):
        a = (low[node, axis] - origin[axis]) * inverse[axis]
        b = (high[node, axis] - origin[axis]) * inverse[axis]
        near = max(near, min(a, b))
        far = min(far, max(a, b))
    return near <= far * (1.0 + 1e-9)


@njit(cache=True)
def _distance(p, q, r, origin, ray):  # type: ignore[no-untyped-def]
    """Distance along the ray to a triangle (Moeller and Trumbore, edges included), infinite for a miss."""
    e1x, e1y, e1z = q[0] - p[0], q[1] - p[1], q[2] - p[2]
    e2x, e2y, e2z = r[0] - p[0], r[1] - p[1], r[2] - p[2]
    hx, hy, hz = ray[1] * e2z - ray[2] * e2y, ray[2] * e2x - ray[0] * e2z, ray[0] * e2y - ray[1] * e2x
    a = e1x * hx + e1y * hy + e1z * hz
    if a == 0.0:
        return np.inf
    sx, sy, sz = origin[0] - p[0], origin[1] - p[1], origin[2] - p[2]
    u = (sx * hx + sy * hy + sz * hz) / a
    qx, qy, qz = sy * e1z - sz * e1y, sz * e1x - sx * e1z, sx * e1y - sy * e1x
    v = (ray[0] * qx + ray[1] * qy + ray[2] * qz) / a
    if u < -1e-9 or v < -1e-9 or u + v > 1.0 + 1e-9:
        return np.inf
    t = (e2x * qx + e2y * qy + e2z * qz) / a
    return t if t > 0.0 else np.inf


@njit(cache=True)
def first_hit(v, vertices, faces, order, low, high, ray):  # type: ignore[no-untyped-def]
    """The first face met from vertex v along `ray`, its own faces left out; -1: none. order, low, high: a Tree's arrays."""
    leaves = len(low) // 2
    origin, inverse = vertices[v], np.empty(3)
    for axis in range(3):
        inverse[axis] = 1.0 / ray[axis] if abs(ray[axis]) > 1e-300 else 1e300
    stack = np.empty(DEPTH, dtype=np.int32)
    stack[0] = 1
    top, reach, hit = 1, np.inf, -1
    while top > 0:
        top -= 1
        node = stack[top]
        if not _enters(low, high, node, origin, inverse, reach):
            continue
        if node < leaves:
            stack[top] = 2 * node
            stack[top + 1] = 2 * node + 1
            top += 2
            continue
        first = (node - leaves) * LEAF_FACES
        for k in range(first, min(first + LEAF_FACES, len(order))):
            f = order[k]
            if v in (faces[f, 0], faces[f, 1], faces[f, 2]):
                continue
            t = _distance(vertices[faces[f, 0]], vertices[faces[f, 1]], vertices[faces[f, 2]], origin, ray)
            if t < reach:
                reach, hit = t, f
    return hit
