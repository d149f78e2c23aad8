"""Narrow: whether a hanging place reaches nowhere far from its anchors (numba kernels)."""

from mdp.kernels.arrays import table
from mdp.kernels.kernel import helper, no_nrt
from mdp.mesh import Floats, Ints
from mdp.support_need.spans import Sides

FINE_MM = 0.1  # between two places that are looked at, neither of them too far from an anchor
ROUNDING_MM = 1e-6  # a place just as far from a side as it may be
DEEP = 64  # halvings of a triangle, one within the other


@no_nrt
def is_near_anchors(sides: Sides, reach_mm: float, triangle: Floats, todo: Floats, nearest: int) -> int:
    """An anchor within reach of a triangle (6,), x, y of its corners, all of which lies within reach of anchors; -1: some of it
    does not. nearest: the anchor to try first; todo (DEEP, 6): room for triangles."""
    count = 1
    for k in range(6):
        todo[0, k] = triangle[k]
    while count > 0:
        count -= 1
        t = todo[count]
        for k in range(3):
            nearest = _near_anchor(sides.ends, sides.anchored, t[2 * k], t[2 * k + 1], reach_mm, nearest)
            if nearest < 0:
                return -1
        longest, split = 0.0, 0
        for k in range(3):
            n = (k + 1) % 3
            length = (t[2 * n] - t[2 * k]) ** 2 + (t[2 * n + 1] - t[2 * k + 1]) ** 2
            if length > longest:
                longest, split = length, k
        if longest > FINE_MM * FINE_MM and not _all_near_one(sides, t, reach_mm, nearest) and count + 2 <= DEEP:
            _halve(todo, count, split)
            count += 2
    return nearest


@helper
def triangles_room() -> Floats:
    """Room for the triangles of is_near_anchors."""
    return table(DEEP, 6)


@no_nrt
def _halve(todo: Floats, at: int, split: int) -> None:
    """Put the halves of a triangle in its place and the one after it, cut through the middle of an edge."""
    a, b, c = 2 * split, 2 * ((split + 1) % 3), 2 * ((split + 2) % 3)
    for axis in range(2):
        middle = 0.5 * (todo[at, a + axis] + todo[at, b + axis])
        todo[at + 1, 0 + axis], todo[at + 1, 2 + axis], todo[at + 1, 4 + axis] = middle, todo[at, b + axis], todo[at, c + axis]
        todo[at, b + axis] = middle


@no_nrt
def _all_near_one(sides: Sides, t: Floats, reach_mm: float, first: int) -> bool:
    """Whether one anchor lies near all corners of a triangle, and so near all of it."""
    ends, anchored, count = sides.ends, sides.anchored, len(sides.anchored)
    for k in range(count):
        e = (first + k) % count
        if anchored[e] > 0:
            near = 0
            while near < 3 and _is_near(ends, e, t[2 * near], t[2 * near + 1], reach_mm):
                near += 1
            if near == 3:
                return True
    return False


@no_nrt
def _near_anchor(ends: Floats, anchored: Ints, x: float, y: float, reach_mm: float, first: int) -> int:
    """A anchored side within reach of a place, looked for from a side on; -1: none."""
    count = len(anchored)
    for k in range(count):
        e = (first + k) % count
        if anchored[e] > 0 and _is_near(ends, e, x, y, reach_mm):
            return e
    return -1


@no_nrt
def _is_near(ends: Floats, e: int, x: float, y: float, reach_mm: float) -> bool:
    """Whether a place lies within reach of a side."""
    ax, ay, bx, by = ends[e, 0], ends[e, 1], ends[e, 2] - ends[e, 0], ends[e, 3] - ends[e, 1]
    length = bx * bx + by * by
    share = ((x - ax) * bx + (y - ay) * by) / length if length > 0.0 else 0.0
    share = min(max(share, 0.0), 1.0)
    return bool((x - ax - share * bx) ** 2 + (y - ay - share * by) ** 2 <= (reach_mm + ROUNDING_MM) ** 2)
