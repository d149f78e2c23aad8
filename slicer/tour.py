"""Tour: a short order of things that each have a start and an end; greedy nearest neighbour, then exchanges that shorten it.

Exchanges are the classic ones: 2-opt (a stretch of the tour turned round) and Or-opt (up to three neighbours moved elsewhere,
turned or not), with true lengths also where a thing must not be turned.
"""

import numpy as np
from numba import njit
from numpy.typing import NDArray

from mdp.mesh import Floats

REACH = 200  # exchanges reach so far along the tour, less far in a tour of more than a thousand things
PASSES, FEW_PASSES = 12, 4
MANY = 1000
GAIN_MM = 1e-6
MOST_MOVED = 3

Tour = tuple[NDArray[np.int64], NDArray[np.bool_]]


@njit(cache=True)
def tour(starts: Floats, ends: Floats, fixed: NDArray[np.bool_], x: float, y: float, goal: Floats) -> Tour:
    """Order and turns of n things from the place x, y; starts, ends: (n, 2) mm; fixed: (n,) must not be turned.

    goal: (1, 2) where the tour should end up, or (0, 2).
    """
    order, flips = _greedy(starts, ends, fixed, x, y)
    ways = np.zeros((len(order) + len(goal), 4))  # in x, in y, out x, out y of each thing in its place, then the goal
    ways[len(order) :, :2] = goal
    for k in range(len(order)):
        _enter(ways, k, starts[order[k]], ends[order[k]], flips[k])
    still = fixed[order]
    many = len(order) > MANY
    reach = max(REACH * MANY // len(order), 20) if many else REACH
    for _ in range(FEW_PASSES if many else PASSES):
        gained = _turn_round(order, flips, ways, still, x, y, reach)
        gained += _move(order, flips, ways, still, x, y, reach)
        if gained < GAIN_MM:
            break
    return order, flips


@njit(cache=True)
def _enter(ways: Floats, k: int, start: Floats, end: Floats, flip: bool) -> None:
    if flip:
        ways[k, :2], ways[k, 2:] = end, start
    else:
        ways[k, :2], ways[k, 2:] = start, end


@njit(cache=True)
def _greedy(starts: Floats, ends: Floats, fixed: NDArray[np.bool_], x: float, y: float) -> Tour:
    n = len(starts)
    order, flips = np.arange(n), np.zeros(n, np.bool_)
    for place in range(n):
        best, flip, least = place, False, np.inf
        for k in range(place, n):
            i = order[k]
            distance = (starts[i, 0] - x) ** 2 + (starts[i, 1] - y) ** 2
            if distance < least or (distance == least and i < order[best]):
                best, flip, least = k, False, distance
            if not fixed[i]:
                distance = (ends[i, 0] - x) ** 2 + (ends[i, 1] - y) ** 2
                if distance < least:
                    best, flip, least = k, True, distance
        order[place], order[best] = order[best], order[place]
        flips[place] = flip
        x, y = starts[order[place]] if flip else ends[order[place]]
    return order, flips


@njit(cache=True)
def _gap(ways: Floats, i: int, j: int, x: float, y: float) -> float:
    """Travel from thing i to thing j in their present sense; i = -1: from x, y; j = n: no travel."""
    if j == len(ways):
        return 0.0
    if i >= 0:
        x, y = ways[i, 2], ways[i, 3]
    return float(np.hypot(ways[j, 0] - x, ways[j, 1] - y))


@njit(cache=True)
def _turned(ways: Floats, still: NDArray[np.bool_], k: int) -> tuple[float, float, float, float]:
    """Where thing k is entered and left when the stretch around it runs the other way."""
    if still[k]:
        return ways[k, 0], ways[k, 1], ways[k, 2], ways[k, 3]
    return ways[k, 2], ways[k, 3], ways[k, 0], ways[k, 1]


@njit(cache=True)
def _reverse(order: NDArray[np.int64], flips: NDArray[np.bool_], ways: Floats, still: NDArray[np.bool_], i: int, j: int) -> None:
    order[i : j + 1] = order[i : j + 1][::-1].copy()
    flips[i : j + 1] = flips[i : j + 1][::-1].copy()
    still[i : j + 1] = still[i : j + 1][::-1].copy()
    ways[i : j + 1] = ways[i : j + 1][::-1].copy()
    for k in range(i, j + 1):
        if not still[k]:
            flips[k] = not flips[k]
            ways[k, 0], ways[k, 1], ways[k, 2], ways[k, 3] = ways[k, 2], ways[k, 3], ways[k, 0], ways[k, 1]


@njit(cache=True)
def _turn_round(
    order: NDArray[np.int64], flips: NDArray[np.bool_], ways: Floats, still: NDArray[np.bool_], x: float, y: float, reach: int
) -> float:
    n = len(order)
    gained = 0.0
    for i in range(n):
        px, py = (x, y) if i == 0 else (ways[i - 1, 2], ways[i - 1, 3])
        before = _gap(ways, i - 1, i, x, y)
        forth = back = 0.0
        inner_x, inner_y = 0.0, 0.0
        for j in range(i, min(i + reach, n)):
            in_x, in_y, out_x, out_y = _turned(ways, still, j)
            if j > i:
                forth += _gap(ways, j - 1, j, x, y)
                back += np.hypot(inner_x - out_x, inner_y - out_y)
            inner_x, inner_y = in_x, in_y
            last_x, last_y = _turned(ways, still, i)[2:]
            after = 0.0 if j + 1 == len(ways) else np.hypot(ways[j + 1, 0] - last_x, ways[j + 1, 1] - last_y)
            change = before + forth + _gap(ways, j, j + 1, x, y) - np.hypot(in_x - px, in_y - py) - back - after
            if change > GAIN_MM:
                _reverse(order, flips, ways, still, i, j)
                gained += change
                break
    return gained


@njit(cache=True)
def _move(
    order: NDArray[np.int64], flips: NDArray[np.bool_], ways: Floats, still: NDArray[np.bool_], x: float, y: float, reach: int
) -> float:
    """Up to MOST_MOVED neighbours cut out and put elsewhere: by three reversals, or two where they are turned on the way."""
    n = len(order)
    gained = 0.0
    for i in range(n):
        for many in range(1, min(MOST_MOVED, n - i) + 1):
            last = i + many - 1
            saved = _gap(ways, i - 1, i, x, y) + _gap(ways, last, last + 1, x, y)
            if last + 1 < len(ways):
                fx, fy = (x, y) if i == 0 else (ways[i - 1, 2], ways[i - 1, 3])
                saved -= np.hypot(ways[last + 1, 0] - fx, ways[last + 1, 1] - fy)
            if saved <= GAIN_MM:
                continue
            best, to = GAIN_MM, -2
            for k in range(max(i - reach, -1), min(last + reach, n)):  # put between k and k + 1
                if i - 1 <= k <= last:
                    continue
                kx, ky = (x, y) if k < 0 else (ways[k, 2], ways[k, 3])
                added = np.hypot(ways[i, 0] - kx, ways[i, 1] - ky) - _gap(ways, k, k + 1, x, y)
                if k + 1 < len(ways):
                    added += np.hypot(ways[k + 1, 0] - ways[last, 2], ways[k + 1, 1] - ways[last, 3])
                if saved - added > best:
                    best, to = saved - added, k
            if to == -2:
                continue
            _rotate(order, flips, ways, still, i, last, to)
            gained += best
            break
    return gained


@njit(cache=True)
def _rotate(
    order: NDArray[np.int64], flips: NDArray[np.bool_], ways: Floats, still: NDArray[np.bool_], i: int, last: int, to: int
) -> None:
    """Things i..last put behind thing `to`, all as they are."""
    low, high = (i, to) if to > last else (to + 1, last)
    middle = last + 1 if to > last else i  # what begins here comes first
    ranks = np.concatenate((np.arange(middle, high + 1), np.arange(low, middle)))
    order[low : high + 1] = order[ranks]
    flips[low : high + 1] = flips[ranks]
    still[low : high + 1] = still[ranks]
    ways[low : high + 1] = ways[ranks]
