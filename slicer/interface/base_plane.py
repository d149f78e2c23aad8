"""Base plane: that of a later part as the layers of an earlier part see it: places near it, places carried across.

That of a limb, beside which earlier parts stand above it, counts only near the limb.
"""

import atexit
from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from mdp.cut import solid_of
from mdp.decomposition import Part
from mdp.mesh import Floats
from slicer.geometry.polygons import Polygons, contours, offset, offset_round
from slicer.heights import Heights
from slicer.interface.interface import frame_change

LEVEL = 1e-9  # a plane whose normal is nearer to upright than this meets a layer nowhere or everywhere
LEAST_COSINE = 0.05  # a plane that stands steeper is taken to lean so much: shadows on it stay finite
AROUND_MM = 5.0  # support of a limb stays within this distance of its shadow
COARSE_MM = 0.05  # tolerance to which a shadow is simplified
PLACES_KEPT = 64


def plane_in_frame_of(part: Part, normal: Floats, offset_mm: float) -> Floats:
    """(4,) normal and offset of a plane of the workpiece frame in the frame of a part."""
    turned = part.rotation @ normal
    return np.array([*turned, offset_mm - turned[2] * part.base.offset_mm])


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


def limb_planes(part: Part, later: Sequence[Part], heights: Heights, beside_mm: float) -> dict[int, "BasePlane"]:
    """The base planes of later limbs by part index, each as far as that beside its limb."""
    limbs = [upper for upper in later if upper.base.limbs_mm is not None]
    far_mm = 2.0 * float(np.linalg.norm(part.in_part_frame().vertices, axis=1).max()) if limbs else 0.0
    return {limb.index: BasePlane.of(part, limb, heights, far_mm, offset(shadow_of(limb), beside_mm)) for limb in limbs}


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
