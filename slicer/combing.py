"""Combing: ways through the inside of a section for travels whose straight line would leave it.

The way follows the border of the section's inside from where the straight line leaves it to where it comes back, the shorter
way round, and is then pulled taut. Every segment of it is tested against the border of the section's safe inside.
"""

from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from mdp.kernel import floats, kernel, longs, part
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
        out: NDArray[np.bool_] = _leaves(self.safe, since, to, True)
        return out

    def crosses(self, since: Floats, to: Floats) -> NDArray[np.bool_]:
        """(n, 2) by two whether the travels between these points cross the border of the safe inside, wherever they begin."""
        out: NDArray[np.bool_] = _leaves(self.safe, since, to, False)
        return out

    def way(self, start: Floats, end: Floats, detour_mm: float) -> Floats | None:
        """Points (k, 2) between start and end of a way inside, at most detour_mm longer than the straight line; or None."""
        longest = float(np.hypot(*(end - start))) + detour_mm
        for track in (self._behind, self._among):
            way = np.empty((len(track.sides) + 2 * len(track.begins) + 4, 2))
            count = _way(self.safe, track, start[0], start[1], end[0], end[1], longest, 2.0 * self._width_mm, way)
            if count > 1:
                return way[1 : count - 1].copy()
        return None


@kernel
def _leaves(safe: Lattice, since: Floats, to: Floats, begins_within: bool) -> NDArray[np.bool_]:
    """Which segments cross the border, or begin outside where that counts."""
    out = np.empty(len(to), np.bool_)
    for k in range(len(to)):
        x, y = since[k, 0], since[k, 1]
        out[k] = (begins_within and not within(safe, x, y)) or not free(safe, x, y, to[k, 0], to[k, 1])
    return out


@part
def _reached(safe: Lattice, track: Lattice, x: float, y: float, reach: float) -> tuple[float, float, bool]:
    """Where a way from a point begins: there, or where it reaches the track's inside; and whether it does."""
    if within(track, x, y):
        return x, y, True
    ax, ay, side = nearest(track, x, y, reach)
    return ax + 1e-7 * (ax - x), ay + 1e-7 * (ay - y), side >= 0 and free(safe, x, y, ax, ay)


@kernel
def _way(
    safe: Lattice, track: Lattice, x0: float, y0: float, x1: float, y1: float, longest: float, reach: float, way: Floats
) -> int:
    """Fills in the way from one point to the other, both included; returns how many points it has, 0 where there is none."""
    ax, ay, begins = _reached(safe, track, x0, y0, reach)
    if not begins:
        return 0
    bx, by, ends = _reached(safe, track, x1, y1, reach)
    if not ends:
        return 0
    way[0, 0], way[0, 1] = x0, y0
    n = _along(track, ax, ay, bx, by, TAUT * longest, way)
    if n == 0:
        return 0
    way[n, 0], way[n, 1] = x1, y1
    n += 1
    for _ in range(2):
        n = _pulled(safe, way, n)
        if n == 0:
            return 0
    total = 0.0
    for i in range(1, n):
        total += np.hypot(way[i, 0] - way[i - 1, 0], way[i, 1] - way[i - 1, 1])
    return n if total <= longest else 0


@part
def _along(track: Lattice, x0: float, y0: float, x1: float, y1: float, longest: float, way: Floats) -> int:
    """Appends the straight line, each stretch outside replaced by the way along the loop that it leaves through and returns by.

    From row 1 on; returns the number of rows, 0 where there is no such way.
    """
    room = 16
    at, which = floats(room, 0.0), longs(room, 0)
    many = crossings(track, x0, y0, x1, y1, at, which)
    while many < 0:
        room *= 4
        at, which = floats(room, 0.0), longs(room, 0)
        many = crossings(track, x0, y0, x1, y1, at, which)
    way[1, 0], way[1, 1] = x0, y0
    n, left, k = 2, longest, 0
    while k < many:
        last = k
        for j in range(k + 1, many):
            if track.loop[which[j]] == track.loop[which[k]]:
                last = j
        if last == k:  # the end lies beyond this loop: in another island
            return 0
        way[n, 0], way[n, 1] = x0 + at[k] * (x1 - x0), y0 + at[k] * (y1 - y0)
        bx, by = x0 + at[last] * (x1 - x0), y0 + at[last] * (y1 - y0)
        n, length = _round(track, which[k], which[last], bx, by, left, way, n)
        if n == 0:
            return 0
        left -= length
        k = last + 1
    way[n, 0], way[n, 1] = x1, y1
    return n + 1


@part
def _round(
    track: Lattice, leaving: int, coming: int, bx: float, by: float, longest: float, way: Floats, n: int
) -> tuple[int, float]:
    """Appends the shorter way along a loop from row n, on the side `leaving`, to a point bx, by of another side, `coming`.

    Returns the new number of rows, 0 when the way is too long, and its length.
    """
    least, shorter = np.inf, 1
    for sense in range(1, -2, -2):
        _, length = _walk(track, leaving, coming, bx, by, longest, way, n, sense)
        if length < least:
            least, shorter = length, sense
    if least > longest:
        return 0, least
    end, least = _walk(track, leaving, coming, bx, by, longest, way, n, shorter)
    return end, least


@part
def _walk(
    track: Lattice, leaving: int, coming: int, bx: float, by: float, longest: float, way: Floats, n: int, sense: int
) -> tuple[int, float]:
    """Appends the way along a loop forward (1) or backward (-1) until it is too long; the new number of rows and the length."""
    begin, end = track.begins[track.loop[leaving]], track.begins[track.loop[leaving] + 1]
    side, length, corner = leaving, 0.0, 1 + sense
    while side != coming and length <= longest:
        way[n + 1, 0], way[n + 1, 1] = track.sides[side, corner], track.sides[side, corner + 1]
        length += np.hypot(way[n + 1, 0] - way[n, 0], way[n + 1, 1] - way[n, 1])
        side = begin + (side - begin + sense) % (end - begin)
        n += 1
    way[n + 1, 0], way[n + 1, 1] = bx, by
    return n + 2, length + np.hypot(bx - way[n, 0], by - way[n, 1])


@part
def _pulled(safe: Lattice, way: Floats, count: int) -> int:
    """Leaves as few points of a way as the border allows, in reverse order; returns how many, 0 when it crosses the border."""
    n, i, last = 1, 0, count - 1
    while i < last:
        step = last - i
        while step > 1 and not free(safe, way[i, 0], way[i, 1], way[i + step, 0], way[i + step, 1]):
            step = step - 1 if step <= 8 else (3 * step) // 4
        if step == 1 and not free(safe, way[i, 0], way[i, 1], way[i + 1, 0], way[i + 1, 1]):
            return 0
        i += step
        way[n, 0], way[n, 1] = way[i, 0], way[i, 1]
        n += 1
    for k in range(n // 2):
        for axis in range(2):
            way[k, axis], way[n - 1 - k, axis] = way[n - 1 - k, axis], way[k, axis]
    return n
