"""Cost: what a person pays for a decomposition, in mm2 of blemished surface.

Area that needs support is scarred where support touches it. Every cut leaves a seam, a scar along its rim that is search.seam_mm
wide on a model of 100 mm, less where it is hidden. Faces that neither stand nor lie along their part's direction show stairs. The
paper's J is the special case of a seam without width and no stairs."""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from mdp.cost.hidden import hidden_shares
from mdp.cut import Solid, mesh_of, run_faces
from mdp.mesh import Floats, Ints, Mesh
from mdp.overhang import Mask, facing_down, risky_upright, standing
from mdp.plane import Plane
from mdp.support_need.need import MADE_BY_A_CUT, ModelPieces, SupportNeed, needs_support
from mdp.support_need.patches import CARRIES_ITSELF, UNSUPPORTABLE
from mdp.sweep.crossing import areas_above
from mdp.sweep.cylinders import Cylinder, spoiled_by_cuts
from mdp.zone import NOWHERE, ZonesOnModel
from profiles.profile import Profile
from profiles.search import Search

NO_SEAM_WEIGHT = 100.0  # of a rim where a person wants no seam
STEPS_OF_MM = 0.2  # search.stair_weight is that of layers so high


@dataclass(frozen=True, eq=False)
class TracedMesh:
    """What was cut from a model: its mesh, and (m,) the face of the model that each of its faces is a piece of, MADE_BY_A_CUT
    where a cut laid it open. One face of a flat place stands for all of them: their normals are the same."""

    mesh: Mesh
    sources: Ints


def origin_of(model: Solid) -> int:
    """The number by which the faces of a model's solid are known in all that is cut from it."""
    return run_faces(model)[0][0]


def piece_of(solid: Solid, origin: int) -> TracedMesh:
    """What was cut from the model of an origin."""
    sources = [np.where(run == origin, faces, MADE_BY_A_CUT) for run, faces in run_faces(solid)]
    return TracedMesh(mesh_of(solid), np.concatenate(sources).astype(np.int32))


@dataclass(frozen=True, eq=False)
class SeamPlaces:
    """Where on a model seams cost how much. origin: of the model; by_source: (m,) how much a mm of rim counts on
    each of the model's faces; zones: of the search; where they want no seam it counts NO_SEAM_WEIGHT times; cylinders: its bores
    and turned body."""

    origin: int
    by_source: Floats
    zones: ZonesOnModel = NOWHERE
    cylinders: tuple[Cylinder, ...] = ()

    @classmethod
    def of(cls, mesh: Mesh, solid: Solid, search: Search, zones: ZonesOnModel = NOWHERE) -> "SeamPlaces":
        """The places of an uncut model, a mesh and the solid made of it."""
        cylinders = spoiled_by_cuts(mesh) if search.feature_mm2 > 0.0 or search.feature_weight > 1.0 else ()
        whole = piece_of(solid, origin_of(solid))
        hidden = hidden_shares(whole.mesh) if search.hidden_seam_share < 1.0 else np.zeros(len(whole.sources))
        # Of faces that one stands for the mean by area; manifold3d adds some faces where edges lie upon each other.
        areas, size = whole.mesh.areas_mm2, len(mesh.faces)
        total, area = np.bincount(whole.sources, hidden * areas, size), np.bincount(whole.sources, areas, size)
        by_source: Floats = 1.0 - (1.0 - search.hidden_seam_share) * (total / np.where(area > 0.0, area, 1.0))
        for cylinder in cylinders:
            if cylinder.is_bore:
                by_source[cylinder.faces] = search.feature_weight
        return cls(origin_of(solid), by_source, zones, cylinders)

    def piece(self, solid: Solid) -> TracedMesh:
        """What was cut from the model."""
        return piece_of(solid, self.origin)

    def cylinders_of(self, piece: TracedMesh) -> tuple[Cylinder, ...]:
        """The bores and the turned body of which cuts have left something."""
        left = np.unique(piece.sources) if self.cylinders else piece.sources[:0]
        return tuple(cylinder for cylinder in self.cylinders if np.isin(cylinder.faces, left, assume_unique=True).any())

    def weights(self, piece: TracedMesh) -> Floats:
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
    need: SupportNeed | None = None


class CutCost(NamedTuple):
    """The final cost of a cut: the risky area left on its part, the part's stairs, the scar of its seam, and a charge per cut.

    lost_mm2: the share that the cut has added, all but the stairs that the part had before; stairs_mm2: the share of stairs;
    seam_mm2: the scar of the seam with the bores that it crosses, and the charge.
    """

    residual_mm2: float
    lost_mm2: float
    stairs_mm2: float
    seam_mm2: float


def weight_of_stairs(profile: Profile) -> float:
    """How much an area counts whose steps are as high as a layer of the profile."""
    return profile.search.effective.stair_weight * profile.process.layer_height_mm / STEPS_OF_MM


def stair_weights(piece: TracedMesh, weight: float) -> Floats | None:
    """(m,) how much an area on each face of what was cut from a model counts whose steps are as high as a layer: nothing on faces
    that cuts laid open; None where stairs do not count."""
    return None if weight <= 0.0 else np.where(piece.sources == MADE_BY_A_CUT, 0.0, weight)


def needing_upright(mesh: Mesh, profile: Profile) -> Mask:
    """(m,) faces of a whole model that need support printed straight up, by the terms of the profile's search."""
    search = profile.search.effective
    risky = risky_upright(mesh, profile.process.self_supporting_angle_deg, search.count_platform_faces)
    if search.objective == "risky":
        return risky
    return risky & needs_support(mesh, profile.process, on_platform=True)


def excess_mm2(mesh: Mesh, pieces: ModelPieces, plane: Plane, cut: Mask) -> float:
    """By how much what needs support above a plane along its normal counts more than its area: over nothing but air, and where
    none is wanted. mesh: what the plane cuts; cut: (m,) those of its faces that it may cut."""
    classes, counts = pieces.along(plane.normal), 1.0 if pieces.counts is None else pieces.counts
    times = np.where(classes == UNSUPPORTABLE, pieces.need.weight, 1.0) * counts
    risky = facing_down(mesh, plane.normal, pieces.need.process.self_supporting_angle_deg)
    chosen = np.flatnonzero(cut & risky & (classes != CARRIES_ITSELF) & (times != 1.0))
    above_mm2 = areas_above(mesh.faces[chosen], plane.heights_mm(mesh.vertices), mesh.areas_mm2[chosen])
    return float((above_mm2 * (times[chosen] - 1.0)).sum())
