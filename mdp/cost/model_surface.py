"""Model surface: what is worked out once for every face of a whole model, and looked up for what cuts leave of it."""

from dataclasses import dataclass

import numpy as np

from mdp.cut import Solid, mesh_of, run_faces
from mdp.mesh import Floats, Ints, Mesh

MADE_BY_A_CUT = -1


@dataclass(frozen=True, eq=False)
class ModelSurface:
    """The surface of a whole model. origin: the number by which its solid's faces are known in all that is cut from it."""

    mesh: Mesh
    origin: int

    @classmethod
    def of(cls, mesh: Mesh, solid: Solid) -> "ModelSurface":
        """The surface of a model and the solid made of it."""
        return cls(mesh, run_faces(solid)[0][0])

    def sources(self, solid: Solid) -> Ints:
        """(m,) for each face of what was cut from the model, as mesh_of orders them, the face of the model that it is a piece of;
        MADE_BY_A_CUT where a cut laid it open.

        Of the faces of a flat place one stands for all: their normals are the same.
        """
        pieces = [np.where(origin == self.origin, faces, MADE_BY_A_CUT) for origin, faces in run_faces(solid)]
        return np.concatenate(pieces).astype(np.int32)

    def by_source(self, solid: Solid, values: Floats) -> Floats:
        """(M,) what is known of each face of the uncut model's solid (m,), to be looked up by source: of faces that one stands
        for the mean by area. M may be a few more than the model's faces: manifold3d adds some where edges lie upon each other."""
        sources, areas = self.sources(solid), mesh_of(solid).areas_mm2
        size = len(self.mesh.faces)
        total, area = np.bincount(sources, values * areas, size), np.bincount(sources, areas, size)
        means: Floats = total / np.where(area > 0.0, area, 1.0)
        return means
