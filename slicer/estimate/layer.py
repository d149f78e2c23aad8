"""Layer: what single layers of a part take, sliced as for a print.

Left out is what single layers do not tell: bridges, ironing, skin under walls that begin soon, what is poured into grooves and
pins; and seams are where the layer alone would have them.
"""

from collections.abc import Mapping, Sequence
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
from slicer.sections import Sections
from slicer.shells import Shell, Shells, layer_processes
from slicer.strokes.order import order_beads
from slicer.strokes.overhanging import split_overhangs, strengthen_overhangs
from slicer.strokes.pieces import in_pieces
from slicer.strokes.seam import NO_LIMITS, NO_SEAMS, Surroundings, place_seams, rear_of
from slicer.strokes.speed import first_layer_speeds, speeds_mm_s
from slicer.support.pedestal import pedestal_layers
from slicer.support.support import Supports
from slicer.walls.walls import Walls

SUPPORT = (Kind.SUPPORT, Kind.SUPPORT_INTERFACE)


def sections_near(part: Part, profile: Profile, layers: Indices, later: Sequence[Part]) -> Sections:
    """The sections of a part's layers, empty but for the lowest, the highest, some layers and those that decide where these are
    solid. later: the parts printed after it."""
    top, bottom = shell_layers(profile.of_part(part.index).process)
    heights = heights_of(part, profile, later)
    count = len(heights.tip_mm)
    near = layers[:, None] + np.array([*_steps(top, bottom), -1, 0, 1, top])
    kept = np.unique(np.clip(np.append(near, [0, count - 1]), 0, count - 1))
    some = section_layers(part, profile, heights[kept], (), later)

    def spread(places: Sequence[Polygons]) -> list[Polygons]:
        everywhere = [Polygons()] * count
        for layer, place in zip(kept.tolist(), places, strict=True):
            everywhere[layer] = place
        return everywhere

    own = spread(some.own)
    pedestal_mm = float(some.heights.tip_mm[some.pedestal_layers - 1]) if some.pedestal_layers else 0.0
    return replace(
        some,
        heights=heights,
        outlines=own if some.outlines is some.own else spread(some.outlines),
        own=own,
        ungrooved=own if some.ungrooved is some.own else spread(some.ungrooved),
        neighbours=replace(some.neighbours, beside=spread(some.neighbours.beside)),
        pedestal_layers=pedestal_layers(heights.tip_mm, pedestal_mm),
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
    """The shells of some layers; those of the others are not there, but for what is sparse below one of them."""
    process, nozzle_mm, model = sections.process, sections.profile.machine.head.nozzle_mm, model_around(sections)
    empty = Polygons()
    nothing = [empty] * len(sections.outlines)
    processes = layer_processes(process, sections.on_platform, len(nothing))
    no_shell = Shell(process, Walls((), empty, empty), (), Region(*[empty] * 5), (), empty)
    shells, areas, dense, filled = [no_shell] * len(nothing), list(nothing), list(nothing), list[Polygons]()
    for layer in layers.tolist():
        [own] = strengthen_overhangs([processes[layer]], [sections.own[layer]], sections.below(layer))
        sides = {"height_mm": float(sections.heights.height_mm[layer]), "nozzle_mm": nozzle_mm}
        walled = cut_walls(sections.own[layer], model.sections[layer], own, **sides, usual=process.walls)
        region, lower = _region(sections, model, walled, layer)
        shells[layer] = Shell(own, walled.walls, walled.ending, region, (), empty)
        if layer and shells[layer - 1] is no_shell:
            shells[layer - 1] = replace(no_shell, region=replace(no_shell.region, sparse=lower))
        areas[layer] = support.areas[support.which[layer]]
        dense[layer] = support.dense[support.which[layer]] if support.closed[layer] else empty
        filled += [region.sparse] if not region.sparse.is_empty() else []
    infill = with_line_width(process, process.infill_line_width_mm)
    density = pattern_density(filled[len(filled) // 2 :][:1], infill, process.layer_height_mm)
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
        return Region(*[Polygons()] * 5), Polygons()
    shared = walled.model_inside
    for step in _steps(top, bottom):
        shared = shared ^ at(layer + step)
    lower = sparse_area(walled.model_inside, shared, at(layer) if top else shared, process)
    uncut = sparse_area(
        walled.model_inside, shared ^ at(layer + top) if top else shared, at(layer - 1) if bottom else shared, process
    )
    if not sections.on_platform and layer < solid_bottom_layers(process):
        sparse = Polygons()
    else:
        cover = Cover((), [walled.model_inside] * (layer + 1), (), (), model.others if model.is_cut else ())
        sparse = beside_cuts(inside, uncut, cover, layer, process)
    return split_inside(inside, sparse, uncut, at(layer + 1) if top else inside, process), lower ^ inside


def _taken(shells: Shells, layer: int, tip: Floats) -> tuple[tuple[float, float, float], Floats]:
    """Seconds, mm3 and mm3 of support of a layer, and where it ends. tip: (2,) where the one before ended."""
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
    fixed: Mapping[Kind, float] | None = None
    flow = profile.material.flow
    if layer == 0:
        fixed = first_layer_speeds(sections.process, sections.on_platform)
        flow *= sections.process.first_layer_flow if sections.on_platform else sections.process.interface_flow
    speeds = speeds_mm_s(strokes, profile, height_mm, fixed, flow)
    mm3 = strokes.lengths_mm * bead_area_mm2(strokes.width_mm, height_mm) * strokes.flow * flow
    time_s = strokes_s(strokes, speeds, tip, profile, layer == 0 and sections.on_platform)
    return (time_s, float(mm3.sum()), float(mm3[strokes.is_of(*SUPPORT)].sum())), strokes.points[-1, :2]
