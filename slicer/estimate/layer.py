"""Layer: what single layers of a part take, sliced as for a print, but for what lies far from them."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from mdp.decomposition import Part
from mdp.mesh import Floats, Indices
from profiles.profile import Profile
from slicer.bead import with_line_width
from slicer.estimate.duration import line_s, retraction_s, strokes_s
from slicer.estimate.hanging import ThickSupport
from slicer.fill.infill import pattern_density
from slicer.fill.region import Cover, Region, regions, shell_layers
from slicer.geometry.polygons import Polygons, union
from slicer.heights import Heights
from slicer.interface.cut_walls import CutWalls, cut_walls
from slicer.interface.model import Model, model_around
from slicer.layer_beads import lay_beads
from slicer.paths import Kind, bead_area_mm2
from slicer.sectioning import section_layers
from slicer.sections import Neighbours, Sections
from slicer.shells import Shell, Shells, layer_processes
from slicer.strokes.order import order_beads
from slicer.strokes.overhanging import split_overhangs, strengthen_overhangs
from slicer.strokes.pieces import in_pieces
from slicer.strokes.seam import NO_LIMITS, NO_SEAMS, Surroundings, place_seams, rear_of
from slicer.strokes.speed import axes_mm_s2, first_layer_speeds, speeds_mm_s
from slicer.strokes.strokes import Strokes
from slicer.strokes.travels import travels
from slicer.support.support import Supports

SUPPORT = (Kind.SUPPORT, Kind.SUPPORT_INTERFACE)
DENSITY_LAYERS = 3


def sections_near(part: Part, profile: Profile, heights: Heights, layers: Indices, later: Sequence[Part]) -> Sections:
    """The sections of a part's layers, empty but for the lowest, the highest, some layers and as many beside them as shells look."""
    top, bottom = shell_layers(profile.of_part(part.index).process)
    count = len(heights.tip_mm)
    near = layers[:, None] + np.arange(-max(bottom, 1) - 1, max(top, 1) + 2)
    kept = np.unique(np.clip(np.append(near, [0, count - 1]), 0, count - 1))
    some = section_layers(part, profile, heights[kept], (), later)

    def spread(places: Sequence[Polygons]) -> list[Polygons]:
        spread = [Polygons()] * count
        for layer, place in zip(kept.tolist(), places, strict=True):
            spread[layer] = place
        return spread

    around = some.neighbours
    own = spread(some.own)
    return replace(
        some,
        heights=heights,
        outlines=own if some.outlines is some.own else spread(some.outlines),
        own=own,
        ungrooved=own if some.ungrooved is some.own else spread(some.ungrooved),
        neighbours=replace(around, beside=spread(around.beside)),
        pedestal_layers=int(np.searchsorted(heights.tip_mm, float(some.heights.tip_mm[max(some.pedestal_layers - 1, 0)]) + 1e-6)) if some.pedestal_layers else 0,
        too_thin=frozenset(),
    )


def sliced_layers(sections: Sections, support: ThickSupport, layers: Indices) -> Floats:
    """(n, 3) seconds, mm3 and mm3 of support of each of some layers."""
    shells = _shells(sections, support, layers)
    return np.array([_taken(shells, layer) for layer in layers.tolist()]).reshape(-1, 3)


