"""Footing: how firmly a print holds on the build plate, and how a model stands there in some orientation.

The plate holds the contact like glue holds the end of an upright beam. The nozzle's push at the top of the print and the weight,
where it acts beside the middle of the contact, bend it: the greatest tension is the bending moment over the least section modulus
of the contact, less what the weight presses on it.
"""

from dataclasses import dataclass
from enum import IntEnum
from math import atan2, degrees

import numpy as np
from manifold3d import CrossSection, JoinType

from mdp.cut import Solid, solid_of
from mdp.directions.orientation import LEAN_DEG, SIDES, centre_of_mass, diameter_mm
from mdp.mesh import Floats, Mesh, dot
from mdp.overhang import PLATFORM_TOLERANCE_MM
from mdp.sweep.bending import AREA, X, Y, greatest_stress_per_moment, section_moments
from profiles.profile import Profile

PUSH_N = 1.0  # sideways push of the nozzle at the top of a print: light contact with a curled edge
ADHESION_MPA = 0.2  # of plastic to a clean warm plate, a few times less than published peel tests of PLA and PETG give
NEWTON_PER_G = 9.81e-3
BRIM_SEGMENTS = 32  # of a full turn around a corner
# Of the diameter: so high above the plate a rounded end is as wide as its base; brim and support fill in what is rounded below.
BLUNT = 0.01
# Shares of a model's shadow that its base takes up: by which a brim can hold it, where it rests and where it hardly does; by
# which it stands firmly; and of a flat base. The last two tell best what people choose (tools/RESULTS.md).
SMALL_BASE, LEANING_BASE, FIRM_BASE, FLAT_BASE = 0.015, 0.03, 0.1, 0.2
BROAD_DEG = 15.0  # by which a model on a broad stance may be tilted


class Stance(IntEnum):
    """How a model stands on the plate: it may come off, it is held, it stands firmly, it stands on a flat base."""

    LOOSE = 0
    HELD = 1
    FIRM = 2
    FLAT = 3


@dataclass(frozen=True, eq=False)
class Plate:
    """The plate under a model: its mesh and solid, its centre of mass and diameter, the width of the brim that a small base gets,
    and the density, as if it were printed solid."""

    mesh: Mesh
    solid: Solid
    centre: Floats
    diameter_mm: float
    brim_mm: float
    density_g_cm3: float

    @classmethod
    def under(cls, mesh: Mesh, profile: Profile) -> "Plate":
        """The plate under a mesh, by a profile."""
        brim_mm = profile.process.brim_mm or profile.process.small_base_brim_mm
        return cls(mesh, solid_of(mesh), centre_of_mass(mesh), diameter_mm(mesh), brim_mm, profile.material.density_g_cm3)

    def stance(self, rotation: Floats, of_file: bool = False) -> Stance:
        """How the model stands when it is turned by a rotation (3, 3); of_file: as in its file, where it is believed to stand if
        it does not tip over by itself."""
        base = self._base(rotation)
        share, lean_deg = base.area() / self._shadow_mm2(rotation), self._lean_deg(rotation, base)
        rests = lean_deg >= (0.0 if of_file else LEAN_DEG)
        based = share >= (SMALL_BASE if rests else LEANING_BASE) and lean_deg >= -LEAN_DEG
        alone = lean_deg >= LEAN_DEG and self._tension_mpa(rotation, base, 0.0) <= ADHESION_MPA
        if not alone and not (based and self._tension_mpa(rotation, base, self.brim_mm) <= ADHESION_MPA):
            return Stance.LOOSE
        if lean_deg >= LEAN_DEG and share >= FLAT_BASE:
            return Stance.FLAT
        return Stance.FIRM if share >= FIRM_BASE or (based and lean_deg >= BROAD_DEG) else Stance.HELD

    def tension_mpa(self, rotation: Floats, brim_mm: float = 0.0) -> float:
        """The greatest tension under the model, with a brim around its base."""
        return self._tension_mpa(rotation, self._base(rotation), brim_mm)

    def _tension_mpa(self, rotation: Floats, base: CrossSection, brim_mm: float) -> float:
        low, high = self._heights_mm(rotation)
        if brim_mm > 0.0:
            base = base.offset(brim_mm, JoinType.Round, circular_segments=BRIM_SEGMENTS)
        weight_n = 1e-3 * self.density_g_cm3 * self.solid.volume() * NEWTON_PER_G
        return _tension_mpa(section_edges(base), high - low, weight_n, (rotation @ self.centre)[:2])

    def _base(self, rotation: Floats) -> CrossSection:
        """What the model stands on: the larger of the sections where it touches the plate and a little above."""
        turned, (low, _) = self.solid.transform(np.column_stack([rotation, np.zeros(3)])), self._heights_mm(rotation)
        heights_mm = (0.5 * PLATFORM_TOLERANCE_MM, BLUNT * self.diameter_mm)
        return max((turned.slice(low + height_mm) for height_mm in heights_mm), key=CrossSection.area)

    def _heights_mm(self, rotation: Floats) -> tuple[float, float]:
        heights = self.mesh.vertices @ rotation[2]
        return float(heights.min()), float(heights.max())

    def _shadow_mm2(self, rotation: Floats) -> float:
        """The area of the model's shadow, surfaces above each other counted each."""
        return 0.5 * float(np.abs(dot(self.mesh.normals, rotation[2])) @ self.mesh.areas_mm2)

    def _lean_deg(self, rotation: Floats, base: CrossSection) -> float:
        """The least angle by which the model, tilted to any of 64 sides, has its centre of mass over the edge of a base; below 0
        where it is not over the base to begin with."""
        corners, centre = section_edges(base)[:, :2], rotation @ self.centre
        if len(corners) == 0:
            return -90.0
        reach_mm = float(((corners - centre[:2]) @ SIDES).max(axis=0).min())
        return degrees(atan2(reach_mm, float(centre[2]) - self._heights_mm(rotation)[0]))


def tips_over(base: CrossSection, height_mm: float) -> bool:
    """Whether the nozzle's push at a height would tear a base off the plate."""
    return _tension_mpa(section_edges(base), height_mm) > ADHESION_MPA


def section_modulus_mm3(base: CrossSection) -> float:
    """Least section modulus of an area over all directions of bending, 0 of an empty one."""
    return 1.0 / greatest_stress_per_moment(section_edges(base))


def section_edges(area: CrossSection) -> Floats:
    """(n, 4) the edges x, y, x, y of an area's outlines, the area on the left of each."""
    loops = [np.asarray(loop) for loop in area.to_polygons()]
    return np.concatenate([np.zeros((0, 4)), *(np.hstack([loop, np.roll(loop, -1, axis=0)]) for loop in loops)])


def _tension_mpa(edges: Floats, height_mm: float, weight_n: float = 0.0, centre: Floats | None = None) -> float:
    """The greatest tension in a contact; infinite where it has no area. centre (2,): where the weight acts."""
    moments = section_moments(edges)
    area_mm2 = float(moments[AREA])
    if area_mm2 <= 0.0:
        return np.inf
    lever_mm = 0.0 if centre is None else float(np.linalg.norm(centre - moments[[X, Y]] / area_mm2))
    bending_n_mm = PUSH_N * height_mm + weight_n * lever_mm
    return bending_n_mm * float(greatest_stress_per_moment(edges)) - weight_n / area_mm2
