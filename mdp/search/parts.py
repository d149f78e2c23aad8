"""Parts of a node: its solids in print order, each with a pose so that the table turns little, and the decomposition made of
them.
"""

from collections.abc import Sequence
from dataclasses import replace

from mdp.clearance import allowed_poses
from mdp.decomposition import VOLUME_TOLERANCE, Decomposition, FrontRow, Part
from mdp.mesh import Mesh
from mdp.overhang import Mask, risky_above, risky_upright
from mdp.plane import PLATFORM
from mdp.pose import Pose, least_rotation, level, poses, rotation
from mdp.ranking.node import Node
from mdp.ranking.ranker import CLASSIC
from mdp.search.problem import Problem
from mdp.support_need.patches import CARRIES_ITSELF
from mdp.sweep.crossing import NO_RIM
from mdp.zone import NOWHERE, ZonesOnModel
from profiles.machine import Machine

MOST_FEATHERED = 0.1  # share of a seam; a larger one is reported
MOST_FOLDED = 1e-2  # share of the volume; the reader resolves larger overlaps


def one_piece(mesh: Mesh, machine: Machine, zones: ZonesOnModel = NOWHERE) -> Part:
    """A model as it stands, uncut, with its zones; without the faces that need support."""
    pose = level(machine)
    whole = Part(1, mesh, PLATFORM, pose, rotation(machine, pose), mesh.volume_mm3, 0.0)
    return replace(whole, no_seam=zones.no_seam, no_support=zones.no_support, support=zones.support, modifiers=zones.modifiers)


def make_parts(problem: Problem, node: Node) -> tuple[Part, ...]:
    """Parts in print order: the remainder first, then the cuts in reverse order."""
    machine, clearance = problem.machine, problem.settings.clearance
    bases = [PLATFORM, *reversed(node.planes)]
    pieces = [node.piece, *(node.places.piece(cut.part) for cut in reversed(node.cuts))]
    before = node.path[::-1]  # for each part but the first, the node that it was cut off from

    def allowed(position: int, near_turn_deg: float | None = None) -> list[Pose]:
        base, mesh = bases[position], pieces[position].mesh
        if not clearance:
            return poses(machine, base.normal, near_turn_deg)
        reached = allowed_poses(machine, base.normal, mesh.vertices + problem.place_mm, near_turn_deg)
        if base.limbs_mm is None:
            return reached
        return list(problem.clear_poses(before[position], base, reached))

    def fits(position: int, pose: Pose) -> bool:
        return not clearance or pose in allowed(position, pose.turn_deg)

    options = [[level(machine)], *(allowed(position) for position in range(1, len(bases)))]
    chosen = least_rotation(machine, options, fits)
    seams = (NO_RIM, *reversed(node.seams))
    zones, terms, parts = node.places.zones, node.terms, []
    for position, (base, piece, pose) in enumerate(zip(bases, pieces, chosen, strict=True)):
        mesh, needs = piece.mesh, None if terms.need is None else terms.need.pieces(piece.mesh, piece.sources)
        risky = risky_above(mesh, base, terms.angle_deg) if position else node.remainder.risky
        upright: Mask | None = None
        if needs is not None:
            risky = risky & (needs.along(base.normal) != CARRIES_ITSELF) if position else risky
            upright = risky_upright(mesh, terms.angle_deg, terms.count_platform_faces) & needs.upright & (needs.sources >= 0)
        parts.append(
            Part(
                index=position + 1,
                mesh=mesh,
                base=base,
                pose=pose,
                rotation=rotation(machine, pose),
                volume_mm3=mesh.volume_mm3,
                risky_area_mm2=float(mesh.areas_mm2[risky].sum()),
                seam_mm=seams[position].length_mm,
                feather_share=seams[position].feather_share,
                needing=None if needs is None else risky,
                needing_upright=upright,  # faces created by cuts are not the model's
                no_seam=zones.no_seam.among(piece.sources),
                no_support=zones.no_support.among(piece.sources),
                modifiers=zones.modifiers,
                support=zones.support.among(piece.sources),
            )
        )
    return tuple(parts)


def decomposition_of(
    problem: Problem, name: str, parts: tuple[Part, ...], front: Sequence[FrontRow], notes: Sequence[str] = ()
) -> Decomposition:
    """The decomposition of a model into given parts. front: its rows, with the chosen one marked; notes: in addition to those
    about parts.
    """
    mesh, root = problem.mesh, problem.root.remainder
    folded = folded_mm3(mesh, parts)
    return Decomposition(
        name=name,
        mesh=mesh,
        parts=parts,
        beam_width=problem.settings.beam_width,
        ranker=CLASSIC,
        risky_area_mm2=float(root.mesh.areas_mm2[root.risky].sum()),
        residual_area_mm2=sum(part.risky_area_mm2 for part in parts),
        candidates_evaluated=problem.evaluated,
        rounds=0,
        search_s=0.0,
        notes=(*_notes_of_parts(folded, parts), *notes),
        folded_mm3=folded,
        front=tuple(front),
        uncut=(one_piece(mesh, problem.machine, problem.zones),),
    )


def notes_of_search(decomposition: Decomposition) -> tuple[str, ...]:
    """The notes of a decomposition that are not about its parts."""
    own = _notes_of_parts(decomposition.folded_mm3, decomposition.parts)
    return tuple(note for note in decomposition.notes if note not in own)


def folded_mm3(mesh: Mesh, parts: Sequence[Part]) -> float:
    """Difference between the parts' volume and that of a mesh that slightly intersects itself, mm3; 0 for others.

    A mesh's volume counts a point as often as the surface winds around it, negatively if inside out; a cut counts it once or not
    at all.
    """
    difference = abs(mesh.volume_mm3 - sum(part.volume_mm3 for part in parts))
    return difference if VOLUME_TOLERANCE * mesh.volume_mm3 < difference <= MOST_FOLDED * mesh.volume_mm3 else 0.0


def _notes_of_parts(folded: float, parts: Sequence[Part]) -> list[str]:
    """Notes on self-intersections, and on parts with feather edges along much of their seam."""
    notes = []
    if folded > 0:
        notes.append(f"the surface intersects itself: {folded:.3g} mm³ enclosed twice or inside out are counted once")
    for part in parts:
        if part.feather_share > MOST_FEATHERED:
            share = f"{part.feather_share:.0%} of its seam is a feather edge"
            notes.append(f"part {part.index}: {share}, base and surface meet at less than 20 deg")
    return notes
