"""Spans: whether parallel lines of limited length can bridge an overhang from anchor to anchor, and whether every point of it is
close to an anchor.

Shared by the search, for patches of the surface, and the slicer, for bridges (slicer.overhangs): where lines cross the sides, and
how much of their length may be loose or too long. Each caller chooses its directions and lines, and its anchors: in the search
the anchored sides of the rim, in the slicer the layer below.
"""

from typing import NamedTuple

import numpy as np

from mdp.kernels.arrays import floats, ints
from mdp.kernels.kernel import helper, no_nrt
from mdp.mesh import Floats, Ints

TURNS = 8  # directions tried over half a turn, besides those of the patch's sides: the search tests thousands of patches
BINS = 36  # bins for the directions of the sides, over half a turn
BESIDE = 0.37  # share of a bin: position of direction 0 in the first one, so that common angles lie at no end of a bin
LINES = 24  # greatest number of lines over a patch, otherwise one per line width
MOST_LOOSE = 0.2  # greatest share of loose line ends
TOLERATED = 0.02  # greatest share of the lines' length with a loose end, as at corners of a patch
ROUNDING_MM = 0.05  # tolerance on the length of a span
FINE_MM = 0.1  # between two tested points, neither too far from an anchor
NEAR_ROUNDING_MM = 1e-6  # tolerance on the distance from a side
DEEP = 64  # nested halvings of a triangle


class Sides(NamedTuple):
    """The rim of an overhang projected along the direction, mm: ends (n, 4) x, y, x, y, and whether each side is an anchor
    (n,).
    """

    ends: Floats
    anchored: Ints


@helper
def spans(sides: Sides, area_mm2: float, longest_mm: float, width_mm: float) -> bool:
    """Whether parallel lines, at least a line width apart and none too long, bridge a patch of the given area."""
    if longest_mm <= 0.0 or len(sides.anchored) == 0:
        return False
    angles = _angles(sides.ends)
    for a in range(len(angles)):
        cos, sin = np.cos(angles[a]), np.sin(angles[a])
        across_mm, loose_mm = _across(sides, cos, sin)
        if (
            area_mm2 <= 0.5 * (longest_mm + ROUNDING_MM) * across_mm  # otherwise the mean line is too long
            and loose_mm <= MOST_LOOSE * across_mm
            and _spans_along(sides, cos, sin, longest_mm, width_mm)
        ):
            return True
    return False


@helper
def _across(sides: Sides, cos: float, sin: float) -> tuple[float, float]:
    """Extent of the sides across lines at an angle: of all sides, and of those that are not anchors."""
    ends, whole, loose = sides.ends, 0.0, 0.0
    for e in range(len(ends)):
        reach = abs((ends[e, 3] - ends[e, 1]) * cos - (ends[e, 2] - ends[e, 0]) * sin)
        whole += reach
        loose += 0.0 if sides.anchored[e] > 0 else reach
    return whole, loose


@helper
def _angles(ends: Floats) -> Floats:
    """Directions to try, radians: along and across the two most common directions of the sides, and evenly spread ones."""
    length, turned = floats(BINS, 0.0), floats(BINS, 0.0)
    for e in range(len(ends)):
        x, y = ends[e, 2] - ends[e, 0], ends[e, 3] - ends[e, 1]
        angle, size = np.arctan2(y, x), np.sqrt(x * x + y * y)
        angle -= np.pi * np.floor(angle / np.pi + BESIDE / BINS)
        b = min(max(int(angle / np.pi * BINS + BESIDE), 0), BINS - 1)
        length[b] += size
        turned[b] += size * angle
    angles = floats(TURNS + 4, 0.0)
    for own in range(2):
        b = 0
        for candidate in range(1, BINS):
            if length[candidate] > length[b]:
                b = candidate
        angle = turned[b] / length[b] if length[b] > 0.0 else 0.1 * own
        angles[2 * own], angles[2 * own + 1] = angle + 0.5 * np.pi, angle
        length[b] = 0.0
    for k in range(TURNS):
        angles[4 + k] = np.pi * k / TURNS
    return angles


