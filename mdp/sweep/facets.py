"""Facets: the table of a solid's faces, and its surface arranged for sweeping, with neighbours close together in memory.

Data that a sweep reads in sequence is stored in sequence: the faces' corner numbers, normals and area vectors as three long
arrays each, and the neighbours of every vertex in cyclic order.
"""

from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from mdp.kernels.arrays import flags, ints, longs, table
from mdp.kernels.kernel import kernel, no_nrt
from mdp.kernels.sorting import counting_sort
from mdp.mesh import Floats, Ints, Mesh, crosses_of
from mdp.overhang import PLATE_TOLERANCE_MM, Mask
from mdp.support_need.patches import NEEDS_SUPPORT, UNSUPPORTABLE, Classes
from mdp.sweep.rays import TriangleTree, triangle_tree

# altitude of a triangle, as a share of the largest coordinate, below which rounding may decide which corner is higher
LEAST_ALTITUDE = 1e-8
COSINE_MARGIN = 1e-6
GRID_BITS = 16  # bits for the cells of the space-filling curve along each axis
UNKNOWN = -2  # anchor of a vertex that has not been computed

Indices = NDArray[np.uint32]


class FaceTable(NamedTuple):
    """The faces of a solid, one row per coordinate: points (3, n) of its vertices, corners (3, m), unit normals (3, m).

    For each face (m,): its area; sources, its source face in the model, negative if created by a cut, which needs support
    wherever it is risky; whether it is risky upright; counts, the weight of area that needs support; seam_weights, the weight of
    a mm of rim, (0,) if seams cost nothing; stair_weights, the weight of area whose steps are as high as a layer, (0,) if
    stair-stepping costs nothing.
    """

    points: Floats
    corners: Indices
    normals: Floats
    areas_mm2: Floats
    sources: Ints
    risky: Mask
    counts: Floats
    seam_weights: Floats
    stair_weights: Floats

    @property
    def counted_mm2(self) -> Floats:
        """(m,) weighted area of each face if it needs support."""
        return self.areas_mm2 * self.counts

    def of_faces(self, chosen: NDArray[np.int64]) -> "FaceTable":
        """The table of a subset of the faces, given by number."""
        columns: list[Any] = [np.take(column, chosen, axis=-1) if column.size else column for column in self[1:]]
        return FaceTable(self.points, *columns)


class Blemishes(NamedTuple):
    """Blemishes of a solid along each of (k, 3) directions: its faces, the cosine of normal and direction below which a face is
    risky, the support classes of the model's faces (k, n), the weight of area over air, the extra weight of a rim on a feather
    edge, and the faces that no cut can save (m,), (0,) if not requested.
    """

    directions: Floats
    faces: FaceTable
    risky_below: float
    classes: Classes
    weight: float
    feather: float
    unavoidable: Mask


@no_nrt
def class_along(blemishes: Blemishes, row: int, f: int) -> int:
    """Support class of a face that is risky along a direction."""
    source = blemishes.faces.sources[f]
    return int(blemishes.classes[row, source]) if source >= 0 else NEEDS_SUPPORT


@no_nrt
def times_along(blemishes: Blemishes, row: int, f: int) -> float:
    """Weight of the area of a face that is risky along a direction."""
    needed = class_along(blemishes, row, f)
    return blemishes.weight if needed == UNSUPPORTABLE else 1.0 if needed == NEEDS_SUPPORT else 0.0


class Layout(NamedTuple):
    """A solid arranged for sweeps along any direction: its faces and boxes over them; vectors_mm2 (3, m), their normals times
    areas; rising_edges (2, e), each with its lower end first, those with the lowest lower end first.

    For the vertices: the neighbours of v in cyclic order are neighbours[starts[v] : starts[v + 1]]; unit angle-weighted normals
    (3, n), whose sign gives the side of the solid (Baerentzen, Aanaes); flatness (n,), see _flatness; sharp: numbers 3 f + k of
    the face corners at which the vertex normal does not represent the surface; standing: vertices on the build plate; anchors
    (n,): the face that a ray into the solid meets, -1 if none, UNKNOWN until the sweep computes it.
    """

    faces: FaceTable
    triangles: TriangleTree
    vectors_mm2: Floats
    rising_edges: Indices
    starts: Ints
    neighbours: Ints
    vertex_normals: Floats
    flatness: Floats
    sharp: Ints
    standing: Ints
    anchors: Ints


