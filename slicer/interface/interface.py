"""Interface: what a part finds beneath and beside it, in its own frame, and how its layers see the base planes of later parts.

The base plane of a limb, beside which earlier parts stand above it, counts only near the limb.
"""

import atexit
from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from mdp.cut import solid_of
from mdp.decomposition import Part
from mdp.mesh import Floats, Mesh
from mdp.topology.cross_section import cross_sections
from profiles.process import Process
from slicer.bead import outer_wall_width_mm
from slicer.geometry.polygons import Polygons, clean, contours, offset, offset_round, union
from slicer.geometry.segments import near_height
from slicer.heights import Heights

SKIN = 0.8  # line widths inside the section from where on a tip is off the outer wall, whose middle lies at 0.5
SIDES = 32  # of what is round about an edge
BELOW_MM = 0.02  # from a base plane to the section that stands for the cut face in it, of the parts on either side
BASES_KEPT = 64
LEVEL = 1e-9  # a plane whose normal is nearer to upright than this meets a layer nowhere or everywhere
LEAST_COSINE = 0.05  # a plane that stands steeper is taken to lean so much: shadows on it stay finite
AROUND_MM = 5.0  # support of a limb stays within this distance of its shadow
COARSE_MM = 0.05  # tolerance to which a shadow is simplified
PLACES_KEPT = 64


def near_parts(part: Part, others: Sequence[Part], reach_mm: float) -> list[Part]:
    """Those of other parts whose box, in the part's frame, comes as near to its own as that."""
    low, high = part.in_part_frame().bounds_mm
    boxes = [in_frame_of(part, neighbour).bounds_mm for neighbour in others]
    near = [bool(np.all((box[0] < high + reach_mm) & (box[1] > low - reach_mm))) for box in boxes]
    return [neighbour for neighbour, is_near in zip(others, near, strict=True) if is_near]


def in_frame_of(part: Part, neighbour: Part) -> Mesh:
    """The mesh of a neighbour in the frame of a part."""
    return neighbour.mesh.transform(part.rotation, (0.0, 0.0, -part.base.offset_mm))


def frame_change(part: Part, to: Part) -> tuple[Floats, Floats]:
    """turn (3, 3) and shift (3,) that carry a point of a part's frame into the frame of another part: turn @ x + shift."""
    turn = to.rotation @ part.rotation.T
    return turn, turn[:, 2] * part.base.offset_mm - np.array([0.0, 0.0, to.base.offset_mm])


@lru_cache(BASES_KEPT)
def base_section(part: Part) -> Polygons:
    """The face with which a part stands on its base plane, in its frame."""
    return clean(cross_sections(part.in_part_frame(), np.array([BELOW_MM]))[0])


atexit.register(base_section.cache_clear)  # polygons left when Python ends would make manifold3d print a list of leaks


def sections_of(others: Sequence[Part], part: Part, cuts_mm: Floats) -> list[Polygons]:
    """For every height in the part's frame the sections of other parts together."""
    layers = [[clean(loops) for loops in cross_sections(in_frame_of(part, neighbour), cuts_mm)] for neighbour in others]
    return [union(layer) for layer in zip(*layers, strict=True)] if layers else [Polygons()] * len(cuts_mm)


def plane_in_frame_of(part: Part, normal: Floats, offset_mm: float) -> Floats:
    """(4,) normal and offset of a plane of the workpiece frame in the frame of a part."""
    turned = part.rotation @ normal
    return np.array([*turned, offset_mm - turned[2] * part.base.offset_mm])


def limb_planes(part: Part, later: Sequence[Part], heights: Heights, beside_mm: float) -> dict[int, "BasePlane"]:
    """The base planes of later limbs by part index, each as far as that beside its limb."""
    limbs = [upper for upper in later if upper.base.limbs_mm is not None]
    far_mm = 2.0 * float(np.linalg.norm(part.in_part_frame().vertices, axis=1).max()) if limbs else 0.0
    return {limb.index: BasePlane.of(part, limb, heights, far_mm, offset(shadow_of(limb), beside_mm)) for limb in limbs}