@helper
def _spans_along(sides: Sides, cos: float, sin: float, longest_mm: float, width_mm: float) -> bool:
    """Whether lines at an angle bridge the patch. The middle line comes first, since it is the most informative."""
    ends, count = sides.ends, len(sides.anchored)
    low, high = np.inf, -np.inf
    for e in range(count):
        y = ends[e, 1] * cos - ends[e, 0] * sin
        low, high = min(low, y), max(high, y)
    lines = max(min(int((high - low) / width_mm), LINES), 1)
    places, crossed = floats(count, 0.0), ints(count, 0)
    total, loose = 0.0, 0.0
    for k in range(lines):
        y = low + (high - low) * (((lines // 2 + k) % lines) + 0.5) / lines
        for c in range(0, line_across(ends, (cos, sin), y, places, crossed) - 1, 2):
            span = places[c + 1] - places[c]
            if span > longest_mm + ROUNDING_MM:
                return False
            total += span
            loose += 0.0 if sides.anchored[crossed[c]] > 0 and sides.anchored[crossed[c + 1]] > 0 else span
    return loose <= TOLERATED * total


@no_nrt
def line_across(ends: Floats, along: tuple[float, float], y: float, places: Floats, crossed: Ints) -> int:
    """Fill in the positions at which a line crosses sides (n, 4), ascending, and the numbers of the sides; returns the count.

    along: cosine and sine of the line's direction; y: its height in the frame turned by it; places: positions along it.
    """
    cos, sin = along
    count = 0
    for e in range(len(ends)):
        begin, end = ends[e, 1] * cos - ends[e, 0] * sin - y, ends[e, 3] * cos - ends[e, 2] * sin - y
        if (begin < 0.0) != (end < 0.0):
            share = begin / (begin - end)
            x = ends[e, 0] + share * (ends[e, 2] - ends[e, 0])
            place, at = x * cos + (ends[e, 1] + share * (ends[e, 3] - ends[e, 1])) * sin, count
            while at > 0 and places[at - 1] > place:
                places[at], crossed[at] = places[at - 1], crossed[at - 1]
                at -= 1
            places[at], crossed[at] = place, e
            count += 1
    return count


@no_nrt
def is_near_anchors(sides: Sides, reach_mm: float, triangle: Floats, todo: Floats, nearest: int) -> int:
    """The last anchor used if every point of a triangle (6,), x, y of its corners, lies within reach of anchors; -1 otherwise.
    nearest: the anchor to try first; todo (DEEP, 6): scratch space for triangles.
    """
    count = 1
    for k in range(6):
        todo[0, k] = triangle[k]
    while count > 0:
        count -= 1
        t = todo[count]
        for k in range(3):
            nearest = _anchor_near(sides, t[2 * k : 2 * k + 2], reach_mm, nearest)
            if nearest < 0:
                return -1
        longest, split = 0.0, 0
        for k in range(3):
            n = (k + 1) % 3
            length = (t[2 * n] - t[2 * k]) ** 2 + (t[2 * n + 1] - t[2 * k + 1]) ** 2
            if length > longest:
                longest, split = length, k
        if longest > FINE_MM * FINE_MM and _anchor_near(sides, t, reach_mm, nearest) < 0 and count + 2 <= DEEP:
            _halve(todo, count, split)
            count += 2
    return nearest


@no_nrt
def _halve(todo: Floats, at: int, split: int) -> None:
    """Replace a triangle by its halves, in its row and the next one, split at the middle of an edge."""
    a, b, c = 2 * split, 2 * ((split + 1) % 3), 2 * ((split + 2) % 3)
    for axis in range(2):
        middle = 0.5 * (todo[at, a + axis] + todo[at, b + axis])
        todo[at + 1, 0 + axis], todo[at + 1, 2 + axis], todo[at + 1, 4 + axis] = middle, todo[at, b + axis], todo[at, c + axis]
        todo[at, b + axis] = middle


@no_nrt
def _anchor_near(sides: Sides, places: Floats, reach_mm: float, first: int) -> int:
    """An anchored side within reach of all given points x, y, x, y, and so of all points between them, starting with side
    `first`; -1 if there is none.
    """
    count = len(sides.anchored)
    for k in range(count):
        e = (first + k) % count
        if sides.anchored[e] > 0:
            near = 0
            while near < len(places) and _is_near(sides.ends, e, places[near], places[near + 1], reach_mm):
                near += 2
            if near == len(places):
                return e
    return -1


@no_nrt
def _is_near(ends: Floats, e: int, x: float, y: float, reach_mm: float) -> bool:
    """Whether a point lies within reach of a side."""
    ax, ay, bx, by = ends[e, 0], ends[e, 1], ends[e, 2] - ends[e, 0], ends[e, 3] - ends[e, 1]
    length = bx * bx + by * by
    share = ((x - ax) * bx + (y - ay) * by) / length if length > 0.0 else 0.0
    share = min(max(share, 0.0), 1.0)
    return bool((x - ax - share * bx) ** 2 + (y - ay - share * by) ** 2 <= (reach_mm + NEAR_ROUNDING_MM) ** 2)
