"""Path order: a short order of paths with a start and an end each, by greedy nearest neighbour, then exchanges.

A change of speed between two paths counts like CHANGE_MM of travel, so that paths of one speed are grouped unless that means a
long detour.

The exchanges are those of the travelling salesman problem: 2-opt (reverse a stretch of the order) and Or-opt (move up to three
neighbours elsewhere), with true lengths also for paths that must not be reversed.

Some lines may begin at any of their corners: closed ones without a seam, and long open ones, which are split in two. A long line
of infill often runs through the whole island and ends near its start, far from the tip. Where it saves travel, it begins at the
corner nearest to the tip, and continues at its start after its end.
"""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from mdp.kernels.arrays import flags, longs, table
from mdp.kernels.kernel import kernel, no_nrt
from mdp.mesh import Floats, Indices

CHANGE_MM = 3.0  # at 15 mm, prints with many small islands take 1 % longer, since most of the travels also retract
TRIES = 2  # the order depends on where lines begin, which in turn depends on the order
WORTH_MM = 5.0  # travel that splitting a line must save, since the extra end and start of a bead are visible
CLOSED, OPEN, AS_IT_IS = 2, 1, 0  # freedom of a line: begin anywhere, begin anywhere in two pieces, none
REACH = 200  # range of exchanges along the order; shorter for more than a thousand paths
# Random lines of 1 to 8 mm on a plate of 100 mm, commit 5c72b83f: with up to 900 of them nothing is gained after 12 passes; 4
# passes give a path 0.6 to 1 % longer in half the time, 1 pass 6 to 13 % longer; with 2,500 lines 4 passes give 0.3 % longer.
PASSES, FEW_PASSES = 12, 4
MANY = 1000  # number of paths from which few passes are made
GAIN_MM = 1e-6  # smaller gains are rounding, and might exchange back and forth forever
MOST_MOVED = 3  # as in Or (1976); one gives paths 0.3 to 0.8 % longer, four change them by -0.4 to +0.5 %

# Paths in their present order: (n,) number of each, (n,) whether it is reversed, (n,) whether it must not be, and (2 n + 1 +
# goals, 3) points with speeds: the start of all, then entry and exit of each path in its present direction, then the goal.
Paths = tuple[Indices, NDArray[np.bool_], NDArray[np.bool_], Floats]


def order_lines(
    lines: Sequence[Floats], speeds: Floats, fixed: NDArray[np.bool_], freedom: Sequence[int], tip: Floats, goal: Floats
) -> list[tuple[int, list[Floats]]]:
    """Lines (n, 2) in a short order starting from the tip, as in order_paths, with starts chosen where their freedom allows it:
    the number of each line and its pieces (n, 2) in printing direction.

    speeds: (n, 2) at start and end of each line; fixed: (n,) whether it must not be reversed; tip: (3,) initial position and
    speed; goal: (1, 3) final position and speed, or (0, 3).
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
    """The corner at which a line should begin so that the path between two points via the line is shortest; 0 for its start."""
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
    """A line (n, 2) from one of its corners to its end, continued from its start to that corner."""
    closed = bool((line[0] == line[-1]).all())
    return np.concatenate([line[at:], line[int(closed) : at + 1]]) if at else line


def _nearer_from_its_end(line: Floats, since: Floats, to: Floats) -> bool:
    forth = float(np.hypot(*(line[0] - since)) + np.hypot(*(to - line[-1])))
    return float(np.hypot(*(line[-1] - since)) + np.hypot(*(to - line[0]))) < forth - 1e-9


@kernel
def order_paths(
    starts: Floats, ends: Floats, fixed: NDArray[np.bool_], tip: Floats, goal: Floats
) -> tuple[Indices, NDArray[np.bool_]]:
    """Order and reversals of n paths; starts, ends: (n, 3) mm, mm and speed; fixed: (n,) whether a path must not be reversed.

    tip: (3,) initial position and speed; goal: (1, 3) desired final position and speed, or (0, 3).
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
    """Fill in the greedy order, always to the nearest path. given: points as in Paths, in the order of the numbers."""
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
    """Cost from one point to another: travel, plus CHANGE_MM if their speeds differ; 0 if b does not exist."""
    if b >= len(at):
        return 0.0
    travel = np.hypot(at[b, 0] - at[a, 0], at[b, 1] - at[a, 1])
    return float(travel + CHANGE_MM) if at[b, 2] != at[a, 2] else float(travel)


@no_nrt
def _reverse_stretches(paths: Paths, reach: int) -> float:
    """2-opt: reverse stretches where that saves travel; returns the saving, mm."""
    order, _, fixed, at = paths
    n, gained = len(order), 0.0
    for i in range(n):
        before = _way(at, 2 * i, 2 * i + 1)
        last = 2 * i + (2 if fixed[i] else 1)  # exit of the reversed stretch
        forth = back = 0.0
        inner = last
        for j in range(i, min(i + reach, n)):
            into, out = (2 * j + 1, 2 * j + 2) if fixed[j] else (2 * j + 2, 2 * j + 1)  # ends of path j in the reversed stretch
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
    """Or-opt: move up to MOST_MOVED neighbours elsewhere where that saves travel; returns the saving, mm."""
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
            for k in range(max(i - reach, -1), min(last + reach, n)):  # insert between k and k + 1
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
    """Reverse the stretch i..j and its paths."""
    _mirror(paths, i, j)
    _, flips, fixed, at = paths
    for k in range(i, j + 1):
        if not fixed[k]:
            flips[k] = not flips[k]
            for axis in range(3):
                at[2 * k + 1, axis], at[2 * k + 2, axis] = at[2 * k + 2, axis], at[2 * k + 1, axis]


@no_nrt
def _rotate(paths: Paths, i: int, last: int, to: int) -> None:
    """Move paths i..last behind path `to` without reversing them, by three mirrorings."""
    low, high = (i, to) if to > last else (to + 1, last)
    middle = last + 1 if to > last else i  # what begins here comes first
    _mirror(paths, low, middle - 1)
    _mirror(paths, middle, high)
    _mirror(paths, low, high)


@no_nrt
def _mirror(paths: Paths, i: int, j: int) -> None:
    """Reverse the order of paths i..j without reversing the paths."""
    order, flips, fixed, at = paths
    while i < j:
        order[i], order[j] = order[j], order[i]
        flips[i], flips[j] = flips[j], flips[i]
        fixed[i], fixed[j] = fixed[j], fixed[i]
        for axis in range(3):
            for end in range(1, 3):
                at[2 * i + end, axis], at[2 * j + end, axis] = at[2 * j + end, axis], at[2 * i + end, axis]
        i, j = i + 1, j - 1