@lru_cache(PLACES_KEPT)
def shadow_of(limb: Part) -> Polygons:
    """The outline of a limb seen along its direction, in its frame."""
    return solid_of(limb.in_part_frame()).project().simplify(COARSE_MM)


@lru_cache(PLACES_KEPT)
def room_of(limb: Part) -> Polygons:
    """The area of a limb's base plane over which it and its support are printed."""
    return offset_round(shadow_of(limb), AROUND_MM)


atexit.register(shadow_of.cache_clear)  # as base_section
atexit.register(room_of.cache_clear)


@dataclass(frozen=True, eq=False)
class BasePlane:
    """turn (3, 3) and shift (3,) carry a point of the earlier part's frame into the later part's: turn @ x + shift.

    heights: of the earlier part's layers. Of a layer's two sides the one that comes nearer to the plane from below stands for it.
    far_mm: how far from the origin of the earlier frame its layers reach. places: the area of the plane that counts, where the
    later part is a limb; None: all of it.
    """

    turn: Floats
    shift: Floats
    heights: Heights
    far_mm: float
    places: Polygons | None = None

    @classmethod
    def of(cls, earlier: Part, later: Part, heights: Heights, far_mm: float, places: Polygons | None = None) -> "BasePlane":
        """The base plane of a later part, as far as it or its support is printed over it unless other places are given."""
        if places is None and later.base.limbs_mm is not None:
            places = room_of(later)
        return cls(*frame_change(earlier, later), heights, far_mm, places)

    @property
    def cosine(self) -> float:
        """Of the angle between the two directions."""
        return float(self.turn[2, 2])

    def z_mm(self, layer: int) -> float:
        """The height that stands for a layer."""
        return float((self.heights.tip_mm if self.cosine >= 0.0 else self.heights.bottom_mm)[layer])

    def points_mm(self, places: Floats) -> Floats:
        """(n, 3) points of the earlier frame for (n, 2) places on the plane."""
        on_plane = np.column_stack([places, np.zeros(len(places))])
        points: Floats = (on_plane - self.shift) @ self.turn
        return points

    def layers_near(self, places: Polygons, deep_mm: float) -> range:
        """The layers that come within deep_mm below places on the plane."""
        if places.is_empty():
            return range(0)
        on_plane: Floats = self.points_mm(np.concatenate(contours(places)))[:, 2]
        deeper = on_plane - deep_mm * self.cosine
        low, high = min(on_plane.min(), deeper.min()), max(on_plane.max(), deeper.max())
        return range(int(np.searchsorted(self.heights.tip_mm, low)), int(np.searchsorted(self.heights.bottom_mm, high)))

    def band(self, layer: int, low_mm: float, high_mm: float) -> Polygons:
        """What of a layer lies low_mm to high_mm above the plane (below it: negative), over or under the places that count."""
        whole = self._whole_band(layer, low_mm, high_mm)
        if self.places is None or whole.is_empty():
            return whole
        narrow_mm = max(LEAST_COSINE - abs(self.cosine), 0.0) * self.far_mm  # by which the shadow of a steep plane may be off
        return whole ^ self.shadow(offset_round(self.places, narrow_mm) if narrow_mm else self.places, layer)

    def _whole_band(self, layer: int, low_mm: float, high_mm: float) -> Polygons:
        normal, at = self.turn[2, :2], float(self.turn[2, 2] * self.z_mm(layer) + self.shift[2])
        across, far_mm = float(np.hypot(*normal)), self.far_mm
        if across < LEVEL:
            return Polygons.square((2.0 * far_mm, 2.0 * far_mm), True) if low_mm <= at <= high_mm else Polygons()
        near, far = np.clip((np.array([low_mm, high_mm]) - at) / across, -far_mm, far_mm)
        if far <= near:
            return Polygons()
        along = normal / across
        aside = np.array([-along[1], along[0]]) * far_mm
        return Polygons([np.array([near * along - aside, far * along - aside, far * along + aside, near * along + aside])])

    def project(self, places: Polygons, layer: int) -> Polygons:
        """Places in a layer carried straight onto the plane, in the later part's frame."""
        turn, shift = self._onto_plane(self.z_mm(layer))
        return places.transform(np.column_stack([turn, shift]))

    def shadow(self, places: Polygons, layer: int) -> Polygons:
        """What of a layer lies straight over or under places on the plane."""
        turn, shift = self._onto_plane(self.z_mm(layer))
        back = np.linalg.inv(turn)
        return places.transform(np.column_stack([back, -back @ shift]))

    def _onto_plane(self, z_mm: float) -> tuple[Floats, Floats]:
        """(2, 2) and (2,) that carry a height's places onto the plane, exact where the height meets the plane."""
        u, s, vt = np.linalg.svd(self.turn[:2, :2])
        turn: Floats = u @ np.diag(np.maximum(s, LEAST_COSINE)) @ vt
        normal, at = self.turn[2, :2], float(self.turn[2, 2] * z_mm + self.shift[2])
        meets = -at * normal / max(float(normal @ normal), LEVEL) if np.hypot(*normal) > LEVEL else np.zeros(2)
        shift: Floats = (self.turn[:2, :2] - turn) @ meets + self.turn[:2, 2] * z_mm + self.shift[:2]
        return turn, shift


