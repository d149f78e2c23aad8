"""Roots: where support ends beside a slope, the rest of its discs goes straight down until all of it stands."""

from collections.abc import Sequence
from math import radians, tan

from slicer.geometry.polygons import Polygons, bounding_box, offset, union
from slicer.support.reachable import COARSE_MM, SPECK_MM2, ReachableAreas, dilate, drop_slivers, only_slivers


def add_roots(bodies: Sequence[Polygons], areas: ReachableAreas) -> list[Polygons]:
    """Support of every layer with the roots of what ends in the layers above.

    A root is at most as deep as the steepest slope that support may not slide along is high under its disc.
    """
    process = areas.process
    across = process.support_distance_mm + 2.0 * areas.radius_mm
    angle = min(process.support_branch_angle_deg, process.self_supporting_angle_deg)
    deep = across / max(tan(radians(angle)), 0.5)
    grown = list(bodies)
    roots: list[tuple[Polygons, float]] = []
    for m in range(len(bodies) - 2, -1, -1):
        ends = _loose_ends(bodies, areas, m + 1)
        if not ends.is_empty():
            roots.append((ends, float(areas.bottom_mm[m + 1]) - deep))
        if roots:
            blocked = _blocked_area(union([root for root, _ in roots]), areas, m)
            left = [(root - blocked, last) for root, last in roots if areas.bottom_mm[m] >= last]
            roots = [(root, last) for root, last in left if not only_slivers(root)]
            grown[m] = union([bodies[m], *(root for root, _ in roots)])
    return grown


def _loose_ends(bodies: Sequence[Polygons], areas: ReachableAreas, m: int) -> Polygons:
    """What of a layer's support nothing in the layer below carries, but something to stand on is near."""
    if bodies[m].is_empty() or areas.placeable[m].is_empty():
        return Polygons()
    loose = bodies[m] - bodies[m - 1]
    if loose.area() < SPECK_MM2 or (loose ^ areas.placeable[m]).area() < SPECK_MM2:
        return Polygons()
    return drop_slivers(loose - dilate(bodies[m - 1], float(areas.lean_mm[m])))


def _blocked_area(root: Polygons, areas: ReachableAreas, m: int) -> Polygons:
    """Where the gaps to the part forbid support, about a root."""
    distance_mm, outlines = areas.process.support_distance_mm, areas.sections.outlines
    window = bounding_box(root, distance_mm + 1.0)
    beside = offset((outlines[m] ^ window).simplify(COARSE_MM), distance_mm + COARSE_MM)
    near = [*outlines[areas.next_below(m) : m], *outlines[m + 1 : areas.next_above(m)]]
    return union([beside, *(outline ^ window for outline in near), *areas.shut[m : m + 1]])
