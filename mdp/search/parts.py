"""Parts of a node: its solids in print order, each at a pose, so that the table turns little, and the decomposition they are."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

from mdp.clearance import allowed_poses
from mdp.cost.cost import CostTerms
from mdp.decomposition import VOLUME_TOLERANCE, Decomposition, FrontRow, Part
from mdp.mesh import Mesh
from mdp.overhang import Mask, risky_above, risky_upright
from mdp.plane import PLATFORM, Plane
from mdp.pose import Pose, least_rotation, level, poses, rotation
from mdp.search.node import Node
from mdp.search.problem import Problem
from mdp.support_need.need import ModelPieces
from mdp.support_need.patches import CARRIES_ITSELF
from mdp.sweep.rims import NO_RIM
from profiles.machine import Machine

MOST_FEATHERED = 0.1  # share of a seam; a person is told of more
MOST_FOLDED = 1e-2  # share of the volume; the reader disentangles what is worse


def one_piece(mesh: Mesh, machine: Machine) -> Part:
    """A model as it stands, uncut; what needs support of it is not looked at."""
    pose = level(machine)
    return Part(1, mesh, PLATFORM, pose, rotation(machine, pose), mesh.volume_mm3, 0.0)


def make_parts(problem: Problem, node: Node) -> tuple[Part, ...]:
    """Parts in print order: what remains first, then the cuts, last one first."""
    machine, clearance = problem.machine, problem.settings.clearance
    bases = [PLATFORM, *(cut.base for cut in reversed(node.cuts))]
    pieces = [node.piece, *(node.places.surface.piece(cut.solid) for cut in reversed(node.cuts))]

    ancestors = [node]  # for each part the node that it was cut off, the first one's is the last
    while ancestors[-1].parent is not None:
        ancestors.append(ancestors[-1].parent)

    def allowed(position: int, near_turn_deg: float | None = None) -> list[Pose]:
        base, mesh = bases[position], pieces[position].mesh
        if not clearance:
            return poses(machine, base.normal, near_turn_deg)
        reached = allowed_poses(machine, base.normal, mesh.vertices + problem.place_mm, near_turn_deg)
        if base.limbs_mm is None:
            return reached
        return list(problem.clear_poses(ancestors[position], base, reached))

    def fits(position: int, pose: Pose) -> bool:
        return not clearance or pose in allowed(position, pose.turn_deg)

    options = [[level(machine)], *(allowed(position) for position in range(1, len(bases)))]
    chosen = least_rotation(machine, options, fits)
    seams = (NO_RIM, *reversed(node.seams))
    zones, need, parts = node.places.zones, node.terms.need, []
    for position, (base, piece, pose) in enumerate(zip(bases, pieces, chosen, strict=True)):
        needs = None if need is None else need.pieces(piece)
        risky = _needing(piece.mesh, base, needs, node.terms) if position else node.remainder.risky
        parts.append(
            Part(
                index=position + 1,
                mesh=piece.mesh,
                base=base,
                pose=pose,
                rotation=rotation(machine, pose),
                volume_mm3=piece.mesh.volume_mm3,
                risky_area_mm2=float(piece.mesh.areas_mm2[risky].sum()),
                seam_mm=seams[position].length_mm,
                feather_share=seams[position].feather_share,
                needing=None if needs is None else risky,
                needing_upright=None if needs is None else _needing_upright(piece.mesh, needs, node.terms),
                no_seam=zones.no_seam.among(piece.sources),
                no_support=zones.no_support.among(piece.sources),
                modifiers=zones.modifiers,
                support=zones.support.among(piece.sources),
            )
        )
    return tuple(parts)


def _needing(mesh: Mesh, base: Plane, needs: ModelPieces | None, terms: CostTerms) -> Mask:
    """(m,) faces of a part that need support."""
    risky = risky_above(mesh, base, terms.angle_deg)
    if needs is None:
        return risky
    needing: Mask = risky & (needs.along(base.normal) != CARRIES_ITSELF)
    return needing


def _needing_upright(mesh: Mesh, needs: ModelPieces, terms: CostTerms) -> Mask:
    """(m,) faces of a part that would need it if the model were printed straight up; those of cuts are not the model's."""
    risky = risky_upright(mesh, terms.angle_deg, terms.count_platform_faces)
    needing: Mask = risky & needs.upright & (needs.sources >= 0)
    return needing


@dataclass(frozen=True, eq=False)
class Taken:
    """The parts that are taken, and the front with their row marked; note: what is given up for their time."""

    parts: tuple[Part, ...]
    front: tuple[FrontRow, ...]
    note: tuple[str, ...] = ()


@dataclass(frozen=True)
class Outcome:
    """How a search, or a plan in its place, went. rounds: stages of a beam; evaluated: candidates that were looked at."""

    name: str
    ranker: str
    rounds: int
    evaluated: int
    search_s: float
    notes: tuple[str, ...]


def made_of(problem: Problem, taken: Taken, outcome: Outcome) -> Decomposition:
    """The decomposition that was taken."""
    mesh, parts, zones = problem.mesh, taken.parts, problem.zones
    whole = replace(
        one_piece(mesh, problem.machine),
        no_seam=zones.no_seam,
        no_support=zones.no_support,
        support=zones.support,
        modifiers=zones.modifiers,
    )
    folded = folded_mm3(mesh, parts)
    return Decomposition(
        name=outcome.name,
        mesh=mesh,
        parts=parts,
        beam_width=problem.settings.beam_width,
        ranker=outcome.ranker,
        risky_area_mm2=float(problem.root.remainder.mesh.areas_mm2[problem.root.remainder.risky].sum()),
        residual_area_mm2=sum(part.risky_area_mm2 for part in parts),
        candidates_evaluated=outcome.evaluated,
        rounds=outcome.rounds,
        search_s=outcome.search_s,
        notes=(*_folded_note(folded), *_feather_notes(parts), *outcome.notes, *taken.note),
        folded_mm3=folded,
        front=taken.front,
        uncut=(whole,),
    )


def notes_of_search(decomposition: Decomposition) -> tuple[str, ...]:
    """The notes of a decomposition that do not tell of its own parts."""
    own = (*_folded_note(decomposition.folded_mm3), *_feather_notes(decomposition.parts))
    return tuple(note for note in decomposition.notes if note not in own)


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


def _feather_notes(parts: Sequence[Part]) -> tuple[str, ...]:
    """Parts that end in thin edges along much of their seam."""
    return tuple(
        f"part {part.index}: {part.feather_share:.0%} of its seam is a feather edge, base and surface meet at less than 20 deg"
        for part in parts
        if part.feather_share > MOST_FEATHERED
    )
