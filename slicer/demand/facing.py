"""Facing: a later part's base plane as an earlier part's frame sees it: bands along it, places carried across."""

from dataclasses import dataclass

import numpy as np

from mdp.decomposition import Part
from mdp.mesh import Floats
from slicer.geometry.polygons import Polygons

LEVEL = 1e-9  # a plane whose normal is nearer to upright than this has all of a layer on one side
LEAST_COSINE = 0.05  # a plane that stands steeper is taken to lean so much: shadows on it stay finite


@dataclass(frozen=True, eq=False)
class Facing:
    """turn (3, 3) and shift (3,) carry a point of the earlier part's frame into the later part's: turn @ x + shift."""

    turn: Floats
    shift: Floats

    @classmethod
    def of(cls, earlier: Part, later: Part) -> "Facing":
        """The base plane of `later` in the frame of `earlier`."""
        turn = later.rotation @ earlier.rotation.T
        return cls(turn, turn[:, 2] * earlier.base.offset_mm - np.array([0.0, 0.0, later.base.offset_mm]))

    @property
    def cosine(self) -> float:
        """Of the angle between the two directions."""
        return float(self.turn[2, 2])

    def nearest_z_mm(self, low_mm: float, high_mm: float) -> float:
        """The one of a layer's two sides that comes nearer to the plane from below."""
        return high_mm if self.cosine >= 0.0 else low_mm

    def points_mm(self, places: Floats) -> Floats:
        """(n, 3) points of the earlier frame for (n, 2) places on the plane."""
        on_plane = np.column_stack([places, np.zeros(len(places))])
        points: Floats = (on_plane - self.shift) @ self.turn
        return points

    def band(self, z_mm: float, low_mm: float, high_mm: float, far_mm: float) -> Polygons:
        """What of a height of the earlier frame lies low_mm to high_mm above the plane (below it: negative)."""
        normal, at = self.turn[2, :2], float(self.turn[2, 2] * z_mm + self.shift[2])
        across = float(np.hypot(*normal))
        if across < LEVEL:
            return Polygons.square((2.0 * far_mm, 2.0 * far_mm), True) if low_mm <= at <= high_mm else Polygons()
        near, far = np.clip((np.array([low_mm, high_mm]) - at) / across, -far_mm, far_mm)
        if far <= near:
            return Polygons()
        along = normal / across
        aside = np.array([-along[1], along[0]]) * far_mm
        return Polygons([np.array([near * along - aside, far * along - aside, far * along + aside, near * along + aside])])

    def project(self, places: Polygons, z_mm: float) -> Polygons:
        """Places at a height of the earlier frame carried straight onto the plane, in the later part's frame."""
        turn, shift = self._onto_plane(z_mm)
        return places.transform(np.column_stack([turn, shift]))

    def shadow(self, places: Polygons, z_mm: float) -> Polygons:
        """What of a height of the earlier frame lies straight over or under places on the plane."""
        turn, shift = self._onto_plane(z_mm)
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
