"""Fuzzy skin: walls whose points are moved at random, which hides the layers and gives a better grip.

A wall is sampled anew at random distances, and every point moved across the wall, as PrusaSlicer does (PerimeterGenerator.cpp,
fuzzy_polygon). It begins and ends where it did, so seams stay where they are hidden. The random numbers depend only on where
the wall comes in the print, so the bytes are the same on any number of cores.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from mdp.mesh import Floats
from profiles.process import Process
from slicer.bead import Bead
from slicer.geometry.edge_index import EdgeIndex, depths, index_edges
from slicer.geometry.polygons import Polygons, area_mm2, offset, union
from slicer.paths import Kind

SPREAD = 0.25  # share by which the distance of points varies
FEWEST = 3  # points between the ends of a rough wall: a shorter wall stays even, or nothing would be left of it


def fuzzy_walls(beads: Sequence[Bead], process: Process, joints: Sequence[Polygons], seed: tuple[int, int]) -> list[Bead]:
    """The beads of a layer, begun at their seams, with the walls that are to be rough moved.

    joints: the areas of other parts in this layer and its neighbours, beside which walls stay as they are; seed: numbers of
    part and layer.
    """
    reach_mm = process.line_width_mm + process.fuzzy_skin_thickness_mm
    even = index_edges(offset(union(joints), reach_mm) if joints else Polygons())
    return [
        replace(bead, points=_roughened(bead.points, process, even, (*seed, k))) if _is_fuzzy(bead, process.fuzzy_skin) else bead
        for k, bead in enumerate(beads)
    ]


def _is_fuzzy(bead: Bead, wanted: str) -> bool:
    if bead.line:
        return False
    if bead.kind is Kind.INNER_WALL:
        return wanted == "allwalls"
    return bead.kind is Kind.OUTER_WALL and (wanted != "external" or area_mm2(bead.points) > 0.0)


def _roughened(points: Floats, process: Process, even: EdgeIndex, seed: tuple[int, ...]) -> Floats:
    """A wall (n, 2) sampled anew outside the area, given by its edges, in which it stays as it is."""
    random, apart_mm = np.random.default_rng(seed), process.fuzzy_skin_point_distance_mm
    steps = np.diff(points, axis=0)
    along = np.concatenate([[0.0], np.cumsum(np.hypot(*steps.T))])
    most = int(along[-1] / ((1.0 - SPREAD) * apart_mm)) + 1
    sampled = np.cumsum(apart_mm * random.uniform(1.0 - SPREAD, 1.0 + SPREAD, most))
    sampled = sampled[sampled < along[-1] - (1.0 - SPREAD) * apart_mm]
    if len(sampled) < FEWEST:
        return points
    moved_mm = process.fuzzy_skin_thickness_mm * random.uniform(-1.0, 1.0, len(sampled))
    step = np.minimum(np.searchsorted(along, sampled, side="right") - 1, len(steps) - 1)
    lengths = np.maximum(np.diff(along), 1e-9)
    tangent = steps[step] / lengths[step, None]
    at = points[step] + (sampled - along[step])[:, None] * tangent
    rough = at + moved_mm[:, None] * np.column_stack([tangent[:, 1], -tangent[:, 0]])
    stays, goes = depths(points, even) > 0.0, depths(at, even) <= 0.0
    stays[[0, -1]] = True
    order = np.argsort(np.concatenate([along[stays], sampled[goes]]), kind="stable")
    return np.ascontiguousarray(np.concatenate([points[stays], rough[goes]])[order])
