"""Roots: where support ends beside a slope, the rest of its discs goes straight down until all of it stands."""

from collections.abc import Sequence
from math import radians, tan

import numpy as np

from profiles.process import Process
from slicer.polygons import Polygons, around, grown, united
from slicer.room import COARSE_MM, EVEN_MM, SPECK_MM2, Room, leaning, slivers, solid


def rooted(bodies: Sequence[Polygons], outlines: Sequence[Polygons], room: Room, process: Process) -> list[Polygons]:
    """Support of every layer with the roots of what ends in the layers above.

    A root is at most as deep as the steepest slope that support may not slide along is high under its disc.
    """
    across = process.support_distance_mm + 2.0 * room.radius_mm
    angle = min(process.support_branch_angle_deg, process.self_supporting_angle_deg)
    deep = across / max(tan(radians(angle)), 0.5)
    grown_bodies = list(bodies)
    roots: list[tuple[Polygons, float]] = []
    for m in range(len(bodies) - 2, -1, -1):
        ended = _ended(bodies, room, m + 1)
        if not ended.is_empty():
            roots.append((ended, float(room.bottom_mm[m + 1]) - deep))
        if roots:
            barred = _barred(united([root for root, _ in roots]), outlines, room, process, m)
            left = [(root - barred, last) for root, last in roots if room.bottom_mm[m] >= last]
            roots = [(root, last) for root, last in left if not slivers(root)]
            grown_bodies[m] = united([bodies[m], *(root for root, _ in roots)])
    return grown_bodies


def _ended(bodies: Sequence[Polygons], room: Room, m: int) -> Polygons:
    """What of a layer's support nothing in the layer below carries, but ground is near."""
    if bodies[m].is_empty() or room.ground[m].is_empty():
        return Polygons()
    loose = bodies[m] - bodies[m - 1]
    if loose.area() < SPECK_MM2 or (loose ^ room.ground[m]).area() < SPECK_MM2:
        return Polygons()
    return solid(loose - leaning(bodies[m - 1], float(room.lean_mm[m])))


def _barred(root: Polygons, outlines: Sequence[Polygons], room: Room, process: Process, m: int) -> Polygons:
    """Where the gaps to the part forbid support, about a root."""
    window = around(root, process.support_distance_mm + 1.0)
    under = int(np.searchsorted(room.top_mm, room.bottom_mm[m] - process.support_bottom_gap_mm + EVEN_MM, side="right"))
    over = int(np.searchsorted(room.bottom_mm, room.top_mm[m] + process.support_gap_mm - EVEN_MM))
    beside = grown((outlines[m] ^ window).simplify(COARSE_MM), process.support_distance_mm + COARSE_MM)
    near = [*outlines[min(under, m) : m], *outlines[m + 1 : over]]
    return united([beside, *(outline ^ window for outline in near)])
