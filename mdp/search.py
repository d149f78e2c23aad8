"""Search: beam-guided search for the cuts, after the 2020 paper, with progressive relaxation (pool).

Otherwise than published: the best node ever seen
is the result, the search goes on while any node has a useful child, a node that can no longer beat it is dropped (what a
cut leaves risky above its plane is never repaired later, so that sum bounds all descendants), and two orders of the
same cuts take one place.
"""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from time import perf_counter

import manifold3d as m3
import numpy as np

from mdp.candidates import REASONS, Bounds, Checked, bounds, check, refusals, worth
from mdp.clearance import allowed_poses
from mdp.cut import cut, mesh_of, solid_of
from mdp.decomposition import Decomposition, Part
from mdp.features import Model, features
from mdp.mesh import Floats, Ints, Mesh
from mdp.overhang import risky_above, risky_upright
from mdp.plane import PLATFORM, Plane
from mdp.pool import Entry, Standing, fill
from mdp.pose import level, poses, rotation
from mdp.ranker import RANKERS
from mdp.sequence import least_rotation
from mdp.sweep import Remainder
from profiles.machine import Machine
from profiles.profile import Profile


@dataclass(frozen=True, eq=False)
class Cut:
    """A part cut off: the solid above its base plane, and the area that stays risky on it."""

    base: Plane
    solid: m3.Manifold
    residual_mm2: float


@dataclass(frozen=True, eq=False)
class Node:
    """What remains after some cuts, and how good that is."""

    solid: m3.Manifold
    cuts: tuple[Cut, ...]
    angle_deg: float
    count_platform_faces: bool

    @cached_property
    def remainder(self) -> Remainder:
        """The remaining solid for the sweep."""
        mesh = mesh_of(self.solid)
        return Remainder(mesh, risky_upright(mesh, self.angle_deg, self.count_platform_faces))

    @cached_property
    def risky_mm2(self) -> float:
        """Risky area of what remains when it is printed straight up."""
        return float(self.remainder.mesh.areas_mm2[self.remainder.risky].sum())

    @cached_property
    def residual_mm2(self) -> float:
        """Area left risky on the parts cut off so far: a lower bound of the cost of every descendant."""
        return sum(c.residual_mm2 for c in self.cuts)

    @property
    def cost_mm2(self) -> float:
        """J of the paper when the search stops here."""
        return self.risky_mm2 + self.residual_mm2

    @cached_property
    def signature(self) -> tuple[float, ...]:
        """Equal for two orders of the same cuts."""
        return (round(self.solid.volume(), 3), round(self.risky_mm2, 3), round(self.residual_mm2, 3))


@dataclass(frozen=True)
class Progress:
    """Where the search stands."""

    stage: int
    beam: int
    best_share: float


def decompose(
    mesh: Mesh, name: str, profile: Profile, ranker: str = "classic", on_stage: Callable[[Progress], None] | None = None
) -> Decomposition:
    """Find the parts of a closed mesh standing on the platform; one part when nothing is risky or no cut is feasible."""
    began = perf_counter()
    search = _Search(mesh, profile, ranker)
    best = search.run(on_stage)
    parts = _parts(best, search.machine, profile.process.self_supporting_angle_deg, profile.search.clearance)
    return Decomposition(
        name=name,
        mesh=mesh,
        parts=parts,
        beam_width=profile.search.beam_width,
        ranker=ranker,
        risky_area_mm2=search.root.risky_mm2,
        residual_area_mm2=sum(part.risky_area_mm2 for part in parts),
        candidates_evaluated=search.evaluated,
        rounds=search.stages,
        search_s=perf_counter() - began,
        notes=search.notes(len(parts)),
    )


