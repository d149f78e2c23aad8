"""Overhangs: what of each layer needs support, what bridges from anchor to anchor, and what is a ledge that carries itself."""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from math import inf

from mdp.overhang import UP, facing_down
from mdp.support_need.need import needs_support
from slicer.fill.bridge import LEAST, Bridge, find_bridge
from slicer.geometry.edge_index import index_edges
from slicer.geometry.polygons import Polygons, islands, offset, union
from slicer.sectioning import RIM_MM, Sections, faces_by_layer

LEAST_MM2 = 1e-3  # places smaller than this are rounding
HEAP = 12  # so many layers are united first: a sweep over all of them at once meets many more crossings


@dataclass(frozen=True, eq=False)
class Overhang:
    """The overhangs of one layer.

    hanging: needs support; bridges: lines span them; ledges: carry themselves, though no line spans them; unwanted: would need
    support, but a person wants none there.
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
    process, mesh, outlines, cuts_mm = sections.process, sections.mesh, sections.outlines, sections.heights.cut_mm
    level_mm, arch_mm = (inf, inf) if process.support == "none" else (process.bridge_mm, process.arch_longest_mm)
    overhangs = [Overhang()] * len(outlines)
    risky = facing_down(mesh, UP, process.self_supporting_angle_deg)
    needing = faces_by_layer(mesh, cuts_mm, risky & needs_support(mesh, process, sections.on_platform))
    faces = faces_by_layer(mesh, cuts_mm, risky)
    for i in range(int(sections.on_platform), len(outlines)):
        below = outlines[i - 1] if i else offset(sections.plastic_below or Polygons(), RIM_MM)
        beyond, triangles = outlines[i] - below, faces.get(i, [])
        floating = _floating(outlines[i], below, beyond.area())
        hanging = beyond ^ offset(Polygons(triangles), 0.5 * RIM_MM) if triangles else Polygons()
        hanging = hanging if floating.is_empty() else hanging + floating
        if not hanging.is_empty():
            all_need = len(needing.get(i, ())) == len(triangles)
            need = hanging if all_need else hanging ^ (offset(Polygons(needing.get(i, [])), 0.5 * RIM_MM) + floating)
            anchors = below + (outlines[i] - hanging)  # also slopes beside it that carry themselves
            overhang = _sort_islands(hanging, need, anchors, process.line_width_mm, (level_mm, min(level_mm, arch_mm)))
            if sections.no_support:
                wanted = overhang.hanging - sections.no_support[i]
                overhang = replace(overhang, hanging=wanted, unwanted=overhang.hanging - wanted)
            overhangs[i] = overhang
    return overhangs


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
    held_by = index_edges(offset(anchors, 0.25 * width_mm))
    rest, bridges = [], []
    for island in places:
        bridge = find_bridge(island, held_by, width_mm)
        most_mm = longest_mm[(island ^ need).area() >= LEAST * width_mm**2]
        if bridge is not None and (most_mm == inf or bridge.carries(most_mm)):
            bridges.append(bridge)
        else:
            rest.append(island)
    left = Polygons.compose(rest) if rest else Polygons()
    return Overhang(left ^ need, tuple(bridges), left - need)


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