def _shells(sections: Sections, support: ThickSupport, layers: Indices) -> Shells:
    process, nozzle_mm = sections.process, sections.profile.machine.head.nozzle_mm
    count, empty = len(sections.outlines), Polygons()
    none = Region(empty, empty, empty, empty, empty)
    processes = layer_processes(process, sections.on_platform, count)
    model = model_around(sections)
    shells: list[Shell | None] = [None] * count
    areas, dense = [empty] * count, [empty] * count
    for layer in layers.tolist():
        own, height_mm = processes[layer], float(sections.heights.height_mm[layer])
        [own] = strengthen_overhangs([own], [sections.own[layer]], sections.below(layer))
        walled = cut_walls(sections.own[layer], model.sections[layer], own, height_mm=height_mm, nozzle_mm=nozzle_mm, usual=process.walls)
        below = none
        if layer:
            below = _region(sections, model, walled, layer - 1)
        shells[layer] = Shell(own, walled.walls, walled.ending, _region(sections, model, walled, layer), (), empty)
        if layer and shells[layer - 1] is None:
            shells[layer - 1] = replace(shells[layer], region=below)
        if support.which[layer] >= 0:
            areas[layer] = support.areas[support.which[layer]]
            dense[layer] = support.dense[support.which[layer]] if support.closed[layer] else empty
    nothing = [empty] * count
    sparse = [shells[layer].region.sparse for layer in layers.tolist()]
    sparse = [area for area in sparse if not area.is_empty()]
    infill = with_line_width(process, process.infill_line_width_mm)
    density = pattern_density(sparse[:: max(len(sparse) // DENSITY_LAYERS, 1)], infill, process.layer_height_mm)
    return Shells(Supports(sections, areas, dense, nothing, nothing, nothing), shells, density)


def _region(sections: Sections, model: Model, walled: CutWalls, layer: int) -> Region:
    process = sections.process
    top, bottom = shell_layers(process)
    whole = [mine if other is None else other for mine, other in zip(sections.own, model.sections, strict=True)]
    above = [*whole[layer + 1 : layer + 1 + top], *model.above][:top]
    below = [*whole[max(layer - bottom, 0) : layer][::-1], *model.below][:bottom]
    reach = process.interface_top_layers
    later = (union(list(model.others[max(layer - reach, 0) : layer + reach + 1])),) if model.is_cut else ()
    cover = Cover([whole[layer]], [walled.model_inside], below, above, later)
    [region] = regions([walled.walls.inside], cover, not sections.on_platform and layer < process.interface_bottom_layers, process)
    return region


def _taken(shells: Shells, layer: int) -> tuple[float, float, float]:
    sections, shell = shells.sections, shells.layers[layer]
    profile, process, heights = sections.profile, shell.process, sections.heights
    height_mm, outline, support = float(heights.height_mm[layer]), sections.outlines[layer], shells.supports.areas[layer]
    own, auxiliary = lay_beads(shells, layer)
    around = Surroundings(rear_of(sections.mesh.bounds_mm), NO_SEAMS, rear_of(sections.mesh.bounds_mm), NO_LIMITS, layer, NO_SEAMS)
    beads, _ = place_seams([*own, *auxiliary], process, around)
    beads += shell.ending
    if not beads:
        return 0.0, 0.0, 0.0
    strokes = order_beads(beads, outline, process, beads[0].points[0], support)
    strokes = in_pieces(split_overhangs(strokes, outline, sections.below(layer), process), height_mm)
    fixed, flow = None, profile.material.flow
    if layer == 0:
        fixed = first_layer_speeds(sections.process, sections.on_platform)
        flow *= sections.process.first_layer_flow if sections.on_platform else sections.process.interface_flow
    speeds = speeds_mm_s(strokes, profile, height_mm, fixed, flow)
    mm3 = strokes.lengths_mm * bead_area_mm2(strokes.width_mm, height_mm) * strokes.flow * flow
    time_s = strokes_s(strokes, speeds, profile, layer == 0 and sections.on_platform) + _change_s(strokes, sections, support, outline)
    return time_s, float(mm3.sum()), float(mm3[strokes.is_of(*SUPPORT)].sum())


def _change_s(strokes: Strokes, sections: Sections, support: Polygons, outline: Polygons) -> float:
    """Seconds of the way from a layer's end to the beginning of the next one, which is taken to be like its own."""
    profile, process = sections.profile, sections.process
    since, to = strokes.last_points[-1:], strokes.first_points[:1]
    retracts, _ = travels(since, to, outline, support, process)
    way_s = line_s(float(np.hypot(*(to - since)[0])), process.travel_speed_mm_s, axes_mm_s2(profile))
    rise_s = line_s(process.layer_height_mm, process.lift_speed_mm_s, profile.machine.z.acceleration_mm_s2)
    return way_s + (retraction_s(profile) if retracts[0] else rise_s)
