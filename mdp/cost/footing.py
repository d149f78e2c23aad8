"""Footing: how firmly a print holds on the build plate, and how a model stands there in a given orientation.

The plate holds the contact like glue holds the end of an upright beam. The nozzle's push at the top of the print and the weight,
where it acts beside the middle of the contact, bend it: the greatest tension is the bending moment over the least section modulus
of the contact, less the pressure of the weight.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from manifold3d import CrossSection, FillRule, JoinType

from mdp.cut import convex_hull
from mdp.directions.orientation import LEAN_DEG, SIDES, centre_of_mass, diameter_mm, tipping_angle_deg
from mdp.kernels.arrays import floats, table
from mdp.kernels.kernel import kernel
from mdp.kernels.threads import in_threads
from mdp.mesh import Floats, Ints, Mesh, dot
from mdp.overhang import PLATE_TOLERANCE_MM
from mdp.sweep.bending import AREA, X, Y, greatest_stress_per_moment, section_moments
from mdp.topology.cross_section import loop_edges, loops_at
from mdp.topology.edges import opposites
from profiles.profile import Profile

PUSH_N = 1.0  # sideways push of the nozzle at the top of a print: light contact with a curled edge
ADHESION_MPA = 0.2  # adhesion of plastic to a clean warm plate, a fraction of what published peel tests of PLA and PETG give
NEWTON_PER_G = 9.81e-3
BRIM_SEGMENTS = 32  # segments in a full turn around a corner
# Height above the plate, as a share of the diameter, at which the base of a rounded end is measured: brim and support fill the
# gap below it.
BLUNT = 0.01
# Least base area, as a share of the model's shadow, that a brim can hold: where the model rests, and where it nearly tips over.
SMALL_BASE, LEANING_BASE = 0.015, 0.03
FACE = 0.05  # share of the shadow that touches the plate if the model stands on a face; three tips touch with less
BROAD_BASE = 0.2  # a base of this share of the shadow is as good as any larger one
STEADY_MPA = 0.25 * ADHESION_MPA  # tension under a base with its brim; a larger one makes a stance no less steady


@dataclass(frozen=True)
class Footing:
    """How a model stands on the plate. base_share, touching_share: area of its base and area touching the plate, as shares of its
    shadow; lean_deg: the least angle by which it can be tilted before it tips over, negative if it tips over by itself;
    tension_mpa: the greatest tension under it; brimmed_mpa: that tension with a brim, whether or not the model would get one.
    """

    base_share: float
    touching_share: float
    lean_deg: float
    tension_mpa: float
    brimmed_mpa: float

    def held(self, of_file: bool = False) -> bool:
        """Whether the plate holds the model. of_file: in the orientation of its file. Such a model may tip over by itself by up
        to LEAN_DEG, since its brim still holds it; a reoriented model must have its centre of mass above its base.
        """
        if self.lean_deg >= LEAN_DEG and self.tension_mpa <= ADHESION_MPA:
            return True
        if self.torn_off or self.lean_deg < (-LEAN_DEG if of_file else 0.0):
            return False
        rests = self.lean_deg >= (0.0 if of_file else LEAN_DEG)
        return self.base_share >= (SMALL_BASE if rests else LEANING_BASE)

    @property
    def torn_off(self) -> bool:
        """Whether the nozzle's push tears the model off the plate in spite of a brim."""
        return self.brimmed_mpa > ADHESION_MPA

    @property
    def on_face(self) -> bool:
        """Whether at least the share FACE of the model's shadow touches the plate."""
        return self.touching_share >= FACE

    @property
    def on_tip(self) -> bool:
        """Whether the model stands on a point, an edge or a rounded end."""
        return self.touching_share < SMALL_BASE

    @property
    def narrow(self) -> float:
        """How much the base falls short of a broad one, 0 to 1."""
        return min(1.0, max(0.0, 1.0 - self.base_share / BROAD_BASE))

    @property
    def unsteady(self) -> float:
        """How close the tension under the base, with a brim, comes to STEADY_MPA, 0 to 1."""
        return min(1.0, max(0.0, self.brimmed_mpa / STEADY_MPA))


