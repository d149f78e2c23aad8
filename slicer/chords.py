"""Chords: Delaunay triangulation of sampled polygons by flipping, and the chains of its inner sides' middles."""

import numpy as np
from numpy.typing import NDArray

from mdp.kernel import flags, kernel, longs, part
from mdp.mesh import Floats, Ints

Indices = NDArray[np.int64]
MOST_PASSES = 60  # of flipping; real polygons need fewer than ten, rounding must not make it endless


@part
def _turn(points: Floats, a: int, b: int, c: int) -> float:
    """Twice the signed area of a triangle of three of the points."""
    x, y = points[a, 0], points[a, 1]
    return float((points[b, 0] - x) * (points[c, 1] - y) - (points[b, 1] - y) * (points[c, 0] - x))


@part
def _inside_circle(points: Floats, a: int, b: int, c: int, p: int) -> bool:
    """Whether p lies clearly inside the circle through a, b, c (counter-clockwise)."""
    x, y = points[p, 0], points[p, 1]
    ax, ay, bx, by = points[a, 0] - x, points[a, 1] - y, points[b, 0] - x, points[b, 1] - y
    cx, cy = points[c, 0] - x, points[c, 1] - y
    a2, b2, c2 = ax * ax + ay * ay, bx * bx + by * by, cx * cx + cy * cy
    determinant = a2 * (bx * cy - by * cx) + b2 * (cx * ay - cy * ax) + c2 * (ax * by - ay * bx)
    return bool(determinant > 1e-12)


@part
def _flip(points: Floats, tails: Ints, across: Ints) -> None:
    """Lawson's flips until every inner side is locally Delaunay; tails (3 m,) and across (3 m,) change in place."""
    for _ in range(MOST_PASSES):
        flipped = 0
        for a in range(len(tails)):
            b = across[a]
            if b < a:
                continue
            a_prev, b_prev = a - a % 3 + (a + 2) % 3, b - b % 3 + (b + 2) % 3
            p, q, r, s = tails[a], tails[b], tails[a_prev], tails[b_prev]
            if not _inside_circle(points, p, q, r, s) or _turn(points, s, q, r) <= 0.0 or _turn(points, r, p, s) <= 0.0:
                continue
            outer_a, outer_b = across[a_prev], across[b_prev]
            tails[a], tails[b] = s, r
            across[a], across[b] = outer_b, outer_a
            if outer_b >= 0:
                across[outer_b] = a
            if outer_a >= 0:
                across[outer_a] = b
            across[a_prev], across[b_prev] = b_prev, a_prev
            flipped += 1
        if not flipped:
            break


@part
def _measure(points: Floats, tails: Ints, across: Ints, inner: Indices, width: Floats, place: Indices, areas: Floats) -> int:
    """Per triangle: inner sides, width over its boundary side (0: none), place (connected piece); per place: area.

    Returns how many places there are; inner, width and areas come as zeros, place as -1.
    """
    for t in range(len(inner)):
        doubled = _turn(points, tails[3 * t], tails[3 * t + 1], tails[3 * t + 2])
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
        stack[0], depth = seed, 1
        while depth > 0:
            depth -= 1
            t = stack[depth]
            areas[places] += 0.5 * _turn(points, tails[3 * t], tails[3 * t + 1], tails[3 * t + 2])
            for k in range(3):
                other = across[3 * t + k] // 3
                if other >= 0 and place[other] < 0:
                    place[other] = places
                    stack[depth] = other
                    depth += 1
        places += 1
    return places


@part
def _fork(points: Floats, tails: Ints, t: int, out: Floats, out_width: Floats, n: int) -> int:
    """Appends the middle of a fork triangle, whose width is unknown; the new n."""
    for axis in range(2):
        out[n, axis] = (points[tails[3 * t], axis] + points[tails[3 * t + 1], axis] + points[tails[3 * t + 2], axis]) / 3.0
    out_width[n] = -1.0
    return n + 1


def chains(points: Floats, triangles: Ints, across: Ints) -> tuple[Floats, Floats, Indices, Indices, Indices, Floats]:
    """Chains of middles of inner sides: points (n, 2), widths (n,), start of each chain, its ends, its place; place areas.

    An end is the number of a fork triangle, or -1 at a tip; a ring has both ends -1 and repeats its first point.
    """
    most, size = 2 * triangles.size + 8, len(triangles)
    out, widths = np.empty((most, 2)), np.empty(most)
    starts, ends, places = np.empty(most, np.int64), np.empty((most, 2), np.int64), np.empty(most, np.int64)
    inner, width, place, areas = np.zeros(size, np.int64), np.zeros(size), np.full(size, -1, np.int64), np.zeros(size)
    measures = (inner, width, place, areas)
    n, count, many = _chains(points, triangles.ravel().copy(), across.copy(), measures, out, widths, starts, ends, places)
    return out[:n], widths[:n], starts[:count], ends[:count], places[:count], areas[:many]


@kernel
def _chains(  # type: ignore[no-untyped-def]
    points, tails, across, measures, out, out_width, starts, ends, places
):
    inner, width, place, areas = measures
    _flip(points, tails, across)
    many = _measure(points, tails, across, inner, width, place, areas)
    done = flags(len(tails))
    n = count = 0
    for rings in range(2):
        for h0 in range(len(tails)):
            t = h0 // 3
            if done[h0] or across[h0] < 0 or (rings == 0 and inner[t] == 2):
                continue
            starts[count], places[count] = n, place[t]
            ends[count, 0] = t if inner[t] == 3 else -1
            if inner[t] == 3:
                n = _fork(points, tails, t, out, out_width, n)
            h = h0
            while True:
                done[h] = done[across[h]] = True
                next_t = across[h] // 3
                a, b = tails[h], tails[h - h % 3 + (h + 1) % 3]
                out[n, 0], out[n, 1] = 0.5 * (points[a, 0] + points[b, 0]), 0.5 * (points[a, 1] + points[b, 1])
                near, far = width[h // 3] * (inner[h // 3] == 2), width[next_t] * (inner[next_t] == 2)
                out_width[n] = 0.5 * (near + far) if near > 0.0 and far > 0.0 else max(near, far)
                n += 1
                t = next_t
                if inner[t] != 2:
                    break
                back = across[h]
                for k in range(3):
                    if 3 * t + k != back and across[3 * t + k] >= 0:
                        h = 3 * t + k
                if done[h]:
                    first = starts[count]
                    out[n, 0], out[n, 1], out_width[n] = out[first, 0], out[first, 1], out_width[first]
                    n += 1
                    break
            ends[count, 1] = t if inner[t] == 3 else -1
            if inner[t] == 3:
                n = _fork(points, tails, t, out, out_width, n)
            _fill_widths(out, out_width, starts[count], n)
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
