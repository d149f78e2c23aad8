"""Model need: what the faces of a whole model need, looked up for what cuts leave of it."""

from dataclasses import dataclass

import numpy as np

from mdp.cost.model_surface import MADE_BY_A_CUT, Piece
from mdp.mesh import Mesh
from mdp.overhang import Mask, facing_down, risky_upright
from mdp.plane import Plane
from mdp.support_need.need import ModelPieces, SupportNeed, needs_support
from mdp.support_need.patches import CARRIES_ITSELF, UNSUPPORTABLE
from mdp.zone import UNMARKED, Marked
from profiles.profile import Profile

NO_SUPPORT_WEIGHT = 100.0  # of an area that needs support where a person wants none


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


def excess_mm2(mesh: Mesh, pieces: ModelPieces, plane: Plane) -> float:
    """By how much what needs support above a plane along its normal counts more than its area: over nothing but air, and where
    none is wanted. mesh: what the plane cuts."""
    classes, counts = pieces.along(plane.normal), 1.0 if pieces.counts is None else pieces.counts
    times = np.where(classes == UNSUPPORTABLE, pieces.need.weight, 1.0) * counts
    risky = facing_down(mesh, plane.normal, pieces.need.process.self_supporting_angle_deg)
    chosen = np.flatnonzero(risky & (classes != CARRIES_ITSELF) & (times != 1.0))
    low, middle, high = np.sort(plane.heights_mm(mesh.vertices)[mesh.faces[chosen]], axis=1).T
    with np.errstate(divide="ignore", invalid="ignore"):
        lower, upper = low * low / ((middle - low) * (high - low)), high * high / ((high - middle) * (high - low))
    share = np.where(middle > 0.0, 1.0 - np.where(low < 0.0, lower, 0.0), np.where(high > 0.0, upper, 0.0))
    return float((mesh.areas_mm2[chosen] * share * (times[chosen] - 1.0)).sum())
