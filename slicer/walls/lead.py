"""Lead: how an outer wall begins and ends inside, over its inner walls, where no seam is wanted anywhere along it."""

import numpy as np

from mdp.mesh import Floats
from slicer.geometry.distance import distances
from slicer.geometry.polygons import edges_of, start_at

SAMPLE_MM = 2.0  # straight sides are tried at this distance, too
OFF_WALL = 0.7  # of its length a lead has to reach inside: so far beside its middle the outer wall is out of the tip's way


def lead_in(loop: Floats, lead_mm: float) -> Floats:
    """(2,) from the loop's beginning to where a lead inside begins, as far as there is room."""
    way = _inward(loop)
    lead: Floats = way * min(lead_mm, 0.5 * _room_mm(loop, way))
    return lead


def begin_with_room(loop: Floats, lead_mm: float) -> Floats:
    """The loop, begun at the place nearest to its beginning from which a lead leaves its outer wall; the one with most room where
    there is none: in a sharp corner the way inside runs along the wall.
    """
    deepest, most = loop, _depth_mm(loop, lead_mm)
    if most >= OFF_WALL * lead_mm:
        return loop
    steps = start_at(loop, 1) - loop
    counts = (np.hypot(*steps.T) / SAMPLE_MM).astype(np.int64) + 1
    places = [(i, s / counts[i]) for i in range(len(loop)) for s in range(counts[i])]
    places.sort(key=lambda place: float(np.hypot(*(loop[place[0]] + place[1] * steps[place[0]] - loop[0]))))
    for i, share in places:
        begun = start_at(loop, i)
        if share:
            begun = np.concatenate([(loop[i] + share * steps[i])[None], start_at(loop, (i + 1) % len(loop))])
        depth = _depth_mm(begun, lead_mm)
        if depth > most:
            deepest, most = begun, depth
        if depth >= OFF_WALL * lead_mm:
            break
    return deepest


def _depth_mm(loop: Floats, lead_mm: float) -> float:
    """How far from the loop a lead begins."""
    return float(distances((loop[0] + lead_in(loop, lead_mm))[None], edges_of([loop]))[0])


def _inward(loop: Floats) -> Floats:
    """Unit vector to the left of the loop at its beginning, where the solid is."""
    steps = np.array([loop[0] - loop[-1], loop[1] - loop[0]])
    steps /= np.maximum(np.hypot(*steps.T), 1e-12)[:, None]
    along = steps.sum(axis=0)
    length = float(np.hypot(*along))
    along = along / length if length > 1e-6 else steps[1]
    return np.array([-along[1], along[0]])


def _room_mm(loop: Floats, way: Floats) -> float:
    """How far the inside of a loop (n, 2) reaches from its beginning along a unit vector; 0 where that leads out of it."""
    sides, beside = start_at(loop, 1) - loop, (loop - loop[0]) @ np.array([-way[1], way[0]])
    following = start_at(beside, 1)
    crossed = np.flatnonzero((beside > 0.0) != (following > 0.0))
    share = beside[crossed] / (beside[crossed] - following[crossed])
    along = (loop[crossed] + share[:, None] * sides[crossed] - loop[0]) @ way
    along = along[along > 1e-6]
    return float(along.min()) if len(along) % 2 else 0.0
