"""Layer: seconds and plastic of single layers of a part, sliced as for a print.

Bridges, ironing, skin under walls that begin a few layers higher and pins are left out: they depend on other layers. Seams lie
where the layer alone would have them.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from mdp.decomposition import Part
from mdp.mesh import Floats, Indices
from profiles.profile import Profile
from slicer.bead import Bead, with_line_width
from slicer.estimate.duration import strokes_s
from slicer.estimate.hanging import ThickSupport
from slicer.fill.infill import pattern_density
from slicer.fill.region import Cover, Region, region_of, sparse_area
from slicer.geometry.polygons import Polygons
from slicer.heights import Heights, pedestal_layers, shell_layers
from slicer.paths import bead_area_mm2
from slicer.sectioning import Sections, section_part
from slicer.shells import Shell, Shells, cover, cut_walls, lay_beads, layer_processes, model_sections, strengthen_overhangs
from slicer.slice import order_layer
from slicer.strokes.order import SUPPORTS
from slicer.strokes.seam import NO_SEAMS, Surroundings, place_seams
from slicer.strokes.seam_plan import NO_LIMITS, rear_of
from slicer.support.handed_down import up_to
from slicer.support.support import Supports
from slicer.walls.walls import Walls


def sections_near(part: Part, profile: Profile, layers: Indices, later: Sequence[Part], heights: Heights) -> Sections:
    """The sections of a part's layers, all but a few of them empty: given are the lowest, the highest, `layers`, and those that
    decide where these are solid.

    later: the parts printed after it; heights: of its layers, and of those that only its support has.
    """
    top, bottom = shell_layers(profile.of_part(part.index).process)
    count = max(int(np.searchsorted(heights.cut_mm, part.in_part_frame().bounds_mm[1, 2])), 1)
    near = layers[:, None] + np.array([*_steps(top, bottom), -1, 0, 1, top])
    needed = np.unique(np.clip(np.append(near, [0, count - 1]), 0, count - 1))
    sampled = section_part(part, profile, (), later, {}, heights[needed])

    def spread(places: Sequence[Polygons]) -> list[Polygons]:
        everywhere = [Polygons()] * count
        for layer, place in zip(needed.tolist(), places, strict=True):
            everywhere[layer] = place
        return everywhere

    whole = replace(
        sampled,
        heights=heights[:count],
        outlines=spread(sampled.outlines),
        own=spread(sampled.own),
        ungrooved=spread(sampled.ungrooved),
        beside=spread(sampled.beside),
        pedestal_layers=pedestal_layers(heights, profile.search.pedestal_mm) if sampled.on_platform else 0,
        too_thin=frozenset(),
    )
    return up_to(whole, float(heights.tip_mm[-1]))


def _steps(top: int, bottom: int) -> tuple[int, ...]:
    """Offsets of the layers that decide where both a layer and the one below it are covered: the next one, the farthest above
    that the shells of both reach, and the farthest below. The caller adds what only one of the two needs."""
    return tuple({min(1, top - 1), top - 1, -bottom} - {0, -1} if top else {-bottom} - {0})


def sliced_layers(sections: Sections, support: ThickSupport, layers: Indices) -> Floats:
    """(n, 3) seconds, mm3 and mm3 of support of each of some layers."""
    shells = _shells(sections, support, layers)
    tip, figures = rear_of(sections.mesh.bounds_mm), []
    for layer in layers.tolist():
        layer_figures, tip = _layer_figures(shells, layer, tip)
        figures.append(layer_figures)
    return np.array(figures)


def _shells(sections: Sections, support: ThickSupport, layers: Indices) -> Shells:
    """The shells of some layers; those of the others are not there, but for what is sparse below one of them."""
    process, nozzle_mm, model = sections.process, sections.profile.machine.head.nozzle_mm, model_sections(sections)
    empty = Polygons()
    empty_areas = [empty] * len(sections.outlines)
    processes = layer_processes(process, sections.on_platform, len(empty_areas))
    no_shell = Shell(process, Walls((), empty, empty), (), Region(*[empty] * 5), (), empty)
    walled: dict[int, tuple[Walls, tuple[Bead, ...], Polygons]] = {}
    for layer in layers.tolist():
        [own] = strengthen_overhangs([processes[layer]], [sections.own[layer]], sections.below(layer))
        processes[layer], height_mm = own, float(sections.heights.height_mm[layer])
        walled[layer] = cut_walls(
            sections.own[layer], model[layer], own, height_mm=height_mm, nozzle_mm=nozzle_mm, usual=process.walls
        )
    covers = cover(sections, model, [walled[layer][2] if layer in walled else empty for layer in range(len(empty_areas))])
    shells, areas, dense, filled = [no_shell] * len(empty_areas), list(empty_areas), list(empty_areas), list[Polygons]()
    for layer, (walls, ending, _) in walled.items():
        region, lower = _region(sections, covers, walls.inside, layer)
        shells[layer] = Shell(processes[layer], walls, ending, region, (), empty)
        if layer and shells[layer - 1] is no_shell:
            shells[layer - 1] = replace(no_shell, region=replace(no_shell.region, sparse=lower))
        areas[layer] = support.areas[support.which[layer]]
        dense[layer] = support.dense[support.which[layer]] if support.closed[layer] else empty
        filled += [region.sparse] if not region.sparse.is_empty() else []
    infill = with_line_width(process, process.infill_line_width_mm)
    density = pattern_density(filled[len(filled) // 2 :][:1], infill, process.layer_height_mm)
    return Shells(Supports(sections, areas, dense, empty_areas, empty_areas, empty_areas), shells, density)


def _region(sections: Sections, covers: Cover, inside: Polygons, layer: int) -> tuple[Region, Polygons]:
    """The region of a layer, and what is sparse of the one below."""
    process, whole = sections.process, covers.insides[layer]
    top, bottom = shell_layers(process)
    if inside.is_empty():
        return Region(*[Polygons()] * 5), Polygons()
    shared = whole
    for step in _steps(top, bottom):
        shared = shared ^ covers.section(layer + step)
    lower = sparse_area(whole, shared, covers.section(layer) if top else shared, process)
    uncut = sparse_area(
        whole, shared ^ covers.section(layer + top) if top else shared, covers.section(layer - 1) if bottom else shared, process
    )
    return region_of(inside, uncut, covers, layer, not sections.on_platform, process), lower ^ inside


def _layer_figures(shells: Shells, layer: int, tip: Floats) -> tuple[tuple[float, float, float], Floats]:
    """Seconds, mm3 and mm3 of support of a layer, and where it ends. tip: (2,) where the one before ended."""
    sections, shell = shells.sections, shells.layers[layer]
    own, auxiliary = lay_beads(shells, layer)
    around = Surroundings(rear_of(sections.mesh.bounds_mm), NO_SEAMS, tip, NO_LIMITS, layer, NO_SEAMS)
    beads, _ = place_seams([*own, *auxiliary], shell.process, around)
    beads += shell.ending
    if not beads:
        return (0.0, 0.0, 0.0), tip
    strokes, speeds, flow = order_layer(beads, shells, layer, tip, Polygons())
    mm3 = strokes.lengths_mm * bead_area_mm2(strokes.width_mm, float(sections.heights.height_mm[layer])) * strokes.flow * flow
    time_s = strokes_s(strokes, speeds, tip, sections.profile, layer == 0 and sections.on_platform)
    return (time_s, float(mm3.sum()), float(mm3[strokes.is_of(*SUPPORTS)].sum())), strokes.points[-1, :2]
