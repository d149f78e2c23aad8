"""Search: from a mesh to its ordered parts, by a beam of cuts that is polished or as published in 2020.

Otherwise than published: the best node ever seen is the result, the search goes on while any node has a useful child, a
candidate that can no longer beat it is dropped (what a cut leaves risky above its plane is never repaired later, so that sum
bounds all descendants), two orders of the same cuts take one place, the places of the beam differ in what they look for
(beam), and the best results are polished off the grid of candidates (polish).
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from time import perf_counter

import numpy as np

from mdp.beam import Beam
from mdp.candidates import REASONS
from mdp.clearance import allowed_poses
from mdp.cut import mesh_of
from mdp.decomposition import VOLUME_TOLERANCE, Decomposition, Part
from mdp.mesh import Mesh
from mdp.node import Node
from mdp.overhang import risky_above
from mdp.pedestal import on_pedestal
from mdp.plane import PLATFORM
from mdp.polish import polished
from mdp.pool import entries
from mdp.pose import Pose, level, poses, rotation
from mdp.ranker import RANKERS
from mdp.record import Trace
from mdp.rules import Rules
from mdp.sequence import least_rotation
from mdp.threads import ahead
from profiles.machine import Machine
from profiles.profile import Profile

MOST_FOLDED = 1e-2  # share of the volume; the reader disentangles what is worse


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
    rules = Rules(mesh, profile)
    trace = None if on_record is None else Trace(name, rules.model, rules.root.signature)
    tell = on_stage or (lambda progress: None)
    if profile.search.method == "published":
        best, rounds = _published(rules, tell)
    else:
        best, rounds = _followed(rules, ranker, trace, tell)
    if on_record is not None and trace is not None:
        on_record(trace.to_bytes())
    parts = _parts(best, rules.machine, profile.process.self_supporting_angle_deg, profile.search.clearance)
    folded = folded_mm3(mesh, parts)
    return Decomposition(
        name=name,
        mesh=mesh,
        parts=parts,
        beam_width=profile.search.beam_width,
        ranker=ranker,
        risky_area_mm2=rules.root.risky_mm2,
        residual_area_mm2=sum(part.risky_area_mm2 for part in parts),
        candidates_evaluated=rules.evaluated,
        rounds=rounds,
        search_s=perf_counter() - began,
        notes=(*_folded_note(folded), *_notes(rules, len(parts))),
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


def _followed(rules: Rules, ranker: str, trace: Trace | None, tell: Callable[[Progress], None]) -> tuple[Node, int]:
    """The best node of a beam, the finalists polished, and after how many stages."""
    beam = Beam(rules, RANKERS[ranker], trace)
    stage = 0
    try:
        while any(beam.nodes) and _goes_on(rules, stage):
            stage += 1
            beam.advance()
            held = sum(node is not None for node in beam.nodes)
            tell(Progress(stage, held, beam.best.cost_mm2 / rules.model.risky_mm2))
        return _polished(rules, beam, stage, tell), stage
    except KeyboardInterrupt:
        rules.stop()
        raise
    finally:
        beam.close()


def _polished(rules: Rules, beam: Beam, stage: int, tell: Callable[[Progress], None]) -> Node:
    """The best of a beam and of its polished finalists."""
    best = beam.best
    finalists = beam.finalists() if rules.settings.polish else []
    for coming in [ahead(polished, rules, node) for node in finalists]:
        best = min(best, coming.result(), key=lambda found: (found.cost_mm2, len(found.cuts)))
        tell(Progress(stage, 1, best.cost_mm2 / rules.model.risky_mm2))
    return best


def _published(rules: Rules, tell: Callable[[Progress], None]) -> tuple[Node, int]:
    """The best node of the authors' loop, and after how many stages.

    It ends as soon as the beam's best does not rise, keeps twins, and stops looking at candidates once one of a good parent
    is useless.
    """
    best, beam, stage = rules.root, [rules.root], 0
    while _goes_on(rules, stage):
        stage += 1
        tables = [rules.table(node) for node in beam]
        useless = max(table.saved_mm2 for table in tables) / rules.model.risky_mm2
        children: list[Node] = []
        for entry in entries(tables, rules.model.risky_mm2, np.inf, useless):
            table = tables[entry.table]
            child = rules.cut(beam[entry.table], table.plane(entry.row), float(table.worth.residual_mm2[entry.row]))
            children += [child] if child is not None else []
            if len(children) == rules.settings.beam_width:
                break
        highest = min(children, key=lambda node: node.cost_mm2, default=best)
        if highest.cost_mm2 >= best.cost_mm2:
            break
        best, beam = highest, children
        tell(Progress(stage, len(beam), best.cost_mm2 / rules.model.risky_mm2))
    return best, stage


def _goes_on(rules: Rules, stage: int) -> bool:
    return rules.model.risky_mm2 > 0 and stage < rules.settings.most_parts - 1 and not rules.late()


def _notes(rules: Rules, parts: int) -> tuple[str, ...]:
    """What a person should know of the outcome."""
    if rules.model.risky_mm2 <= 0:
        return ("no face needs support: the model is printed straight up as one part",)
    if rules.late():
        return (f"search.time_limit_s = {rules.settings.time_limit_s:g} ended the search; the best so far is used",)
    if parts > 1:
        return ()
    counts = rules.refusals()
    told = [f"{counts[why]} because {text}" for why, text in REASONS.items() if counts[why] > 0]
    return (f"no feasible cut among {sum(counts.values())} candidates: {'; '.join(told)}",)


def _parts(node: Node, machine: Machine, angle_deg: float, clearance: bool) -> tuple[Part, ...]:
    """Parts in print order: what remains first, then the cuts, last one first."""
    solids = [(PLATFORM, node.remainder.mesh), *((c.base, mesh_of(c.solid)) for c in reversed(node.cuts))]
    options = [[level(machine)]]
    for base, mesh in solids[1:]:
        options.append(allowed_poses(machine, base.normal, mesh.vertices) if clearance else poses(machine, base.normal))

    def fits(place: int, pose: Pose) -> bool:
        base, mesh = solids[place]
        return not clearance or pose in allowed_poses(machine, base.normal, mesh.vertices, pose.turn_deg)

    parts = []
    for position, ((base, mesh), pose) in enumerate(zip(solids, least_rotation(machine, options, fits), strict=True)):
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
