"""Combing: ways through the inside of a section for travels whose straight line would leave it.

The way follows the border of the section's inside from where the straight line leaves it to where it comes back, the shorter
way round, and is then pulled taut. Every segment of it is tested against the border of the section's safe inside.
"""

from functools import cached_property

import numpy as np
from numba import njit
from numpy.typing import NDArray

from mdp.mesh import Floats
from slicer.lattice import Lattice, crossings, free, lattice, nearest, within
from slicer.polygons import Polygons, grown

SAFE = 0.4  # line widths inside the section within which travels ooze unseen; centrelines of outer walls lie at 0.5
BEHIND = 1.1  # ways run behind the outer wall where the section is wide enough,
AMONG = 0.45  # else as near to its middle as the walls themselves
TAUT = 3.0  # a way along the border may be longer than allowed by this factor before it is pulled taut
NOWHERE = np.zeros((0, 2))


class Ground:
    """Where the tip may travel in one layer without a retraction."""

    def __init__(self, section: Polygons, width_mm: float) -> None:
        self._section, self._width_mm = section, width_mm

    @cached_property
    def safe(self) -> Lattice:
        """The border that no travel without a retraction crosses."""
        return lattice(grown(self._section, -SAFE * self._width_mm))

    @cached_property
    def _behind(self) -> Lattice:
        return lattice(grown(self._section, -BEHIND * self._width_mm))

    @cached_property
    def _among(self) -> Lattice:
        return lattice(grown(self._section, -AMONG * self._width_mm))

    def leaves(self, since: Floats, to: Floats) -> NDArray[np.bool_]:
        """(n, 2) by two whether the travels between these points leave the safe inside."""
        out: NDArray[np.bool_] = _leaves(self.safe, since, to)
        return out

    def way(self, start: Floats, end: Floats, detour_mm: float) -> Floats | None:
        """Points (k, 2) between start and end of a way inside, at most detour_mm longer than the straight line; or None."""
        longest = float(np.hypot(*(end - start))) + detour_mm
        for track in (self._behind, self._among):
            found = _way(self.safe, track, start[0], start[1], end[0], end[1], longest, 2.0 * self._width_mm)
            if len(found) > 1:
                return np.ascontiguousarray(found[1:-1])
        return None


@njit(cache=True)
def _leaves(safe: Lattice, since: Floats, to: Floats) -> NDArray[np.bool_]:
    out = np.empty(len(to), np.bool_)
    for k in range(len(to)):
        x, y = since[k]
        out[k] = not within(safe, x, y) or not free(safe, x, y, to[k, 0], to[k, 1])
    return out


@njit(cache=True)
def _way(safe: Lattice, track: Lattice, x0: float, y0: float, x1: float, y1: float, longest: float, reach: float) -> Floats:
    """The way from one point to the other, both included; empty where there is none."""
    none = np.zeros((0, 2))
    ax, ay, bx, by = x0, y0, x1, y1
    if not within(track, x0, y0):
        ax, ay, side = nearest(track, x0, y0, reach)
        if side < 0 or not free(safe, x0, y0, ax, ay):
            return none
        ax, ay = ax + 1e-7 * (ax - x0), ay + 1e-7 * (ay - y0)
    if not within(track, x1, y1):
        bx, by, side = nearest(track, x1, y1, reach)
        if side < 0 or not free(safe, x1, y1, bx, by):
            return none
        bx, by = bx + 1e-7 * (bx - x1), by + 1e-7 * (by - y1)
    points = _along(track, ax, ay, bx, by, TAUT * longest)
    if len(points) == 0:
        return none
    way = np.empty((len(points) + 2, 2))
    way[0], way[1:-1], way[-1] = (x0, y0), points, (x1, y1)
    taut = _pulled(safe, way)
    return taut if len(taut) and _length(taut) <= longest else none


@njit(cache=True)
def _length(points: Floats) -> float:
    total = 0.0
    for i in range(1, len(points)):
        total += np.hypot(points[i, 0] - points[i - 1, 0], points[i, 1] - points[i - 1, 1])
    return total