def plastic_below(part: Part, earlier: Sequence[Part], section: Polygons) -> Polygons | None:
    """Plastic just below the base plane; None on the platform. Parts not handed over are taken to fill the section."""
    if part.index == 1:
        return None
    if not earlier:
        return section
    return sections_of(earlier, part, np.array([-BELOW_MM]))[0]


def joints(part: Part, later: Sequence[Part], section: Polygons, below: Polygons | None) -> Floats:
    """(n, 6) segments, in the part's frame, of the lines where it meets the parts before and after it on the surface.

    section: of its first layer; below: the plastic under it, None on the platform.
    """
    rims = [] if below is None else [np.insert(loop, 2, 0.0, axis=1) for loop in contours(section ^ below)]
    for upper in later:
        for loop in contours(base_section(upper)):
            placed = np.insert(loop, 2, upper.base.offset_mm, axis=1) @ upper.rotation
            rims.append(placed @ part.rotation.T - np.array([0.0, 0.0, part.base.offset_mm]))
    segments = [np.hstack([rim, np.roll(rim, -1, axis=0)]) for rim in rims]
    return np.concatenate(segments) if segments else np.zeros((0, 6))


def skin_beside(edges: Floats, section: Polygons, z_mm: float, process: Process) -> Polygons:
    """Outer walls of a section near the edges of interfaces, where what a travel or wipe leaves shows along the joint."""
    near = _beside(edges, z_mm, process.interface_seam_mm)
    width_mm = min(process.line_width_mm, outer_wall_width_mm(process))
    return near if near.is_empty() else near ^ (section - offset(section, -SKIN * width_mm))


def _beside(edges: Floats, z_mm: float, reach_mm: float) -> Polygons:
    """What of the plane at a height lies about as near as that to segments (n, 6) in space."""
    near = near_height(edges, z_mm, reach_mm)
    if not len(near):
        return Polygons()
    rise = near[:, 5] - near[:, 2]
    level = np.abs(rise) < 1e-9
    at = (z_mm - near[:, 2] + reach_mm * np.array([[-1.0], [1.0]])) / np.where(level, 1.0, rise)
    shares: Floats = np.where(level, [[0.0], [1.0]], np.sort(at, axis=0).clip(0.0, 1.0))  # in order, and within the segments
    begin, end = (near[:, :3] + share[:, None] * (near[:, 3:] - near[:, :3]) for share in shares)
    heights = np.array([begin[:, 2], end[:, 2]]) - z_mm
    least = np.where(heights.prod(axis=0) < 0.0, 0.0, np.abs(heights).min(axis=0))
    reaches = np.sqrt(np.maximum(reach_mm**2 - least**2, 0.0))
    return union([_around(a, b, reach) for a, b, reach in zip(begin, end, reaches.tolist(), strict=True)])


def _around(begin: Floats, end: Floats, reach_mm: float) -> Polygons:
    """What lies as near as that to a segment seen from above."""
    disc = Polygons.circle(reach_mm, SIDES)
    return Polygons.batch_hull([disc.translate((float(x), float(y))) for x, y in (begin[:2], end[:2])])
