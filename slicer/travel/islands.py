"""Islands: what of a layer hangs together, the section's pieces and those of its support, and a short way through all of them."""

from collections.abc import Sequence

import numpy as np

from mdp.mesh import Floats, Ints
from slicer.bead import Bead
from slicer.geometry.polygons import Polygons, area_mm2, contours
from slicer.paths import Kind

OUTSIDE = -1000  # ranks up to this belong to no island of the section: skirt, brim, support
SUPPORTS = (Kind.SUPPORT, Kind.SUPPORT_INTERFACE)
FIRST = -1  # the number of what comes before all islands: skirt and brim


def islands_of(beads: Sequence[Bead], section: Polygons, support: Polygons) -> Ints:
    """(n,) the number of each bead's island: the smallest outer contour round its start, of the section or of its support.

    Those of support come after those of the section; FIRST: skirt and brim.
    """
    ranks = np.array([bead.rank for bead in beads], dtype=np.int32)
    starts = np.array([bead.points[0] for bead in beads]).reshape(-1, 2)
    torn_off = np.array([bead.kind in SUPPORTS for bead in beads], dtype=np.bool_)
    islands = np.where(ranks <= OUTSIDE, FIRST, 0).astype(np.int32)
    own, after = ranks > OUTSIDE, 0
    for wanted, area in ((own, section), (~own & torn_off, support)):
        if wanted.any():
            islands[wanted] = after + _pieces_around(starts[wanted], area)
            after = int(islands.max()) + 1
    return islands


def _pieces_around(starts: Floats, area: Polygons) -> Ints:
    """(n,) the number of the area's piece that each start lies in; those in none have a number of their own."""
    outer = sorted((loop for loop in contours(area) if area_mm2(loop) > 0), key=lambda loop: abs(area_mm2(loop)))
    if len(outer) < 2:
        return np.zeros(len(starts), np.int32)
    import shapely  # 30 ms, which commands that slice nothing need not spend

    rings = shapely.linearrings(np.concatenate(outer), indices=np.repeat(np.arange(len(outer)), [len(loop) for loop in outer]))
    piece, start = shapely.STRtree(shapely.points(starts)).query(shapely.polygons(rings), "contains")
    pieces = np.full(len(starts), len(outer), np.int32)
    np.minimum.at(pieces, start, piece.astype(np.int32))  # of an island in a hole of another one the inner, which is smaller
    return pieces