@njit(cache=True)
def _along(track: Lattice, x0: float, y0: float, x1: float, y1: float, longest: float) -> Floats:
    """The straight line, each stretch outside replaced by the way along the loop that it leaves through and returns by."""
    at, which = crossings(track, x0, y0, x1, y1, 1 << 30)
    points = np.empty((2 + 2 * len(at), 2))
    pieces = [np.array([[x0, y0]])]
    left = longest
    k = 0
    while k < len(at):
        loop = track.loop[which[k]]
        last = k
        for j in range(k + 1, len(at)):
            if track.loop[which[j]] == loop:
                last = j
        if last == k:  # the end lies beyond this loop: in another island
            return points[:0]
        leave = np.array([x0 + at[k] * (x1 - x0), y0 + at[k] * (y1 - y0)])
        back = np.array([x0 + at[last] * (x1 - x0), y0 + at[last] * (y1 - y0)])
        piece = _round(track, which[k], leave, which[last], back, left)
        if len(piece) == 0:
            return points[:0]
        left -= _length(piece)
        pieces.append(piece)
        k = last + 1
    pieces.append(np.array([[x1, y1]]))
    n = 0
    for piece in pieces:
        n += len(piece)
    out = np.empty((n, 2))
    n = 0
    for piece in pieces:
        out[n : n + len(piece)] = piece
        n += len(piece)
    return out


@njit(cache=True)
def _round(track: Lattice, leaving: int, leave: Floats, coming: int, back: Floats, longest: float) -> Floats:
    """Along a loop from a point of one side to a point of another, the shorter way round; empty when that is too long."""
    begin, end = track.begins[track.loop[leaving]], track.begins[track.loop[leaving] + 1]
    n = end - begin
    ways = np.empty((2, n + 2, 2))
    counts, lengths = np.empty(2, np.int64), np.empty(2)
    for backward in range(2):
        way = ways[backward]
        way[0] = leave
        count, side, length = 1, leaving, 0.0
        forward_on_one = leaving == coming and (
            np.hypot(leave[0] - track.sides[leaving, 0], leave[1] - track.sides[leaving, 1])
            <= np.hypot(back[0] - track.sides[leaving, 0], back[1] - track.sides[leaving, 1])
        )
        around = n if leaving == coming and forward_on_one == (backward == 1) else 0
        while (side != coming or around > 0) and length <= longest:
            around -= 1
            if backward:
                way[count] = track.sides[side, :2]
                side = begin + (side - begin - 1) % n
            else:
                way[count] = track.sides[side, 2:]
                side = begin + (side - begin + 1) % n
            length += np.hypot(way[count, 0] - way[count - 1, 0], way[count, 1] - way[count - 1, 1])
            count += 1
            if side == coming:
                around = 0
        way[count] = back
        lengths[backward] = length + np.hypot(back[0] - way[count - 1, 0], back[1] - way[count - 1, 1])
        counts[backward] = count + 1
    shorter = 1 if lengths[1] < lengths[0] else 0
    return ways[shorter, : counts[shorter] if lengths[shorter] <= longest else 0]


@njit(cache=True)
def _pulled(safe: Lattice, way: Floats) -> Floats:
    """The way with as few of its points as the border allows, tried from both ends; empty when it crosses the border itself."""
    for _ in range(2):
        kept = np.empty_like(way)
        kept[0] = way[0]
        n, i, last = 1, 0, len(way) - 1
        while i < last:
            step = last - i
            while step > 1 and not free(safe, way[i, 0], way[i, 1], way[i + step, 0], way[i + step, 1]):
                step = step - 1 if step <= 8 else (3 * step) // 4
            if step == 1 and not free(safe, way[i, 0], way[i, 1], way[i + 1, 0], way[i + 1, 1]):
                return way[:0]
            i += step
            kept[n] = way[i]
            n += 1
        way = kept[:n][::-1].copy()
    return way
