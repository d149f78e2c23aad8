"""Grown: the faces of a surface around a point, as far as they look about the way that the point's own face does."""

from dataclasses import dataclass
from math import cos, radians

import numpy as np

from mdp.mesh import Floats, Mesh
from mdp.overhang import Mask
from mdp.topology.components import connected_components
from mdp.topology.edges import edges_of
from profiles.frozen import Vector

FARTHEST_MM = 1.0  # from a surface that a point may lie to mean a place of it
MOST_GROWN_DEG = 180.0
ROUNDING = 1e-6  # of a cosine: an angle of 0 takes the faces of a flat place


@dataclass(frozen=True)
class Grown:
    """The faces that hang together with the one at a point of the workpiece frame and turn from it by at most so much."""

    point_mm: Vector
    angle_deg: float

    def faces(self, mesh: Mesh) -> Mask:
        """(m,) which faces of a mesh they are; those without area count where they link others."""
        face = nearest_face(mesh, np.array(self.point_mm))[0]
        alike = mesh.normals @ mesh.normals[face] >= cos(radians(self.angle_deg)) - ROUNDING
        alike |= mesh.areas_mm2 == 0.0
        pairs = edges_of(mesh.faces.astype(np.int64)).twins // 3
        pairs = pairs[alike[pairs].all(axis=1)]
        label = connected_components(len(mesh.faces), pairs[:, 0], pairs[:, 1])
        together: Mask = np.equal(label, label[face])
        return together

    def away_mm(self, mesh: Mesh) -> float:
        """How far from the surface the point lies."""
        return nearest_face(mesh, np.array(self.point_mm))[1]


def nearest_face(mesh: Mesh, point: Floats) -> tuple[int, float]:
    """The face with area that is nearest to a point (3,), the first of several, and its distance, mm."""
    corners = mesh.vertices[mesh.faces] - point
    edges = np.roll(corners, -1, axis=1) - corners
    lengths = np.einsum("fki,fki->fk", edges, edges)
    share = np.clip(-np.einsum("fki,fki->fk", corners, edges) / np.where(lengths > 0.0, lengths, 1.0), 0.0, 1.0)
    least = np.linalg.norm(corners + share[..., None] * edges, axis=2).min(axis=1)
    sides = np.einsum("fki,fki->fk", np.cross(corners, edges), mesh.normals[:, None])  # of the point's shadow on the face
    height = np.abs(np.einsum("fi,fi->f", corners[:, 0], mesh.normals))
    distance = np.where((sides >= 0.0).all(axis=1), height, least)
    distance[mesh.areas_mm2 == 0.0] = np.inf
    face = int(np.argmin(distance))
    return face, float(distance[face])
