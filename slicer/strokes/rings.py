"""Rings: lines that may begin at any of their corners: closed ones without a seam, and long open ones, which are taken in two.

A long line of infill often runs through the whole island and ends beside its beginning, far from where the tip is. It is begun at
the corner beside the tip then, and after its end goes on at its beginning, wherever that saves travel.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from mdp.kernels.kernel import kernel
from mdp.mesh import Floats
from slicer.strokes.path_order import order_paths

ROUNDS = 2  # the order depends on where lines begin, and that on the order
WORTH_MM = 5.0  # travel that taking a line in two has to save: a bead that ends and begins once more shows
CLOSED, OPEN, AS_IT_IS = 2, 1, 0  # what may be done with a line: begun anywhere, begun anywhere in two pieces, nothing


@dataclass(frozen=True, eq=False)
class Run:
    """A line in its place. number: which it was; pieces: (n, 2) each, as they are printed."""

    number: int
    pieces: tuple[Floats, ...]


def order_lines(
    lines: Sequence[Floats], fixed: NDArray[np.bool_], freedom: Sequence[int], tip: Floats, goal: Floats
) -> list[Run]:
    """Lines (n, 2) in a short order from the tip on, as order_paths, begun where their freedom allows it.

    fixed: (n,) must not be reversed; tip: (2,) where all begins; goal: (1, 2) where it ends up, or (0, 2).
    """
    begun, held, cut = list(lines), fixed.copy(), [0] * len(lines)
    if any(freedom):
        for k, free in enumerate(freedom):
            if free == CLOSED:
                begun[k] = _begin_at(lines[k], _corner(lines[k], tip, tip, True))
    for _ in range(ROUNDS if any(freedom) else 1):
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
        Run(k, (begun[k][: cut[k]], begun[k][cut[k] :]) if cut[k] else (begun[k][::-1] if flip else begun[k],))
        for k, flip in zip(order.tolist(), flips.tolist(), strict=True)
    ]


def _begin_at(line: Floats, at: int) -> Floats:
    """A line (n, 2) from one of its corners on to its end, and on from its beginning to that corner."""
    closed = bool((line[0] == line[-1]).all())
    return np.concatenate([line[at:], line[int(closed) : at + 1]]) if at else line


def _nearer_from_its_end(line: Floats, since: Floats, to: Floats) -> bool:
    forth = float(np.hypot(*(line[0] - since)) + np.hypot(*(to - line[-1])))
    return float(np.hypot(*(line[-1] - since)) + np.hypot(*(to - line[0]))) < forth - 1e-9


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
