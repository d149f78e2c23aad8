"""Hanging: the support of a part from few thick layers, by the rules of the real ones."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from mdp.decomposition import Part
from mdp.mesh import Floats, Indices
from mdp.overhang import PLATFORM_TOLERANCE_MM, Mask, threshold
from mdp.support_need.need import needs_support
from mdp.topology.cross_section import cross_sections
from profiles.process import Process
from profiles.profile import Profile
from slicer.bead import spacing_mm
from slicer.geometry.polygons import Polygons, clean, edges
from slicer.heights import Heights, part_heights
from slicer.interface.interface import plastic_below
from slicer.overhangs import find_overhangs
from slicer.sectioning import Sections, no_support_areas, plate_outline, vase_profile
from slicer.support.handed_down import plan_supports
from slicer.support.support import Supports, own_supports

LAYERS = 36  # thick layers at most, and one above what hangs
COARSE_MM = 0.05  # sections are simplified by this
LEAST_MM = 0.4  # of a thick layer


@dataclass(frozen=True, eq=False)
class ThickSupport:
    """The support of a part's layers, which go up as far as it does: which of the areas stands in each, the last one, which is
    empty, where none does; and whether it is dense there, as far as the part is near."""

    heights: Heights
    which: Indices
    closed: Mask
    areas: Sequence[Polygons]
    dense: Sequence[Polygons]


def thick_supports(parts: Sequence[Part], profile: Profile) -> list[ThickSupport]:
    """The support of every part of a print. Raises SliceError where a part is too high to be meant."""
    profiles = [vase_profile(profile.of_part(part.index)) for part in parts]
    heights = [part_heights(part, parts[k + 1 :], own) for k, (part, own) in enumerate(zip(parts, profiles, strict=True))]
    tops = [_hanging_up_to_mm(part, own.process) for part, own in zip(parts, profiles, strict=True)]
    plain = [
        ThickSupport(own, np.zeros(len(own.tip_mm), np.int64), np.zeros(len(own.tip_mm), np.bool_), [Polygons()], [Polygons()])
        for own in heights
    ]
    if not any(tops):
        return plain
    reach = len(parts) if any(tops[1:]) else 1  # of a later part's support some may have to be printed with an earlier one
    sections = []
    for k, (own, top_mm) in enumerate(zip(profiles[:reach], tops, strict=False)):
        top_mm = float(heights[k].tip_mm[-1]) if any(tops[k + 1 :]) else top_mm
        thick = _thick_layers(float(heights[k].tip_mm[0]), top_mm, 0.5 * float(heights[k].height_mm.min()))
        sections.append(_thick_sections(parts, k, own, thick))
    planned = plan_supports([own_supports(layers, find_overhangs(layers)) for layers in sections])
    return [_of_layers(*row) for row in zip(heights, planned, profiles, strict=False)] + plain[reach:]


def _thick_sections(parts: Sequence[Part], k: int, profile: Profile, thick: Heights) -> Sections:
    part, process = parts[k], profile.process
    mesh = part.in_part_frame()
    outlines = [clean(loops, 0.0).simplify(COARSE_MM) for loops in cross_sections(mesh, thick.cut_mm)]
    # A thick layer stands for what hangs anywhere in it: the gaps, less than half a thick layer, are lost in that.
    coarse = {
        "layer_height_mm": float(thick.height_mm[-1]),
        "support_interface_layers": 2,
        "support_bottom_interface_layers": 1,
        "support_gap_mm": 0.0,
        "support_bottom_gap_mm": 0.0,
    }
    return Sections(
        part=part,
        earlier=parts[:k],
        later=parts[k + 1 :],
        profile=profile.model_copy(update={"process": process.model_copy(update=coarse)}),
        mesh=mesh,
        heights=thick,
        outlines=outlines,
        own=outlines,
        ungrooved=outlines,
        beside=[Polygons()] * len(outlines),
        plastic_below=plastic_below(part, parts[:k], outlines[0]),
        plate=plate_outline(profile.machine.table),
        no_support=no_support_areas(part, mesh, thick.cut_mm),
    )


def _of_layers(heights: Heights, support: Supports, profile: Profile) -> ThickSupport:
    """The support of layers from that of thick ones."""
    process, tips_mm = profile.process, support.sections.heights.tip_mm
    standing = [float(tips_mm[k]) for k, area in enumerate(support.areas) if not area.is_empty()]
    heights = heights.up_to(max(standing, default=0.0), process.layer_height_mm)
    which = np.searchsorted(tips_mm, heights.cut_mm)
    closed = np.append(tips_mm, np.inf)[which] - heights.cut_mm < process.support_interface_layers * process.layer_height_mm
    return ThickSupport(heights, which, closed, [*support.areas, Polygons()], [*support.dense, Polygons()])


def support_lengths_mm(support: ThickSupport, process: Process, on_platform: bool) -> Floats:
    """(n, 2) sparse and dense lines of the support of every layer of a part."""
    extents = np.array(
        [(area.area(), _around_mm(area), dense.area()) for area, dense in zip(support.areas, support.dense, strict=True)]
    )
    area, around, close = extents[support.which].T
    spacing = spacing_mm(process.support_line_width_mm or process.line_width_mm, process.layer_height_mm)
    walls_mm, density = process.support_walls * around, np.full(len(area), process.support_density)
    if on_platform:
        density[0] = process.support_foot_density
    inside = np.maximum(area - walls_mm * spacing, 0.0)
    dense = np.minimum(np.where(support.closed, close, 0.0), inside)
    return np.column_stack([walls_mm + (inside - dense) * density / spacing, dense * process.support_interface_density / spacing])


def _around_mm(area: Polygons) -> float:
    sides = edges(area)
    return float(np.hypot(sides[:, 2] - sides[:, 0], sides[:, 3] - sides[:, 1]).sum())


def _hanging_up_to_mm(part: Part, process: Process) -> float:
    """The height of the highest risky face of a part that needs support and does not rest on its base plane; 0: there is none."""
    if process.support == "none":
        return 0.0
    mesh, on_platform = part.in_part_frame(), part.index == 1
    lifted = mesh.vertices[mesh.faces, 2].max(axis=1) > PLATFORM_TOLERANCE_MM
    down = mesh.normals[:, 2] < threshold(process.self_supporting_angle_deg)
    risky = down & lifted & needs_support(mesh, process, on_platform)
    hanging_mm2 = -float((mesh.normals[risky, 2] * mesh.areas_mm2[risky]).sum())
    return float(mesh.vertices[mesh.faces[risky], 2].max()) if hanging_mm2 > process.support_least_mm2 else 0.0


def _thick_layers(first_mm: float, top_mm: float, over_mm: float) -> Heights:
    """Few equal layers over the first one up to a height, and one that is cut so much above it, where what hangs there begins."""
    count = int(np.clip((top_mm - first_mm) / LEAST_MM, 1, LAYERS)) if top_mm > first_mm else 0
    tips = first_mm + (top_mm - first_mm) * np.arange(count + 2 if count else 1) / max(count, 1)
    thick = np.diff(tips, prepend=0.0)
    cuts = tips - 0.5 * thick
    if count:
        cuts[-1] = min(cuts[-1], top_mm + over_mm)
    return Heights(tips, thick, cuts)
