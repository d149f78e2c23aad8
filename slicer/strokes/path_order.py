"""Path order: a short order of paths that each have a start and an end: greedy nearest neighbour, then exchanges.

A change of speed on the way from one path to the next counts as much as CHANGE_MM of travel, so that paths of one speed follow
each other unless that means a long detour.

Exchanges are the classic ones of the travelling salesman's problem: 2-opt (a stretch of the order reversed) and Or-opt (up to
three neighbours moved elsewhere), with true lengths also where a path must not be reversed.

Some lines may begin at any of their corners: closed ones without a seam, and long open ones, which are taken in two. A long line
of infill often runs through the whole island and ends beside its beginning, far from where the tip is. It is begun at the corner
beside the tip then, and after its end goes on at its beginning, wherever that saves travel.
"""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from mdp.kernels.arrays import flags, longs, table
from mdp.kernels.kernel import kernel, no_nrt
from mdp.mesh import Floats, Indices

CHANGE_MM = 3.0  # at 15 mm, prints with many small islands take 1 % longer, since most of their travels also retract
TRIES = 2  # the order depends on where lines begin, and that on the order
WORTH_MM = 5.0  # travel that taking a line in two has to save: a bead that ends and begins once more shows
CLOSED, OPEN, AS_IT_IS = 2, 1, 0  # what may be done with a line: begun anywhere, begun anywhere in two pieces, nothing
REACH = 200  # exchanges reach so far along the order, less far in an order of more than a thousand paths
# Random lines of 1 to 8 mm on a plate of 100 mm, commit 5c72b83f: with up to 900 of them nothing is gained after 12 passes,
# 4 leave the way 0.6 to 1 % longer for half the time, 1 leaves it 6 to 13 % longer; with 2,500 of them 4 leave it 0.3 % longer.
PASSES, FEW_PASSES = 12, 4
MANY = 1000  # paths, from which on there are few passes
GAIN_MM = 1e-6  # less is rounding, and an exchange back and forth would never end
MOST_MOVED = 3  # as Or (1976); one leaves the same ways 0.3 to 0.8 % longer, four change them by -0.4 to +0.5 %

# Paths in their present order: (n,) number of each, (n,) reversed, (n,) must not be, and (2 n + 1 + goals, 3) places with their
# speeds: where all begins, then where each path is entered and left as it runs now, then the goal.
Paths = tuple[Indices, NDArray[np.bool_], NDArray[np.bool_], Floats]


def order_lines(
    lines: Sequence[Floats], speeds: Floats, fixed: NDArray[np.bool_], freedom: Sequence[int], tip: Floats, goal: Floats
) -> list[tuple[int, list[Floats]]]:
    """Lines (n, 2) in a short order from the tip on, as order_paths, begun where their freedom allows it: the number of each and
    the pieces (n, 2) of it as they are printed.

    speeds: (n, 2) with which each begins and ends; fixed: (n,) must not be reversed; tip: (3,) where and with which speed all
    begins; goal: (1, 3) where and with which it ends up, or (0, 3).
    """
    held, cut, pairs = fixed.copy(), [0] * len(lines), zip(lines, freedom, strict=True)
    begun = [_begin_at(line, _corner(line, tip[:2], tip[:2], True)) if free == CLOSED else line for line, free in pairs]
    for _ in range(TRIES if any(freedom) else 1):
        entries, exits = np.array([line[0] for line in begun]), np.array([line[-1] for line in begun])
        order, flips = order_paths(np.c_[entries, speeds[:, 0]], np.c_[exits, speeds[:, 1]], held, tip, goal)
        since = tip[:2]
        for step, k in enumerate(order.tolist()):
            if freedom[k]:
                after = order[step + 1] if step + 1 < len(order) else -1
                to = begun[after][-1 if flips[step + 1] else 0] if after >= 0 else goal[0, :2] if len(goal) else since
                at = _corner(lines[k], since, to, freedom[k] == CLOSED)
                begun[k] = _begin_at(lines[k], at)
                if freedom[k] == OPEN:
                    held[k], cut[k] = fixed[k] or at > 0, len(lines[k]) - at if at else 0
                    flips[step] = False if at else _nearer_from_its_end(lines[k], since, to)
            since = begun[k][0 if flips[step] else -1]
    return [
        (k, [begun[k][: cut[k]], begun[k][cut[k] :]] if cut[k] else [begun[k][::-1] if flip else begun[k]])
        for k, flip in zip(order.tolist(), flips.tolist(), strict=True)
    ]


