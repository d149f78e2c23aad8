"""Candidates: planes by direction and offset, filtered by the criteria, the reach of the axes and the clearance of the head.

Criteria of the 2020 paper: I (self-supported above the plane) is the search's relaxed goal, II (the remainder stands on the build
plate), III (the plate lies below the plane), IV (a large volume above the plane).
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from enum import IntEnum
from math import radians, sin, sqrt

import numpy as np

from mdp.clearance import least_height_mm
from mdp.cost.cost import CostTerms, CutCost
from mdp.directions.unit_vectors import spread
from mdp.mesh import Floats, Ints, Mesh
from mdp.overhang import PLATE_TOLERANCE_MM, Mask, threshold
from mdp.plane import Plane
from mdp.sweep.components import LEAST_CONTACT_AREA_MM2
from mdp.sweep.limbs import LimbSums
from mdp.sweep.sweep import Gains, Remainder, gains, sweep
from mdp.zone import KeptFaces, Zone, spans_mm
from profiles.messages import key_name, phrase
from profiles.profile import Profile
from profiles.search import Search

# A plane never coincides with a face that overhangs along its direction: the face would seem to rest on the cut, but lies over
# air.
COPLANAR_MM = 1e-4


class Reason(IntEnum):
    """Why a candidate is rejected, FEASIBLE if it is not. The first reason that holds is counted."""

    FEASIBLE = 0
    PLATFORM = 1
    FLOATING = 2
    REACH = 3
    CLEARANCE = 4
    VOLUME = 5
    INTERFACE = 6
    FRAGILE = 7
    GAIN = 8
    KEEP = 9
    WEAK = 10
    STANDING = 11


REASONS = {
    Reason.PLATFORM: "it would cut into the build plate",
    Reason.FLOATING: "the remainder would not stand on the build plate",
    Reason.REACH: "the axes do not reach the direction",
    Reason.CLEARANCE: "the head would meet the table",
    Reason.VOLUME: f"the part would be too small ({key_name('search.least_volume_share')})",
    Reason.INTERFACE: f"the part or a piece of it would hang on too small an area ({key_name('search.least_interface_mm2')})",
    Reason.FRAGILE: f"the plane would leave a sliver ({key_name('search.fragile_mm')})",
    Reason.GAIN: (
        f"it would make too little safe for the seam it leaves ({key_name('search.seam_mm')}, {key_name('search.least_gain')})"
    ),
    Reason.KEEP: f"the plane would pass through a zone that stays whole{phrase('', ' ([[keep]])')}",
    Reason.WEAK: f"the nozzle could break the part or a piece of it off its base ({key_name('search.nozzle_load_n')})",
    Reason.STANDING: "the head would meet the print beside it",
}


def directions(search: Search) -> Floats:
    """(k, 3) unit directions spread evenly over the sphere's cap above the least elevation."""
    return spread(search.directions, sin(radians(search.least_elevation_deg))).copy()


@dataclass(frozen=True, eq=False)
class Bounds:
    """Constraints per direction, computed once per search: (k,) arrays. keep_mm: (k, spans, 2) offsets between which a plane
    would pass through a [[keep]] zone; fragment_mm: height below which a piece is a fragment; fragile_mm: thickness below which
    it is a sliver; step_mm: between candidates along a direction.
    """

    directions: Floats
    least_offset_mm: Floats
    least_height_mm: Floats
    least_volume_mm3: float
    least_interface_mm2: float
    keep_mm: Floats
    fragment_mm: float
    fragile_mm: float
    step_mm: float

    @property
    def contact_area_mm2(self) -> float:
        """The least area on which a piece of the part may stand, mm2."""
        return max(self.least_interface_mm2, LEAST_CONTACT_AREA_MM2)


def bounds_of(
    chosen: Floats, mesh: Mesh, profile: Profile, disc: tuple[Floats, float], keep: Sequence[Zone | KeptFaces] = ()
) -> Bounds:
    """Bounds for (k, 3) directions. disc: the disc that every plane must clear; keep: the zones that stay in one piece."""
    (centre, radius), search = disc, profile.search.effective
    tilt = np.hypot(chosen[:, 0], chosen[:, 1])
    heights = np.zeros(len(chosen))
    if search.clearance:
        heights = np.array([least_height_mm(profile.machine, direction) for direction in chosen])
    return Bounds(
        directions=chosen,
        least_offset_mm=chosen[:, :2] @ centre + radius * tilt,
        least_height_mm=heights,
        least_volume_mm3=search.least_volume_share * mesh.volume_mm3,
        least_interface_mm2=search.least_interface_mm2,
        keep_mm=spans_mm(chosen, keep),
        fragment_mm=sqrt(search.least_interface_mm2),
        fragile_mm=max(search.fragile_mm, COPLANAR_MM),
        step_mm=search.offset_step_mm,
    )


