"""Rays through the tree of boxes against testing each triangle, and distances against another library."""

import numpy as np
import pytest
import trimesh

from mdp.mesh import Floats, Mesh
from mdp.sweep.rays import nearest_faces, triangle_tree
from mdp.sweep.slivers import OPPOSITE_COSINE, thin_faces
from mdp.sweep.sweep import Remainder
from tests import shapes
from tests.mdp.solids import random_solid


def nearest_mm(origin: Floats, ray: Floats, mesh: Mesh) -> float:
    """Distance along a ray to the first face whose normal agrees with it; infinite: none."""
    facing = mesh.normals @ ray >= OPPOSITE_COSINE
    normals, (first, second, third) = mesh.normals[facing], (mesh.vertices[mesh.faces[facing, k]] for k in range(3))
    along = np.einsum("ij,ij->i", first - origin, normals) / (normals @ ray)
    place = origin + along[:, None] * ray
    sides = [np.cross(b - a, place - a) for a, b in ((first, second), (second, third), (third, first))]
    inside = np.all([np.einsum("ij,ij->i", side, normals) >= -1e-9 for side in sides], axis=0)
    return float(along[inside & (along > 0.0)].min(initial=np.inf))


@pytest.mark.parametrize(("seed", "thickness_mm"), [(0, 1.0), (1, 2.5), (2, 6.0), (3, 20.0)])
def test_the_solid_is_thin_where_an_opposite_face_is_nearest(seed: int, thickness_mm: float) -> None:
    solid = random_solid(seed)
    remainder = Remainder(solid, np.zeros(len(solid.faces), np.bool_))
    mesh, thin = remainder.facets.mesh, thin_faces(remainder.layout.triangles, thickness_mm)
    assert thin.shape == (len(mesh.faces),)
    for face in range(0, len(mesh.faces), 5):
        nearest = nearest_mm(mesh.vertices[mesh.faces[face]].mean(axis=0), -mesh.normals[face], mesh)
        if abs(nearest - thickness_mm) > 1e-6:
            assert thin[face] == (nearest < thickness_mm)


@pytest.mark.parametrize("mesh", [shapes.tee(), shapes.bowl(), random_solid(3)], ids=["tee", "bowl", "random"])
def test_distances_are_those_of_trimesh(mesh: Mesh) -> None:
    places = np.random.default_rng(1).uniform(mesh.bounds_mm[0] - 5.0, mesh.bounds_mm[1] + 5.0, (200, 3))
    triangles = mesh.vertices[mesh.faces]
    nearest = [trimesh.triangles.closest_point(triangles, np.tile(place, (len(triangles), 1))) - place for place in places]
    expected = [np.linalg.norm(off, axis=1).min() for off in nearest]
    assert nearest_faces(triangle_tree(mesh), places, 1e3)[0] == pytest.approx(expected, abs=1e-9)
    assert nearest_faces(triangle_tree(mesh), places, 2.0)[0] == pytest.approx(np.minimum(expected, 2.0), abs=1e-9)