def _corner(line: Floats, since: Floats, to: Floats, closed: bool) -> int:
    """The corner to begin a line at, so that the way from one place over it to another is shortest; 0: its beginning."""
    return int(_best_corner(np.ascontiguousarray(line), since[0], since[1], to[0], to[1], closed))


@kernel
def _best_corner(line: Floats, x0: float, y0: float, x1: float, y1: float, closed: bool) -> int:
    last = len(line) - 1
    best, least, between = 0, np.inf, 0.0
    if not closed:
        between = np.hypot(line[last, 0] - line[0, 0], line[last, 1] - line[0, 1])
        forth = np.hypot(line[0, 0] - x0, line[0, 1] - y0) + np.hypot(line[last, 0] - x1, line[last, 1] - y1)
        back = np.hypot(line[last, 0] - x0, line[last, 1] - y0) + np.hypot(line[0, 0] - x1, line[0, 1] - y1)
        least = min(forth, back) - WORTH_MM
    for k in range(0 if closed else 1, last):
        way = np.hypot(line[k, 0] - x0, line[k, 1] - y0) + np.hypot(line[k, 0] - x1, line[k, 1] - y1) + between
        if way < least - 1e-9:
            best, least = k, way
    return best


def _begin_at(line: Floats, at: int) -> Floats:
    """A line (n, 2) from one of its corners on to its end, and on from its beginning to that corner."""
    closed = bool((line[0] == line[-1]).all())
    return np.concatenate([line[at:], line[int(closed) : at + 1]]) if at else line


def _nearer_from_its_end(line: Floats, since: Floats, to: Floats) -> bool:
    forth = float(np.hypot(*(line[0] - since)) + np.hypot(*(to - line[-1])))
    return float(np.hypot(*(line[-1] - since)) + np.hypot(*(to - line[0]))) < forth - 1e-9