@dataclass(frozen=True, eq=False)
class BuildPlate:
    """The plate under a model: the model's mesh, (3 m,) the half-edge across each half-edge, its centre of mass and diameter, the
    width of the brim for a small base, and the density of the solid model.
    """

    mesh: Mesh
    across: Ints
    centre: Floats
    diameter_mm: float
    brim_mm: float
    density_g_cm3: float

    @classmethod
    def under(cls, mesh: Mesh, profile: Profile) -> "BuildPlate":
        """The plate under a mesh for a profile. Without a brim on a pedestal or a raft: these hold no better than the plate, and
        a brim would surround them.
        """
        process = profile.process
        stands_off = profile.search.pedestal_mm > 0.0 or process.raft_layers > 0
        brim_mm = 0.0 if stands_off else process.brim_mm or process.small_base_brim_mm
        return cls(mesh, opposites(mesh.faces), centre_of_mass(mesh), diameter_mm(mesh), brim_mm, profile.material.density_g_cm3)

    @cached_property
    def weight_n(self) -> float:
        """Weight of the model, printed solid, N."""
        return 1e-3 * self.density_g_cm3 * self.mesh.volume_mm3 * NEWTON_PER_G

    def footing(self, rotation: Floats) -> Footing:
        """How the model stands after a rotation (3, 3)."""
        turned, centre = np.column_stack([dot(self.mesh.vertices, row) for row in rotation]), rotation @ self.centre
        low, high = float(turned[:, 2].min()), float(turned[:, 2].max())
        half_mm = 0.5 * (high - low)
        touching_mm, blunt_mm = min(0.5 * PLATE_TOLERANCE_MM, half_mm), min(BLUNT * self.diameter_mm, half_mm)
        cuts_mm = low + np.array(sorted([touching_mm, blunt_mm]))
        areas = [CrossSection(loops, FillRule.Positive) for loops in loops_at(turned, self.mesh.faces, self.across, cuts_mm)]
        touching, base = areas[int(touching_mm > blunt_mm)], max(areas, key=CrossSection.area)
        brim = base.offset(self.brim_mm, JoinType.Round, circular_segments=BRIM_SEGMENTS) if self.brim_mm > 0.0 else base
        tensions = [_tension_mpa(section_edges(area), high - low, self.weight_n, centre[:2]) for area in (base, brim)]
        corners = section_edges(base)[:, :2] - centre[:2]
        lean_deg = tipping_angle_deg(corners, float(centre[2]) - low) if len(corners) else -90.0
        shadow_mm2 = 0.5 * float((np.abs(dot(self.mesh.normals, rotation[2])) * self.mesh.areas_mm2).sum())
        return Footing(base.area() / shadow_mm2, touching.area() / shadow_mm2, lean_deg, *tensions)

    def stance_bounds(self, rotations: Floats) -> tuple[Floats, Floats]:
        """(k,) upper bounds of the touching area, mm2, and (k,) of the lean, degrees, of the model turned by (k, 3, 3) rotations.

        The base lies within the hull's sections at the same heights, which take a tenth of the time. Rounding may lower a bound
        by 1e-5.
        """
        hull, rotations = convex_hull(self.mesh.vertices), np.ascontiguousarray(rotations)
        corners, above_mm = hull.vertices - self.centre, np.array([0.5 * PLATE_TOLERANCE_MM, BLUNT * self.diameter_mm])
        bounds = np.zeros((len(rotations), 2))
        in_threads(_measure_hull, len(rotations), (corners, hull.faces, above_mm), rotations, bounds)
        return bounds[:, 0], bounds[:, 1]


@kernel
def _measure_hull(begin: int, end: int, hull: tuple[Floats, Ints, Floats], rotations: Floats, out: Floats) -> None:
    """Area of a turned hull's section at the first of two heights above its lowest corner, mm2, and the angle by which it can be
    leaned before the origin passes the edge of either section, degrees; a section is no higher than the hull's middle. hull: its
    corners, its faces and the heights.
    """
    corners, faces, above_mm = hull
    turned, ends, reach = table(len(corners), 3), table(2, 2), floats(SIDES.shape[1], 0.0)
    for k in range(begin, end):
        lowest, highest = np.inf, -np.inf
        for v in range(len(corners)):
            for axis in range(3):
                turned[v, axis] = 0.0
                for j in range(3):
                    turned[v, axis] += rotations[k, axis, j] * corners[v, j]
            lowest, highest = min(lowest, turned[v, 2]), max(highest, turned[v, 2])
        out[k, 1] = -90.0
        for i in range(len(above_mm)):
            level, area_mm2 = lowest + min(above_mm[i], 0.5 * (highest - lowest)), 0.0
            for side in range(len(reach)):
                reach[side] = -np.inf
            for face in range(len(faces)):
                crossed = False
                for corner in range(3):
                    start, stop = faces[face, corner], faces[face, (corner + 1) % 3]
                    upward = turned[start, 2] < level
                    if upward == (turned[stop, 2] < level):
                        continue
                    crossed, row = True, 1 if upward else 0
                    share = (level - turned[start, 2]) / (turned[stop, 2] - turned[start, 2])
                    for axis in range(2):
                        ends[row, axis] = turned[start, axis] + share * (turned[stop, axis] - turned[start, axis])
                    for side in range(len(reach)):
                        reach[side] = max(reach[side], ends[row, 0] * SIDES[0, side] + ends[row, 1] * SIDES[1, side])
                if crossed:  # the triangle between the section's edge in this face and the origin
                    area_mm2 += 0.5 * (ends[0, 0] * ends[1, 1] - ends[0, 1] * ends[1, 0])
            if i == 0:
                out[k, 0] = area_mm2
            least_mm = np.inf
            for side in range(len(reach)):
                least_mm = min(least_mm, reach[side])
            out[k, 1] = max(out[k, 1], np.degrees(np.arctan2(least_mm, -lowest)))


def tips_over(base: CrossSection, height_mm: float) -> bool:
    """Whether the nozzle's push at a height, mm, would tear a base off the plate."""
    return _tension_mpa(section_edges(base), height_mm) > ADHESION_MPA


def section_edges(area: CrossSection) -> Floats:
    """(n, 4) the edges x, y, x, y of an area's outlines, the area on the left of each."""
    return loop_edges([np.asarray(loop) for loop in area.to_polygons()])


def _tension_mpa(edges: Floats, height_mm: float, weight_n: float = 0.0, centre: Floats | None = None) -> float:
    """Greatest tension in a contact, MPa; infinite if it has no area. centre (2,): point where the weight acts."""
    moments = section_moments(edges)
    area_mm2 = float(moments[AREA])
    if area_mm2 <= 0.0:
        return np.inf
    lever_mm = 0.0 if centre is None else float(np.linalg.norm(centre - moments[[X, Y]] / area_mm2))
    bending_n_mm = PUSH_N * height_mm + weight_n * lever_mm
    return bending_n_mm * float(greatest_stress_per_moment(edges)) - weight_n / area_mm2
