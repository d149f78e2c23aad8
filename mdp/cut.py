"""Cut: exact, closed halves of a solid, convex hulls and coarser meshes, by manifold3d."""

from math import asin, atan2, degrees
from typing import TypeAlias

import manifold3d as m3
import numpy as np

from mdp.mesh import Floats, Ints, Mesh
from mdp.plane import Plane
from profiles.errors import MeshError

Solid: TypeAlias = m3.Manifold


def solid_of(mesh: Mesh, apart: bool = False) -> Solid:
    """The mesh as a manifold3d solid. apart: coplanar faces stay separate in cuts, so run_faces distinguishes them. Raises
    MeshError for an invalid solid.
    """
    own = np.arange(len(mesh.faces), dtype=np.uint64) if apart else None
    solid = m3.Manifold(m3.Mesh64(mesh.vertices.copy(), mesh.faces.astype(np.uint64), face_id=own))
    if solid.status() != m3.Error.NoError:
        raise MeshError(f"the mesh is not a valid solid ({solid.status().name})")
    return solid


def mesh_of(solid: Solid) -> Mesh:
    """The solid's mesh, its vertices and faces in manifold3d's spatial order."""
    mesh = solid.to_mesh64()
    return Mesh(np.asarray(mesh.vert_properties)[:, :3], np.asarray(mesh.tri_verts))


def run_faces(solid: Solid) -> list[tuple[int, Ints]]:
    """The faces of a solid in runs, ordered as in mesh_of: manifold3d's ID of the original solid, and the source face in it of
    each face. A cutter has an ID of its own.
    """
    mesh = solid.to_mesh64()
    ends = np.asarray(mesh.run_index, dtype=np.int64) // 3
    faces = np.asarray(mesh.face_id).astype(np.int32)
    return [(int(origin), faces[a:b]) for origin, a, b in zip(mesh.run_original_id, ends[:-1], ends[1:], strict=True)]


def cut(solid: Solid, plane: Plane) -> tuple[Solid, Solid]:
    """Cut a solid: the pieces above the plane, or only the limbs that the plane names, and the rest; their volumes add up."""
    if plane.limbs_mm is None:
        return above(solid, plane), below(solid, plane)
    limbs, standing = divide(above(solid, plane), plane.limbs_mm)
    return limbs, below(solid, plane) + standing


def divide(upper: Solid, points_mm: Floats) -> tuple[Solid, Solid]:
    """The pieces of a solid nearest to (k, 3) points, and its other pieces; a void goes with the piece around it."""
    pieces = upper.decompose()
    bodies = [piece for piece in pieces if piece.volume() > 0.0]
    meshes = [mesh_of(body) for body in bodies]
    named = {min(range(len(bodies)), key=lambda k: meshes[k].distance_mm(point)) for point in points_mm} if bodies else set()
    limbs = m3.Manifold.compose([body for k, body in enumerate(bodies) if k in named])
    standing = m3.Manifold.compose([body for k, body in enumerate(bodies) if k not in named])
    return (limbs, standing) if len(bodies) == len(pieces) else (upper ^ limbs, upper ^ standing)


def above(solid: Solid, plane: Plane) -> Solid:
    """The part of a solid above a plane."""
    return solid ^ _half_space(solid, plane)


def below(solid: Solid, plane: Plane) -> Solid:
    """The part of a solid below a plane."""
    return solid - _half_space(solid, plane)


def corners_above(mesh: Mesh, plane: Plane) -> Floats:
    """(n, 3) corners of the part of a mesh above a plane: its vertices and the crossing points of its edges, without cutting."""
    return np.concatenate([mesh.vertices[plane.heights_mm(mesh.vertices) > 0.0], passing_places(mesh, plane)])


def passing_places(mesh: Mesh, plane: Plane) -> Floats:
    """(k, 3) points where the edges of a closed mesh pass through a plane."""
    heights = plane.heights_mm(mesh.vertices)
    starts, ends = mesh.faces.ravel(), np.roll(mesh.faces, -1, axis=1).ravel()
    rising = (heights[starts] <= 0.0) & (heights[ends] > 0.0)  # every edge rises along one of its two faces
    low, high = starts[rising], ends[rising]
    share = (heights[low] / (heights[low] - heights[high]))[:, None]
    return mesh.vertices[low] + share * (mesh.vertices[high] - mesh.vertices[low])


def convex_hull(points: Floats) -> Mesh:
    """The mesh of the convex hull of (n, 3) points."""
    return mesh_of(m3.Manifold.hull_points(points.copy()))


def simplify(mesh: Mesh, tolerance_mm: float) -> Mesh:
    """The mesh with fewer faces, its surface moved by about tolerance_mm at most."""
    return mesh_of(solid_of(mesh).simplify(tolerance_mm))


def _half_space(solid: Solid, plane: Plane) -> Solid:
    """Cutter: a cube above the plane, one face of it in the plane, large enough to cover the solid. manifold3d's split_by_plane
    uses the same cutter, but computes both halves and takes half as long again as one.
    """
    low, high = np.array(solid.bounding_box()).reshape(2, 3)
    x, y, z = (float(value) for value in plane.normal)
    size_mm = float(np.linalg.norm(0.5 * (low + high) - plane.offset_mm * plane.normal) + 0.5 * np.linalg.norm(high - low))
    cube = m3.Manifold.cube((2.0, 2.0, 2.0), True).translate((1.0, 0.0, 0.0)).scale((size_mm, size_mm, size_mm))
    return cube.translate((plane.offset_mm, 0.0, 0.0)).rotate((0.0, -degrees(asin(z)), degrees(atan2(y, x))))
