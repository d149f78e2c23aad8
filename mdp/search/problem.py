"""Problem: the constants of a search, the feasibility of planes at a node, and the node after a cut."""

from collections.abc import Iterator, Sequence
from functools import cached_property, partial
from math import inf, radians, sin, sqrt
from time import perf_counter

import numpy as np

from mdp.clearance import allowed_poses, passes_clear
from mdp.cost.cost import CostTerms, CutCost, SeamPlaces, weight_of_stairs
from mdp.cut import Solid, below, cut, mesh_of, solid_of
from mdp.directions.flats import Flats
from mdp.directions.orientation import diameter_mm
from mdp.mesh import Floats, Mesh
from mdp.overhang import BASE_TOLERANCE_MM, PLATE_TOLERANCE_MM, standing, threshold
from mdp.plane import Plane
from mdp.pose import Pose
from mdp.ranking.candidates import (
    Bounds,
    Reason,
    ScoredCandidates,
    bounds_of,
    check,
    count_rejected,
    directions,
    lost_mm2,
    plate_disc,
    residual_mm2,
    score_candidates,
    seam_mm2,
)
from mdp.ranking.node import Node
from mdp.ranking.ranking import CandidateTable, Model
from mdp.support_need.need import SupportNeed
from mdp.sweep.bending import stress_per_newton
from mdp.sweep.limbs import LimbSums, limb_faces, limb_vertices, sum_limbs
from mdp.sweep.sweep import Gains, gains, unavoidable_faces
from mdp.zone import NO_ZONES, Zones
from profiles.machine import Machine
from profiles.profile import Profile

SIZE_MM = 100.0  # size of the model for which a seam counts as wide as search.seam_mm
FINEST = 1 / 32  # share of the offset step; a grid through a plane nearer to the origin would have too many planes


