"""Hanging: the support of a part from few thick layers, by the rules of the real ones."""

from dataclasses import dataclass

import numpy as np

from mdp.decomposition import Part
from mdp.mesh import Floats, Mesh
from mdp.overhang import PLATFORM_TOLERANCE_MM, Mask, threshold
from mdp.support_need.need import needs_support
from profiles.process import Process
from profiles.profile import Profile
from slicer.estimate.shell import NOTHING, Extent, extent_of
from slicer.geometry.cross_section import cross_sections
from slicer.geometry.polygons import Polygons, clean, contours, offset
from slicer.heights import Heights
from slicer.overhangs import find_overhangs
from slicer.sections import Sections
from slicer.support.support import own_supports
from slicer.zones import no_support_areas

LAYERS = 50  # thick layers at most, and one above what hangs: on thin limbs 40 lost up to 0.3 of the support that 60 find
COARSE_MM = 0.05  # sections are simplified by this
LEAST_MM = 0.7  # of a thick layer


@dataclass(frozen=True, eq=False)
class ThickSupport:
    """Support in thick layers: their tops, (k,) mm, what stands in each of them and what of it touches the part; foot: the
    lowest one's.
    """

    tip_mm: Floats
    height_mm: Floats
    areas: tuple[Extent, ...]
    contacts: tuple[Extent, ...]
    walls: tuple[tuple[Floats, ...], ...]
    foot: Polygons

    def at(self, z_mm: float) -> int | None:
        """The thick layer at a height, None where there is none."""
        k = int(np.searchsorted(self.tip_mm, z_mm))
        return k if k < len(self.areas) and self.areas[k] is not NOTHING else None


def thick_support(part: Part, heights: Heights, profile: Profile, plate: Polygons) -> ThickSupport:
    """The support of a part; parts printed later are not looked at."""
    process, mesh, on_platform = profile.process, part.in_part_frame(), part.index == 1
    risky = _hanging(mesh, process, on_platform)
    hanging_mm2 = -float((mesh.normals[risky, 2] * mesh.areas_mm2[risky]).sum())
    if process.support == "none" or hanging_mm2 <= process.support_least_mm2:
        return ThickSupport(np.zeros(0), np.zeros(0), (), (), (), Polygons())
    top_mm = float(mesh.vertices[mesh.faces[risky], 2].max())
    thick = _thick_layers(float(heights.tip_mm[0]), top_mm, 0.5 * float(heights.height_mm.min()))
    outlines = [clean(loops, 0.0).simplify(COARSE_MM) for loops in cross_sections(mesh, thick.cut_mm)]
    single = process.model_copy(update={"support_interface_layers": 1, "support_bottom_interface_layers": 1})
    sections = Sections(
        part=part,
        earlier=(),
        later=(),
        profile=profile.model_copy(update={"process": single}),
        mesh=mesh,
        heights=thick,
        outlines=outlines,
        own=outlines,
        ungrooved=outlines,
        beside=[Polygons()] * len(outlines),
        plastic_below=None if on_platform else outlines[0],
        plate=plate,
        no_support=no_support_areas(part, mesh, thick.cut_mm),
    )
    supports = own_supports(sections, find_overhangs(sections))
    areas, contacts = tuple(map(extent_of, supports.areas)), tuple(map(extent_of, supports.dense))
    half_mm = 0.5 * sections.support_process.line_width_mm
    walls = tuple(tuple(contours(offset(area, -half_mm))) for area in supports.areas)
    return ThickSupport(thick.tip_mm, thick.height_mm, areas, contacts, walls, supports.areas[0])


def _hanging(mesh: Mesh, process: Process, on_platform: bool) -> Mask:
    """(m,) risky faces that need support, without those that rest on the base plane."""
    lifted = mesh.vertices[mesh.faces, 2].max(axis=1) > PLATFORM_TOLERANCE_MM
    down = mesh.normals[:, 2] < threshold(process.self_supporting_angle_deg)
    risky: Mask = down & lifted & needs_support(mesh, process, on_platform)
    return risky


def _thick_layers(first_mm: float, top_mm: float, over_mm: float) -> Heights:
    """Few equal layers over the first one up to a height, and one that is cut so much above it, where what hangs there begins."""
    count = int(np.clip((top_mm - first_mm) / LEAST_MM, 1, LAYERS)) if top_mm > first_mm else 0
    tips = first_mm + (top_mm - first_mm) * np.arange(count + 2 if count else 1) / max(count, 1)
    thick = np.diff(tips, prepend=0.0)
    cuts = tips - 0.5 * thick
    if count:
        cuts[-1] = min(cuts[-1], top_mm + over_mm)
    return Heights(tips, thick, cuts)
