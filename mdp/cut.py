"""Cut: exact, closed halves of a solid by manifold3d."""

import manifold3d as m3
import numpy as np

from mdp.mesh import Mesh
from mdp.plane import Plane
from profiles.errors import MeshError


def solid_of(mesh: Mesh) -> m3.Manifold:
    """The mesh as a manifold3d solid; MeshError when it is none."""
    solid = m3.Manifold(m3.Mesh64(mesh.vertices.copy(), mesh.faces.astype(np.uint64)))
    if solid.status() != m3.Error.NoError:
        raise MeshError(f"the mesh is not a valid solid ({solid.status().name})")
    return solid


def mesh_of(solid: m3.Manifold) -> Mesh:
    """The solid's mesh, its vertices and faces in manifold3d's spatial order."""
    mesh = solid.to_mesh64()
    return Mesh(np.asarray(mesh.vert_properties)[:, :3], np.asarray(mesh.tri_verts))


def cut(solid: m3.Manifold, plane: Plane) -> tuple[m3.Manifold, m3.Manifold]:
    """The solid above the plane and the solid below it; their volumes add up."""
    above, below = solid.split_by_plane(tuple(float(x) for x in plane.normal), plane.offset_mm)
    return above, below
