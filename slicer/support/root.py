"""Roots: where support ends beside a slope, the rest of its discs goes straight down until all of it stands."""

from collections.abc import Sequence
from math import radians, tan

import numpy as np

from profiles.process import Process
from slicer.geometry.polygons import Polygons, bounding_box, offset, union
from slicer.support.reachable import COARSE_MM, EVEN_MM, SPECK_MM2, ReachableAreas, dilate, drop_slivers, only_slivers


def add_roots(
    bodies: Sequence[Polygons], outlines: Sequence[Polygons], areas: ReachableAreas, process: Process
) -> list[Polygons]:
    """Support of every layer with the roots of what ends in the layers above.

    A root is at most as deep as the steepest slope that support may not slide along is high under its disc.
    """
    across = process.support_distance_mm + 2.0 * areas.radius_mm
    angle = min(process.support_branch_angle_deg, process.self_supporting_angle_deg)
    deep = across / max(tan(radians(angle)), 0.5)
    grown_bodies = list(bodies)
    roots: list[tuple[Polygons, float]] = []
    for m in range(len(bodies) - 2, -1, -1):
        ends = _loose_ends(bodies, areas, m + 1)
        if not ends.is_empty():
            roots.append((ends, float(areas.bottom_mm[m + 1]) - deep))
        if roots:
            blocked = _blocked_area(union([root for root, _ in roots]), outlines, areas, process, m)
            left = [(root - blocked, last) for root, last in roots if areas.bottom_mm[m] >= last]
            roots = [(root, last) for root, last in left if not only_slivers(root)]
            grown_bodies[m] = union([bodies[m], *(root for root, _ in roots)])
    return grown_bodies


def _loose_ends(bodies: Sequence[Polygons], areas: ReachableAreas, m: int) -> Polygons:
    """What of a layer's support nothing in the layer below carries, but ground is near."""
    if bodies[m].is_empty() or areas.ground[m].is_empty():
        return Polygons()
    loose = bodies[m] - bodies[m - 1]
    if loose.area() < SPECK_MM2 or (loose ^ areas.ground[m]).area() < SPECK_MM2:
        return Polygons()
    return drop_slivers(loose - dilate(bodies[m - 1], float(areas.lean_mm[m])))


def _blocked_area(root: Polygons, outlines: Sequence[Polygons], areas: ReachableAreas, process: Process, m: int) -> Polygons:
    """Where the gaps to the part forbid support, about a root."""
    window = bounding_box(root, process.support_distance_mm + 1.0)
    under = int(np.searchsorted(areas.top_mm, areas.bottom_mm[m] - process.support_bottom_gap_mm + EVEN_MM, side="right"))
    over = int(np.searchsorted(areas.bottom_mm, areas.top_mm[m] + process.support_gap_mm - EVEN_MM))
    beside = offset((outlines[m] ^ window).simplify(COARSE_MM), process.support_distance_mm + COARSE_MM)
    near = [*outlines[min(under, m) : m], *outlines[m + 1 : over]]
    return union([beside, *(outline ^ window for outline in near)])
