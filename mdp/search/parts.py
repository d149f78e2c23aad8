"""Parts of a node: its solids in print order, each at a pose, so that the table turns little."""

from mdp.clearance import allowed_poses
from mdp.cost.cost import CostTerms
from mdp.cut import mesh_of
from mdp.decomposition import Part
from mdp.mesh import Mesh
from mdp.overhang import Mask, risky_above
from mdp.plane import PLATFORM
from mdp.pose import Pose, level, poses, rotation
from mdp.pose_sequence import least_rotation
from mdp.search.node import Cut, Node
from mdp.support_need.patches import CARRIES_ITSELF
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
    parts = []
    for position, ((base, mesh), pose) in enumerate(zip(solids, least_rotation(machine, options, fits), strict=True)):
        risky = _needing(node.cuts[-position], mesh, node.terms) if position else node.remainder.risky
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
            )
        )
    return tuple(parts)


def _needing(cut: Cut, mesh: Mesh, terms: CostTerms) -> Mask:
    """(m,) faces of a part that need support."""
    risky = risky_above(mesh, cut.base, terms.angle_deg)
    if terms.need is None:
        return risky
    needing: Mask = risky & (terms.need.pieces(cut.solid).along(cut.base.normal) != CARRIES_ITSELF)
    return needing