class Problem:
    """Settings, machine and bounds of a search, its root, and the number of evaluated candidates.

    start: the node from which the search starts: the root, or the node after the user's planes. place_mm: (3,) shift of the
    model, centred about the turn axis here, to its place on the plate, on which the machine's reach depends.
    """

    def __init__(self, mesh: Mesh, profile: Profile, zones: Zones = NO_ZONES) -> None:
        self.profile, self.settings = profile, profile.search.effective
        settings = self.settings
        self.machine = profile.machine if settings.clearance else without_limits(profile.machine)
        self.place_mm = np.array([*profile.process.place_mm, 0.0])
        self.mesh, self.zones = mesh, zones.on(mesh)
        solid = solid_of(mesh, apart=self.zones.by_face)
        need = None
        if settings.objective == "scar":
            need = SupportNeed.of(mesh, profile.process, settings.unsupportable_weight, self.zones)
        self.terms = CostTerms(
            angle_deg=profile.process.self_supporting_angle_deg,
            count_platform_faces=settings.count_platform_faces,
            seam_mm=settings.seam_mm * diameter_mm(mesh) / SIZE_MM,
            feather=settings.feather_weight,
            cut_mm2=settings.cut_mm2,
            stair_weight=weight_of_stairs(profile),
            feature_mm2=settings.feature_mm2,
            need=need,
        )
        self.root = self.start = Node(solid, self.terms, SeamPlaces.of(mesh, solid, settings, self.zones))
        radius_mm = 0.5 * float(np.linalg.norm(mesh.bounds_mm[1] - mesh.bounds_mm[0]))
        self.model = Model(self.root.risky_mm2, mesh.volume_mm3, radius_mm)
        self.plate_disc = plate_disc(mesh, settings)
        self.preferred_mm3 = settings.preferred_volume_share * mesh.volume_mm3
        # Gains are shares of the risky area without faces on the plate, which no cut can save; as published, with them.
        published, risky = settings.method == "published", self.root.remainder.risky
        counted = risky if published else risky & ~standing(self.root.remainder.mesh)
        savable_mm2 = float(self.root.remainder.mesh.areas_mm2[counted].sum())
        self.least_gain_mm2 = settings.least_gain * savable_mm2
        self.bearable_mpa = profile.material.cold_weld_mpa / settings.strength_safety
        self.large_gain_mm2 = min(self.least_gain_mm2, settings.least_gain_preferred * savable_mm2)
        self._evaluated: list[int] = []  # appended to by several threads
        self._root_scored: ScoredCandidates | None = None
        self.begin()

    @cached_property
    def limits(self) -> Bounds:
        """The bounds of the sampled directions and, if stair-stepping counts, of those along the model's flats. Computed lazily:
        a user's plane needs only its own bounds.
        """
        sampled = directions(self.settings) @ self.axes
        if self.terms.stair_weight > 0.0:
            sampled = np.concatenate([sampled, self.flats.directions(self.least_z)])
        return self.bounds_along(sampled)

    @property
    def axes(self) -> Floats:
        """(3, 3) rows: axes of a frame that turns about z with the model; on the paper's terms those of the workpiece frame."""
        return np.eye(3) if self.terms.need is None else self.terms.need.axes

    @cached_property
    def flats(self) -> Flats:
        """The large flats of the model."""
        return Flats.of(self.mesh)

    @property
    def least_z(self) -> float:
        """Least z of a part's printing direction, from the greatest tilt of the table."""
        return sin(radians(self.settings.least_elevation_deg))

    def begin(self) -> None:
        """Start the clock of the time limit."""
        limit_s = self.settings.time_limit_s
        self._ends_s = inf if limit_s is None else perf_counter() + limit_s

    def stop(self) -> None:
        """Make everything that checks late() stop."""
        self._ends_s = -inf

    @property
    def evaluated(self) -> int:
        """The number of candidates that were evaluated."""
        return sum(self._evaluated)

    def late(self) -> bool:
        """Whether the time limit is reached."""
        return perf_counter() >= self._ends_s

    def continues(self, stage: int) -> bool:
        """Whether a stage follows after the given number of stages."""
        cuts = len(self.start.cuts) + stage
        return self.model.risky_mm2 > 0 and cuts < self.settings.most_parts - 1 and not self.late()

    def full(self, node: Node) -> bool:
        """Whether a node has the greatest allowed number of parts."""
        return len(node.cuts) >= self.settings.most_parts - 1

    def table(self, node: Node, large: bool = False, described: bool = False, limits: Bounds | None = None) -> CandidateTable:
        """The scored candidates of a node. large: also those that gain enough only for a part of the preferred volume; described:
        also the area that no cut can save, for features; limits: bounds of some directions instead of all.
        """
        limits = self.limits if limits is None else limits
        least_mm2 = self.large_gain_mm2 if large and self.preferred_mm3 > 0 else self.least_gain_mm2
        unavoidable = None
        if described:
            least_mm = np.where(np.isfinite(self.limits.least_height_mm), self.limits.least_offset_mm, np.inf)
            unavoidable = unavoidable_faces(node.remainder, self.limits.directions, least_mm, threshold(self.terms.angle_deg))
        scored = score_candidates(node.remainder, limits, self.terms, least_mm2, unavoidable)
        self._evaluated.append(scored.evaluated)
        if node is self.root and limits is self.limits:
            self._root_scored = scored
        return CandidateTable(scored, node, self.model, self.least_gain_mm2, partial(self.is_weak, node))

    def count_rejected(self) -> dict[Reason, int]:
        """The number of the root's candidates rejected for each reason."""
        scored, is_weak = self._root_scored or self.table(self.root).scored, partial(self.is_weak, self.root)
        return count_rejected(scored, self.least_gain_mm2, is_weak)

    def allowed(self, node: Node, plane: Plane) -> bool:
        """Whether a plane, on the grid of candidates or off it, may cut a node."""
        if plane.limbs_mm is None and 0.0 < abs(plane.offset_mm) < FINEST * self.settings.offset_step_mm:
            return False
        return self.check(node, plane, self.bounds_along(plane.normal[None]))[0] == Reason.FEASIBLE

    def bounds_along(self, directions: Floats) -> Bounds:
        """The bounds of (k, 3) directions."""
        return bounds_of(directions, self.mesh, self.profile, self.plate_disc, self.zones.keep)

    def limb_sums(self, node: Node, planes: Sequence[Plane]) -> LimbSums:
        """Sums over the limbs of planes at a node, without cutting."""
        return sum_limbs(node.remainder, planes, threshold(self.terms.angle_deg), sqrt(self.settings.least_interface_mm2))

    def check(self, node: Node, plane: Plane, limits: Bounds) -> tuple[Reason, float]:
        """Whether a plane off the grid can cut a node, and the thickness of the thinnest sliver that it would leave. limits:
        bounds of its direction. For limbs, floating pieces and clearance of the head are not checked.
        """
        if plane.limbs_mm is None:
            step_mm = self.step_mm(plane.offset_mm)
            checked = check(node.remainder, limits, step_mm, np.zeros(1, np.int32), np.array([plane.offset_mm]))
            reason, sliver_mm = Reason(int(checked.reason[0])), float(checked.fragile_mm[0])
        else:
            reason, sliver_mm = self._check_limbs(node, plane, limits)
        return (Reason.WEAK if reason == Reason.FEASIBLE and self.is_weak(node, plane) else reason), sliver_mm

    def _check_limbs(self, node: Node, plane: Plane, limits: Bounds) -> tuple[Reason, float]:
        sums, offset_mm, keep_mm = self.limb_sums(node, [plane]), plane.offset_mm, limits.keep_mm[0]
        checks = {
            Reason.INTERFACE: not sums.exists[0] or sums.contact_mm2[0] < limits.contact_area_mm2,
            Reason.REACH: not np.isfinite(limits.least_height_mm[0]),
            Reason.CLEARANCE: sums.lowest_mm[0] < limits.least_height_mm[0],
            Reason.VOLUME: sums.volume_mm3[0] < limits.least_volume_mm3,
            Reason.KEEP: ((keep_mm[:, 0] < offset_mm) & (offset_mm < keep_mm[:, 1])).any(),
        }
        first = next((reason for reason, out in checks.items() if out), None)
        if first is not None:
            return first, np.inf
        sliver_mm = node.sliver_mm(plane)
        return (Reason.FRAGILE if sliver_mm < limits.fragile_mm else Reason.FEASIBLE), sliver_mm

    def is_weak(self, node: Node, plane: Plane) -> bool:
        """Whether the part above a plane could break off while it is printed."""
        return self.settings.nozzle_load_n > 0.0 and self.stress_mpa(node, plane) > self.bearable_mpa

    def stress_mpa(self, node: Node, plane: Plane) -> float:
        """Stress at the base of the part above a plane when the nozzle pushes its top, MPa."""
        remainder, fragment_mm = node.remainder, sqrt(self.settings.least_interface_mm2)
        if plane.limbs_mm is None:
            stress = stress_per_newton(remainder.mesh, plane, fragment_mm)
        else:
            stress = stress_per_newton(remainder.facets.mesh, plane, fragment_mm, limb_vertices(remainder, plane))
        return self.settings.nozzle_load_n * stress

    def cut(self, node: Node, plane: Plane, cost: CutCost | None = None) -> Node | None:
        """The node after a cut; None if nothing is cut off or no pose works for the part.

        cost: final cost of the cut, if known.
        """
        if plane.limbs_mm is not None:
            return self._cut_limbs(node, plane)
        vertices = node.remainder.mesh.vertices
        upper, rest = vertices[plane.heights_mm(vertices) > 0.0], below(node.solid, plane)
        if len(upper) == 0 or rest.is_empty():
            return None
        child = Node(rest, self.terms, node.places, node, plane, self._cost(node, plane) if cost is None else cost)
        if self.settings.clearance:
            lower = child.remainder.mesh.vertices
            corners = np.vstack([upper, lower[plane.heights_mm(lower) >= -BASE_TOLERANCE_MM]])
            if not allowed_poses(self.machine, plane.normal, corners + self.place_mm):
                return None
        return child

    def cut_row(self, table: CandidateTable, row: int) -> Node | None:
        """The node after the cut of a row in a node's table."""
        return self.cut(table.node, table.plane(row), table.scored.cost(row))

    def _cut_limbs(self, node: Node, plane: Plane) -> Node | None:
        """The node after limbs are cut off; None if a piece would float or the head would hit a standing part."""
        if not self.is_clear(node, plane):
            return None
        limbs, rest = cut(node.solid, plane)
        if limbs.is_empty() or rest.is_empty() or _floats(rest, plane):
            return None
        return Node(rest, self.terms, node.places, node, plane, self._cost(node, plane))

    def is_clear(self, node: Node, plane: Plane) -> bool:
        """Whether there is a pose at which the head clears the parts beside the limbs of a plane."""
        if not self.settings.clearance:
            return True
        poses = allowed_poses(self.machine, plane.normal, node.corners_cut(plane) + self.place_mm)
        return next(self.clear_poses(node, plane, poses), None) is not None

    def clear_poses(self, node: Node, plane: Plane, poses: Sequence[Pose]) -> Iterator[Pose]:
        """The poses at which the head clears all standing parts while the limbs that a plane cuts off a node are printed."""
        mesh, limb = node.remainder.mesh, limb_faces(node.remainder, plane)
        corners = mesh.vertices[mesh.faces]
        stands = corners[(plane.heights_mm(mesh.vertices) > 0.0)[mesh.faces].any(axis=1) & ~limb]
        return (pose for pose in poses if passes_clear(self.machine, pose, (corners[limb], stands), plane.offset_mm))

    def _cost(self, node: Node, plane: Plane) -> CutCost:
        """The final cost of a cut."""
        swept: Gains | LimbSums
        if plane.limbs_mm is None:
            step_mm = self.step_mm(plane.offset_mm)
            swept = gains(node.remainder, plane.normal[None], step_mm, threshold(self.terms.angle_deg))
            place = round(plane.offset_mm / step_mm) - int(swept.first[0])
        else:
            swept, place = self.limb_sums(node, [plane]), 0
        residual = residual_mm2(swept, self.terms)
        costs = (residual, lost_mm2(swept, residual), swept.stairs_mm2, seam_mm2(swept, self.terms))
        return CutCost(*(float(cost.ravel()[place]) for cost in costs))

    def step_mm(self, offset_mm: float) -> float:
        """Step of a grid that contains the offset, close to the step of the candidates' grid."""
        step_mm, size_mm = self.settings.offset_step_mm, abs(offset_mm)
        return size_mm / max(1, round(size_mm / step_mm)) or step_mm

    def replay(self, node: Node, planes: Sequence[Plane]) -> Node | None:
        """The node after cutting with the planes in turn; None if one of them is infeasible."""
        for plane in planes:
            child = self.cut(node, plane) if self.allowed(node, plane) else None
            if child is None:
                return None
            node = child
        return node


def _floats(rest: Solid, plane: Plane) -> bool:
    """Whether a piece of the remainder floats after limbs are cut off. A piece that begins exactly in the plane does not: where a
    face of the solid lies in the plane, the union keeps touching pieces separate.
    """
    for piece in rest.decompose():
        if piece.volume() > 0.0 and piece.bounding_box()[2] > PLATE_TOLERANCE_MM:
            lowest_mm = float(plane.heights_mm(mesh_of(piece).vertices).min())
            if abs(lowest_mm) > BASE_TOLERANCE_MM:
                return True
    return False


def with_search(profile: Profile, **settings: object) -> Profile:
    """The profile with changed search settings."""
    return profile.model_copy(update={"search": profile.search.model_copy(update=settings)})


def without_limits(machine: Machine) -> Machine:
    """The machine with unlimited rotary axes, if it has any."""
    if not machine.tilts:
        return machine
    wide = {"limits_deg": (-1e6, 1e6), "budget_deg": None}
    tilt, turn = machine.tilt.model_copy(update=wide), machine.turn.model_copy(update=wide)
    return machine.model_copy(update={"tilt": tilt, "turn": turn})
