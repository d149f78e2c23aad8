"""Chordal axis (Prasad 1997): chains of the middles of a triangulation's inner sides, with the width of the polygon along them.

In the Delaunay triangulation of a narrow polygon most triangles have one side on the boundary: the middles of their two inner
sides join to the axis, the height over the boundary side is the local width. Triangles with three inner sides are forks, those
with one are tips.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from mdp.kernels.arrays import flags, longs
from mdp.kernels.kernel import kernel, part
from mdp.mesh import Floats
from slicer.geometry.triangulation import Triangulation, doubled_area

Indices = NDArray[np.int64]


class Axis(NamedTuple):
    """points: (n, 2) mm; widths: (n,) mm; of each chain where it starts, its ends and its place; areas: (p,) mm2 of places.

    A place is a connected piece of the polygons. An end is the number of a fork triangle, or -1 at a tip; a ring has both ends
    -1 and repeats its first point.
    """

    points: Floats
    widths: Floats
    starts: Indices
    ends: Indices
    places: Indices
    areas: Floats


class _Triangles(NamedTuple):
    """Of each triangle its inner sides, the width over its boundary side (0: none) and its place."""

    inner: Indices
    width: Floats
    place: Indices


def chordal_axis(triangulation: Triangulation) -> Axis:
    """The chordal axis of the triangulated polygons."""
    most, size = 2 * len(triangulation.tails) + 8, len(triangulation.tails) // 3
    triangles = _Triangles(np.zeros(size, np.int64), np.zeros(size), np.full(size, -1, np.int64))
    starts, ends, places = np.empty(most, np.int64), np.empty((most, 2), np.int64), np.empty(most, np.int64)
    out = Axis(np.empty((most, 2)), np.empty(most), starts, ends, places, np.zeros(size))
    n, count, many = _trace(triangulation, triangles, out)
    return Axis(out.points[:n], out.widths[:n], starts[:count], ends[:count], places[:count], out.areas[:many])


@part
def _measure(triangulation: Triangulation, triangles: _Triangles, areas: Floats) -> int:
    """Fills in what is known of the triangles and the areas of their places; returns how many places there are."""
    points, tails, across = triangulation
    inner, width, place = triangles
    for t in range(len(inner)):
        doubled = doubled_area(points, tails[3 * t], tails[3 * t + 1], tails[3 * t + 2])
        for k in range(3):
            a, b = tails[3 * t + k], tails[3 * t + (k + 1) % 3]
            if across[3 * t + k] >= 0:
                inner[t] += 1
            else:
                width[t] = doubled / max(np.hypot(points[b, 0] - points[a, 0], points[b, 1] - points[a, 1]), 1e-9)
    stack = longs(len(inner), 0)
    places = 0
    for seed in range(len(inner)):
        if place[seed] >= 0:
            continue
        place[seed] = places
        stack[0], waiting = seed, 1
        while waiting > 0:
            waiting -= 1
            t = stack[waiting]
            areas[places] += 0.5 * doubled_area(points, tails[3 * t], tails[3 * t + 1], tails[3 * t + 2])
            for k in range(3):
                other = across[3 * t + k] // 3
                if other >= 0 and place[other] < 0:
                    place[other] = places
                    stack[waiting] = other
                    waiting += 1
        places += 1
    return places


@part
def _add_fork(triangulation: Triangulation, t: int, out: Axis, n: int) -> int:
    """Appends the middle of a fork triangle, whose width is unknown; the new n."""
    points, tails = triangulation.points, triangulation.tails
    for axis in range(2):
        total = points[tails[3 * t], axis] + points[tails[3 * t + 1], axis] + points[tails[3 * t + 2], axis]
        out.points[n, axis] = total / 3.0
    out.widths[n] = -1.0
    return n + 1


@kernel
def _trace(triangulation: Triangulation, triangles: _Triangles, out: Axis) -> tuple[int, int, int]:
    """Fills in the axis; returns how many points, chains and places there are. Chains with an end come first, then rings."""
    points, tails, across = triangulation
    inner, width, place = triangles
    many = _measure(triangulation, triangles, out.areas)
    done = flags(len(tails))
    n = count = 0
    for rings in range(2):
        for h0 in range(len(tails)):
            t = h0 // 3
            if done[h0] or across[h0] < 0 or (rings == 0 and inner[t] == 2):
                continue
            out.starts[count], out.places[count] = n, place[t]
            out.ends[count, 0] = t if inner[t] == 3 else -1
            if inner[t] == 3:
                n = _add_fork(triangulation, t, out, n)
            h = h0
            while True:
                done[h] = done[across[h]] = True
                next_t = across[h] // 3
                a, b = tails[h], tails[h - h % 3 + (h + 1) % 3]
                out.points[n, 0], out.points[n, 1] = 0.5 * (points[a, 0] + points[b, 0]), 0.5 * (points[a, 1] + points[b, 1])
                near, far = width[h // 3] * (inner[h // 3] == 2), width[next_t] * (inner[next_t] == 2)
                out.widths[n] = 0.5 * (near + far) if near > 0.0 and far > 0.0 else max(near, far)
                n += 1
                t = next_t
                if inner[t] != 2:
                    break
                back = across[h]
                for k in range(3):
                    if 3 * t + k != back and across[3 * t + k] >= 0:
                        h = 3 * t + k
                if done[h]:
                    first = out.starts[count]
                    out.points[n, 0], out.points[n, 1] = out.points[first, 0], out.points[first, 1]
                    out.widths[n] = out.widths[first]
                    n += 1
                    break
            out.ends[count, 1] = t if inner[t] == 3 else -1
            if inner[t] == 3:
                n = _add_fork(triangulation, t, out, n)
            _fill_widths(out.points, out.widths, out.starts[count], n)
            count += 1
    return n, count, many


@part
def _fill_widths(points: Floats, widths: Floats, start: int, end: int) -> None:
    """Forks and sides between forks take the width of the nearest measured side, else the distance they bridge."""
    known = 0.0
    for i in range(start, end):
        if widths[i] > 0.0:
            known = widths[i]
        elif known > 0.0:
            widths[i] = known
    for i in range(end - 1, start - 1, -1):
        if widths[i] > 0.0:
            known = widths[i]
        else:
            widths[i] = known
    if known <= 0.0:
        gap = np.hypot(points[end - 1, 0] - points[start, 0], points[end - 1, 1] - points[start, 1])
        for i in range(start, end):
            widths[i] = max(gap, 1e-3)
