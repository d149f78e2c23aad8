"""Footing: how firmly a print holds on the build plate, and how a model stands there in some orientation.

The plate holds the contact like glue holds the end of an upright beam. The nozzle's push at the top of the print and the weight,
where it acts beside the middle of the contact, bend it: the greatest tension is the bending moment over the least section modulus
of the contact, less what the weight presses on it.
"""

from dataclasses import dataclass
from enum import IntEnum

import numpy as np
from manifold3d import CrossSection, JoinType

from mdp.cut import Solid, solid_of
from mdp.directions.orientation import LEAN_DEG, Orientation, centre_of_mass
from mdp.mesh import Floats, Mesh
from mdp.overhang import PLATFORM_TOLERANCE_MM
from mdp.sweep.bending import AREA, X, Y, greatest_stress_per_moment, section_moments
from profiles.profile import Profile

PUSH_N = 1.0  # sideways push of the nozzle at the top of a print: light contact with a curled edge
ADHESION_MPA = 0.2  # of plastic to a clean warm plate, a few times less than published peel tests of PLA and PETG give
NEWTON_PER_G = 9.81e-3
BRIM_SEGMENTS = 32  # of a full turn around a corner
# Shares of a model's shadow that its base takes up: by which a brim can hold it, where it rests and where it hardly does, and for
# every degree less; by which it stands firmly, where it rests and however it leans; and of a flat base.
SMALL_BASE, LEANING_BASE, LEANING_BASE_DEG = 0.015, 0.03, 0.0015
FIRM_BASE, FIRM_LEANING_BASE, FLAT_BASE = 0.05, 0.12, 0.2
BROAD_DEG = 15.0  # by which a model on a broad stance may be leaned


def plate_tension_mpa(solid: Solid, centre: Floats, rotation: Floats, brim_mm: float, density_g_cm3: float) -> float:
    """The greatest tension under a solid that is turned by a rotation (3, 3) and set on the plate. centre (3,): its centre of
    mass; brim_mm: the width of the brim around its contact; density_g_cm3: as if it were printed solid."""
    turned = solid.transform(np.column_stack([rotation, np.zeros(3)]))
    bounds = turned.bounding_box()
    contact = turned.slice(bounds[2] + 0.5 * PLATFORM_TOLERANCE_MM)
    if brim_mm > 0.0:
        contact = contact.offset(brim_mm, JoinType.Round, circular_segments=BRIM_SEGMENTS)
    weight_n = 1e-3 * density_g_cm3 * solid.volume() * NEWTON_PER_G
    return _tension_mpa(section_edges(contact), bounds[5] - bounds[2], weight_n, (rotation @ centre)[:2])


class Stance(IntEnum):
    """How a model stands on the plate: it may come off, it is held, it stands firmly, it stands on a flat base."""

    LOOSE = 0
    HELD = 1
    FIRM = 2
    FLAT = 3


@dataclass(frozen=True, eq=False)
class Plate:
    """The plate under a model: its solid and centre of mass, the width of the brim that a small base gets, and the density."""

    solid: Solid
    centre: Floats
    brim_mm: float
    density_g_cm3: float

    @classmethod
    def under(cls, mesh: Mesh, profile: Profile) -> "Plate":
        """The plate under a mesh, by a profile."""
        brim_mm = profile.process.brim_mm or profile.process.small_base_brim_mm
        return cls(solid_of(mesh), centre_of_mass(mesh), brim_mm, profile.material.density_g_cm3)

    def stance(self, orientation: Orientation, of_file: bool = False) -> Stance:
        """How the model stands in an orientation; of_file: in that of its file, which is believed to stand if it does not tip
        over by itself."""
        share, lean_deg, stable = orientation.standing_share, orientation.lean_deg, orientation.stable
        rests = stable or (of_file and lean_deg >= 0.0)
        least = SMALL_BASE if rests else LEANING_BASE + LEANING_BASE_DEG * (LEAN_DEG - lean_deg)
        based = share >= least and lean_deg >= -LEAN_DEG
        if not (stable or based):
            return Stance.LOOSE
        if not (stable and self._holds(orientation, 0.0)) and not (based and self._holds(orientation, self.brim_mm)):
            return Stance.LOOSE
        if stable and share >= FLAT_BASE:
            return Stance.FLAT
        firm = share >= (FIRM_BASE if stable else FIRM_LEANING_BASE) or (based and lean_deg >= BROAD_DEG)
        return Stance.FIRM if firm else Stance.HELD

    def _holds(self, orientation: Orientation, brim_mm: float) -> bool:
        """Whether the plate holds the model in an orientation with such a brim."""
        return plate_tension_mpa(self.solid, self.centre, orientation.rotation, brim_mm, self.density_g_cm3) <= ADHESION_MPA


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
