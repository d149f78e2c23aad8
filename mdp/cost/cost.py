"""Cost: what a person pays for a decomposition, in mm2 of blemished surface.

Area that needs support is scarred where support touches it, and every cut leaves a seam, a scar along its rim that is
search.seam_mm wide, less of one where it is hidden. The paper's J is the special case of a seam without width.
"""

from dataclasses import dataclass

import numpy as np

from mdp.cost.hidden import hidden_shares
from mdp.cost.model_need import MADE_BY_A_CUT, ModelNeed, ModelSurface, Piece
from mdp.cut import Solid
from mdp.mesh import Floats, Mesh, dot
from mdp.overhang import standing
from mdp.plane import Plane
from mdp.sweep.rims import Rim, measure_rim
from mdp.zone import NOWHERE, ZonesOnModel

NO_SEAM_WEIGHT = 100.0  # of a rim where a person wants no seam


@dataclass(frozen=True, eq=False)
class SeamPlaces:
    """Where on a model seams cost how much. by_source: (m,) how much a mm of rim counts on each of the model's faces; zones: of
    the search; where they want no seam it counts NO_SEAM_WEIGHT times."""

    surface: ModelSurface
    by_source: Floats
    zones: ZonesOnModel

    @classmethod
    def of(cls, surface: ModelSurface, solid: Solid, hidden_share: float, zones: ZonesOnModel = NOWHERE) -> "SeamPlaces":
        """The places of an uncut model; hidden_share: how much a rim counts where it is hidden altogether."""
        whole = surface.piece(solid)
        hidden = hidden_shares(whole.mesh) if hidden_share < 1.0 else np.zeros(len(whole.sources))
        by_source = 1.0 - (1.0 - hidden_share) * surface.by_source(whole, hidden)
        return cls(surface, by_source, zones)

    def weights(self, piece: Piece) -> Floats:
        """(m,) how much a mm of rim counts on each face of what cuts have left of the model: 0 on faces that they laid open,
        which the parts on them cover, and on those that stand on the platform."""
        free = (piece.sources == MADE_BY_A_CUT) | standing(piece.mesh)
        unwanted = self.zones.no_seam.among(piece.sources).touched(piece.mesh)
        return np.where(free, 0.0, self.by_source[piece.sources] * np.where(unwanted, NO_SEAM_WEIGHT, 1.0))


@dataclass(frozen=True)
class CostTerms:
    """What a search counts, as it holds. seam_mm: width of the scar along a rim, 0: seams cost nothing; feather: by how much more
    a rim counts where face and plane meet at a small angle; cut_mm2: what a cut costs beside its seam; need: what needs support,
    None: every face that overhangs, the paper's terms."""

    angle_deg: float
    count_platform_faces: bool
    seam_mm: float = 0.0
    feather: float = 0.0
    cut_mm2: float = 0.0
    need: ModelNeed | None = None


def measure_seam(mesh: Mesh, weights: Floats, plane: Plane, feather: float) -> Rim:
    """The seam of a cut through a mesh on whose (m,) faces a mm of rim counts so much. The same as the sweep's rim, for one
    plane."""
    cosines = dot(mesh.normals, plane.normal)
    return measure_rim(mesh.faces, plane.heights_mm(mesh.vertices), cosines, mesh.areas_mm2, weights, feather)