def plate_disc(mesh: Mesh, search: Search) -> tuple[Floats, float]:
    """Centre and radius of the disc of criterion III: the configured one, or else the model's footprint."""
    return footprint(mesh) if search.platform_radius_mm is None else (np.zeros(2), search.platform_radius_mm)


def footprint(mesh: Mesh) -> tuple[Floats, float]:
    """Centre (2,) and radius of an approximately minimal disc around the model's contact with the build plate (Badoiu and
    Clarkson).
    """
    points = mesh.vertices[mesh.vertices[:, 2] <= PLATE_TOLERANCE_MM][:, :2]
    if len(points) == 0:
        return np.zeros(2), 0.0
    centre = 0.5 * (points.min(axis=0) + points.max(axis=0))
    for step in range(1, 200):
        farthest = points[np.argmax(((points - centre) ** 2).sum(axis=1))]
        centre = centre + (farthest - centre) / (step + 1)
    return centre, float(np.sqrt(((points - centre) ** 2).sum(axis=1).max()))


@dataclass(frozen=True, eq=False)
class ScoredCandidates:
    """The candidates of one solid with enough gain above the build plate, one array row each.

    Their feasibility is not known yet. direction is a row of limits.directions; above_mm2: the risky area above the plane when it
    is printed straight up; residual_mm2, lost_mm2, stairs_mm2, seam_mm2: see CutCost; unavoidable_mm2: the share of the first two
    that no cut can save; unavoidable_here_mm2: that share of the solid's risky area; both 0 unless requested. first, columns:
    (k,) the first plane along each direction, in steps of limits.step_mm, and the number of all planes along it.
    """

    remainder: Remainder
    limits: Bounds
    direction: Ints
    offset_mm: Floats
    above_mm2: Floats
    gain_mm2: Floats
    residual_mm2: Floats
    lost_mm2: Floats
    stairs_mm2: Floats
    seam_mm2: Floats
    unavoidable_mm2: Floats
    first: Ints
    columns: Ints
    unavoidable_here_mm2: float = 0.0

    @property
    def end_mm(self) -> Floats:
        """Offset of the last plane along the direction of each candidate."""
        end_mm: Floats = ((self.first + self.columns - 1) * np.float64(self.limits.step_mm))[self.direction]
        return end_mm

    @property
    def evaluated(self) -> int:
        """The number of all planes, whether scored or not."""
        return int(self.columns.sum())

    def cost(self, row: int) -> CutCost:
        """The cost of a row's cut."""
        costs = (self.residual_mm2, self.lost_mm2, self.stairs_mm2, self.seam_mm2)
        return CutCost(*(float(cost[row]) for cost in costs))


@dataclass(frozen=True, eq=False)
class Feasibility:
    """Results of the sweep for some candidates, one array row each. reason is FEASIBLE or the reason for rejection.

    fragile_mm is the distance to the nearest surface that the plane would cut into a sliver. contact_area_mm2 is the least area
    on which a piece of the part stands; fragments, pieces lower than the side of a square of least_interface_mm2, may stand on
    less.
    """

    reason: Ints
    volume_mm3: Floats
    section_mm2: Floats
    fragile_mm: Floats
    contact_area_mm2: Floats


def score_candidates(
    remainder: Remainder, limits: Bounds, terms: CostTerms, least_gain_mm2: float, unavoidable: Mask | None = None
) -> ScoredCandidates:
    """Candidates of a solid with a gain of at least least_gain_mm2: the risky area and the stair-stepping that a cut saves, less
    the stair-stepping that it adds and its seam. unavoidable: the faces that no cut can save, see sweep.gains.
    """
    swept = gains(remainder, limits.directions, limits.step_mm, threshold(terms.angle_deg), unavoidable)
    residual, offset = residual_mm2(swept, terms), swept.offsets_mm(limits.step_mm)
    gain = gain_mm2(swept, residual)
    above = (offset >= limits.least_offset_mm[:, None]) & np.isfinite(limits.least_height_mm)[:, None]
    scored = swept.used & above & (gain >= least_gain_mm2)
    for low, high in np.moveaxis(limits.keep_mm, 0, 2):
        scored &= (offset <= low[:, None]) | (offset >= high[:, None])
    direction = np.nonzero(scored)[0].astype(np.int32)
    return ScoredCandidates(
        remainder=remainder,
        limits=limits,
        direction=direction,
        offset_mm=offset[scored],
        above_mm2=swept.up_mm2[scored],
        gain_mm2=gain[scored],
        residual_mm2=residual[scored],
        lost_mm2=lost_mm2(swept, residual)[scored],
        stairs_mm2=swept.stairs_mm2[scored],
        seam_mm2=seam_mm2(swept, terms)[scored],
        unavoidable_mm2=swept.unavoidable_mm2[scored],
        first=swept.first,
        columns=swept.columns,
        unavoidable_here_mm2=0.0 if unavoidable is None else float(remainder.facets.faces.counted_mm2[unavoidable].sum()),
    )


