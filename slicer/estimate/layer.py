"""Layer: what single layers of a part take, sliced as for a print, but for what lies far from them."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from mdp.decomposition import Part
from mdp.mesh import Floats, Indices
from profiles.profile import Profile
from slicer.bead import with_line_width
from slicer.estimate.duration import strokes_s
from slicer.estimate.hanging import ThickSupport
from slicer.fill.infill import pattern_density
from slicer.fill.region import Cover, Region, beside_cuts, shell_layers, solid_bottom_layers, sparse_area, split_inside
from slicer.geometry.polygons import Polygons
from slicer.interface.cut_walls import CutWalls, cut_walls
from slicer.interface.model import Model, model_around
from slicer.layer_beads import lay_beads
from slicer.paths import Kind, bead_area_mm2
from slicer.sectioning import heights_of, section_layers
from slicer.sections import Neighbours, Sections
from slicer.shells import Shell, Shells, layer_processes
from slicer.strokes.order import order_beads
from slicer.strokes.overhanging import split_overhangs, strengthen_overhangs
from slicer.strokes.pieces import in_pieces
from slicer.strokes.seam import NO_LIMITS, NO_SEAMS, Surroundings, place_seams, rear_of
from slicer.strokes.speed import first_layer_speeds, speeds_mm_s
from slicer.support.support import Supports

SUPPORT = (Kind.SUPPORT, Kind.SUPPORT_INTERFACE)
DENSITY_LAYERS = 3


def sections_near(part: Part, profile: Profile, layers: Indices, later: Sequence[Part]) -> Sections:
    """The sections of a part's layers, empty but for the lowest, the highest, some layers and as many beside them as shells look."""
    top, bottom = shell_layers(profile.of_part(part.index).process)
    heights = heights_of(part, profile, later)
    count = len(heights.tip_mm)
    near = layers[:, None] + np.array([*_steps(top, bottom), -1, 0, 1, top])
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


def _steps(top: int, bottom: int) -> tuple[int, ...]:
    """Which layers above and below one tell how far it is covered: the farthest of its shells but one, which the layer below asks
    for, too, and what is next to it."""
    return tuple({min(1, top - 1), top - 1, -bottom} - {0, -1} if top else {-bottom} - {0})


def sliced_layers(sections: Sections, support: ThickSupport, layers: Indices) -> Floats:
    """(n, 3) seconds, mm3 and mm3 of support of each of some layers."""
    shells = _shells(sections, support, layers)
    tip, taken = rear_of(sections.mesh.bounds_mm), []
    for layer in layers.tolist():
        figures, tip = _taken(shells, layer, tip)
        taken.append(figures)
    return np.array(taken)


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
        region, lower = _region(sections, model, walled, layer)
        shells[layer] = Shell(own, walled.walls, walled.ending, region, (), empty)
        if layer and shells[layer - 1] is None:
            shells[layer - 1] = replace(shells[layer], region=replace(none, sparse=lower))
        areas[layer] = support.areas[support.which[layer]]
        dense[layer] = support.dense[support.which[layer]] if support.closed[layer] else empty
    nothing = [empty] * count
    sparse = [shells[layer].region.sparse for layer in layers.tolist()]
    sparse = [area for area in sparse if not area.is_empty()]
    infill = with_line_width(process, process.infill_line_width_mm)
    density = pattern_density(sparse[:: max(len(sparse) // DENSITY_LAYERS, 1)], infill, process.layer_height_mm)
    return Shells(Supports(sections, areas, dense, nothing, nothing, nothing), shells, density)


def _region(sections: Sections, model: Model, walled: CutWalls, layer: int) -> tuple[Region, Polygons]:
    """The region of a layer, and what is sparse of the one below."""
    process, inside = sections.process, walled.walls.inside
    top, bottom = shell_layers(process)

    def at(number: int) -> Polygons:
        """The model in a layer."""
        if 0 <= number < len(sections.own):
            return sections.own[number] if model.sections[number] is None else model.sections[number]
        beyond, k = (model.below, -1 - number) if number < 0 else (model.above, number - len(sections.own))
        return beyond[k] if k < len(beyond) else Polygons()

    if inside.is_empty():
        return Region(*(Polygons(),) * 5), Polygons()
    shared = walled.model_inside
    for step in _steps(top, bottom):
        shared = shared ^ at(layer + step)
    lower = sparse_area(walled.model_inside, shared, at(layer) if top else shared, process)
    uncut = sparse_area(walled.model_inside, shared ^ at(layer + top) if top else shared, at(layer - 1) if bottom else shared, process)
    if not sections.on_platform and layer < solid_bottom_layers(process):
        sparse = Polygons()
    else:
        cover = Cover((), [walled.model_inside] * (layer + 1), (), (), model.others if model.is_cut else ())
        sparse = beside_cuts(inside, uncut, cover, layer, process)
    return split_inside(inside, sparse, uncut, at(layer + 1) if top else inside, process), lower ^ inside


def _taken(shells: Shells, layer: int, tip: Floats) -> tuple[tuple[float, float, float], Floats]:
    sections, shell = shells.sections, shells.layers[layer]
    profile, process, heights = sections.profile, shell.process, sections.heights
    height_mm, outline, support = float(heights.height_mm[layer]), sections.outlines[layer], shells.supports.areas[layer]
    own, auxiliary = lay_beads(shells, layer)
    around = Surroundings(rear_of(sections.mesh.bounds_mm), NO_SEAMS, tip, NO_LIMITS, layer, NO_SEAMS)
    beads, _ = place_seams([*own, *auxiliary], process, around)
    beads += shell.ending
    if not beads:
        return (0.0, 0.0, 0.0), tip
    strokes = order_beads(beads, outline, process, tip, support)
    strokes = in_pieces(split_overhangs(strokes, outline, sections.below(layer), process), height_mm)
    fixed, flow = None, profile.material.flow
    if layer == 0:
        fixed = first_layer_speeds(sections.process, sections.on_platform)
        flow *= sections.process.first_layer_flow if sections.on_platform else sections.process.interface_flow
    speeds = speeds_mm_s(strokes, profile, height_mm, fixed, flow)
    mm3 = strokes.lengths_mm * bead_area_mm2(strokes.width_mm, height_mm) * strokes.flow * flow
    time_s = strokes_s(strokes, speeds, tip, profile, layer == 0 and sections.on_platform)
    return (time_s, float(mm3.sum()), float(mm3[strokes.is_of(*SUPPORT)].sum())), strokes.points[-1, :2]
