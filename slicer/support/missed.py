"""Missed: the hanging places that support does not hold, and why each of them gets none."""

from collections.abc import Sequence
from math import radians, tan

import numpy as np

from profiles.process import Process
from slicer.geometry.polygons import Polygons, bounding_box, closing, islands, offset, union
from slicer.support.overhang import RIM_MM
from slicer.support.reachable import EVEN_MM, ReachableAreas

LEAST_MM2 = 1e-3  # places smaller than this are rounding
HEAP = 12  # so many layers are united first: a sweep over all of them at once meets many more crossings
LEDGE = 2.0  # line widths: a ledge no wider carries itself, the search's definition (mdp.support_need.patches)


def window(k: int, areas: ReachableAreas, process: Process) -> range:
    """The layers, from the highest down, on which a hanging place of layer k may rest.

    The distance across keeps support as much lower under a slope that is just too flat.
    """
    drop = float(areas.bottom_mm[k]) - process.support_gap_mm
    slack = process.support_distance_mm / max(tan(radians(process.self_supporting_angle_deg)), 0.5)
    highest = int(np.searchsorted(areas.top_mm, drop + EVEN_MM, side="right")) - 1
    lowest = int(np.searchsorted(areas.top_mm, drop - slack - EVEN_MM))
    return range(highest, min(lowest, highest) - 1, -1) if highest >= 0 else range(0)


def seen_from_above(hanging: Sequence[Polygons]) -> Polygons:
    """The places that hanging layers make up together."""
    places = [offset(place, RIM_MM) for place in hanging if not place.is_empty()]
    return union([union(places[k : k + HEAP]) for k in range(0, len(places), HEAP)])


def drop_small(hanging: Sequence[Polygons], least_mm2: float) -> list[Polygons]:
    """The hanging places without those that, seen from above, are too small to matter."""
    small = union([island for island in islands(seen_from_above(hanging)) if island.area() < least_mm2])
    if small.is_empty():
        return list(hanging)
    large = [place if place.is_empty() else place - small for place in hanging]
    return [place if place.area() >= LEAST_MM2 else Polygons() for place in large]


def find_missed(
    wanted: Sequence[Polygons],
    printed: Sequence[Polygons],
    outlines: Sequence[Polygons],
    areas: ReachableAreas,
    process: Process,
    on_platform: bool,
) -> tuple[Polygons, ...]:
    """What of the hanging places neither lies over printed support, half a bead beyond its edge, nor spans from there to
    the part, nor has the part or the platform a layer's height below where support would end, nor is part of a mere ledge.
    """
    missed = []
    for k, place in enumerate(wanted):
        bare = Polygons() if place.is_empty() else _bare(k, place, printed, outlines, areas, process)
        missed.append(_without_near(k, bare, outlines, areas, process, on_platform))
    return tuple(_drop_ledges(missed, printed, outlines, areas, process))


def _drop_ledges(
    missed: Sequence[Polygons],
    printed: Sequence[Polygons],
    outlines: Sequence[Polygons],
    areas: ReachableAreas,
    process: Process,
) -> list[Polygons]:
    """The missed places without those that, seen from above, have nothing of a size beyond a ledge's reach from what is held."""
    above = seen_from_above(missed)
    reach, beyond = LEDGE * process.line_width_mm, []
    for k, bare in enumerate(missed):
        if k and not bare.is_empty():
            carrying = (outlines[k - 1] ^ bounding_box(bare, 2.0 * reach)) - above
            bare = bare - offset(carrying + _held(k, printed, areas, process), reach)
        beyond.append(bare)
    large = [place for place in drop_small(beyond, process.support_least_mm2) if not place.is_empty()]
    if not large:
        return [Polygons()] * len(missed)
    seen = offset(union(large), RIM_MM)
    kept = union([island for island in islands(above) if not (island ^ seen).is_empty()])
    return [place if place.is_empty() else place ^ kept for place in missed]


def _held(k: int, printed: Sequence[Polygons], areas: ReachableAreas, process: Process) -> Polygons:
    """The places of a layer that lie over printed support."""
    held = union([printed[m] for m in window(k, areas, process) if m < len(printed)])
    return held if held.is_empty() else offset(held, 0.5 * process.line_width_mm)


def _bare(
    k: int,
    place: Polygons,
    printed: Sequence[Polygons],
    outlines: Sequence[Polygons],
    areas: ReachableAreas,
    process: Process,
) -> Polygons:
    """What of a hanging place lies over no support and does not span from there to the part."""
    held = _held(k, printed, areas, process)
    bare = place - held
    if k and not held.is_empty() and bare.area() >= LEAST_MM2:
        reach = 2.0 * process.support_distance_mm + 1.0
        spanned = closing((held + outlines[k - 1]) ^ bounding_box(bare, reach), 0.5 * process.support_distance_mm + RIM_MM)
        bare = bare - spanned
    return bare if bare.area() >= LEAST_MM2 else Polygons()


def _without_near(
    k: int, bare: Polygons, outlines: Sequence[Polygons], areas: ReachableAreas, process: Process, on_platform: bool
) -> Polygons:
    """A bare place without what has plastic or the platform so near below it that no layer of support has room between."""
    if bare.is_empty() or not k:
        return bare
    lowest = float(areas.bottom_mm[k]) - process.support_gap_mm - process.layer_height_mm
    if lowest <= EVEN_MM and on_platform:
        return Polygons()
    near = list(outlines[int(np.searchsorted(areas.top_mm, lowest - EVEN_MM)) : k - 1])
    rest = bare - union(near) if near else bare
    return rest if rest.area() >= LEAST_MM2 else Polygons()
