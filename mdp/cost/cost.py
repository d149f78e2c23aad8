"""Cost: the price of a decomposition in mm2 of blemished surface.

Support blemishes the surface that it touches. Every cut leaves a seam along its rim, as wide as search.seam_mm on a model of 100
mm, narrower where it is hidden. Faces neither level nor parallel to their part's direction show stair-stepping. The paper's J is
the special case with seams of zero width and no stair-stepping.
"""

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

NO_SEAM_WEIGHT = 100.0  # weight of a rim where the user wants no seam
STEPS_OF_MM = 0.2  # layer height to which search.stair_weight refers


@dataclass(frozen=True, eq=False)
class TracedMesh:
    """A piece cut from a model: its mesh, and (m,) the source face in the model of each of its faces, MADE_BY_A_CUT for faces
    created by a cut. One face of a flat region stands for all of them, since their normals are equal.
    """

    mesh: Mesh
    sources: Ints


def origin_of(model: Solid) -> int:
    """manifold3d's ID of a model's solid, by which all pieces cut from it refer to its faces."""
    return run_faces(model)[0][0]


def piece_of(solid: Solid, origin: int) -> TracedMesh:
    """The traced mesh of a piece cut from the model with an origin ID."""
    sources = [np.where(run == origin, faces, MADE_BY_A_CUT) for run, faces in run_faces(solid)]
    return TracedMesh(mesh_of(solid), np.concatenate(sources).astype(np.int32))


@dataclass(frozen=True, eq=False)
class SeamPlaces:
    """Weights of cut seams on a model. origin: manifold3d's ID of the model; by_source: (m,) weight of a mm of rim on each face
    of the model; zones: user-marked zones of the search, where an unwanted seam counts NO_SEAM_WEIGHT times; cylinders: the bores
    and the turned body.
    """

    origin: int
    by_source: Floats
    zones: ZonesOnModel = NOWHERE
    cylinders: tuple[Cylinder, ...] = ()

    @classmethod
    def of(cls, mesh: Mesh, solid: Solid, search: Search, zones: ZonesOnModel = NOWHERE) -> "SeamPlaces":
        """Seam weights of an uncut model, given as a mesh and the solid made from it."""
        cylinders = spoiled_by_cuts(mesh) if search.feature_mm2 > 0.0 or search.feature_weight > 1.0 else ()
        whole = piece_of(solid, origin_of(solid))
        hidden = hidden_shares(whole.mesh) if search.hidden_seam_share < 1.0 else np.zeros(len(whole.sources))
        # Coplanar faces share one source, which gets the mean by area; manifold3d adds some faces where edges coincide.
        areas, size = whole.mesh.areas_mm2, len(mesh.faces)
        total, area = np.bincount(whole.sources, hidden * areas, size), np.bincount(whole.sources, areas, size)
        by_source: Floats = 1.0 - (1.0 - search.hidden_seam_share) * (total / np.where(area > 0.0, area, 1.0))
        for cylinder in cylinders:
            if cylinder.is_bore:
                by_source[cylinder.faces] = search.feature_weight
        return cls(origin_of(solid), by_source, zones, cylinders)

    def piece(self, solid: Solid) -> TracedMesh:
        """The traced mesh of a piece cut from the model."""
        return piece_of(solid, self.origin)

    def cylinders_of(self, piece: TracedMesh) -> tuple[Cylinder, ...]:
        """The bores and the turned body of which a piece still has faces."""
        left = np.unique(piece.sources) if self.cylinders else piece.sources[:0]
        return tuple(cylinder for cylinder in self.cylinders if np.isin(cylinder.faces, left, assume_unique=True).any())

    def weights(self, piece: TracedMesh) -> Floats:
        """(m,) weight of a mm of rim on each face of a piece: 0 on faces created by a cut, which the parts on them cover, and on
        faces that stand on the build plate.
        """
        free = (piece.sources == MADE_BY_A_CUT) | standing(piece.mesh)
        unwanted = self.zones.no_seam.among(piece.sources).touched(piece.mesh)
        return np.where(free, 0.0, self.by_source[piece.sources] * np.where(unwanted, NO_SEAM_WEIGHT, 1.0))


@dataclass(frozen=True)
class CostTerms:
    """Terms of the cost. seam_mm: width of the blemish along a rim, 0 if seams cost nothing; feather: how much more a rim counts
    where face and plane meet at a small angle; cut_mm2: cost of a cut in addition to its seam; stair_weight: weight of an area
    whose steps are as high as a layer; feature_mm2: cost of cutting a bore askew; need: which faces need support, None: every
    overhang, as in the paper.
    """

    angle_deg: float
    count_platform_faces: bool
    seam_mm: float = 0.0
    feather: float = 0.0
    cut_mm2: float = 0.0
    stair_weight: float = 0.0
    feature_mm2: float = 0.0
    need: SupportNeed | None = None


class CutCost(NamedTuple):
    """The final cost of a cut: the risky area left on its part, the part's stair-stepping, the blemish of its seam, and a charge
    per cut.

    lost_mm2: the share that the cut has added, which is all but the earlier stair-stepping; stairs_mm2: the share of
    stair-stepping; seam_mm2: the seam with the bores that it crosses, and the charge.
    """

    residual_mm2: float
    lost_mm2: float
    stairs_mm2: float
    seam_mm2: float


def weight_of_stairs(profile: Profile) -> float:
    """Weight of an area whose steps are as high as a layer of the profile."""
    return profile.search.effective.stair_weight * profile.process.layer_height_mm / STEPS_OF_MM


def stair_weights(piece: TracedMesh, weight: float) -> Floats | None:
    """(m,) weight of stair-stepping on each face of a piece, for steps as high as a layer: 0 on faces created by a cut; None if
    stair-stepping costs nothing.
    """
    return None if weight <= 0.0 else np.where(piece.sources == MADE_BY_A_CUT, 0.0, weight)


def needing_upright(mesh: Mesh, profile: Profile) -> Mask:
    """(m,) faces of a whole model that need support when it is printed straight up, by the objective of the profile's search."""
    search = profile.search.effective
    risky = risky_upright(mesh, profile.process.self_supporting_angle_deg, search.count_platform_faces)
    if search.objective == "risky":
        return risky
    return risky & needs_support(mesh, profile.process, on_plate=True)


def excess_mm2(mesh: Mesh, pieces: ModelPieces, plane: Plane, cut: Mask) -> float:
    """Extra cost of the faces above a plane that need support along its normal, beyond their area: those that no support can
    reach, and those where the user wants none. mesh: the mesh that the plane cuts; cut: (m,) the faces that it may cut.
    """
    classes, counts = pieces.along(plane.normal), 1.0 if pieces.counts is None else pieces.counts
    times = np.where(classes == UNSUPPORTABLE, pieces.need.weight, 1.0) * counts
    risky = facing_down(mesh, plane.normal, pieces.need.process.self_supporting_angle_deg)
    chosen = np.flatnonzero(cut & risky & (classes != CARRIES_ITSELF) & (times != 1.0))
    above_mm2 = areas_above(mesh.faces[chosen], plane.heights_mm(mesh.vertices), mesh.areas_mm2[chosen])
    return float((above_mm2 * (times[chosen] - 1.0)).sum())
