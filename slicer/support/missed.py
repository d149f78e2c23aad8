"""Missed: the hanging places that support does not hold."""

from collections.abc import Sequence

import numpy as np

from slicer.geometry.cross_section import RIM_MM
from slicer.geometry.polygons import Polygons, bounding_box, closing, islands, offset, union
from slicer.overhangs import LEAST_MM2, drop_small, seen_from_above
from slicer.support.reachable import EVEN_MM, ReachableAreas

LEDGE = 2.0  # line widths: a ledge no wider carries itself, the search's definition (mdp.support_need.patches)


def find_missed(wanted: Sequence[Polygons], printed: Sequence[Polygons], areas: ReachableAreas) -> list[Polygons]:
    """What of the hanging places neither lies over printed support, half a bead beyond its edge, nor spans from there to
    the part, nor has the part or the platform a layer's height below where support would end, nor is part of a mere ledge.
    """
    missed = []
    for k, hanging in enumerate(wanted):
        bare = hanging if hanging.is_empty() else _bare(k, hanging, printed, areas)
        missed.append(bare if bare.is_empty() or not k else _without_near(k, bare, areas))
    return _drop_ledges(missed, printed, areas)


def _drop_ledges(missed: Sequence[Polygons], printed: Sequence[Polygons], areas: ReachableAreas) -> list[Polygons]:
    """The missed places without those that, seen from above, have nothing of a size beyond a ledge's reach from what is held."""
    above, outlines, process = seen_from_above(missed), areas.sections.outlines, areas.process
    reach, beyond = LEDGE * process.line_width_mm, []
    for k, bare in enumerate(missed):
        if k and not bare.is_empty():
            carrying = (outlines[k - 1] ^ bounding_box(bare, 2.0 * reach)) - above
            bare = bare - offset(carrying + _held(k, printed, areas), reach)
        beyond.append(bare)
    large = [area for area in drop_small(beyond, process.support_least_mm2) if not area.is_empty()]
    if not large:
        return [Polygons()] * len(missed)
    seen = offset(union(large), RIM_MM)
    wide = union([island for island in islands(above) if not (island ^ seen).is_empty()])
    return [area if area.is_empty() else area ^ wide for area in missed]


def _held(k: int, printed: Sequence[Polygons], areas: ReachableAreas) -> Polygons:
    """The places of a layer that lie over printed support."""
    held = union([printed[m] for m in areas.carrying_layers(k) if m < len(printed)])
    return held if held.is_empty() else offset(held, 0.5 * areas.process.line_width_mm)


def _bare(k: int, hanging: Polygons, printed: Sequence[Polygons], areas: ReachableAreas) -> Polygons:
    """What of a hanging place lies over no support and does not span from there to the part."""
    held, distance_mm = _held(k, printed, areas), areas.process.support_distance_mm
    bare = hanging - held
    if k and not held.is_empty() and bare.area() >= LEAST_MM2:
        around = (held + areas.sections.outlines[k - 1]) ^ bounding_box(bare, 2.0 * distance_mm + 1.0)
        bare = bare - closing(around, 0.5 * distance_mm + RIM_MM)
    return bare if bare.area() >= LEAST_MM2 else Polygons()


def _without_near(k: int, bare: Polygons, areas: ReachableAreas) -> Polygons:
    """A bare place without what has plastic or the platform so near below it that no layer of support has room between."""
    process = areas.process
    lowest = float(areas.bottom_mm[k]) - process.support_gap_mm - process.layer_height_mm
    if lowest <= EVEN_MM and areas.sections.on_platform:
        return Polygons()
    near = list(areas.sections.outlines[int(np.searchsorted(areas.top_mm, lowest - EVEN_MM)) : k - 1])
    rest = bare - union(near) if near else bare
    return rest if rest.area() >= LEAST_MM2 else Polygons()
