"""Model surface: what is worked out once for every face of a whole model, and looked up for what cuts leave of it."""

from dataclasses import dataclass

import numpy as np

from mdp.cut import Solid, run_faces
from mdp.mesh import Ints, Mesh

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
