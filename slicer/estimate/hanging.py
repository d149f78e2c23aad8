"""Hanging: the support of a part from few thick layers, by the rules of the real ones."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from mdp.decomposition import Part
from mdp.mesh import Floats, Indices, Mesh
from mdp.overhang import PLATFORM_TOLERANCE_MM, Mask, threshold
from mdp.support_need.need import needs_support
from profiles.process import Process
from profiles.profile import Profile
from slicer.bead import spacing_mm
from slicer.geometry.cross_section import cross_sections
from slicer.geometry.polygons import Polygons, clean, edges
from slicer.heights import Heights
from slicer.overhangs import find_overhangs
from slicer.sections import Neighbours, Sections
from slicer.support.support import own_supports
from slicer.walls.brim import plate_outline

LAYERS = 40  # thick layers at most, and one above what hangs
COARSE_MM = 0.05  # sections are simplified by this
LEAST_MM = 0.5  # of a thick layer


@dataclass(frozen=True, eq=False)
class ThickSupport:
    """The support of a part's layers: which of the areas stands in each, -1 where none does, and whether it is dense there, as far
    as the part is near."""

    which: Indices
    closed: Mask
    areas: Sequence[Polygons]
    dense: Sequence[Polygons]


def thick_support(part: Part, heights: Heights, profile: Profile, later: Sequence[Part]) -> ThickSupport:
    """The support of a part; what it hands down to earlier ones is not looked at."""
    process, mesh, on_platform, count = profile.process, part.in_part_frame(), part.index == 1, len(heights.tip_mm)
    risky = _hanging(mesh, process, on_platform)
    hanging_mm2 = -float((mesh.normals[risky, 2] * mesh.areas_mm2[risky]).sum())
    if process.support == "none" or hanging_mm2 <= process.support_least_mm2:
        return ThickSupport(np.full(count, -1), np.zeros(count, np.bool_), (), ())
    top_mm = float(mesh.vertices[mesh.faces[risky], 2].max())
    thick = _thick_layers(float(heights.tip_mm[0]), top_mm, 0.5 * float(heights.height_mm.min()))
    outlines = [clean(loops, 0.0).simplify(COARSE_MM) for loops in cross_sections(mesh, thick.cut_mm)]
    # A thick layer stands for what hangs anywhere in it: the gaps, less than half a thick layer, are lost in that.
    coarse = {"support_interface_layers": 2, "support_bottom_interface_layers": 1, "support_gap_mm": 0.0, "support_bottom_gap_mm": 0.0}
    sections = Sections(
        part=part,
        earlier=(),
        later=later,
        profile=profile.model_copy(update={"process": process.model_copy(update=coarse)}),
        mesh=mesh,
        heights=thick,
        outlines=outlines,
        own=outlines,
        ungrooved=outlines,
        neighbours=Neighbours([Polygons()] * len(outlines)),
        plastic_below=None if on_platform else outlines[0],
        plate=plate_outline(profile.machine.table),
    )
    supports = own_supports(sections, find_overhangs(sections))
    which = np.searchsorted(thick.tip_mm, heights.cut_mm)
    tops = np.append(thick.tip_mm, np.inf)[which]
    roof_mm = process.support_interface_layers * process.layer_height_mm
    which = np.where(which < len(outlines), which, -1)
    return ThickSupport(which, tops - heights.cut_mm < roof_mm, supports.areas, supports.dense)


def support_lengths_mm(support: ThickSupport, heights: Heights, process: Process, on_platform: bool) -> Floats:
    """(n, 2) sparse and dense lines of the support of every layer of a part."""
    extents = np.zeros((len(support.areas) + 1, 3))
    for k, (area, dense) in enumerate(zip(support.areas, support.dense, strict=True)):
        extents[k] = area.area(), _around_mm(area), dense.area()
    area, around, close = extents[support.which].T
    spacing = spacing_mm(process.support_line_width_mm or process.line_width_mm, heights.height_mm)
    walls_mm, density = process.support_walls * around, np.full(len(area), process.support_density)
    if on_platform:
        density[0] = process.support_foot_density
    inside = np.maximum(area - walls_mm * spacing, 0.0)
    dense = np.minimum(np.where(support.closed, close, 0.0), inside)
    return np.column_stack([walls_mm + (inside - dense) * density / spacing, dense * process.support_interface_density / spacing])


def _around_mm(area: Polygons) -> float:
    sides = edges(area)
    return float(np.hypot(sides[:, 2] - sides[:, 0], sides[:, 3] - sides[:, 1]).sum())


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
