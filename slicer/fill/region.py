"""Regions: division of each layer into solid skin and sparse infill."""

from collections.abc import Sequence
from dataclasses import dataclass

from profiles.process import Process
from slicer.geometry.polygons import Polygons, larger, offset, opening, union
from slicer.heights import SHELL_KEYS, shell_layers
from slicer.modifiers import Place, combined, most_shell_layers, overlaid

# share of the line width: a narrower strip beside the wall along a cut needs no skin, since the walls of the two layers meet
THIN = 0.2
BESIDE = 0.75  # share of the line width: offset at which a wall, as on slopes, still rests on the one below
ANCHOR = 2.0  # line widths by which solid layers under walls overlap the infill around, like a bridge its anchors
FEW_MM2 = 25.0  # factor on the line width squared: a smaller sparse area left beside a cut becomes solid
# smallest ironed area: the flat around the orifice has about this size and smooths such an area while it is printed
LEAST_IRONED_MM2 = 2.0
SOLID_KEYS = (*SHELL_KEYS, "infill_density", "solid_below_mm2")


@dataclass(frozen=True, eq=False)
class Region:
    """A layer's inside: top is visible skin including its part under walls; solid is other skin; sparse takes the infill.

    bare: area of top with nothing above it. uncut: sparse area of the uncut model, not clipped to the part.
    """

    bare: Polygons
    top: Polygons
    solid: Polygons
    sparse: Polygons
    uncut: Polygons


@dataclass(frozen=True, eq=False)
class Cover:
    """The uncut model around a part's layers.

    sections, insides: of each layer, and the area that walls would enclose; below, above: sections of as many layers under the
    first and over the last one as shells need, nearest first. later: areas of later parts in each layer, and in those over the
    last one; () if there are none.
    """

    sections: Sequence[Polygons]
    insides: Sequence[Polygons]
    below: Sequence[Polygons]
    above: Sequence[Polygons]
    later: Sequence[Polygons] = ()

    def section(self, layer: int) -> Polygons:
        """The model's section in a layer, also below the first (-1, ...) or above the last one; empty beyond the layers that
        shells need.
        """
        count = len(self.sections)
        beyond, k = (self.below, -1 - layer) if layer < 0 else (self.above, layer - count)
        return self.sections[layer] if 0 <= layer < count else beyond[k] if k < len(beyond) else Polygons()


def regions(
    insides: Sequence[Polygons],
    cover: Cover,
    on_plastic: bool,
    process: Process,
    runs: Sequence[range] | None = None,
    places: Sequence[Place] = (),
) -> list[Region]:
    """The regions of every layer of a part from the areas that its walls enclose. runs: requested ranges of layers, None for all;
    places: areas with modified settings.

    A point is solid if one of the model's next top_layers sections above or bottom_layers below does not cover it: so every
    vertical line meets that many layers of wall or skin below a surface, also on slopes. It is also solid if a later part will
    lie less than interface_top_layers away, in the first interface_bottom_layers on plastic, and under walls that begin.
    """
    found = [Region(*[Polygons()] * 5)] * len(insides)
    ruled, rules = combined(places, SOLID_KEYS), set()
    for own in (process, *(place.over(process) for place in ruled)):  # the settings that decide which areas become solid
        rules.add((shell_layers(own), own.infill_density >= 1.0, own.infill_density > 0.0, own.solid_below_mm2))
    ruled = ruled if len(rules) > 1 else []
    tops = most_shell_layers(process, places)[0] > 0
    for run in [range(len(insides))] if runs is None else runs:
        hollow = _hollow(run, cover, process)
        for place in ruled:
            hollow = _hollow_with(hollow, run, cover, place, process)
        for layer, uncut in zip(run, hollow, strict=True):
            found[layer] = _region_of(insides[layer], uncut, cover, layer, on_plastic, process, tops)
    return found


def _hollow(run: range, cover: Cover, process: Process) -> list[Polygons]:
    """The sparse area of each layer of a run in the uncut model."""
    top, bottom = shell_layers(process)
    inner = cover.insides[run.start : run.stop + max(top, 1)]  # walls that begin above make infill solid
    end = run.start + len(inner)
    stacked = [cover.section(layer) for layer in range(run.start - bottom, end + top)]
    above = _common(stacked, top)[bottom + 1 :] if top else inner
    below = _common(stacked[::-1], bottom)[::-1][bottom - 1 :] if bottom else inner
    sparse_areas = [sparse_area(*row, process) for row in zip(inner, above, below, strict=False)]
    return _without_footings(sparse_areas, cover.sections[run.start + 1 : end], inner[1:], process)[: len(run)]


def _hollow_with(hollow: Sequence[Polygons], run: range, cover: Cover, place: Place, process: Process) -> list[Polygons]:
    """The sparse areas of a run of layers, replaced within a modified area by those with its settings; strips along its border
    that are too narrow for infill become solid.
    """
    own, width_mm, areas = place.over(process), process.line_width_mm, place.areas
    there = [layer for layer in run if not areas[layer].is_empty()]
    if not there:
        return list(hollow)
    inside, done = _hollow(range(there[0], there[-1] + 1), cover, own), list(hollow)
    for layer in there:
        area, at = areas[layer], layer - run.start
        both = overlaid(hollow[at], [(area, inside[layer - there[0]])])
        border = offset(area, 2.0 * width_mm) - offset(area, -2.0 * width_mm)
        done[at] = larger(both - ((both - opening(both, width_mm)) ^ border), FEW_MM2 * width_mm**2)
    return done


