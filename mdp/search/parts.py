"""Parts of a node: its solids in print order, each at a pose, so that the table turns little."""

from mdp.clearance import allowed_poses
from mdp.cost.cost import CostTerms
from mdp.cut import Solid, mesh_of
from mdp.decomposition import Part
from mdp.mesh import Mesh
from mdp.overhang import Mask, risky_above, risky_upright
from mdp.plane import PLATFORM, Plane
from mdp.pose import Pose, level, poses, rotation
from mdp.pose_sequence import least_rotation
from mdp.search.node import Node
from mdp.support_need.need import ModelPieces
from mdp.support_need.patches import CARRIES_ITSELF
from mdp.zone import Marked
from profiles.machine import Machine
from profiles.profile import Profile


def one_piece(mesh: Mesh, machine: Machine) -> Part:
    """A model as it stands, uncut; what needs support of it is not looked at."""
    pose = level(machine)
    return Part(1, mesh, PLATFORM, pose, rotation(machine, pose), mesh.volume_mm3, 0.0)


def make_parts(node: Node, machine: Machine, profile: Profile) -> tuple[Part, ...]:
    """Parts in print order: what remains first, then the cuts, last one first. machine: the profile's, or one without limits."""
    clearance = profile.search.clearance
    solids = [(PLATFORM, node.remainder.mesh), *((c.base, mesh_of(c.solid)) for c in reversed(node.cuts))]
    options = [[level(machine)]]
    for base, mesh in solids[1:]:
        options.append(allowed_poses(machine, base.normal, mesh.vertices) if clearance else poses(machine, base.normal))

    def fits(position: int, pose: Pose) -> bool:
        base, mesh = solids[position]
        return not clearance or pose in allowed_poses(machine, base.normal, mesh.vertices, pose.turn_deg)

    feathered = (0.0, *(seam.feather_share for seam in reversed(node.seams)))
    need, parts = node.terms.need, []
    for position, ((base, mesh), pose) in enumerate(zip(solids, least_rotation(machine, options, fits), strict=True)):
        pieces = None if need is None else need.pieces(node.cuts[-position].solid if position else node.solid)
        risky = _needing(mesh, base, pieces, node.terms) if position else node.remainder.risky
        parts.append(
            Part(
                index=position + 1,
                mesh=mesh,
                base=base,
                pose=pose,
                rotation=rotation(machine, pose),
                volume_mm3=mesh.volume_mm3,
                risky_area_mm2=float(mesh.areas_mm2[risky].sum()),
                feather_share=feathered[position],
                needing=None if pieces is None else risky,
                needing_upright=None if pieces is None else _needing_upright(mesh, pieces, node.terms),
                **_marked(node, node.cuts[-position].solid if position else node.solid),
            )
        )
    return tuple(parts)


def _marked(node: Node, solid: Solid) -> dict[str, Marked]:
    """Where of a part no seam and no support is wanted."""
    zones = node.places.zones
    sources = node.places.surface.sources(solid)
    return {"no_seam": zones.no_seam.among(sources), "no_support": zones.no_support.among(sources)}


def _needing(mesh: Mesh, base: Plane, pieces: ModelPieces | None, terms: CostTerms) -> Mask:
    """(m,) faces of a part that need support."""
    risky = risky_above(mesh, base, terms.angle_deg)
    if pieces is None:
        return risky
    needing: Mask = risky & (pieces.along(base.normal) != CARRIES_ITSELF)
    return needing


def _needing_upright(mesh: Mesh, pieces: ModelPieces, terms: CostTerms) -> Mask:
    """(m,) faces of a part that would need it if the model were printed straight up; those of cuts are not the model's."""
    risky = risky_upright(mesh, terms.angle_deg, terms.count_platform_faces)
    needing: Mask = risky & pieces.upright & (pieces.sources >= 0)
    return needing
