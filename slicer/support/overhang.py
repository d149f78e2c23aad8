"""Overhangs: the places of each layer that hang over nothing and are too flat to carry themselves, and which of them bridge."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from math import inf

import numpy as np

from mdp.mesh import Floats, Mesh
from mdp.overhang import UP, Mask, facing_down
from mdp.support_need.need import needs_support
from profiles.process import Process
from slicer.fill.bridge import LEAST, Bridge, find_bridge, find_bridges
from slicer.geometry.polygons import Polygons, edges, islands, offset, opening, union
from slicer.heights import Heights

RIM_MM = 0.04  # neighbouring strips of a slope overlap by this so that they unite

EMPTY = Polygons()


@dataclass(frozen=True, eq=False)
class Overhang:
    """Of one layer: hanging wants support, bridges carry themselves, ledges do, too, but no line reaches all over them."""

    hanging: Polygons
    bridges: tuple[Bridge, ...]
    ledges: Polygons = EMPTY


def detect_overhangs(
    mesh: Mesh, outlines: Sequence[Polygons], cuts_mm: Floats, process: Process, below: Polygons | None
) -> list[Overhang]:
    """For every layer the part of its outline above a risky face, and what begins over nothing.

    mesh and cuts_mm: part frame. below: plastic under the first layer, None: the platform, on which it may lie. What carries
    itself by the search's definition (mdp.support_need) does not hang; what bridges layer by layer, as arches do, does
    not either. Without support whatever has a bank to hold on to is printed as a bridge, however long.
    """
    level_mm, arch_mm = (inf, inf) if process.support == "none" else (process.bridge_mm, process.arch_longest_mm)
    overhangs = [Overhang(Polygons(), ())] * len(outlines)
    risky = facing_down(mesh, UP, process.self_supporting_angle_deg)
    needing = faces_by_layer(mesh, cuts_mm, risky & needs_support(mesh, process, below is None))
    faces = faces_by_layer(mesh, cuts_mm, risky)
    for i in range(int(below is None), len(outlines)):
        bank = outlines[i - 1] if i else offset(below or EMPTY, RIM_MM)
        floating, triangles = _floating(outlines[i], bank), faces.get(i, [])
        hanging = (outlines[i] - bank) ^ offset(Polygons(triangles), 0.5 * RIM_MM) if triangles else EMPTY
        hanging = hanging if floating.is_empty() else hanging + floating
        if not hanging.is_empty():
            all_need = len(needing.get(i, ())) == len(triangles)
            need = hanging if all_need else hanging ^ (offset(Polygons(needing.get(i, [])), 0.5 * RIM_MM) + floating)
            held = bank + (outlines[i] - hanging)  # also by slopes beside it that carry themselves
            overhangs[i] = _sort_islands(hanging, need, held, process.line_width_mm, (level_mm, min(level_mm, arch_mm)))
    return overhangs


def _floating(outline: Polygons, bank: Polygons) -> Polygons:
    """The pieces of a layer that begin over nothing, however steep they are: a bell's rim that gets thick enough for a line."""
    begun = [] if outline.is_empty() else [piece for piece in islands(outline) if (piece ^ bank).is_empty()]
    return union(begun) if begun else EMPTY


def _sort_islands(
    hanging: Polygons, need: Polygons, bank: Polygons, width_mm: float, longest_mm: tuple[float, float]
) -> Overhang:
    """Sorts the connected pieces of a hanging place.

    need: what of it needs support by the search's definition; longest_mm: of bridges that do not, and of those that do.
    """
    places = islands(hanging)
    if all(island.area() < LEAST * width_mm**2 for island in places):
        return Overhang(need, ())
    banks = edges(offset(bank, 0.25 * width_mm))
    rest, spans = [], []
    for island in places:
        span = find_bridge(island, banks, width_mm)
        most_mm = longest_mm[(island ^ need).area() >= LEAST * width_mm**2]
        if span is not None and (most_mm == inf or span.carries(most_mm)):
            spans.append(span)
        else:
            rest.append(island)
    left = Polygons.compose(rest) if rest else Polygons()
    return Overhang(left ^ need, tuple(spans), left - need)


def faces_by_layer(mesh: Mesh, cuts_mm: Floats, chosen: Mask) -> dict[int, list[Floats]]:
    """Chosen faces seen from above, (3, 2) counter-clockwise, by the layers whose strip of the surface they belong to."""
    corners = mesh.vertices[mesh.faces[chosen]]
    first = np.searchsorted(cuts_mm, corners[:, :, 2].min(axis=1))
    last = np.minimum(np.searchsorted(cuts_mm, corners[:, :, 2].max(axis=1)), len(cuts_mm) - 1)
    masks: dict[int, list[Floats]] = {}
    for corner, a, b in zip(np.ascontiguousarray(corners[:, ::-1, :2]), first.tolist(), last.tolist(), strict=True):
        for layer in range(a, b + 1):
            masks.setdefault(layer, []).append(corner)
    return masks


def bridge_unheld(
    overhangs: Sequence[Overhang],
    outlines: Sequence[Polygons],
    below: Polygons | None,
    supports: Sequence[Polygons],
    heights: Heights,
    process: Process,
) -> list[Overhang]:
    """The overhangs with what hangs over no support printed as bridges too, as well as they can be.

    Such places are ledges, a slot with no room for support, or what support could not reach (Supports.missed tells of these).
    """
    bridged = list(overhangs)
    for i, overhang in enumerate(overhangs):
        free = overhang.hanging + overhang.ledges
        if free.is_empty() or (i == 0 and below is None):
            continue
        bottom_mm = float(heights.bottom_mm[i])
        lowest = int(np.searchsorted(heights.tip_mm, bottom_mm - process.support_gap_mm - 2.0 * process.layer_height_mm))
        held = union([area for area in supports[lowest:i] if not area.is_empty()])
        held = held if held.is_empty() else offset(held, 0.5 * process.line_width_mm)
        bare = opening(free - held, 0.25 * process.line_width_mm)
        if bare.is_empty():
            continue
        bank = outlines[i - 1] if i else offset(below or EMPTY, RIM_MM)
        slopes = outlines[i] - union([free, *(span.place for span in overhang.bridges)])
        banks = edges(offset(union([bank, held, slopes]), 0.25 * process.line_width_mm))
        spans = [span for island in islands(bare) for span in find_bridges(island, banks, process.line_width_mm)]
        bridged[i] = replace(overhang, bridges=(*overhang.bridges, *spans))
    return bridged