class _Search:
    """One search: fixed settings, and the counts that grow while it runs."""

    def __init__(self, mesh: Mesh, profile: Profile, ranker: str) -> None:
        self.settings, self.process = profile.search, profile.process
        self.machine = profile.machine if profile.search.clearance else _without_limits(profile.machine)
        self.ranker = RANKERS[ranker]
        self.root = Node(solid_of(mesh), (), self.process.self_supporting_angle_deg, self.settings.count_platform_faces)
        radius = 0.5 * float(np.linalg.norm(mesh.bounds_mm[1] - mesh.bounds_mm[0]))
        self.model = Model(self.root.risky_mm2, mesh.volume_mm3, radius)
        self.limits: Bounds = bounds(mesh, self.machine, self.settings)
        self.least_gain_mm2 = self.settings.least_gain * self.root.risky_mm2
        self.evaluated = 0
        self.stages = 0

    def run(self, on_stage: Callable[[Progress], None] | None) -> Node:
        """The best node found."""
        best, beam = self.root, [self.root]
        seen = {self.root.signature}
        while beam and self.model.risky_mm2 > 0 and self.stages < self.settings.most_parts - 1:
            self.stages += 1
            children = list(self._children(beam, best, seen))
            best = min([best, *children], key=lambda node: node.cost_mm2)
            beam = [child for child in children if child.residual_mm2 < best.cost_mm2 - self.least_gain_mm2]
            if on_stage is not None:
                on_stage(Progress(self.stages, len(beam), best.cost_mm2 / self.model.risky_mm2))
        return best

    def _children(self, beam: Sequence[Node], best: Node, seen: set[tuple[float, ...]]) -> Iterator[Node]:
        """Up to beam_width new nodes, no two of them the same solid."""
        tables = [worth(node.remainder, self.limits, self.settings, self.root.angle_deg, self.least_gain_mm2) for node in beam]
        self.evaluated += sum(table.evaluated for table in tables)
        standings = [Standing(self.model.risky_mm2 - node.cost_mm2, node.residual_mm2) for node in beam]

        def look(node: int, direction: Ints, offset_mm: Floats) -> Checked:
            return check(beam[node].remainder, self.limits, self.settings, direction, offset_mm)

        most = self.ranker.pool(self.settings.beam_width)
        bound = best.cost_mm2 - self.least_gain_mm2
        entries = fill(tables, standings, self.limits, self.model.risky_mm2, bound, most, look)
        order = self.ranker.order(features([entry.plan for entry in entries], self.model))
        made = 0
        for entry in (entries[k] for k in order):
            if made == self.settings.beam_width:
                return
            child = self._child(beam[entry.node], entry)
            if child is not None and child.signature not in seen:
                seen.add(child.signature)
                made += 1
                yield child

    def _child(self, node: Node, entry: Entry) -> Node | None:
        """The node after a cut; None when the part has no pose at which the machine can print it."""
        above, below = cut(node.solid, entry.plane)
        if above.is_empty() or below.is_empty():
            return None
        if self.settings.clearance and not allowed_poses(self.machine, entry.plane.normal, mesh_of(above).vertices):
            return None
        made = Cut(entry.plane, above, entry.plan.residual_mm2)
        return Node(below, (*node.cuts, made), node.angle_deg, node.count_platform_faces)

    def notes(self, parts: int) -> tuple[str, ...]:
        """What a person should know of the outcome."""
        if self.model.risky_mm2 <= 0:
            return ("no face needs support: the model is printed straight up as one part",)
        if parts > 1:
            return ()
        counts = refusals(self.root.remainder, self.limits, self.settings, self.root.angle_deg, self.least_gain_mm2)
        told = [f"{counts[why]} because {text}" for why, text in REASONS.items() if counts[why] > 0]
        return (f"no feasible cut among {sum(counts.values())} candidates: {'; '.join(told)}",)


def _without_limits(machine: Machine) -> Machine:
    wide = {"limits_deg": (-1e6, 1e6)}
    tilt, turn = machine.tilt.model_copy(update=wide), machine.turn.model_copy(update=wide)
    return machine.model_copy(update={"tilt": tilt, "turn": turn})


def _parts(node: Node, machine: Machine, angle_deg: float, clearance: bool) -> tuple[Part, ...]:
    """Parts in print order: what remains first, then the cuts, last one first."""
    solids = [(PLATFORM, node.remainder.mesh), *((c.base, mesh_of(c.solid)) for c in reversed(node.cuts))]
    options = [[level(machine)]]
    for base, mesh in solids[1:]:
        options.append(allowed_poses(machine, base.normal, mesh.vertices) if clearance else poses(machine, base.normal))
    parts = []
    for position, ((base, mesh), pose) in enumerate(zip(solids, least_rotation(machine, options), strict=True)):
        risky = risky_above(mesh, base, angle_deg) if position else node.remainder.risky
        parts.append(
            Part(
                index=position + 1,
                mesh=mesh,
                base=base,
                pose=pose,
                rotation=rotation(machine, pose),
                volume_mm3=mesh.volume_mm3,
                risky_area_mm2=float(mesh.areas_mm2[risky].sum()),
            )
        )
    return tuple(parts)