def _common(layers: Sequence[Polygons], count: int) -> list[Polygons]:
    """For each i the intersection of layers i .. i + count - 1; nothing beyond the end.

    Running intersections of blocks from both sides (van Herk 1992): three booleans per layer, whatever the count.
    """
    if count <= 0:
        return list(layers)
    n, forward, backward = len(layers), list(layers), list(layers)
    for i in range(n):
        if i % count:
            forward[i] = forward[i - 1] ^ layers[i]
    for i in range(n - 2, -1, -1):
        if (i + 1) % count:
            backward[i] = layers[i] ^ backward[i + 1]
    ends = ((i, i + count - 1) for i in range(n - count + 1))
    common = [backward[i] ^ forward[end] if i % count else forward[end] for i, end in ends]
    return common + [Polygons()] * (n - len(common))


def sparse_area(inside: Polygons, above: Polygons, below: Polygons, process: Process) -> Polygons:
    """The area of the inside that is covered above and below, a line width away from every skin that is anchored in it."""
    if process.infill_density >= 1.0 or inside.is_empty():
        return Polygons()
    width_mm = process.line_width_mm
    covered = inside ^ above ^ below
    sparse = inside
    if inside.area() - covered.area() > 1e-6:
        skin = opening(inside - covered, 0.25 * width_mm)
        sparse = inside if skin.is_empty() else opening(inside - offset(skin, width_mm), width_mm)
    return _large(sparse, process)


def _large(sparse: Polygons, process: Process) -> Polygons:
    """The sparse pieces that are large enough; all of them without infill."""
    return larger(sparse, process.solid_below_mm2) if process.infill_density > 0.0 else sparse


def _without_footings(
    sparse: Sequence[Polygons], sections: Sequence[Polygons], insides: Sequence[Polygons], process: Process
) -> list[Polygons]:
    """The sparse areas without those under walls that begin on them, like the wall of a pocket on its floor or of a pillar on its
    plate.

    sections, insides: of the layers over those of the sparse areas, except for the last one. Under such walls as many layers
    become solid as under a top, extended by ANCHOR lines into the infill.
    """
    width_mm, deep = process.line_width_mm, max(shell_layers(process)[0], 1)
    footings = [
        opening((area ^ section) - inside, 0.5 * BESIDE * width_mm) if not area.is_empty() else area
        for area, section, inside in zip(sparse, sections, insides, strict=False)
    ]
    left = list(sparse)
    for i, area in enumerate(sparse):
        begun = [footing for footing in footings[i : i + deep] if not footing.is_empty()]
        if begun and not area.is_empty():
            left[i] = _large(opening(area - offset(union(begun), ANCHOR * width_mm), width_mm), process)
    return left


def _region_of(
    inside: Polygons, uncut: Polygons, cover: Cover, layer: int, on_plastic: bool, process: Process, tops: bool
) -> Region:
    """The region of one layer. uncut: sparse area of the uncut model; tops: whether uncovered areas get skin."""
    empty, width_mm = Polygons(), process.line_width_mm
    if inside.is_empty():
        return Region(empty, empty, empty, empty, empty)
    # on plastic, skin fills the grooves and holds the pins
    wholly = on_plastic and layer < max(process.interface_bottom_layers, 0 if process.interlock == "none" else 1)
    sparse = empty if wholly else _beside_cuts(inside, uncut, cover, layer, process)
    if not sparse.is_empty() and abs(sparse.area() - inside.area()) < 1e-6:
        return Region(empty, empty, empty, sparse, uncut)
    solid = inside if sparse.is_empty() else inside - sparse
    bare = solid - (cover.section(layer + 1) if tops else inside)
    bare = bare if bare.is_empty() else opening(bare, width_mm)
    if bare.is_empty():
        return Region(bare, bare, solid, sparse, uncut)
    # A top's lines continue under the walls around it and as far as its anchor: a separate frame there would consist of line
    # ends.
    under = opening(solid - offset(bare, (process.walls + ANCHOR) * width_mm), width_mm)
    return Region(bare, solid - under, under, sparse, uncut)


def _beside_cuts(inside: Polygons, uncut: Polygons, cover: Cover, layer: int, process: Process) -> Polygons:
    """The sparse area of a part within that of the uncut model, without the skin under later parts."""
    width_mm, reach = process.line_width_mm, process.interface_top_layers
    near = [area for area in cover.later[max(layer - reach, 0) : layer + reach + 1] if not area.is_empty()]
    if uncut.is_empty() or (not near and inside is cover.insides[layer]):
        return uncut
    left = uncut ^ inside
    if not near:
        return left
    skin = opening(union(near) ^ inside, 0.5 * THIN * width_mm)
    left = opening(left if skin.is_empty() else left - offset(skin, 0.5 * width_mm), width_mm)
    return larger(left, FEW_MM2 * width_mm**2)


def ironed_areas(
    regions: Sequence[Region], beside: Sequence[Polygons], process: Process, places: Sequence[Place] = ()
) -> list[Polygons]:
    """The skin of each layer with nothing above it, a line width away from later parts.

    beside: areas of later parts in each layer and in the one over the last; places: areas with modified settings.
    """
    ironed = combined(places, ["ironing"])
    if not any(own.ironing for own in (process, *(place.over(process) for place in ironed))):
        return [Polygons()] * len(regions)
    width = process.line_width_mm
    tops = [
        region.bare if above.is_empty() else region.bare - offset(above, width)
        for region, above in zip(regions, beside[1:], strict=True)
    ]
    for layer, top in enumerate(tops):
        here = [(place.areas[layer], top if place.over(process).ironing else Polygons()) for place in ironed]
        tops[layer] = overlaid(top if process.ironing else Polygons(), here)
    return [larger(opening(top, 0.5 * width), LEAST_IRONED_MM2) for top in tops]
