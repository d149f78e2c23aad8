"""Cost: what a person pays for a decomposition, in mm2 of blemished surface.

Area that needs support is scarred where support touches it, and every cut leaves a seam, a scar along its rim that is
search.seam_mm wide, less of one where it is hidden. The paper's J is the special case of a seam without width.
"""

from dataclasses import dataclass

import numpy as np

from mdp.cost.hidden import hidden_shares
from mdp.cost.model_need import ModelNeed
from mdp.cost.model_surface import MADE_BY_A_CUT, ModelSurface
from mdp.cut import Solid, mesh_of
from mdp.mesh import Floats, Mesh, dot
from mdp.overhang import standing
from mdp.plane import Plane
from mdp.sweep.rims import measure_rim
from mdp.zone import NOWHERE, ZonesOnModel
from profiles.profile import Profile
from profiles.search import Search

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
        mesh = mesh_of(solid)
        hidden = hidden_shares(mesh) if hidden_share < 1.0 else np.zeros(len(mesh.faces))
        by_source = 1.0 - (1.0 - hidden_share) * surface.by_source(solid, hidden)
        return cls(surface, by_source, zones)

    def weights(self, solid: Solid) -> Floats:
        """(m,) how much a mm of rim counts on each face of what cuts have left of the model: 0 on faces that they laid open,
        which the parts on them cover, and on those that stand on the platform."""
        mesh, sources = mesh_of(solid), self.surface.sources(solid)
        free = (sources == MADE_BY_A_CUT) | standing(mesh)
        unwanted = self.zones.no_seam.among(sources).touched(mesh)
        return np.where(free, 0.0, self.by_source[sources] * np.where(unwanted, NO_SEAM_WEIGHT, 1.0))


@dataclass(frozen=True)
class CostTerms:
    """What a search counts. seam_mm: width of the scar along a rim, 0: seams cost nothing; feather: by how much more a rim
    counts where face and plane meet at a small angle; cut_mm2: what a cut costs beside its seam; need: what needs support,
    None: every face that overhangs, the paper's terms."""

    angle_deg: float
    count_platform_faces: bool
    seam_mm: float = 0.0
    feather: float = 0.0
    cut_mm2: float = 0.0
    need: ModelNeed | None = None


def cost_terms(profile: Profile, settings: Search) -> CostTerms:
    """The terms of a search; settings: the profile's, or those of the published search."""
    seam_mm = settings.seam_mm if settings.objective == "scar" else 0.0
    angle_deg, platform_faces = profile.process.self_supporting_angle_deg, settings.count_platform_faces
    cut_mm2 = settings.cut_mm2 if seam_mm > 0.0 else 0.0
    return CostTerms(angle_deg, platform_faces, seam_mm, settings.feather_weight, cut_mm2)


@dataclass(frozen=True)
class Seam:
    """The rim of a cut where it is seen: its length, the length with feather edges and places weighted, and how much of it is a
    feather edge of less than 20 degrees, mm."""

    length_mm: float
    weighted_mm: float
    feathered_mm: float

    @property
    def feather_share(self) -> float:
        """Share of the rim that is a feather edge; 0 where nothing of it is seen."""
        return self.feathered_mm / self.length_mm if self.length_mm > 0.0 else 0.0


def measure_seam(mesh: Mesh, weights: Floats, plane: Plane, feather: float) -> Seam:
    """The seam of a cut through a mesh on whose (m,) faces a mm of rim counts so much. The same as the sweep's rim, for one
    plane."""
    cosines = dot(mesh.normals, plane.normal)
    return Seam(*measure_rim(mesh.faces, plane.heights_mm(mesh.vertices), cosines, mesh.areas_mm2, weights, feather))
