"""Tour: a short order of things that each have a start and an end; greedy nearest neighbour, then exchanges that shorten it.

Exchanges are the classic ones: 2-opt (a stretch of the tour turned round) and Or-opt (up to three neighbours moved elsewhere,
turned or not), with true lengths also where a thing must not be turned.
"""

import numpy as np
from numpy.typing import NDArray

from mdp.kernel import flags, kernel, longs, part, table
from mdp.mesh import Floats

REACH = 200  # exchanges reach so far along the tour, less far in a tour of more than a thousand things
PASSES, FEW_PASSES = 12, 4
MANY = 1000
GAIN_MM = 1e-6
MOST_MOVED = 3

Tour = tuple[NDArray[np.int64], NDArray[np.bool_]]


@kernel
def tour(starts: Floats, ends: Floats, fixed: NDArray[np.bool_], x: float, y: float, goal: Floats) -> Tour:
    """Order and turns of n things from the place x, y; starts, ends: (n, 2) mm; fixed: (n,) must not be turned.

    goal: (1, 2) where the tour should end up, or (0, 2).
    """
    n = len(starts)
    order, flips, still = longs(n, 0), flags(n), flags(n)
    _greedy(starts, ends, fixed, x, y, order, flips)
    ways = table(n + len(goal), 4)  # in x, in y, out x, out y of each thing in its place, then the goal
    for k in range(n):
        i, into, out = order[k], 2 * int(flips[k]), 2 - 2 * int(flips[k])
        still[k] = fixed[i]
        for axis in range(2):
            ways[k, into + axis], ways[k, out + axis] = starts[i, axis], ends[i, axis]
    for k in range(len(goal)):
        ways[n + k, 0], ways[n + k, 1] = goal[k, 0], goal[k, 1]
    reach = max(REACH * MANY // n, 20) if n > MANY else REACH
    for _ in range(FEW_PASSES if n > MANY else PASSES):
        gained = _turn_round(order, flips, ways, still, x, y, reach)
        gained += _move(order, flips, ways, still, x, y, reach)
        if gained < GAIN_MM:
            break
    return order, flips


@part
def _greedy(
    starts: Floats, ends: Floats, fixed: NDArray[np.bool_], x: float, y: float, order: NDArray[np.int64], flips: NDArray[np.bool_]
) -> None:
    """Fill in the order that goes to the nearest thing each time."""
    for k in range(len(order)):
        order[k] = k
    for place in range(len(order)):
        best, flip, least = place, False, np.inf
        for k in range(place, len(order)):
            i = order[k]
            distance = (starts[i, 0] - x) ** 2 + (starts[i, 1] - y) ** 2
            if distance < least or (distance == least and i < order[best]):
                best, flip, least = k, False, distance
            if not fixed[i]:
                distance = (ends[i, 0] - x) ** 2 + (ends[i, 1] - y) ** 2
                if distance < least:
                    best, flip, least = k, True, distance
        i = order[best]
        order[place], order[best] = i, order[place]
        flips[place] = flip
        x, y = (starts[i, 0], starts[i, 1]) if flip else (ends[i, 0], ends[i, 1])


@part
def _gap(ways: Floats, i: int, j: int, x: float, y: float) -> float:
    """Travel from thing i to thing j in their present sense; i = -1: from x, y; j = n: no travel."""
    if j == len(ways):
        return 0.0
    if i >= 0:
        x, y = ways[i, 2], ways[i, 3]
    return float(np.hypot(ways[j, 0] - x, ways[j, 1] - y))


@part
def _turned(ways: Floats, still: NDArray[np.bool_], k: int) -> tuple[float, float, float, float]:
    """Where thing k is entered and left when the stretch around it runs the other way."""
    if still[k]:
        return ways[k, 0], ways[k, 1], ways[k, 2], ways[k, 3]
    return ways[k, 2], ways[k, 3], ways[k, 0], ways[k, 1]


@part
def _mirror(order: NDArray[np.int64], flips: NDArray[np.bool_], ways: Floats, still: NDArray[np.bool_], i: int, j: int) -> None:
    """The things i..j in reverse order, each as it is."""
    while i < j:
        order[i], order[j] = order[j], order[i]
        flips[i], flips[j] = flips[j], flips[i]
        still[i], still[j] = still[j], still[i]
        for k in range(4):
            ways[i, k], ways[j, k] = ways[j, k], ways[i, k]
        i, j = i + 1, j - 1


@part
def _reverse(order: NDArray[np.int64], flips: NDArray[np.bool_], ways: Floats, still: NDArray[np.bool_], i: int, j: int) -> None:
    """The things i..j run the other way."""
    _mirror(order, flips, ways, still, i, j)
    for k in range(i, j + 1):
        if not still[k]:
            flips[k] = not flips[k]
            for axis in range(2):
                ways[k, axis], ways[k, 2 + axis] = ways[k, 2 + axis], ways[k, axis]


@part
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
            _, _, last_x, last_y = _turned(ways, still, i)
            after = 0.0 if j + 1 == len(ways) else np.hypot(ways[j + 1, 0] - last_x, ways[j + 1, 1] - last_y)
            change = before + forth + _gap(ways, j, j + 1, x, y) - np.hypot(in_x - px, in_y - py) - back - after
            if change > GAIN_MM:
                _reverse(order, flips, ways, still, i, j)
                gained += change
                break
    return gained


@part
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


@part
def _rotate(
    order: NDArray[np.int64], flips: NDArray[np.bool_], ways: Floats, still: NDArray[np.bool_], i: int, last: int, to: int
) -> None:
    """Things i..last put behind thing `to`, all as they are: what lies on both sides of a place changes sides."""
    low, high = (i, to) if to > last else (to + 1, last)
    middle = last + 1 if to > last else i  # what begins here comes first
    _mirror(order, flips, ways, still, low, middle - 1)
    _mirror(order, flips, ways, still, middle, high)
    _mirror(order, flips, ways, still, low, high)