@dataclass(frozen=True, eq=False)
class Facets:
    """The surface of a solid ordered along a space-filling curve: its mesh, its face table, and (m,) the faces' numbers in the
    solid.
    """

    mesh: Mesh
    faces: FaceTable
    order: NDArray[np.int64]

    @classmethod
    def of(cls, mesh: Mesh, faces: FaceTable) -> "Facets":
        """The facets of a mesh. faces: its face table in its own order."""
        low = mesh.bounds_mm[0]
        scale = (2**GRID_BITS - 1) / max(float((mesh.bounds_mm[1] - low).max()), 1e-12)
        order = np.argsort(_morton(mesh.vertices, low, scale), kind="stable")
        number = np.empty(len(order), np.int32)
        number[order] = np.arange(len(order), dtype=np.int32)
        turn = np.argsort(_morton(mesh.vertices[mesh.faces].mean(axis=1), low, scale), kind="stable")
        laid = Mesh(mesh.vertices[order], number[mesh.faces[turn]])
        points, corners = np.ascontiguousarray(laid.vertices.T), np.ascontiguousarray(laid.faces.T.astype(np.uint32))
        return cls(laid, faces.of_faces(turn)._replace(points=points, corners=corners), turn)

    def layout(self, cosine: float) -> Layout:
        """The surface arranged for sweeping. cosine: a vertex is sharp if one of its faces deviates more than that from the
        vertex normal.
        """
        mesh, z = self.mesh, self.faces.points[2]
        starts, neighbours, single = _link(mesh.faces.flatten(), len(mesh.vertices))
        normals = _vertex_normals(mesh.vertices, mesh.faces, mesh.normals)
        least_mm = LEAST_ALTITUDE * float(np.abs(mesh.bounds_mm).max())
        flatness = np.where(single, _flatness(mesh, normals, least_mm), -1.0)
        return Layout(
            faces=self.faces,
            triangles=triangle_tree(mesh),
            vectors_mm2=np.ascontiguousarray((mesh.normals * mesh.areas_mm2[:, None]).T),
            rising_edges=_rising_edges(mesh.faces, z),
            starts=starts.astype(np.int32),
            neighbours=neighbours,
            vertex_normals=np.ascontiguousarray(normals.T),
            flatness=flatness,
            sharp=np.flatnonzero(flatness[mesh.faces] <= cosine).astype(np.int32),
            standing=np.flatnonzero(z <= PLATE_TOLERANCE_MM).astype(np.int32),
            anchors=np.full(len(mesh.vertices), UNKNOWN, np.int32),
        )


def _rising_edges(faces: Ints, z: Floats) -> Indices:
    starts, ends = faces.reshape(-1), faces[:, [1, 2, 0]].reshape(-1)
    once = (z[starts] < z[ends]) | ((z[starts] == z[ends]) & (starts < ends))
    starts, ends = starts[once], ends[once]
    order = np.argsort(z[starts], kind="stable")
    return np.ascontiguousarray(np.stack([starts[order], ends[order]]).astype(np.uint32))


@kernel
def _morton(points: Floats, low: Floats, scale: float) -> NDArray[np.int64]:
    """Position along Morton's curve, by which near points get near numbers."""
    codes = longs(len(points), 0)
    for v in range(len(points)):
        for axis in range(3):
            cell = int((points[v, axis] - low[axis]) * scale)
            for bit in range(GRID_BITS):
                codes[v] |= ((cell >> bit) & 1) << (3 * bit + axis)
    return codes


@kernel
def _link(corners: Ints, size: int) -> tuple[NDArray[np.int64], Ints, Mask]:
    """Starts and neighbours of all vertices, in cyclic order if they form a single ring, and whether they do.

    corners: (3 m,) vertices of the faces, face by face.
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


def _flatness(mesh: Mesh, vertex_normals: Floats, least_mm: float) -> Floats:
    """(n,) least cosine between a vertex' normal m and those of its faces, 0 if rounding decides; the caller sets -1 for vertices
    without a single ring.

    A vertex with |d . m| below it is regular for the direction d: around it the surface is a graph over the plane across m whose
    slope cannot outweigh d's part in that plane.
    """
    corners = mesh.vertices[mesh.faces]
    longest = np.max([_squares(corners[:, k] - corners[:, k - 1]) for k in range(3)], axis=0)
    altitudes_mm = np.sqrt(_squares(crosses_of(mesh.vertices, mesh.faces)) / np.where(longest > 0.0, longest, 1.0))
    products = mesh.normals[:, None] * vertex_normals[mesh.faces]
    cosines = products[..., 0] + products[..., 1] + products[..., 2]
    flat = np.ones(len(mesh.vertices))
    np.minimum.at(flat, mesh.faces, np.where(altitudes_mm[:, None] > least_mm, np.maximum(cosines - COSINE_MARGIN, 0.0), 0.0))
    return flat


def _squares(vectors: Floats) -> Floats:
    x, y, z = vectors.T
    squares: Floats = x * x + y * y + z * z
    return squares


@kernel
def _vertex_normals(vertices: Floats, faces: Ints, normals: Floats) -> Floats:
    """(n, 3) unit vertex normals: the normals of the faces around each vertex, weighted by their angles there."""
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
