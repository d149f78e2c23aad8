"""Dips: whether a hanging place begins in mid-air (numba kernels).

It does where it holds a bottom of the surface that lies deeper than DIP_MM below all ways out of it. The region of a surface that
lies below some height and is connected with a bottom does not depend on how it is cut into triangles.
"""

from typing import NamedTuple

from mdp.kernels.kernel import no_nrt
from mdp.mesh import Floats, Ints
from mdp.topology.linked_faces import LinkedFaces

DIP_MM = 0.05  # a quarter of a usual layer: no layer shows it
ROUNDING_MM = 1e-6  # bottoms whose heights differ by less are as low
UNSEEN = -1  # no vertex


class Pool(NamedTuple):
    """seen (n,): from which bottom, one with a way out, a vertex was seen, UNSEEN else; queue (n,): room."""

    seen: Ints
    queue: Ints


@no_nrt
def begins_in_air(surface: LinkedFaces, heights: Floats, patch: Ints, pool: Pool, base_mm: float) -> bool:
    """Whether a patch has a bottom in the air."""
    for f in patch:
        for k in range(3):
            v = surface.faces[f, k]
            candidate = pool.seen[v] == UNSEEN and heights[v] > base_mm and _is_bottom(surface, heights, v)
            if candidate and not _has_way_out(surface, heights, v, pool, base_mm):
                return True
    return False


@no_nrt
def _is_bottom(surface: LinkedFaces, heights: Floats, v: int) -> bool:
    """Whether no vertex next to one lies lower."""
    at, end = surface.starts[v], surface.starts[v + 1]
    while at < end and heights[surface.around[at]] >= heights[v]:
        at += 1
    return bool(at == end)


@no_nrt
def _has_way_out(surface: LinkedFaces, heights: Floats, bottom: int, pool: Pool, base_mm: float) -> bool:
    """Whether what hangs together with a bottom and lies no higher than DIP_MM above it goes on below it or to the base. If so,
    it has been seen, as far as one had to look."""
    seen, queue = pool.seen, pool.queue
    low = heights[bottom] - ROUNDING_MM
    seen[bottom], queue[0] = bottom, bottom
    at, count = 0, 1
    while at < count:
        v = queue[at]
        for k in range(surface.starts[v], surface.starts[v + 1]):
            w = surface.around[k]
            if heights[w] < low or heights[w] <= base_mm or _leads_out(seen[w], bottom, heights):
                return True
            if seen[w] != bottom and heights[w] <= heights[bottom] + DIP_MM:
                seen[w], queue[count] = bottom, w
                count += 1
        at += 1
    for k in range(count):
        seen[queue[k]] = UNSEEN
    return False


@no_nrt
def _leads_out(seen_bottom: int, bottom: int, heights: Floats) -> bool:
    """Whether another bottom as low, which has a way out, has been found."""
    return bool(seen_bottom != UNSEEN and seen_bottom != bottom and abs(heights[seen_bottom] - heights[bottom]) <= ROUNDING_MM)
