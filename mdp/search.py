"""Search: beam-guided search for the cuts, after the 2020 paper, with progressive relaxation (pool).

Otherwise than published: the best node ever seen is the result, the search goes on while any node has a useful child, a
candidate that can no longer beat it is dropped (what a cut leaves risky above its plane is never repaired later, so that sum
bounds all descendants), two orders of the same cuts take one place, and a wider beam holds the narrower ones.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import islice
from time import perf_counter

import numpy as np

from mdp.candidates import REASONS, Bounds, Checked, bounds, check, refusals, worth
from mdp.clearance import allowed_poses
from mdp.cut import cut, mesh_of, solid_of
from mdp.decomposition import VOLUME_TOLERANCE, Decomposition, Part
from mdp.features import Model
from mdp.mesh import Floats, Ints, Mesh
from mdp.node import Cut, Node
from mdp.overhang import risky_above
from mdp.pedestal import on_pedestal
from mdp.plane import PLATFORM, Plane
from mdp.pool import Entry, Table, entries
from mdp.pose import level, poses, rotation
from mdp.ranker import RANKERS
from mdp.record import Child, Offer, Trace
from mdp.sequence import least_rotation
from profiles.machine import Machine
from profiles.profile import Profile

PUBLISHED = {"least_volume_share": 0.1, "least_interface_mm2": 0.0, "least_gain": 1e-4}
MOST_FOLDED = 1e-2  # share of the volume; the reader disentangles what is worse
RECORDED = 50  # candidates of a pool that are put on record, the B of the 2020 paper
LADDER = (1, 2, 5, 10, 20, 50, 100, 200, 500)


@dataclass(frozen=True)
class Progress:
    """Where the search stands."""

    stage: int
    beam: int
    best_share: float


def decompose(
    mesh: Mesh,
    name: str,
    profile: Profile,
    ranker: str = "classic",
    on_stage: Callable[[Progress], None] | None = None,
    on_record: Callable[[bytes], None] | None = None,
) -> Decomposition:
    """Find the parts of a closed mesh standing on the platform; one part when nothing is risky or no cut is feasible.

    on_record is given what the search looked at and what became of it, as the content of an .npz file.
    """
    began = perf_counter()
    if profile.search.pedestal_mm > 0:
        mesh = on_pedestal(mesh, profile.search.pedestal_mm)
    search = _Search(mesh, profile, ranker)
    if on_record is not None:
        search.trace = Trace(name, search.model, search.root.signature)
    best = search.run_published(on_stage) if profile.search.method == "published" else search.run(on_stage)
    if on_record is not None and search.trace is not None:
        on_record(search.trace.to_bytes())
    parts = _parts(best, search.machine, profile.process.self_supporting_angle_deg, profile.search.clearance)
    folded = folded_mm3(mesh, parts)
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
        notes=(*_folded_note(folded), *search.notes(len(parts))),
        folded_mm3=folded,
    )


def folded_mm3(mesh: Mesh, parts: Sequence[Part]) -> float:
    """Volume by which the parts differ from a mesh whose surface passes through itself a little, 0 for others.

    A mesh's volume counts a place as often as the surface winds around it, inside out places less than once; a cut counts it
    once or not at all.
    """
    difference = abs(mesh.volume_mm3 - sum(part.volume_mm3 for part in parts))
    return difference if VOLUME_TOLERANCE * mesh.volume_mm3 < difference <= MOST_FOLDED * mesh.volume_mm3 else 0.0


def _folded_note(folded: float) -> tuple[str, ...]:
    text = f"the surface passes through itself: {folded:.3g} mm3 that it winds around twice or inside out are counted once"
    return (text,) if folded > 0 else ()


class _Search:
    """One search: fixed settings, and what it remembers while it runs."""

    def __init__(self, mesh: Mesh, profile: Profile, ranker: str) -> None:
        self.settings, self.process = profile.search, profile.process
        if profile.search.method == "published":
            self.settings = profile.search.model_copy(update=PUBLISHED)
        self.machine = profile.machine if profile.search.clearance else _without_limits(profile.machine)
        self.ranker = RANKERS[ranker]
        self.root = Node(solid_of(mesh), (), self.process.self_supporting_angle_deg, self.settings.count_platform_faces)
        radius = 0.5 * float(np.linalg.norm(mesh.bounds_mm[1] - mesh.bounds_mm[0]))
        self.model = Model(self.root.risky_mm2, mesh.volume_mm3, radius)
        self.limits: Bounds = bounds(mesh, self.machine, self.settings)
        self.least_gain_mm2 = self.settings.least_gain * self.root.risky_mm2
        self.evaluated = 0
        self.stages = 0
        self.began = perf_counter()
        self.best = self.root
        self.trace: Trace | None = None
        self._children: dict[tuple[int, int], Node | None] = {}

    def _late(self) -> bool:
        """Whether the time limit is reached."""
        limit = self.settings.time_limit_s
        return limit is not None and perf_counter() - self.began >= limit

    def run(self, on_stage: Callable[[Progress], None] | None) -> Node:
        """The best node found.

        Beams of the ladder's widths run side by side, a wider one keeping all that the narrower ones keep: so a wider beam
        never ends worse, and no more than beam_width nodes are followed in all.
        """
        widths = [*(width for width in LADDER if width < self.settings.beam_width), self.settings.beam_width]
        beams = {width: [self.root] for width in widths}
        seen = {width: {self.root.signature} for width in widths}
        while beams[widths[-1]] and self._goes_on():
            self.stages += 1
            tables = {id(node): self._table(node) for node in beams[widths[-1]]}
            self._children.clear()
            if self.trace is not None:
                self.trace.stage([node.signature for node in beams[widths[-1]]])
            following: list[Node] = []
            for width in widths:
                following = self._next(beams[width], tables, following, width, seen[width])
                beams[width] = following
            self.best = min([self.best, *following], key=lambda node: node.cost_mm2)
            if on_stage is not None:
                on_stage(Progress(self.stages, len(following), self.best.cost_mm2 / self.model.risky_mm2))
        return self.best

    def _goes_on(self) -> bool:
        return self.model.risky_mm2 > 0 and self.stages < self.settings.most_parts - 1 and not self._late()

    def run_published(self, on_stage: Callable[[Progress], None] | None) -> Node:
        """The authors' loop: ends as soon as the beam's best does not rise, keeps twins, and stops looking at candidates once
        one of a good parent is useless."""
        beam = [self.root]
        while self._goes_on():
            self.stages += 1
            tables = [self._table(node) for node in beam]
            useless = max(table.saved_mm2 for table in tables) / self.model.risky_mm2
            self._children.clear()
            children: list[Node] = []
            for entry in entries(tables, self.model.risky_mm2, np.inf, useless):
                child = self._child(beam[entry.table], tables[entry.table], entry.row)
                children += [child] if child is not None else []
                if len(children) == self.settings.beam_width:
                    break
            best = min(children, key=lambda node: node.cost_mm2, default=self.best)
            if best.cost_mm2 >= self.best.cost_mm2:
                break
            self.best, beam = best, children
            if on_stage is not None:
                on_stage(Progress(self.stages, len(beam), best.cost_mm2 / self.model.risky_mm2))
        return self.best

    def _table(self, node: Node) -> Table:
        found = worth(node.remainder, self.limits, self.settings, self.root.angle_deg, self.least_gain_mm2)
        self.evaluated += found.evaluated

        def look(direction: Ints, offset_mm: Floats) -> Checked:
            return check(node.remainder, self.limits, self.settings, direction, offset_mm)

        return Table(found, self.limits, self.model.risky_mm2 - node.cost_mm2, node.residual_mm2, look)

    def _next(
        self, beam: Sequence[Node], tables: dict[int, Table], kept: Sequence[Node], width: int, seen: set[tuple[float, ...]]
    ) -> list[Node]:
        """The beam after one more cut: what the narrower beams keep, then the best children, no two of them the same solid."""
        following = list(kept)
        seen.update(node.signature for node in kept)
        mine = [tables[id(node)] for node in beam]
        pool = entries(mine, self.model.risky_mm2, self.best.cost_mm2) if mine else iter(())
        ordered = self.ranker.ordered(pool, lambda entry: mine[entry.table].plan(entry.row), self.model)
        if self.trace is not None:
            ordered = iter(offered := list(islice(ordered, max(RECORDED, 2 * width))))
        made: list[Child] = []
        for place, entry in enumerate(ordered):
            if len(following) >= width:
                break
            child = self._child(beam[entry.table], mine[entry.table], entry.row)
            if child is not None:
                made.append(Child(place, child.signature, child.cost_mm2))
                if child.signature not in seen:
                    seen.add(child.signature)
                    following.append(child)
        if self.trace is not None:
            self.trace.pool([_offer(beam, mine, entry) for entry in offered], made)
        return following

    def _child(self, node: Node, table: Table, row: int) -> Node | None:
        """The node after a cut; None when the part has no pose at which the machine can print it."""
        key = (id(node), row)
        if key not in self._children:
            self._children[key] = self._made(node, table.plane(row), float(table.worth.residual_mm2[row]))
        return self._children[key]

    def _made(self, node: Node, plane: Plane, residual_mm2: float) -> Node | None:
        """The node after a cut; None when nothing is cut off or no pose serves the part."""
        above, below = cut(node.solid, plane)
        if above.is_empty() or below.is_empty():
            return None
        if self.settings.clearance and not allowed_poses(self.machine, plane.normal, mesh_of(above).vertices):
            return None
        return Node(below, (*node.cuts, Cut(plane, above, residual_mm2)), node.angle_deg, node.count_platform_faces)

    def notes(self, parts: int) -> tuple[str, ...]:
        """What a person should know of the outcome."""
        if self.model.risky_mm2 <= 0:
            return ("no face needs support: the model is printed straight up as one part",)
        if self._late():
            return (f"search.time_limit_s = {self.settings.time_limit_s:g} ended the search; the best so far is used",)
        if parts > 1:
            return ()
        counts = refusals(self.root.remainder, self.limits, self.settings, self.root.angle_deg, self.least_gain_mm2)
        told = [f"{counts[why]} because {text}" for why, text in REASONS.items() if counts[why] > 0]
        return (f"no feasible cut among {sum(counts.values())} candidates: {'; '.join(told)}",)


def _offer(beam: Sequence[Node], tables: Sequence[Table], entry: Entry) -> Offer:
    table = tables[entry.table]
    return Offer(beam[entry.table].signature, table.plane(entry.row), table.plan(entry.row), entry.round)


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
