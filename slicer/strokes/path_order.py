"""Path order: a short order of paths that each have a start and an end: greedy nearest neighbour, then exchanges.

Exchanges are the classic ones of the travelling salesman's problem: 2-opt (a stretch of the order reversed) and Or-opt (up to
three neighbours moved elsewhere, reversed or not), with true lengths also where a path must not be reversed.

Some lines may begin at any of their corners: closed ones without a seam, and long open ones, which are taken in two. A long line
of infill often runs through the whole island and ends beside its beginning, far from where the tip is. It is begun at the corner
beside the tip then, and after its end goes on at its beginning, wherever that saves travel.
"""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from mdp.kernels.arrays import flags, longs, table
from mdp.kernels.kernel import helper, kernel, no_nrt
from mdp.mesh import Floats, Indices

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

Order = tuple[Indices, NDArray[np.bool_]]


def order_lines(
    lines: Sequence[Floats], fixed: NDArray[np.bool_], freedom: Sequence[int], tip: Floats, goal: Floats
) -> list[tuple[int, list[Floats]]]:
    """Lines (n, 2) in a short order from the tip on, as order_paths, begun where their freedom allows it: the number of each and
    the pieces (n, 2) of it as they are printed.

    fixed: (n,) must not be reversed; tip: (2,) where all begins; goal: (1, 2) where it ends up, or (0, 2).
    """
    held, cut, pairs = fixed.copy(), [0] * len(lines), zip(lines, freedom, strict=True)
    begun = [_begin_at(line, _corner(line, tip, tip, True)) if free == CLOSED else line for line, free in pairs]
    for _ in range(TRIES if any(freedom) else 1):
        entries, exits = np.array([line[0] for line in begun]), np.array([line[-1] for line in begun])
        order, flips = order_paths(entries, exits, held, tip, goal)
        since = tip
        for step, k in enumerate(order.tolist()):
            if freedom[k]:
                after = order[step + 1] if step + 1 < len(order) else -1
                to = begun[after][-1 if flips[step + 1] else 0] if after >= 0 else goal[0] if len(goal) else since
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
def order_paths(starts: Floats, ends: Floats, fixed: NDArray[np.bool_], tip: Floats, goal: Floats) -> Order:
    """Order and reversals of n paths; starts, ends: (n, 2) mm; fixed: (n,) must not be reversed.

    tip: (2,) where all begins; goal: (1, 2) where the order should end up, or (0, 2).
    """
    n = len(starts)
    x, y = tip[0], tip[1]
    order, flips = _greedy(starts, ends, fixed, x, y)
    sequence = _Sequence(order, flips, flags(n), table(n + len(goal), 4), x, y)
    for k in range(n):
        i, into, out = order[k], 2 * int(flips[k]), 2 - 2 * int(flips[k])
        sequence.fixed[k] = fixed[i]
        for axis in range(2):
            sequence.ends[k, into + axis], sequence.ends[k, out + axis] = starts[i, axis], ends[i, axis]
    for k in range(len(goal)):
        sequence.ends[n + k, 0], sequence.ends[n + k, 1] = goal[k, 0], goal[k, 1]
    reach = max(REACH * MANY // n, 20) if n > MANY else REACH
    for _ in range(FEW_PASSES if n > MANY else PASSES):
        gained = _reverse_stretches(sequence, reach)
        gained += _move_neighbours(sequence, reach)
        if gained < GAIN_MM:
            break
    return order, flips


@helper
def _greedy(starts: Floats, ends: Floats, fixed: NDArray[np.bool_], x: float, y: float) -> Order:
    """The order that goes to the nearest path each time."""
    order, flips = longs(len(starts), 0), flags(len(starts))
    for k in range(len(order)):
        order[k] = k
    for step in range(len(order)):
        best, flip, least = step, False, np.inf
        for k in range(step, len(order)):
            i = order[k]
            distance = (starts[i, 0] - x) ** 2 + (starts[i, 1] - y) ** 2
            if distance < least or (distance == least and i < order[best]):
                best, flip, least = k, False, distance
            if not fixed[i]:
                distance = (ends[i, 0] - x) ** 2 + (ends[i, 1] - y) ** 2
                if distance < least:
                    best, flip, least = k, True, distance
        i = order[best]
        order[step], order[best] = i, order[step]
        flips[step] = flip
        x, y = (starts[i, 0], starts[i, 1]) if flip else (ends[i, 0], ends[i, 1])
    return order, flips


class _Sequence(NamedTuple):
    """Paths in their present order from the place x, y on.

    order: (n,) number of each path; flips: (n,) reversed; fixed: (n,) must not be; ends: (n + goals, 4) in x, in y, out x,
    out y of each path as it runs now, then of the goal.
    """

    order: Indices
    flips: NDArray[np.bool_]
    fixed: NDArray[np.bool_]
    ends: Floats
    x: float
    y: float


@helper
def _reverse_stretches(sequence: _Sequence, reach: int) -> float:
    """2-opt: reverses stretches where that saves travel; returns how much."""
    n, ends = len(sequence.order), sequence.ends
    gained = 0.0
    for i in range(n):
        px, py = _exit(sequence, i - 1)
        before = _gap(sequence, i - 1, i)
        forth = back = 0.0
        inner_x, inner_y = 0.0, 0.0
        for j in range(i, min(i + reach, n)):
            in_x, in_y, out_x, out_y = _reversed_ends(sequence, j)
            if j > i:
                forth += _gap(sequence, j - 1, j)
                back += np.hypot(inner_x - out_x, inner_y - out_y)
            inner_x, inner_y = in_x, in_y
            _, _, last_x, last_y = _reversed_ends(sequence, i)
            after = 0.0 if j + 1 == len(ends) else np.hypot(ends[j + 1, 0] - last_x, ends[j + 1, 1] - last_y)
            change = before + forth + _gap(sequence, j, j + 1) - np.hypot(in_x - px, in_y - py) - back - after
            if change > GAIN_MM:
                _reverse(sequence, i, j)
                gained += change
                break
    return gained


@helper
def _move_neighbours(sequence: _Sequence, reach: int) -> float:
    """Or-opt: moves up to MOST_MOVED neighbours elsewhere where that saves travel; returns how much."""
    n, ends = len(sequence.order), sequence.ends
    gained = 0.0
    for i in range(n):
        for many in range(1, min(MOST_MOVED, n - i) + 1):
            last = i + many - 1
            saved = _gap(sequence, i - 1, i) + _gap(sequence, last, last + 1)
            if last + 1 < len(ends):
                fx, fy = _exit(sequence, i - 1)
                saved -= np.hypot(ends[last + 1, 0] - fx, ends[last + 1, 1] - fy)
            if saved <= GAIN_MM:
                continue
            best, to = GAIN_MM, -2
            for k in range(max(i - reach, -1), min(last + reach, n)):  # put between k and k + 1
                if i - 1 <= k <= last:
                    continue
                kx, ky = _exit(sequence, k)
                added = np.hypot(ends[i, 0] - kx, ends[i, 1] - ky) - _gap(sequence, k, k + 1)
                if k + 1 < len(ends):
                    added += np.hypot(ends[k + 1, 0] - ends[last, 2], ends[k + 1, 1] - ends[last, 3])
                if saved - added > best:
                    best, to = saved - added, k
            if to == -2:
                continue
            _rotate(sequence, i, last, to)
            gained += best
            break
    return gained


@helper
def _exit(sequence: _Sequence, i: int) -> tuple[float, float]:
    """Where path i is left; i = -1: where all begins."""
    return (sequence.x, sequence.y) if i < 0 else (sequence.ends[i, 2], sequence.ends[i, 3])


@helper
def _gap(sequence: _Sequence, i: int, j: int) -> float:
    """Travel from path i to path j as they run now; i = -1: from where all begins; j = n: no travel."""
    if j == len(sequence.ends):
        return 0.0
    x, y = _exit(sequence, i)
    return float(np.hypot(sequence.ends[j, 0] - x, sequence.ends[j, 1] - y))


@helper
def _reversed_ends(sequence: _Sequence, k: int) -> tuple[float, float, float, float]:
    """Where path k is entered and left when the stretch around it runs the other way."""
    ends = sequence.ends
    if sequence.fixed[k]:
        return ends[k, 0], ends[k, 1], ends[k, 2], ends[k, 3]
    return ends[k, 2], ends[k, 3], ends[k, 0], ends[k, 1]


@helper
def _reverse(sequence: _Sequence, i: int, j: int) -> None:
    """The stretch i..j the other way round."""
    _mirror(sequence, i, j)
    for k in range(i, j + 1):
        if not sequence.fixed[k]:
            sequence.flips[k] = not sequence.flips[k]
            for axis in range(2):
                sequence.ends[k, axis], sequence.ends[k, 2 + axis] = sequence.ends[k, 2 + axis], sequence.ends[k, axis]


@no_nrt
def _rotate(sequence: _Sequence, i: int, last: int, to: int) -> None:
    """Paths i..last put behind path `to`, all as they run: what lies on both sides of a place changes sides."""
    low, high = (i, to) if to > last else (to + 1, last)
    middle = last + 1 if to > last else i  # what begins here comes first
    _mirror(sequence, low, middle - 1)
    _mirror(sequence, middle, high)
    _mirror(sequence, low, high)


@no_nrt
def _mirror(sequence: _Sequence, i: int, j: int) -> None:
    """The paths i..j in reverse order, each as it runs."""
    order, flips, fixed, ends, _, _ = sequence
    while i < j:
        order[i], order[j] = order[j], order[i]
        flips[i], flips[j] = flips[j], flips[i]
        fixed[i], fixed[j] = fixed[j], fixed[i]
        for k in range(4):
            ends[i, k], ends[j, k] = ends[j, k], ends[i, k]
        i, j = i + 1, j - 1
