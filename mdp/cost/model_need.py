"""Model need: what the faces of a whole model need, looked up for what cuts leave of it."""

from dataclasses import dataclass

import numpy as np

from mdp.cost.model_surface import MADE_BY_A_CUT, ModelSurface
from mdp.cut import Solid
from mdp.mesh import Mesh, dot
from mdp.overhang import Mask, risky_upright, threshold
from mdp.plane import Plane
from mdp.support_need.need import ModelPieces, SupportNeed, needs_support
from mdp.support_need.patches import UNSUPPORTABLE
from profiles.profile import Profile


@dataclass(frozen=True, eq=False)
class ModelNeed:
    """The surface of a model and what it needs along any direction."""

    surface: ModelSurface
    need: SupportNeed

    def pieces(self, solid: Solid) -> ModelPieces:
        """The faces of what was cut from the model, as mesh_of orders them. manifold3d may number a few more than the model has:
        they count as made by a cut."""
        sources = self.surface.sources(solid)
        return ModelPieces(self.need, np.where(sources < len(self.surface.mesh.faces), sources, np.int32(MADE_BY_A_CUT)))


def needing_upright(mesh: Mesh, profile: Profile) -> Mask:
    """(m,) faces of a whole model that need support printed straight up, by the terms of the profile's search."""
    search = profile.search
    risky = risky_upright(mesh, profile.process.self_supporting_angle_deg, search.count_platform_faces)
    if search.objective != "scar" or search.method == "published":
        return risky
    needing: Mask = risky & needs_support(mesh, profile.process, on_platform=True)
    return needing


def unsupportable_mm2(mesh: Mesh, pieces: ModelPieces, plane: Plane) -> float:
    """Area above a plane that needs support along its normal and has but air beneath it. mesh: what the plane cuts."""
    risky = dot(mesh.normals, plane.normal) < threshold(pieces.need.process.self_supporting_angle_deg)
    chosen = np.flatnonzero(risky & (pieces.along(plane.normal) == UNSUPPORTABLE))
    low, middle, high = np.sort(plane.heights_mm(mesh.vertices)[mesh.faces[chosen]], axis=1).T
    with np.errstate(divide="ignore", invalid="ignore"):
        lower, upper = low * low / ((middle - low) * (high - low)), high * high / ((high - middle) * (high - low))
    share = np.where(middle > 0.0, 1.0 - np.where(low < 0.0, lower, 0.0), np.where(high > 0.0, upper, 0.0))
    return float((mesh.areas_mm2[chosen] * share).sum())
