"""Model need: what is worked out once for every face of a whole model, and looked up for what cuts leave of it."""

from dataclasses import dataclass

import numpy as np

from mdp.cut import Solid, mesh_of, run_faces
from mdp.mesh import Floats, Ints, Mesh
from mdp.overhang import Mask, facing_down, risky_upright
from mdp.plane import Plane
from mdp.support_need.need import ModelPieces, SupportNeed, needs_support
from mdp.support_need.patches import CARRIES_ITSELF, UNSUPPORTABLE
from mdp.sweep.crossing import areas_above
from mdp.zone import UNMARKED, Marked
from profiles.profile import Profile

NO_SUPPORT_WEIGHT = 100.0  # of an area that needs support where a person wants none
MADE_BY_A_CUT = -1


@dataclass(frozen=True, eq=False)
class Piece:
    """What was cut from a model: its mesh, and (m,) the face of the model that each of its faces is a piece of, MADE_BY_A_CUT
    where a cut laid it open. One face of a flat place stands for all of them: their normals are the same."""

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


@dataclass(frozen=True, eq=False)
class ModelNeed:
    """What a model needs along any direction; no_support: where an area that needs it counts NO_SUPPORT_WEIGHT times, for it
    would hang."""

    need: SupportNeed
    no_support: Marked = UNMARKED

    def pieces(self, piece: Piece) -> ModelPieces:
        """The faces of what was cut from the model. manifold3d may number a few more than the model has: they count as made by a
        cut."""
        sources = np.where(piece.sources < len(self.need.surface.faces), piece.sources, np.int32(MADE_BY_A_CUT))
        if not self.no_support.anywhere:
            return ModelPieces(self.need, sources)
        barred = self.no_support.among(sources).touched(piece.mesh)
        return ModelPieces(self.need, sources, np.where(barred, NO_SUPPORT_WEIGHT, 1.0))


def needing_upright(mesh: Mesh, profile: Profile) -> Mask:
    """(m,) faces of a whole model that need support printed straight up, by the terms of the profile's search."""
    search = profile.search.effective
    risky = risky_upright(mesh, profile.process.self_supporting_angle_deg, search.count_platform_faces)
    if search.objective == "risky":
        return risky
    needing: Mask = risky & needs_support(mesh, profile.process, on_platform=True)
    return needing


def excess_mm2(mesh: Mesh, pieces: ModelPieces, plane: Plane, cut: Mask) -> float:
    """By how much what needs support above a plane along its normal counts more than its area: over nothing but air, and where
    none is wanted. mesh: what the plane cuts; cut: (m,) those of its faces that it may cut."""
    classes, counts = pieces.along(plane.normal), 1.0 if pieces.counts is None else pieces.counts
    times = np.where(classes == UNSUPPORTABLE, pieces.need.weight, 1.0) * counts
    risky = facing_down(mesh, plane.normal, pieces.need.process.self_supporting_angle_deg)
    chosen = np.flatnonzero(cut & risky & (classes != CARRIES_ITSELF) & (times != 1.0))
    above_mm2 = areas_above(mesh.faces[chosen], plane.heights_mm(mesh.vertices), mesh.areas_mm2[chosen])
    return float((above_mm2 * (times[chosen] - 1.0)).sum())