def residual_mm2(swept: Gains | LimbSums, terms: CostTerms) -> Floats:
    """The final cost of each cut, see CutCost, mm2."""
    return swept.residual_mm2 + swept.stairs_mm2 + seam_mm2(swept, terms)


def lost_mm2(swept: Gains | LimbSums, residual_mm2: Floats) -> Floats:
    """The share of each cut's final cost that it has added, mm2. Every surface shows stair-stepping in any orientation, so
    without this correction large parts would be avoided for the steps that they had before.
    """
    return residual_mm2 - np.minimum(swept.stairs_mm2, swept.stairs_up_mm2)


def gain_mm2(swept: Gains | LimbSums, residual_mm2: Floats) -> Floats:
    """The net saving of each cut, mm2."""
    return swept.up_mm2 + swept.stairs_up_mm2 - residual_mm2


def seam_mm2(swept: Gains | LimbSums, terms: CostTerms) -> Floats:
    """Cost of each cut's seam, of the bores that it cuts askew, and of the cut itself, mm2."""
    return terms.seam_mm * swept.rim_mm + terms.feature_mm2 * swept.crossed + terms.cut_mm2


def check(remainder: Remainder, limits: Bounds, step_mm: float, direction: Ints, offset_mm: Floats) -> Feasibility:
    """Feasibility of planes (rows of limits.directions, offsets on a grid of step_mm)."""
    rows, inverse = np.unique(direction, return_inverse=True)
    swept = sweep(remainder, limits.directions[rows], step_mm, limits.least_height_mm[rows], limits.fragment_mm)
    at = (inverse, np.rint(offset_mm / step_mm).astype(np.int64) - swept.first[inverse])
    reason, keep_mm = np.zeros(len(direction), np.int32), limits.keep_mm[direction]
    checks = {
        Reason.PLATFORM: offset_mm < limits.least_offset_mm[direction],
        Reason.FLOATING: swept.pieces[at] > 0,
        Reason.REACH: ~np.isfinite(limits.least_height_mm[direction]),
        Reason.CLEARANCE: swept.lowest_mm[at] < limits.least_height_mm[direction],
        Reason.VOLUME: swept.volume_mm3[at] < limits.least_volume_mm3,
        Reason.INTERFACE: swept.contact_area_mm2[at] < limits.contact_area_mm2,
        Reason.FRAGILE: swept.fragile_mm[at] < limits.fragile_mm,
        Reason.KEEP: ((keep_mm[..., 0] < offset_mm[:, None]) & (offset_mm[:, None] < keep_mm[..., 1])).any(axis=1),
    }
    for why, out in checks.items():
        reason[out & (reason == 0)] = why
    columns = (swept.volume_mm3, swept.section_mm2, swept.fragile_mm, swept.contact_area_mm2)
    return Feasibility(reason, *(column[at] for column in columns))


def count_rejected(scored: ScoredCandidates, least_gain_mm2: float, is_weak: Callable[[Plane], bool]) -> dict[Reason, int]:
    """The number of a solid's planes rejected for each reason, to report why nothing can be cut. scored: at least the candidates
    that gain least_gain_mm2; is_weak: called only for planes that pass every other check.
    """
    limits, step_mm = scored.limits, scored.limits.step_mm
    direction = np.repeat(np.arange(len(scored.columns), dtype=np.int32), scored.columns)
    begins = np.concatenate([[0], np.cumsum(scored.columns)])
    offset_mm = (np.arange(begins[-1]) + np.repeat(scored.first - begins[:-1], scored.columns)) * np.float64(step_mm)
    reason = check(scored.remainder, limits, step_mm, direction, offset_mm).reason
    gains_enough = np.zeros(len(reason), np.bool_)
    column = np.rint(scored.offset_mm / step_mm).astype(np.int64) - scored.first[scored.direction]
    gains_enough[begins[scored.direction] + column] = scored.gain_mm2 >= least_gain_mm2
    reason[(reason == Reason.FEASIBLE) & ~gains_enough] = Reason.GAIN
    for row in np.flatnonzero(reason == Reason.FEASIBLE):
        if is_weak(Plane(limits.directions[direction[row]], float(offset_mm[row]))):
            reason[row] = Reason.WEAK
    return {why: int((reason == why).sum()) for why in Reason}
