"""Search: beam-guided search for the cuts, after the 2020 paper, with progressive relaxation.

Kept from the paper: candidates that leave (almost) nothing risky above the plane come first, delta is relaxed from 1e-4 by
factors of 5 until the beam is full, near-equal planes of one parent take one place. Otherwise: the best node ever seen
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
from numpy.typing import NDArray

from mdp.candidates import REASONS, Bounds, Candidates, Reason, bounds, evaluate
from mdp.clearance import allowed_poses
from mdp.cut import cut, mesh_of, solid_of
from mdp.decomposition import Decomposition, Part
from mdp.features import Model, features
from mdp.mesh import Floats, Ints, Mesh
from mdp.overhang import risky_above, risky_upright
from mdp.plane import PLATFORM, Plane
from mdp.pose import level, poses, rotation
from mdp.ranker import RANKERS
from mdp.sequence import least_rotation
from mdp.sweep import Surface
from profiles.machine import Machine
from profiles.profile import Profile

FIRST_DELTA, DELTA_FACTOR = 1e-4, 5.0
SAME_COSINE = 0.95
POOL = 50


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
    def surface(self) -> Surface:
        """The remaining solid for the sweep."""
        mesh = mesh_of(self.solid)
        return Surface(mesh, risky_upright(mesh, self.angle_deg, self.count_platform_faces))

    @cached_property
    def risky_mm2(self) -> float:
        """Risky area of what remains when it is printed straight up."""
        return float(self.surface.mesh.areas_mm2[self.surface.risky].sum())

    @cached_property
    def residual_mm2(self) -> float:
        """Area left risky on the parts cut off so far: a lower bound of the cost of every descendant."""
        return sum(c.residual_mm2 for c in self.cuts)

    @property
    def cost_mm2(self) -> float:
        """J of the paper when the search stops here."""
        return self.risky_mm2 + self.residual_mm2

    @cached_property
    def signature(self) -> tuple[float, float, float]:
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
        self.rank = RANKERS[ranker]
        self.root = Node(solid_of(mesh), (), self.process.self_supporting_angle_deg, self.settings.count_platform_faces)
        radius = 0.5 * float(np.linalg.norm(mesh.bounds_mm[1] - mesh.bounds_mm[0]))
        self.model = Model(self.root.risky_mm2, mesh.volume_mm3, radius)
        self.limits: Bounds = bounds(mesh, self.machine, self.settings)
        self.evaluated = 0
        self.stages = 0
        self.refused: Ints = np.zeros(len(Reason), np.int32)

    def run(self, on_stage: Callable[[Progress], None] | None) -> Node:
        best, beam = self.root, [self.root]
        least = self.settings.least_gain * self.model.risky_mm2
        seen = {self.root.signature}
        while beam and self.model.risky_mm2 > 0 and self.stages < self.settings.most_parts - 1:
            self.stages += 1
            children = []
            for node, candidates, row in self._ranked(beam, best):
                child = self._child(node, candidates, row)
                if child is None or child.signature in seen:
                    continue
                seen.add(child.signature)
                children.append(child)
                if len(children) == self.settings.beam_width:
                    break
            for child in children:
                if child.cost_mm2 < best.cost_mm2 - 1e-9 * self.model.risky_mm2:
                    best = child
            beam = [child for child in children if child.residual_mm2 < best.cost_mm2 - least]
            if on_stage is not None:
                on_stage(Progress(self.stages, len(beam), best.cost_mm2 / self.model.risky_mm2))
        return best

    def _ranked(self, beam: Sequence[Node], best: Node) -> Iterator[tuple[Node, Candidates, int]]:
        """Candidates of all nodes of the beam, best first."""
        tables, rows, owners = [], [], []
        least = self.settings.least_gain * self.model.risky_mm2
        for position, node in enumerate(beam):
            table = evaluate(node.surface, self.limits, self.settings, self.process.self_supporting_angle_deg, least)
            self.evaluated += table.evaluated
            self.refused = self.refused + table.refused
            saved = self.model.risky_mm2 - node.cost_mm2
            tables.append(table)
            rows.append(features(table, self.model, saved, node.residual_mm2))
            owners.append(np.full(len(table.offset_mm), position))
        metrics, owner = np.concatenate(rows), np.concatenate(owners)
        residual = np.concatenate([table.residual_mm2 for table in tables]) / self.model.risky_mm2
        place = np.concatenate([np.arange(len(table.offset_mm)) for table in tables])
        alive = np.nonzero(metrics[:, 5] * self.model.risky_mm2 < best.cost_mm2 - least)[0]
        pool = max(POOL, 5 * self.settings.beam_width)
        chosen = _relaxed(metrics, residual, owner, place, tables, alive, pool)
        for index in (chosen[k] for k in self.rank(metrics[chosen])):
            yield beam[owner[index]], tables[owner[index]], int(place[index])

    def _child(self, node: Node, candidates: Candidates, row: int) -> Node | None:
        """The node after a cut; None when the part has no pose at which the machine can print it."""
        base = candidates.plane(row)
        above, below = cut(node.solid, base)
        if above.is_empty() or below.is_empty():
            return None
        points = mesh_of(above).vertices
        if self.settings.clearance and not allowed_poses(self.machine, base.normal, points):
            return None
        made = Cut(base, above, float(candidates.residual_mm2[row]))
        return Node(below, (*node.cuts, made), node.angle_deg, node.count_platform_faces)

    def notes(self, parts: int) -> tuple[str, ...]:
        """What a person should know of the outcome."""
        if self.model.risky_mm2 <= 0:
            return ("no face needs support: the model is printed straight up as one part",)
        if parts > 1:
            return ()
        counts = [(int(self.refused[reason]), text) for reason, text in REASONS.items() if self.refused[reason] > 0]
        reasons = "; ".join(f"{count} because {text}" for count, text in sorted(counts, reverse=True))
        return (f"no feasible cut among {self.evaluated} candidates: {reasons or 'none remains'}",)


def _relaxed(
    metrics: Floats, residual: Floats, owner: Ints, place: Ints, tables: Sequence[Candidates], alive: NDArray[np.intp], pool: int
) -> list[int]:
    """Up to `pool` candidates: those that leave least risky first, within a round by accumulated reduction, then volume."""
    order = alive[np.lexsort((place[alive], owner[alive], -metrics[alive, 2], -metrics[alive, 1]))]
    chosen: list[int] = []
    taken: dict[int, list[tuple[Floats, float]]] = {}
    delta, best = FIRST_DELTA, -np.inf
    waiting = order
    while len(waiting) and len(chosen) < pool:
        admitted = (residual[waiting] < delta) & (metrics[waiting, 1] >= best)
        for index in waiting[admitted]:
            table, row = tables[owner[index]], place[index]
            near = taken.setdefault(int(owner[index]), [])
            if any(_same(table.direction[row], float(table.offset_mm[row]), *other) for other in near):
                continue
            if len(chosen) == pool:
                break
            near.append((table.direction[row], float(table.offset_mm[row])))
            chosen.append(int(index))
        waiting = waiting[~admitted]
        if delta > 1.0:
            break
        delta *= DELTA_FACTOR
        best = max((metrics[k, 1] for k in chosen), default=-np.inf)
    return chosen


def _same(direction: Floats, offset_mm: float, other_direction: Floats, other_offset_mm: float) -> bool:
    """Whether two planes of one parent are too alike to take two places (the authors' rule)."""
    cosine = abs(float(direction @ other_direction))
    return cosine > SAME_COSINE and abs(offset_mm - other_offset_mm) < 2.0 * cosine


def _without_limits(machine: Machine) -> Machine:
    wide = {"limits_deg": (-1e6, 1e6)}
    tilt, turn = machine.tilt.model_copy(update=wide), machine.turn.model_copy(update=wide)
    return machine.model_copy(update={"tilt": tilt, "turn": turn})


def _parts(node: Node, machine: Machine, angle_deg: float, clearance: bool) -> tuple[Part, ...]:
    """Parts in print order: what remains first, then the cuts, last one first."""
    solids = [(PLATFORM, node.surface.mesh), *((c.base, mesh_of(c.solid)) for c in reversed(node.cuts))]
    options = [[level(machine)]]
    for base, mesh in solids[1:]:
        options.append(allowed_poses(machine, base.normal, mesh.vertices) if clearance else poses(machine, base.normal))
    parts = []
    for position, ((base, mesh), pose) in enumerate(zip(solids, least_rotation(machine, options), strict=True)):
        risky = risky_above(mesh, base, angle_deg) if position else node.surface.risky
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
