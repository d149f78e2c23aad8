"""Cost: what a person pays for a decomposition, in mm2 of blemished surface.

Area that needs support is scarred where support touches it, and every cut leaves a seam, a scar along its rim that is
search.seam_mm wide. The paper's J is the special case of a seam without width.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from math import cos, radians

import numpy as np

from mdp.mesh import Floats, Mesh
from mdp.overhang import BASE_TOLERANCE_MM, standing
from mdp.plane import Plane
from mdp.sweep.rims import COT_30
from mdp.zone import Zone, touched
from profiles.profile import Profile
from profiles.search import Search

ROUNDING_MM = 1e-9  # a corner that a cut has made lies in its plane
NO_SEAM_WEIGHT = 100.0  # of a rim where a person wants no seam
PARALLEL = cos(radians(0.1))  # a face of a cut lies along its plane up to rounding


@dataclass(frozen=True)
class CostTerms:
    """What a search counts. seam_mm: width of the scar along a rim, 0: seams cost nothing; feather: by how much more a rim
    counts where face and plane meet at a small angle; no_seam: zones in which a rim counts NO_SEAM_WEIGHT times."""

    angle_deg: float
    count_platform_faces: bool
    seam_mm: float = 0.0
    feather: float = 0.0
    no_seam: tuple[Zone, ...] = ()

    def seam_weights(self, mesh: Mesh, cuts: Sequence[Plane]) -> Floats | None:
        """(m,) how much a mm of rim counts on each face of what remains after some cuts; None where seams cost nothing."""
        return rim_weights(mesh, cuts) * zone_weights(mesh, self.no_seam) if self.seam_mm > 0.0 else None


def cost_terms(profile: Profile, settings: Search, no_seam: tuple[Zone, ...] = ()) -> CostTerms:
    """The terms of a search; settings: the profile's, or those of the published search."""
    seam_mm = settings.seam_mm if settings.objective == "scar" else 0.0
    angle_deg, platform_faces = profile.process.self_supporting_angle_deg, settings.count_platform_faces
    return CostTerms(angle_deg, platform_faces, seam_mm, settings.feather_weight, no_seam)


def rim_weights(mesh: Mesh, cuts: Sequence[Plane]) -> Floats:
    """(m,) 1 where a rim is seen; 0 on faces that earlier cuts laid open, which the part on them covers, and on those that
    stand on the platform."""
    weights = np.ones(len(mesh.faces))
    weights[standing(mesh)] = 0.0
    for plane in cuts:
        along = mesh.normals @ plane.normal > PARALLEL
        within = np.abs(plane.heights_mm(mesh.vertices)) <= BASE_TOLERANCE_MM
        weights[along & within[mesh.faces].all(axis=1)] = 0.0
    return weights


def zone_weights(mesh: Mesh, no_seam: Sequence[Zone]) -> Floats:
    """(m,) by how much more a rim counts on faces that reach into a zone without seams."""
    return np.where(touched(mesh, no_seam), NO_SEAM_WEIGHT, 1.0)


@dataclass(frozen=True)
class Seam:
    """The rim of a cut where it is seen: its length, and the length with feather edges and zones weighted, mm."""

    length_mm: float
    weighted_mm: float


def measure_seam(mesh: Mesh, cuts: Sequence[Plane], plane: Plane, feather: float, no_seam: Sequence[Zone] = ()) -> Seam:
    """The seam of a cut through what earlier cuts have left. The same as the sweep's rim, for one plane."""
    low, middle, high = np.sort(plane.heights_mm(mesh.vertices)[mesh.faces], axis=1).T
    crossed = np.flatnonzero((low < -ROUNDING_MM) & (high > ROUNDING_MM))
    low, middle, high = low[crossed], middle[crossed], high[crossed]
    cosine = np.abs(mesh.normals[crossed] @ plane.normal)
    sine = np.sqrt(np.maximum(1.0 - cosine * cosine, 0.0))
    with np.errstate(divide="ignore", invalid="ignore"):
        share = np.where(middle > 0.0, -low / (middle - low), high / (high - middle))
    chord = 2.0 * mesh.areas_mm2[crossed] * rim_weights(mesh, cuts)[crossed] * share / (high - low)
    weighted = chord * (sine + feather * np.maximum(cosine - COT_30 * sine, 0.0)) * zone_weights(mesh, no_seam)[crossed]
    return Seam(float((chord * sine).sum()), float(weighted.sum()))
