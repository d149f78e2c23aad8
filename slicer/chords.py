"""Chords: Delaunay triangulation of sampled polygons by flipping, and the chains of its inner sides' middles."""

import numpy as np
from numba import njit
from numpy.typing import NDArray

from mdp.mesh import Floats, Ints

MOST_PASSES = 60  # of flipping; real polygons need fewer than ten, rounding must not make it endless


@njit(cache=True)
def _turn(a: Floats, b: Floats, c: Floats) -> float:
    return float((b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]))


@njit(cache=True)
def _inside_circle(a: Floats, b: Floats, c: Floats, p: Floats) -> bool:
    """Whether p lies clearly inside the circle through a, b, c (counter-clockwise)."""
    ax, ay, bx, by, cx, cy = a[0] - p[0], a[1] - p[1], b[0] - p[0], b[1] - p[1], c[0] - p[0], c[1] - p[1]
    a2, b2, c2 = ax * ax + ay * ay, bx * bx + by * by, cx * cx + cy * cy
    determinant = a2 * (bx * cy - by * cx) + b2 * (cx * ay - cy * ax) + c2 * (ax * by - ay * bx)
    return bool(determinant > 1e-12)


@njit(cache=True)
def _flip(points: Floats, tails: Ints, across: Ints) -> None:
    """Lawson's flips until every inner side is locally Delaunay; tails (3 m,) and across (3 m,) change in place."""
    for _ in range(MOST_PASSES):
        flipped = 0
        for a in range(len(tails)):
            b = across[a]
            if b < a:
                continue
            a_prev, b_prev = a - a % 3 + (a + 2) % 3, b - b % 3 + (b + 2) % 3
            p, q, r, s = points[tails[a]], points[tails[b]], points[tails[a_prev]], points[tails[b_prev]]
            if not _inside_circle(p, q, r, s) or _turn(s, q, r) <= 0.0 or _turn(r, p, s) <= 0.0:
                continue
            outer_a, outer_b = across[a_prev], across[b_prev]
            tails[a], tails[b] = tails[b_prev], tails[a_prev]
            across[a], across[b] = outer_b, outer_a
            if outer_b >= 0:
                across[outer_b] = a
            if outer_a >= 0:
                across[outer_a] = b
            across[a_prev], across[b_prev] = b_prev, a_prev
            flipped += 1
        if not flipped:
            break


@njit(cache=True)
def _measures(points: Floats, tails: Ints, across: Ints) -> tuple[Ints, Floats, Ints, Floats]:
    """Per triangle: inner sides, width over its boundary side (0: none), place (connected piece); per place: area."""
    count = len(tails) // 3
    inner, width, place = np.zeros(count, np.int32), np.zeros(count), np.full(count, -1, np.int32)
    areas = np.zeros(count)
    for t in range(count):
        doubled = _turn(points[tails[3 * t]], points[tails[3 * t + 1]], points[tails[3 * t + 2]])
        for k in range(3):
            a, b = points[tails[3 * t + k]], points[tails[3 * t + (k + 1) % 3]]
            if across[3 * t + k] >= 0:
                inner[t] += 1
            else:
                width[t] = doubled / max(np.hypot(b[0] - a[0], b[1] - a[1]), 1e-9)
    stack = np.empty(count, np.int32)
    places = 0
    for seed in range(count):
        if place[seed] >= 0:
            continue
        place[seed] = places
        stack[0], depth = seed, 1
        while depth > 0:
            depth -= 1
            t = stack[depth]
            areas[places] += 0.5 * _turn(points[tails[3 * t]], points[tails[3 * t + 1]], points[tails[3 * t + 2]])
            for k in range(3):
                other = across[3 * t + k]
                if other >= 0 and place[other // 3] < 0:
                    place[other // 3] = places
                    stack[depth] = other // 3
                    depth += 1
        places += 1
    return inner, width, place, areas[:places]


@njit(cache=True)
def _middle(points: Floats, tails: Ints, h: int) -> tuple[float, float]:
    a, b = points[tails[h]], points[tails[h - h % 3 + (h + 1) % 3]]
    return 0.5 * (a[0] + b[0]), 0.5 * (a[1] + b[1])


@njit(cache=True)
def chains(points: Floats, triangles: Ints, across: Ints) -> tuple[Floats, Floats, NDArray[np.int64], Ints, Ints, Floats]:
    """Chains of middles of inner sides: points (n, 2), widths (n,), start of each chain, its ends, its place; place areas.

    An end is the number of a fork triangle, or -1 at a tip; a ring has both ends -1 and repeats its first point.
    """
    tails = triangles.copy().reshape(-1)
    across = across.copy()
    _flip(points, tails, across)
    inner, width, place, areas = _measures(points, tails, across)
    most = 2 * len(tails) + 8
    out, out_width = np.empty((most, 2)), np.empty(most)
    starts, ends, places = np.empty(most, np.int64), np.empty((most, 2), np.int32), np.empty(most, np.int32)
    done = np.zeros(len(tails), np.bool_)
    n = count = 0
    for rings in range(2):
        for h0 in range(len(tails)):
            t = h0 // 3
            if done[h0] or across[h0] < 0 or (rings == 0 and inner[t] == 2):
                continue
            starts[count], places[count] = n, place[t]
            ends[count, 0] = t if inner[t] == 3 else -1
            if inner[t] == 3:
                out[n] = (points[tails[3 * t]] + points[tails[3 * t + 1]] + points[tails[3 * t + 2]]) / 3.0
                out_width[n] = -1.0
                n += 1
            h = h0
            while True:
                done[h] = done[across[h]] = True
                next_t = across[h] // 3
                out[n, 0], out[n, 1] = _middle(points, tails, h)
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
                    out[n], out_width[n] = out[starts[count]], out_width[starts[count]]
                    n += 1
                    break
            ends[count, 1] = t if inner[t] == 3 else -1
            if inner[t] == 3:
                out[n] = (points[tails[3 * t]] + points[tails[3 * t + 1]] + points[tails[3 * t + 2]]) / 3.0
                out_width[n] = -1.0
                n += 1
            _fill_widths(out, out_width, starts[count], n)
            count += 1
    return out[:n], out_width[:n], starts[:count], ends[:count], places[:count], areas


@njit(cache=True)
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
        widths[start:end] = max(gap, 1e-3)
