"""Cost: what a person pays for a decomposition, in mm2 of blemished surface.

Area that needs support is scarred where support touches it. Every cut leaves a seam, a scar along its rim that is search.seam_mm
wide on a model of 100 mm, less where it is hidden. Faces that neither stand nor lie along their part's direction show stairs. The
paper's J is the special case of a seam without width and no stairs."""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from mdp.cost.hidden import hidden_shares
from mdp.cost.model_need import MADE_BY_A_CUT, ModelNeed, ModelSurface, Piece
from mdp.cut import Solid
from mdp.mesh import Floats, Mesh, dot
from mdp.overhang import standing
from mdp.plane import Plane
from mdp.sweep.cylinders import Cylinder
from mdp.sweep.rims import Rim, measure_rim
from mdp.zone import NOWHERE, ZonesOnModel
from profiles.profile import Profile

NO_SEAM_WEIGHT = 100.0  # of a rim where a person wants no seam
STEPS_OF_MM = 0.2  # search.stair_weight is that of layers so high


@dataclass(frozen=True, eq=False)
class SeamPlaces:
    """Where on a model seams cost how much. by_source: (m,) how much a mm of rim counts on each of the model's faces; zones: of
    the search; where they want no seam it counts NO_SEAM_WEIGHT times; cylinders: its bores and turned body."""

    surface: ModelSurface
    by_source: Floats
    zones: ZonesOnModel
    cylinders: tuple[Cylinder, ...] = ()

    @classmethod
    def of(
        cls,
        surface: ModelSurface,
        solid: Solid,
        hidden_share: float,
        zones: ZonesOnModel = NOWHERE,
        *,
        cylinders: tuple[Cylinder, ...] = (),
        feature_weight: float = 1.0,
    ) -> "SeamPlaces":
        """The places of an uncut model; hidden_share: how much a rim counts where it is hidden altogether, feature_weight: on
        the cylinders, hidden or not."""
        whole = surface.piece(solid)
        hidden = hidden_shares(whole.mesh) if hidden_share < 1.0 else np.zeros(len(whole.sources))
        by_source = 1.0 - (1.0 - hidden_share) * surface.by_source(whole, hidden)
        for cylinder in cylinders:
            if cylinder.is_bore:
                by_source[cylinder.faces] = feature_weight
        return cls(surface, by_source, zones, cylinders)

    def cylinders_of(self, piece: Piece) -> tuple[Cylinder, ...]:
        """The bores and the turned body of which cuts have left something."""
        left = np.unique(piece.sources) if self.cylinders else piece.sources[:0]
        return tuple(cylinder for cylinder in self.cylinders if np.isin(cylinder.faces, left, assume_unique=True).any())

    def weights(self, piece: Piece) -> Floats:
        """(m,) how much a mm of rim counts on each face of what cuts have left of the model: 0 on faces that they laid open,
        which the parts on them cover, and on those that stand on the platform."""
        free = (piece.sources == MADE_BY_A_CUT) | standing(piece.mesh)
        unwanted = self.zones.no_seam.among(piece.sources).touched(piece.mesh)
        return np.where(free, 0.0, self.by_source[piece.sources] * np.where(unwanted, NO_SEAM_WEIGHT, 1.0))


@dataclass(frozen=True)
class CostTerms:
    """What a search counts, as it holds. seam_mm: width of the scar along a rim, 0: seams cost nothing; feather: by how much
    more a rim counts where face and plane meet at a small angle; cut_mm2: what a cut costs beside its seam; stair_weight: how
    much an area counts whose steps are as high as a layer; feature_mm2: what it costs to cut a bore askew; need: what
    needs support, None: every face that overhangs, the paper's terms."""

    angle_deg: float
    count_platform_faces: bool
    seam_mm: float = 0.0
    feather: float = 0.0
    cut_mm2: float = 0.0
    stair_weight: float = 0.0
    feature_mm2: float = 0.0
    need: ModelNeed | None = None


class CutCost(NamedTuple):
    """What a cut costs for ever: the area that stays risky on its part, the part's stairs, the scar of its seam, and that it is
    made; lost_mm2: what of it the cut has made worse, all but the stairs that the part had before, too; stairs_mm2: what of it
    are stairs, seam_mm2: the scar of its seam, with the bores that it crosses, and that it is made."""

    residual_mm2: float
    lost_mm2: float
    stairs_mm2: float
    seam_mm2: float


def weight_of_stairs(profile: Profile) -> float:
    """How much an area counts whose steps are as high as a layer of the profile."""
    return profile.search.effective.stair_weight * profile.process.layer_height_mm / STEPS_OF_MM


def stair_weights(piece: Piece, weight: float) -> Floats | None:
    """(m,) how much an area on each face of what was cut from a model counts whose steps are as high as a layer: nothing on faces
    that cuts laid open; None where stairs do not count."""
    return None if weight <= 0.0 else np.where(piece.sources == MADE_BY_A_CUT, 0.0, weight)


def measure_seam(mesh: Mesh, weights: Floats, plane: Plane, feather: float) -> Rim:
    """The seam of a cut through a mesh on whose (m,) faces a mm of rim counts so much. The same as the sweep's rim, for one
    plane."""
    cosines = dot(mesh.normals, plane.normal)
    return measure_rim(mesh.faces, plane.heights_mm(mesh.vertices), cosines, mesh.areas_mm2, weights, feather)