@kernel
def order_paths(
    starts: Floats, ends: Floats, fixed: NDArray[np.bool_], tip: Floats, goal: Floats
) -> tuple[Indices, NDArray[np.bool_]]:
    """Order and reversals of n paths; starts, ends: (n, 3) mm, mm and speed; fixed: (n,) must not be reversed.

    tip: (3,) place and speed from which the order starts; goal: (1, 3) those at which it should end, or (0, 3).
    """
    n = len(starts)
    given, at = table(2 * n + 1, 3), table(2 * n + 1 + len(goal), 3)
    order, flips, held = longs(n, 0), flags(n), flags(n)
    for axis in range(3):
        given[0, axis] = tip[axis]
        for k in range(n):
            given[2 * k + 1, axis], given[2 * k + 2, axis] = starts[k, axis], ends[k, axis]
    _greedy(given, fixed, order, flips)
    for axis in range(3):
        at[0, axis] = tip[axis]
        for k in range(n):
            into = 2 * order[k] + 1 + int(flips[k])
            at[2 * k + 1, axis], at[2 * k + 2, axis] = given[into, axis], given[4 * order[k] + 3 - into, axis]
        for k in range(len(goal)):
            at[2 * n + 1, axis] = goal[k, axis]
    for k in range(n):
        held[k] = fixed[order[k]]
    paths, reach = (order, flips, held, at), max(REACH * MANY // n, 20) if n > MANY else REACH
    for _ in range(FEW_PASSES if n > MANY else PASSES):
        gained = _reverse_stretches(paths, reach)
        gained += _move_neighbours(paths, reach)
        if gained < GAIN_MM:
            break
    return order, flips


@no_nrt
def _greedy(given: Floats, fixed: NDArray[np.bool_], order: Indices, flips: NDArray[np.bool_]) -> None:
    """Fills in the order that goes to the nearest path each time; given: places as in Paths, in the order of the numbers."""
    for k in range(len(order)):
        order[k] = k
    since = 0
    for step in range(len(order)):
        best, flip, least = step, False, np.inf
        for k in range(step, len(order)):
            i = order[k]
            way = _way(given, since, 2 * i + 1)
            if way < least or (way == least and i < order[best]):
                best, flip, least = k, False, way
            if not fixed[i]:
                way = _way(given, since, 2 * i + 2)
                if way < least:
                    best, flip, least = k, True, way
        i = order[best]
        order[step], order[best] = i, order[step]
        flips[step] = flip
        since = 2 * i + (1 if flip else 2)


@no_nrt
def _way(at: Floats, a: int, b: int) -> float:
    """Travel from one place to another, and CHANGE_MM where their speeds differ; no travel where b is no place."""
    if b >= len(at):
        return 0.0
    travel = np.hypot(at[b, 0] - at[a, 0], at[b, 1] - at[a, 1])
    return float(travel + CHANGE_MM) if at[b, 2] != at[a, 2] else float(travel)


@no_nrt
def _reverse_stretches(paths: Paths, reach: int) -> float:
    """2-opt: reverses stretches where that saves travel; returns how much."""
    order, _, fixed, at = paths
    n, gained = len(order), 0.0
    for i in range(n):
        before = _way(at, 2 * i, 2 * i + 1)
        last = 2 * i + (2 if fixed[i] else 1)  # where the reversed stretch is left
        forth = back = 0.0
        inner = last
        for j in range(i, min(i + reach, n)):
            into, out = (2 * j + 1, 2 * j + 2) if fixed[j] else (2 * j + 2, 2 * j + 1)  # of path j in the reversed stretch
            if j > i:
                forth += _way(at, 2 * j, 2 * j + 1)
                back += _way(at, out, inner)
            inner = into
            after = _way(at, 2 * j + 2, 2 * j + 3)
            change = before + forth + after - _way(at, 2 * i, into) - back - _way(at, last, 2 * j + 3)
            if change > GAIN_MM:
                _reverse(paths, i, j)
                gained += change
                break
    return gained


@no_nrt
def _move_neighbours(paths: Paths, reach: int) -> float:
    """Or-opt: moves up to MOST_MOVED neighbours elsewhere where that saves travel; returns how much."""
    order, _, _, at = paths
    n, gained = len(order), 0.0
    for i in range(n):
        for many in range(1, min(MOST_MOVED, n - i) + 1):
            last = i + many - 1
            into, out, after = 2 * i + 1, 2 * last + 2, 2 * last + 3
            saved = _way(at, 2 * i, into) + _way(at, out, after) - _way(at, 2 * i, after)
            if saved <= GAIN_MM:
                continue
            best, to = GAIN_MM, -2
            for k in range(max(i - reach, -1), min(last + reach, n)):  # put between k and k + 1
                if i - 1 <= k <= last:
                    continue
                left = 2 * k + 2
                added = _way(at, left, into) + _way(at, out, left + 1) - _way(at, left, left + 1)
                if saved - added > best:
                    best, to = saved - added, k
            if to == -2:
                continue
            _rotate(paths, i, last, to)
            gained += best
            break
    return gained


@no_nrt
def _reverse(paths: Paths, i: int, j: int) -> None:
    """The stretch i..j the other way round."""
    _mirror(paths, i, j)
    _, flips, fixed, at = paths
    for k in range(i, j + 1):
        if not fixed[k]:
            flips[k] = not flips[k]
            for axis in range(3):
                at[2 * k + 1, axis], at[2 * k + 2, axis] = at[2 * k + 2, axis], at[2 * k + 1, axis]


@no_nrt
def _rotate(paths: Paths, i: int, last: int, to: int) -> None:
    """Paths i..last put behind path `to`, all as they run: what lies on both sides of a place changes sides."""
    low, high = (i, to) if to > last else (to + 1, last)
    middle = last + 1 if to > last else i  # what begins here comes first
    _mirror(paths, low, middle - 1)
    _mirror(paths, middle, high)
    _mirror(paths, low, high)


@no_nrt
def _mirror(paths: Paths, i: int, j: int) -> None:
    """The paths i..j in reverse order, each as it runs."""
    order, flips, fixed, at = paths
    while i < j:
        order[i], order[j] = order[j], order[i]
        flips[i], flips[j] = flips[j], flips[i]
        fixed[i], fixed[j] = fixed[j], fixed[i]
        for axis in range(3):
            for end in range(1, 3):
                at[2 * i + end, axis], at[2 * j + end, axis] = at[2 * j + end, axis], at[2 * i + end, axis]
        i, j = i + 1, j - 1
