"""Facets: a solid's surface laid out for sweeping: structure of arrays, near faces and vertices near in memory.

What a sweep reads in a row lies in a row: a face's corner numbers, its normal and its area vector each as three long arrays, and
around every vertex its neighbours in cyclic order.
"""

from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from mdp.kernels.arrays import flags, floats, ints, longs, table
from mdp.kernels.kernel import kernel, no_nrt
from mdp.kernels.sorting import counting_sort
from mdp.mesh import Floats, Ints, Mesh
from mdp.overhang import PLATFORM_TOLERANCE_MM, Mask
from mdp.stairs import step_shares

LEAST_ALTITUDE = 1e-8  # of a triangle, as a share of the largest coordinate: below, rounding may decide which corner is higher
COSINE_MARGIN = 1e-6
GRID_BITS = 16  # of the space-filling curve's cells along each axis

Indices = NDArray[np.uint32]


class Rings(NamedTuple):
    """Neighbours around every vertex in cyclic order: those of v are neighbours[starts[v] : starts[v + 1]]; (n + 1,), (3 m,)."""

    starts: Ints
    neighbours: Ints


class Rows(NamedTuple):
    """What every direction's sweep reads of a surface of m faces, n vertices and e edges, each coordinate in a row of its own.

    points (3, n), corners (3, m), unit normals (3, m), vectors_mm2 (3, m) normals times areas, rising_edges (2, e),
    vertex_normals (3, n), flatness (n,), sharp: numbers 3 f + k of the face corners at edges.
    """

    points: Floats
    corners: Indices
    normals: Floats
    vectors_mm2: Floats
    rising_edges: Indices
    vertex_normals: Floats
    flatness: Floats
    sharp: Ints


@dataclass(frozen=True, eq=False)
class Facets:
    """Made once a solid. mesh has its vertices and faces in spatial order; risky (m,) tells which faces are risky upright,
    seam_weights (m,) how much a mm of rim counts on each, (0,): not at all; sources (m,) of which face of the model each is a
    piece, below 0: of none; counted_mm2 (m,) what each counts where it needs support; stair_areas_mm2 (m,) what each counts where
    its steps are as high as a layer, (0,): stairs do not count; order (m,): the number of each face in
    the solid's own mesh."""

    mesh: Mesh
    risky: Mask
    seam_weights: Floats
    sources: Ints
    counted_mm2: Floats
    stair_areas_mm2: Floats
    order: NDArray[np.int64]

    @cached_property
    def points(self) -> Floats:
        """(3, n) coordinates."""
        return np.ascontiguousarray(self.mesh.vertices.T)

    @cached_property
    def corners(self) -> Indices:
        """(3, m) vertices of the faces."""
        return np.ascontiguousarray(self.mesh.faces.T.astype(np.uint32))

    @cached_property
    def normals(self) -> Floats:
        """(3, m) unit normals."""
        return np.ascontiguousarray(self.mesh.normals.T)

    @cached_property
    def stairs_up_mm2(self) -> Floats:
        """(m,) what the stairs of each face count printed straight up, (0,): stairs do not count."""
        return self.stair_areas_mm2 * step_shares(self.mesh.normals[: len(self.stair_areas_mm2), 2])

    @property
    def rings(self) -> Rings:
        """The neighbours of every vertex."""
        return self._rings[0]

    @cached_property
    def _rings(self) -> tuple[Rings, Mask]:
        """Rings, and whether a vertex' neighbours form a single ring."""
        starts, neighbours, single = _link(self.mesh.faces.flatten(), len(self.mesh.vertices))
        return Rings(starts.astype(np.int32), neighbours), single

    @cached_property
    def flatness(self) -> Floats:
        """(n,) least cosine between a vertex' normal m and those of its faces, 0 if rounding decides, -1 without a single ring.

        A vertex with |d . m| below it is regular for the direction d: around it the surface is a graph over the plane across m
        whose slope cannot outweigh d's part in that plane.
        """
        _, single = self._rings
        least_mm = LEAST_ALTITUDE * float(np.abs(self.mesh.bounds_mm).max())
        flat = _flatness(self.mesh.vertices, self.mesh.faces, self.mesh.normals, self.vertex_normals, least_mm)
        return np.where(single, flat, -1.0)

    @cached_property
    def rising_edges(self) -> Indices:
        """(2, e) the edges, each with its lower end first, those with the lowest lower end first."""
        faces, z = self.mesh.faces, self.points[2]
        starts, ends = faces.reshape(-1), faces[:, [1, 2, 0]].reshape(-1)
        once = (z[starts] < z[ends]) | ((z[starts] == z[ends]) & (starts < ends))
        starts, ends = starts[once], ends[once]
        order = np.argsort(z[starts], kind="stable")
        return np.ascontiguousarray(np.stack([starts[order], ends[order]]).astype(np.uint32))

    @cached_property
    def standing(self) -> Ints:
        """Vertices on the platform."""
        return np.flatnonzero(self.points[2] <= PLATFORM_TOLERANCE_MM).astype(np.int32)

    @cached_property
    def vertex_normals(self) -> Floats:
        """(n, 3) unit angle-weighted normals; their sign tells on which side of a vertex the solid lies (Baerentzen, Aanaes)."""
        return _vertex_normals(self.mesh.vertices, self.mesh.faces, self.mesh.normals)

    def rows(self, cosine: float) -> Rows:
        """The rows of a sweep; sharp: corners at vertices some face of which leans further than that from the vertex' normal."""
        return Rows(
            points=self.points,
            corners=self.corners,
            normals=self.normals,
            vectors_mm2=np.ascontiguousarray((self.mesh.normals * self.mesh.areas_mm2[:, None]).T),
            rising_edges=self.rising_edges,
            vertex_normals=np.ascontiguousarray(self.vertex_normals.T),
            flatness=self.flatness,
            sharp=np.flatnonzero(self.flatness[self.mesh.faces] <= cosine).astype(np.int32),
        )


