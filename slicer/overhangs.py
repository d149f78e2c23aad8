"""Overhangs: the places of each layer that hang over nothing and are too flat to carry themselves, and which of them bridge."""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from math import inf

import numpy as np

from mdp.overhang import UP, facing_down
from mdp.support_need.need import needs_support
from slicer.fill.bridge import LEAST, Bridge, find_bridge, find_bridges
from slicer.geometry.cross_section import RIM_MM, faces_by_layer
from slicer.geometry.polygons import Polygons, edges, islands, offset, opening, union
from slicer.sections import Sections
from slicer.zones import no_support_areas

LEAST_MM2 = 1e-3  # places smaller than this are rounding
HEAP = 12  # so many layers are united first: a sweep over all of them at once meets many more crossings


@dataclass(frozen=True, eq=False)
class Overhang:
    """Of one layer: hanging wants support, bridges carry themselves, ledges do, too, but no line reaches all over them.

    unwanted: what hangs, and a person wants no support for.
    """

    hanging: Polygons = field(default_factory=Polygons)
    bridges: tuple[Bridge, ...] = ()
    ledges: Polygons = field(default_factory=Polygons)
    unwanted: Polygons = field(default_factory=Polygons)


def find_overhangs(sections: Sections) -> list[Overhang]:
    """For every layer the part of its outline above a risky face, and what begins over nothing.

    On the platform the first layer may lie. What carries itself by the search's definition (mdp.support_need) does not hang;
    what bridges layer by layer, as arches do, does not either. Without support whatever has an anchor to hold on to is printed as
    a bridge, however long.
    """
    overhangs = _all_overhangs(sections)
    if not sections.part.no_support.anywhere:
        return overhangs
    shut = no_support_areas(sections.part, sections.mesh, sections.heights.cut_mm)
    return [_without(overhang, area) for overhang, area in zip(overhangs, shut, strict=True)]


def _without(overhang: Overhang, shut: Polygons) -> Overhang:
    if shut.is_empty() or overhang.hanging.is_empty():
        return overhang
    hanging = overhang.hanging - shut
    return replace(overhang, hanging=hanging, unwanted=overhang.hanging - hanging)


def _all_overhangs(sections: Sections) -> list[Overhang]:
    process, mesh, outlines, cuts_mm = sections.process, sections.mesh, sections.outlines, sections.heights.cut_mm
    level_mm, arch_mm = (inf, inf) if process.support == "none" else (process.bridge_mm, process.arch_longest_mm)
    overhangs = [Overhang()] * len(outlines)
    risky = facing_down(mesh, UP, process.self_supporting_angle_deg)
    needing = faces_by_layer(mesh, cuts_mm, risky & needs_support(mesh, process, sections.on_platform))
    faces = faces_by_layer(mesh, cuts_mm, risky)
    for i in range(int(sections.on_platform), len(outlines)):
        below = _plastic_below(sections, i)
        beyond, triangles = outlines[i] - below, faces.get(i, [])
        floating = _floating(outlines[i], below, beyond.area())
        hanging = beyond ^ offset(Polygons(triangles), 0.5 * RIM_MM) if triangles else Polygons()
        hanging = hanging if floating.is_empty() else hanging + floating
        if not hanging.is_empty():
            all_need = len(needing.get(i, ())) == len(triangles)
            need = hanging if all_need else hanging ^ (offset(Polygons(needing.get(i, [])), 0.5 * RIM_MM) + floating)
            anchors = below + (outlines[i] - hanging)  # also slopes beside it that carry themselves
            overhangs[i] = _sort_islands(hanging, need, anchors, process.line_width_mm, (level_mm, min(level_mm, arch_mm)))
    return overhangs


def _plastic_below(sections: Sections, layer: int) -> Polygons:
    """What a layer that is not on the platform lies on."""
    return sections.outlines[layer - 1] if layer else offset(sections.plastic_below or Polygons(), RIM_MM)


def _floating(outline: Polygons, below: Polygons, beyond_mm2: float) -> Polygons:
    """The pieces of a layer that begin over nothing, however steep they are: a bell's rim that gets thick enough for a line.

    beyond_mm2: how much of the layer lies beyond the one below, which such a piece does all.
    """
    small = [piece for piece in islands(outline) if piece.area() < beyond_mm2 + LEAST_MM2]
    return union([piece for piece in small if (piece ^ below).is_empty()])


def _sort_islands(
    hanging: Polygons, need: Polygons, anchors: Polygons, width_mm: float, longest_mm: tuple[float, float]
) -> Overhang:
    """Sorts the connected pieces of a hanging place.

    need: what of it needs support by the search's definition; longest_mm: of bridges that do not, and of those that do.
    """
    places = islands(hanging)
    if all(island.area() < LEAST * width_mm**2 for island in places):
        return Overhang(need)
    sides = edges(offset(anchors, 0.25 * width_mm))
    rest, bridges = [], []
    for island in places:
        bridge = find_bridge(island, sides, width_mm)
        most_mm = longest_mm[(island ^ need).area() >= LEAST * width_mm**2]
        if bridge is not None and (most_mm == inf or bridge.carries(most_mm)):
            bridges.append(bridge)
        else:
            rest.append(island)
    left = Polygons.compose(rest) if rest else Polygons()
    return Overhang(left ^ need, tuple(bridges), left - need)


def bridges_of_layers(
    sections: Sections, overhangs: Sequence[Overhang], supported: Sequence[Polygons]
) -> list[tuple[Bridge, ...]]:
    """The bridges of every layer: those that carry themselves, and what hangs over no support, as well as it can be.

    Such places are ledges, a slot with no room for support, or what support could not reach (Supports.missed tells of these).
    supported: where each layer's support is.
    """
    process, heights, outlines = sections.process, sections.heights, sections.outlines
    bridges = [overhang.bridges for overhang in overhangs] + [()] * (len(outlines) - len(overhangs))
    for i, overhang in enumerate(overhangs):
        free = overhang.hanging + overhang.ledges
        if free.is_empty() or sections.below(i) is None:
            continue
        drop_mm = float(heights.bottom_mm[i]) - process.support_gap_mm - 2.0 * process.layer_height_mm
        lowest = int(np.searchsorted(heights.tip_mm, drop_mm))
        held = union([area for area in supported[lowest:i] if not area.is_empty()])
        held = held if held.is_empty() else offset(held, 0.5 * process.line_width_mm)
        bare = opening(free - held, 0.25 * process.line_width_mm)
        if bare.is_empty():
            continue
        slopes = outlines[i] - union([free, *(bridge.hanging for bridge in overhang.bridges)])
        anchors = edges(offset(union([_plastic_below(sections, i), held, slopes]), 0.25 * process.line_width_mm))
        bridges[i] += tuple(span for island in islands(bare) for span in find_bridges(island, anchors, process.line_width_mm))
    return bridges


def seen_from_above(hanging: Sequence[Polygons]) -> Polygons:
    """The places that hanging layers make up together."""
    areas = [offset(area, RIM_MM) for area in hanging if not area.is_empty()]
    return union([union(areas[k : k + HEAP]) for k in range(0, len(areas), HEAP)])


def drop_small(hanging: Sequence[Polygons], least_mm2: float) -> list[Polygons]:
    """The hanging places without those that, seen from above, are too small to matter."""
    small = union([island for island in islands(seen_from_above(hanging)) if island.area() < least_mm2])
    if small.is_empty():
        return list(hanging)
    large = [area if area.is_empty() else area - small for area in hanging]
    return [area if area.area() >= LEAST_MM2 else Polygons() for area in large]
