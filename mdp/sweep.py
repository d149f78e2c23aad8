"""Sweep: every offset of a direction evaluated in one pass over the faces, nothing is cut.

For a unit direction d let h = vertex . d. A face adds a piecewise quadratic in the offset c to "area above c", weighted
with 1 (risky areas) or with n . d: by the divergence theorem the n . d-weighted area above c is the cross-section at c and
its first moment about c the volume above c. Faces wholly above an offset go into suffix sums, faces that cross sampled
offsets are added where they cross. Cost: vertices + faces + crossings.

There are two passes: `gains` touches only the faces that are risky one way or the other and tells what a cut is worth;
`sweep` tells whether it can be made, and is asked only for the directions that are worth it.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numba import njit, prange

from mdp.mesh import Floats, Ints, Mesh
from mdp.overhang import Mask
from mdp.pieces import UNKNOWN, count_pieces
from mdp.rays import Tree
from mdp.sums import find_heights, find_lowest, find_slivers, sum_risks, sum_volumes


@dataclass(frozen=True, eq=False)
class Gains:
    """Values for each of k directions (rows) and its offsets c = (first + column) * step; columns beyond count are unused.

    up_mm2: risky area above the plane when printing straight up; residual_mm2: risky area above it when printing along the
    direction.
    """

    first: Ints
    count: Ints
    up_mm2: Floats
    residual_mm2: Floats


@dataclass(frozen=True, eq=False)
class Sweep:
    """Rows and columns as in Gains.

    section_mm2: cross-section; volume_mm3: volume above; lowest_mm: least z of what lies above, exact where it is below the
    direction's watched height, some greater number elsewhere; fragile_mm: distance to the nearest surface that the plane
    would cut into a sliver; pieces: components of the solid below that do not reach the platform.
    """

    first: Ints
    count: Ints
    section_mm2: Floats
    volume_mm3: Floats
    lowest_mm: Floats
    fragile_mm: Floats
    pieces: Ints


@dataclass(frozen=True, eq=False)
class Remainder:
    """What the sweep needs to know of a solid, made once for all directions: its mesh and which faces are risky upright."""

    mesh: Mesh
    risky: Mask

    @cached_property
    def edges(self) -> Ints:
        """(e, 2) int32: the vertices of every edge, near edges near each other, the smaller number first."""
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
    def tree(self) -> Tree:
        """Boxes over the faces, for rays."""
        return Tree(self.mesh)

    @cached_property
    def anchors(self) -> Ints:
        """(n,) the face met from each vertex into the solid, -1 where none is; the sweep looks them up when needed."""
        return np.full(len(self.mesh.vertices), UNKNOWN, np.int32)

    def columns(self, step_mm: float) -> int:
        """Room for the offsets of any direction."""
        return int(float(np.linalg.norm(self.mesh.bounds_mm[1] - self.mesh.bounds_mm[0])) / step_mm) + 3


def gains(remainder: Remainder, directions: Floats, step_mm: float, risky_below: float) -> Gains:
    """What all offsets of (k, 3) unit directions would make safe; risky_below is overhang.threshold of the angle."""
    mesh = remainder.mesh
    surface = (mesh.vertices, mesh.faces, mesh.areas_mm2, mesh.normals, remainder.risky)
    return Gains(*_gains(*surface, np.ascontiguousarray(directions), step_mm, remainder.columns(step_mm), risky_below))


def sweep(remainder: Remainder, directions: Floats, step_mm: float, watched_mm: Floats | None = None) -> Sweep:
    """Whether a cut can be made at all offsets of (k, 3) unit directions.

    watched_mm (k,): the height below which the least z of a part matters; absent: all heights.
    """
    mesh = remainder.mesh
    surface = (mesh.vertices, mesh.faces, mesh.areas_mm2, mesh.normals, remainder.edges, remainder.rising_edges)
    watched = np.full(len(directions), np.inf) if watched_mm is None else watched_mm
    tree = (remainder.tree.faces, remainder.tree.low, remainder.tree.high)
    solid = (remainder.vertex_normals, remainder.anchors, *tree, np.ascontiguousarray(directions), watched)
    return Sweep(*_sweep(*surface, *solid, step_mm, remainder.columns(step_mm)))


@njit(cache=True, parallel=True)
def _gains(vertices, faces, areas, normals, risky, directions, step, columns, risky_below):  # type: ignore[no-untyped-def]
    k = len(directions)
    first, count = np.zeros(k, np.int32), np.zeros(k, np.int32)
    up, residual = np.zeros((k, columns)), np.zeros((k, columns))
    for row in prange(k):
        d = directions[row]
        heights, bins = np.empty(len(vertices)), np.empty(len(vertices), np.int32)
        begin, n = find_heights(vertices, d, step, heights, bins)
        first[row], count[row] = begin, n
        if n > 0:
            sum_risks(faces, areas, normals, risky, d, heights, bins, begin, n, step, risky_below, up[row], residual[row])
    return first, count, up, residual


@njit(cache=True, parallel=True)
def _sweep(  # type: ignore[no-untyped-def]
    vertices, faces, areas, normals, edges, rising, vertex_normals, anchor, order, low, high, directions, watched, step, columns
):
    k = len(directions)
    first, count = np.zeros(k, np.int32), np.zeros(k, np.int32)
    section, volume = np.zeros((k, columns)), np.zeros((k, columns))
    lowest, fragile = np.full((k, columns), np.inf), np.full((k, columns), np.inf)
    pieces = np.zeros((k, columns), np.int32)
    for row in prange(k):
        d = directions[row]
        heights, bins = np.empty(len(vertices)), np.empty(len(vertices), np.int32)
        begin, n = find_heights(vertices, d, step, heights, bins)
        first[row], count[row] = begin, n
        if n > 0:
            sum_volumes(faces, areas, normals, d, heights, bins, begin, n, step, section[row], volume[row])
            find_lowest(vertices, rising, heights, bins, begin, n, step, watched[row], lowest[row])
            find_slivers(vertex_normals, d, heights, bins, begin, n, step, fragile[row])
            count_pieces(vertices, faces, edges, vertex_normals, anchor, order, low, high, d, heights, bins, n, pieces[row])
    return first, count, section, volume, lowest, fragile, pieces