def lay_out(
    mesh: Mesh,
    risky: Mask,
    seam_weights: Floats | None,
    sources: Ints,
    counts: Floats,
    stair_weights: Floats | None = None,
) -> Facets:
    """The surface of a solid along a space-filling curve; its values as in Facets, counts: how many times an area on each face
    counts, stair_weights: how much each does where its steps are as high as a layer."""
    low = mesh.bounds_mm[0]
    scale = (2**GRID_BITS - 1) / max(float((mesh.bounds_mm[1] - low).max()), 1e-12)
    order = np.argsort(_morton(mesh.vertices, low, scale), kind="stable")
    number = np.empty(len(order), np.int32)
    number[order] = np.arange(len(order), dtype=np.int32)
    turn = np.argsort(_morton(mesh.vertices[mesh.faces].mean(axis=1), low, scale), kind="stable")
    weights = np.zeros(0) if seam_weights is None else np.ascontiguousarray(seam_weights[turn])
    laid = Mesh(mesh.vertices[order], number[mesh.faces[turn]])
    stairs_mm2 = np.zeros(0) if stair_weights is None else laid.areas_mm2 * stair_weights[turn]
    counted_mm2 = laid.areas_mm2 * counts[turn]
    return Facets(laid, risky[turn], weights, np.ascontiguousarray(sources[turn]), counted_mm2, stairs_mm2, turn)


@kernel
def _morton(points: Floats, low: Floats, scale: float) -> NDArray[np.int64]:
    """Position along Morton's curve: near points get near numbers."""
    codes = longs(len(points), 0)
    for v in range(len(points)):
        for axis in range(3):
            cell = int((points[v, axis] - low[axis]) * scale)
            for bit in range(GRID_BITS):
                codes[v] |= ((cell >> bit) & 1) << (3 * bit + axis)
    return codes


@kernel
def _link(corners: Ints, size: int) -> tuple[NDArray[np.int64], Ints, Mask]:
    """Starts and neighbours of all vertices, in cyclic order where they form a single ring, and whether they do.

    corners: (3 m,) vertices of the faces, one face after the other.
    """
    starts, around = counting_sort(corners, size)
    first, second, single = ints(len(corners), 0), ints(len(corners), 0), flags(size)
    for at in range(len(around)):
        face, k = around[at] // 3 * 3, around[at] % 3
        first[at], second[at] = corners[face + (k + 1) % 3], corners[face + (k + 2) % 3]
    for v in range(size):
        begin, end = starts[v], starts[v + 1]
        for at in range(begin, end - 1):
            for k in range(at + 1, end):
                if first[k] == second[at]:
                    first[at + 1], first[k] = first[k], first[at + 1]
                    second[at + 1], second[k] = second[k], second[at + 1]
                    break
        single[v] = end > begin and second[end - 1] == first[begin]
        for at in range(begin, end - 1):
            single[v] = single[v] and second[at] == first[at + 1]
    return starts, first, single


@kernel
def _flatness(vertices: Floats, faces: Ints, normals: Floats, vertex_normals: Floats, least: float) -> Floats:
    flat = floats(len(vertices), 1.0)
    for f in range(len(faces)):
        altitude = _altitude(vertices[faces[f, 0]], vertices[faces[f, 1]], vertices[faces[f, 2]])
        for k in range(3):
            v = faces[f, k]
            cosine = 0.0
            for axis in range(3):
                cosine += normals[f, axis] * vertex_normals[v, axis]
            flat[v] = min(flat[v], max(cosine - COSINE_MARGIN, 0.0) if altitude > least else 0.0)
    return flat


@no_nrt
def _altitude(p: Floats, q: Floats, r: Floats) -> float:
    """Least altitude of a triangle."""
    ax, ay, az = q[0] - p[0], q[1] - p[1], q[2] - p[2]
    bx, by, bz = r[0] - p[0], r[1] - p[1], r[2] - p[2]
    cx, cy, cz = bx - ax, by - ay, bz - az
    x, y, z = ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx
    longest = max(ax * ax + ay * ay + az * az, bx * bx + by * by + bz * bz, cx * cx + cy * cy + cz * cz)
    altitude: float = np.sqrt((x * x + y * y + z * z) / longest) if longest > 0.0 else 0.0
    return altitude


@kernel
def _vertex_normals(vertices: Floats, faces: Ints, normals: Floats) -> Floats:
    total = table(len(vertices), 3)
    for f in range(len(faces)):
        for k in range(3):
            o, p, q = faces[f, k], faces[f, (k + 1) % 3], faces[f, (k + 2) % 3]
            ax, ay, az = vertices[p, 0] - vertices[o, 0], vertices[p, 1] - vertices[o, 1], vertices[p, 2] - vertices[o, 2]
            bx, by, bz = vertices[q, 0] - vertices[o, 0], vertices[q, 1] - vertices[o, 1], vertices[q, 2] - vertices[o, 2]
            x, y, z = ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx
            angle = np.arctan2(np.sqrt(x * x + y * y + z * z), ax * bx + ay * by + az * bz)
            for axis in range(3):
                total[o, axis] += angle * normals[f, axis]
    for v in range(len(total)):
        length = np.sqrt(total[v, 0] ** 2 + total[v, 1] ** 2 + total[v, 2] ** 2)
        for axis in range(3):
            total[v, axis] /= length if length > 0.0 else 1.0
    return total
