"""Hanging: the support of a part from few thick layers, by the rules of the real ones."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from mdp.decomposition import Part
from mdp.mesh import Indices, Mesh
from mdp.overhang import PLATFORM_TOLERANCE_MM, Mask, threshold
from mdp.support_need.need import needs_support
from profiles.process import Process
from profiles.profile import Profile
from slicer.bead import spacing_mm, with_line_width
from slicer.estimate.rough import Rough
from slicer.geometry.cross_section import cross_sections
from slicer.geometry.polygons import Polygons, clean, edges
from slicer.heights import Heights
from slicer.overhangs import find_overhangs
from slicer.paths import bead_area_mm2
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
    coarse = {"support_interface_layers": 1, "support_bottom_interface_layers": 1, "support_gap_mm": 0.0, "support_bottom_gap_mm": 0.0}
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


def rough_support(support: ThickSupport, heights: Heights, process: Process) -> Rough:
    """What the layers of a part take for its support."""
    width, high = process.support_line_width_mm or process.line_width_mm, heights.height_mm
    extents = np.array([(area.area(), _around_mm(area), dense.area()) for area, dense in zip(support.areas, support.dense, strict=True)])
    area, around, dense = np.vstack([extents.reshape(-1, 3), np.zeros(3)])[support.which].T
    dense = np.where(support.closed, dense, 0.0)
    spacing = spacing_mm(width, high)
    walls_mm = process.support_walls * around
    inside = np.maximum(area - walls_mm * spacing, 0.0)
    dense = np.minimum(dense, inside)
    sparse_mm, dense_mm = walls_mm + (inside - dense) * process.support_density / spacing, dense * process.support_interface_density / spacing
    time_s = sparse_mm / process.support_speed_mm_s + dense_mm / process.support_interface_speed_mm_s
    return Rough(time_s, (sparse_mm + dense_mm) * bead_area_mm2(width, high))


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
