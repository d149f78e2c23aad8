"""Model surface: what is worked out once for every face of a whole model, and looked up for what cuts leave of it."""

from dataclasses import dataclass

import numpy as np

from mdp.cut import Solid, mesh_of, run_faces
from mdp.mesh import Floats, Ints, Mesh

MADE_BY_A_CUT = -1


@dataclass(frozen=True, eq=False)
class Piece:
    """What was cut from a model: its mesh, and (m,) the face of the model that each of its faces is a piece of, MADE_BY_A_CUT
    where a cut laid it open. Of the faces of a flat place one stands for all: their normals are the same."""

    mesh: Mesh
    sources: Ints


@dataclass(frozen=True, eq=False)
class ModelSurface:
    """The surface of a whole model. origin: the number by which its solid's faces are known in all that is cut from it."""

    mesh: Mesh
    origin: int

    @classmethod
    def of(cls, mesh: Mesh, solid: Solid) -> "ModelSurface":
        """The surface of a model and the solid made of it."""
        return cls(mesh, run_faces(solid)[0][0])

    def piece(self, solid: Solid) -> Piece:
        """What was cut from the model."""
        sources = [np.where(origin == self.origin, faces, MADE_BY_A_CUT) for origin, faces in run_faces(solid)]
        return Piece(mesh_of(solid), np.concatenate(sources).astype(np.int32))

    def by_source(self, whole: Piece, values: Floats) -> Floats:
        """(M,) what is known of each face of the uncut model (m,), to be looked up by source: of faces that one stands for the
        mean by area. M may be a few more than the model's faces: manifold3d adds some where edges lie upon each other."""
        areas, size = whole.mesh.areas_mm2, len(self.mesh.faces)
        total, area = np.bincount(whole.sources, values * areas, size), np.bincount(whole.sources, areas, size)
        means: Floats = total / np.where(area > 0.0, area, 1.0)
        return means
