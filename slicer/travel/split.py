"""Split: beads of a layer parted where they enter and leave a place, so that they are printed otherwise there."""

from collections.abc import Callable, Sequence
from dataclasses import replace
from itertools import pairwise
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from mdp.kernels.arrays import floats
from mdp.kernels.kernel import kernel
from mdp.kernels.sorting import rank, sort
from mdp.mesh import Floats
from slicer.bead import Bead
from slicer.geometry.polygons import Polygons, edges
from slicer.geometry.segments import Segment, inside, orientation
from slicer.paths import Kind
from slicer.travel.combing import NOWHERE
from slicer.travel.order import Placed

SNAP = 1e-6  # of a step's length: a crossing so near its end is at its end


class Sides(NamedTuple):
    """Sides (k, 4) of a place by rising least y; lows: (k,) that y; tallest: how far a side reaches along y at most."""

    edges: Floats
    lows: Floats
    tallest: float

    @classmethod
    def of(cls, edges: Floats) -> "Sides":
        """Those of (k, 4) edges in any order."""
        lows = np.minimum(edges[:, 1], edges[:, 3])
        order = np.argsort(lows, kind="stable")
        return cls(edges[order], lows[order], float(np.abs(edges[:, 3] - edges[:, 1]).max(initial=0.0)))


def split(
    placed: Sequence[Placed], area: Polygons, kinds: Sequence[Kind], shortest_mm: float, change: Callable[[Bead], Bead]
) -> list[Placed]:
    """The beads in the same order, those of some kinds in pieces; change() makes what lies within the area.

    The pieces of a bead follow each other without a travel, only the first one keeps its approach. No piece is shorter than
    shortest_mm.
    """
    sides = Sides.of(edges(area))
    out: list[Placed] = []
    for bead in placed:
        out += _split_bead(bead, sides, shortest_mm, change) if bead.bead.kind in kinds else [bead]
    return out


def _split_bead(placed: Placed, sides: Sides, shortest_mm: float, change: Callable[[Bead], Bead]) -> list[Placed]:
    points, within = cut_line(np.ascontiguousarray(placed.points), sides)
    if not within.any():
        return [placed]
    within = _steady(within, np.hypot(*np.diff(points, axis=0).T), shortest_mm)
    if not within.any():
        return [placed]
    bounds = [0, *(np.flatnonzero(np.diff(within)) + 1).tolist(), len(within)]
    pieces = []
    for a, b in pairwise(bounds):
        piece = points[a : b + 1] if len(bounds) > 2 else placed.points
        bead = replace(placed.bead, points=piece)
        bead = change(bead) if within[a] else bead
        pieces.append(
            replace(
                placed, bead=bead, points=piece, retract=placed.retract and a == 0, approach=NOWHERE if a else placed.approach
            )
        )
    return pieces


def _steady(within: NDArray[np.bool_], lengths: Floats, shortest_mm: float) -> NDArray[np.bool_]:
    """Runs shorter than that take after their surroundings, those within last so that none is overlooked for a gap."""
    for value in (False, True):
        bounds = [0, *(np.flatnonzero(np.diff(within)) + 1).tolist(), len(within)]
        if len(bounds) == 2:
            break  # a short bead that lies within as a whole has no surroundings
        for a, b in pairwise(bounds):
            if within[a] == value and float(lengths[a:b].sum()) < shortest_mm:
                within[a:b] = not value
    return within


def cut_line(points: Floats, sides: Sides) -> tuple[Floats, NDArray[np.bool_]]:
    """The polyline (n, 2) with the places added where it crosses sides, and which steps lie within."""
    size, room = -1, 2 * len(points) + 64
    while size < 0:
        out, within = np.empty((room, 2)), np.empty(room, np.bool_)
        size = _cut_into(points, *sides, out, within)
        room *= 4
    return out[:size], within[: size - 1]


@kernel
def _cut_into(points: Floats, sides: Floats, lows: Floats, tallest: float, out: Floats, marks: NDArray[np.bool_]) -> int:
    """Fills in the points and which steps lie within; returns how many points there are, -1 where there is no room for them."""
    shares, within = floats(len(sides) + 2, 0.0), False
    out[0, 0], out[0, 1] = points[0, 0], points[0, 1]
    n = 1
    for k in range(len(points) - 1):
        step = Segment(points[k, 0], points[k, 1], points[k + 1, 0], points[k + 1, 1])
        x0, y0, dx, dy = step.x0, step.y0, step.x1 - step.x0, step.y1 - step.y0
        low, high = min(y0, y0 + dy), max(y0, y0 + dy)
        many = 1  # the first share stays 0
        touched = k == 0
        for e in range(rank(lows, low - tallest, False), rank(lows, high, True)):
            ax, ay, bx, by = sides[e, 0], sides[e, 1], sides[e, 2], sides[e, 3]
            side_a, side_b = orientation(step, ax, ay), orientation(step, bx, by)
            if (side_a > 0) != (side_b > 0):
                along = side_a / (side_a - side_b)
                share = ((ax + along * (bx - ax) - x0) * dx + (ay + along * (by - ay) - y0) * dy) / (dx * dx + dy * dy)
                touched = touched or -SNAP <= share <= 1.0 + SNAP
                if SNAP < share < 1.0 - SNAP:
                    shares[many] = share
                    many += 1
        if n + many > len(out):
            return -1
        sort(shares, 1, many)
        shares[many] = 1.0
        for s in range(many):
            if touched:
                middle = 0.5 * (shares[s] + shares[s + 1])
                within = inside(sides, x0 + middle * dx, y0 + middle * dy)
            out[n, 0], out[n, 1] = x0 + shares[s + 1] * dx, y0 + shares[s + 1] * dy
            marks[n - 1] = within
            n += 1
        out[n - 1, 0], out[n - 1, 1] = points[k + 1, 0], points[k + 1, 1]
    return n
