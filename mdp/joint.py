"""Joint: the force that breaks a part off its base: a push at the far end of what the base holds, where it is easiest.

The base is a cold weld. A force F at the distance a from the middle of its section bends it with F a there, whatever the
direction of the arm, with the force square to it; in the worst direction that stresses the section by F a / W, W its least
section modulus, so F = s W / a with the strength s of the weld. Pulled straight off it bears s A, A its area.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from manifold3d import CrossSection

from mdp.cost.footing import section_edges
from mdp.cut import Solid, mesh_of, solid_of
from mdp.decomposition import Part
from mdp.directions.orientation import diameter_mm
from mdp.mesh import Floats, Mesh
from mdp.sweep.bending import AREA, X, Y, greatest_stress_per_moment, section_moments
from profiles.profile import Profile

BESIDE_MM = 0.02  # from a base plane, where sections are taken: in the plane itself they would be those of a face
# share of a model's diameter squared: the convex hull of a cut through a neck or the root of a limb is smaller
BULK = 0.15
FIRST = 0.15  # share of the volume: a smaller first part is a sliver, not a base for all the parts on it
TOUCHING_MM2 = 0.01  # sections with less common area meet only in an edge


@dataclass(frozen=True)
class Joint:
    """The strength of a part's base. area_mm2: total area of its pieces, each of which is a joint of its own; arm_mm, load_n,
    tension_n describe the piece that breaks first: the distance of its far end from the middle of its section, and the forces
    that break it, N, sideways at that end and straight off. seam_mm: visible length of its rim. contact_share: share of its
    section that the first layer's beads cover and earlier parts reach; plastic_over_room: plastic in that layer as a share of its
    volume; None if it is not sliced.
    """

    part: int
    area_mm2: float
    arm_mm: float
    load_n: float
    tension_n: float
    seam_mm: float = 0.0
    contact_share: float | None = None
    plastic_over_room: float | None = None


@dataclass(frozen=True, eq=False)
class _Piece:
    """A connected piece of a part, the edges (k, 4) of its contact with other pieces, and the numbers of those pieces."""

    part: Part
    solid: Solid
    edges: Floats
    stands_on: tuple[int, ...]


def joints_of(parts: Sequence[Part], profile: Profile) -> tuple[Joint, ...]:
    """The joints of a decomposition's parts 2, 3, ... in print order; a later part that only this part holds counts as its load.
    Pieces lower than the search's fragments are ignored if there are others.
    """
    if len(parts) < 2:
        return ()
    pieces, fragment_mm = _pieces(parts), float(np.sqrt(profile.search.least_interface_mm2))
    joints = []
    for part in parts:
        if part.on_plate:
            continue
        own = [k for k, piece in enumerate(pieces) if piece.part is part]
        high = [k for k in own if part.base.heights_mm(mesh_of(pieces[k].solid).vertices).max() >= fragment_mm] or own
        several = [_joint(pieces, k, profile.material.cold_weld_mpa) for k in high]
        weakest = min(several, key=lambda joint: joint.load_n)
        joints.append(replace(weakest, area_mm2=sum(joint.area_mm2 for joint in several), seam_mm=part.seam_mm))
    return tuple(joints)


def weakest_of(joints: Sequence[Joint]) -> Joint | None:
    """The joint that breaks first; None if there are none."""
    return min(joints, key=lambda joint: joint.load_n, default=None)


def flaw_of(mesh: Mesh, parts: Sequence[Part], profile: Profile, by_hand: int = 0) -> str:
    """The flaw of a decomposition in words: a joint breaks when the nozzle pushes the far end of what it holds, the first part is
    a sliver, or a cut passes through the bulk of the model, where its seam would surround the whole model. Empty if it is sound,
    and on the paper's terms, which have none of these. by_hand: number of last parts that the user cut off; these are not tested.
    """
    search = profile.search.effective
    if search.seam_mm <= 0.0:
        return ""
    end, most_mm2 = len(parts) - by_hand, BULK * diameter_mm(mesh) ** 2
    weakest = weakest_of(joints_of(parts, profile)[: end - 1])
    if weakest is not None and weakest.load_n < search.strength_safety * search.nozzle_load_n:
        return f"the nozzle could break off part {weakest.part}"
    if end > 1 and parts[0].volume_mm3 < FIRST * sum(part.volume_mm3 for part in parts[:end]):
        return "the first part is too small to carry the others"
    thick = next((part.index for part in parts[1:end] if _base_hull_mm2(part) > most_mm2), None)
    return "" if thick is None else f"the cut below part {thick} surrounds the whole model"


def _base_hull_mm2(part: Part) -> float:
    """Area of the convex hull of a part's base; of its largest piece, if there are several."""
    pieces = _in_frame(solid_of(part.mesh), part).slice(BESIDE_MM).decompose()
    return max((piece.hull().area() for piece in pieces), default=0.0)


def _joint(pieces: Sequence[_Piece], number: int, strength_mpa: float) -> Joint:
    piece = pieces[number]
    part, moments = piece.part, section_moments(piece.edges)
    area_mm2 = float(moments[AREA])
    if area_mm2 <= 0.0:
        return Joint(part.index, 0.0, 0.0, 0.0, 0.0)
    middle = np.array([moments[X] / area_mm2, moments[Y] / area_mm2, part.base.offset_mm]) @ part.rotation
    held = np.concatenate([mesh_of(pieces[k].solid).vertices for k in _held(pieces, number)])
    arm_mm = float(np.linalg.norm(held - middle, axis=1).max())
    load_n = strength_mpa / (greatest_stress_per_moment(piece.edges) * arm_mm)
    return Joint(part.index, area_mm2, arm_mm, float(load_n), strength_mpa * area_mm2)


def _held(pieces: Sequence[_Piece], number: int) -> set[int]:
    """The pieces that come off with a piece; only the piece itself if others hold it too."""
    off, waiting = {number}, [number]
    while waiting:
        at = waiting.pop()
        beside = [k for k, piece in enumerate(pieces) if at in piece.stands_on]
        beside += [k for k in pieces[at].stands_on if at != number]
        waiting += [k for k in dict.fromkeys(beside) if k not in off]
        off.update(beside)
    return off if all(pieces[k].stands_on for k in off) else {number}


def _pieces(parts: Sequence[Part]) -> list[_Piece]:
    """The pieces of all parts in print order; only those of the first part stand on none."""
    pieces: list[_Piece] = []
    for part in parts:
        earlier = list(pieces)
        for solid in solid_of(part.mesh).decompose():
            base = _in_frame(solid, part).slice(BESIDE_MM)
            near = [k for k, piece in enumerate(earlier) if _meet(piece.solid, solid)]
            shared = {k: base ^ _in_frame(earlier[k].solid, part).slice(-BESIDE_MM) for k in near}
            shared = {k: area for k, area in shared.items() if area.area() > TOUCHING_MM2}
            contact = sum(shared.values(), CrossSection())
            pieces.append(_Piece(part, solid, section_edges(contact), tuple(shared)))
    return pieces


def _meet(one: Solid, other: Solid) -> bool:
    """Whether the bounding boxes of two solids are as near to each other as touching pieces."""
    (low, high), (least, most) = (np.reshape(solid.bounding_box(), (2, 3)) for solid in (one, other))
    return bool(np.all((low <= most + BESIDE_MM) & (least <= high + BESIDE_MM)))


def _in_frame(solid: Solid, part: Part) -> Solid:
    return solid.transform(np.column_stack([part.rotation, [0.0, 0.0, -part.base.offset_mm]]))
