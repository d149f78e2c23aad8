"""Overhangs: the stretches of walls that hardly lie on the layer below, told apart so that they are printed slowly."""

from collections.abc import Sequence
from dataclasses import replace
from itertools import pairwise

import numpy as np
from numba import njit
from numpy.typing import NDArray

from mdp.mesh import Floats
from profiles.process import Process
from slicer.bead import Bead
from slicer.order import Placed
from slicer.paths import Kind
from slicer.polygons import Polygons, edges, grown, opened
from slicer.scanline import inside

WALLS = (Kind.OUTER_WALL, Kind.INNER_WALL)
SHORTEST = 2.0  # line widths: no stretch is told apart for less, the speed would flicker
SNAP = 1e-6  # of a step's length: a crossing so near its end is at its end
NOISE_MM = 0.02  # two sections of one upright surface differ by as much after their cleaning


def overhanging(placed: Sequence[Placed], section: Polygons, bank: Polygons | None, process: Process) -> list[Placed]:
    """The beads of a layer with its walls split where they begin and cease to overhang, in the same order.

    bank: what the layer lies on; None: the platform. A bead of width w whose centreline runs d outside the bank has the
    share 1/2 - d/w of its width on it; it overhangs where that is less than process.overhang_share.
    """
    if bank is None or process.overhang_share <= 0.0:
        return list(placed)
    width = process.line_width_mm
    hanging = section - grown(bank, max((0.5 - process.overhang_share) * width, NOISE_MM))
    hanging = hanging if hanging.is_empty() else opened(hanging, NOISE_MM)
    if hanging.is_empty():
        return list(placed)
    sides = edges(hanging)
    sides = sides[np.argsort(np.minimum(sides[:, 1], sides[:, 3]), kind="stable")]
    out: list[Placed] = []
    for each in placed:
        out += _split(each, sides, SHORTEST * width) if each.bead.kind in WALLS else [each]
    return out


def _split(placed: Placed, sides: Floats, shortest_mm: float) -> list[Placed]:
    """A wall as one bead, or as several that follow each other without a travel; only the first one keeps its approach."""
    points, hangs = _cut(np.ascontiguousarray(placed.points), sides)
    hangs = _steady(hangs, np.hypot(*np.diff(points, axis=0).T), shortest_mm)
    if not hangs.any():
        return [placed]
    bounds = [0, *(np.flatnonzero(np.diff(hangs)) + 1).tolist(), len(hangs)]
    pieces = []
    for k, (a, b) in enumerate(pairwise(bounds)):
        piece = points[a : b + 1] if len(bounds) > 2 else placed.points
        bead: Bead = replace(placed.bead, points=piece, kind=Kind.OVERHANG if hangs[a] else placed.bead.kind)
        pieces.append(replace(placed, bead=bead, points=piece) if k == 0 else _following(placed, bead))
    return pieces


def _following(placed: Placed, bead: Bead) -> Placed:
    return replace(placed, bead=bead, points=bead.points, retract=False, approach=np.zeros((0, 2)))


def _steady(hangs: NDArray[np.bool_], lengths: Floats, shortest_mm: float) -> NDArray[np.bool_]:
    """Runs shorter than that take after their surroundings, overhanging ones last so that none is overlooked for a gap."""
    for value in (False, True):
        bounds = [0, *(np.flatnonzero(np.diff(hangs)) + 1).tolist(), len(hangs)]
        for a, b in pairwise(bounds):
            if hangs[a] == value and float(lengths[a:b].sum()) < shortest_mm:
                hangs[a:b] = not value
    return hangs


@njit(cache=True)
def _cut(points: Floats, sides: Floats) -> tuple[Floats, NDArray[np.bool_]]:
    """The polyline (n, 2) with the places added where it crosses sides (k, 4; by rising least y), and which steps lie within."""
    lows = np.minimum(sides[:, 1], sides[:, 3])
    tallest = np.abs(sides[:, 3] - sides[:, 1]).max()
    xs, ys, marks, within = [points[0, 0]], [points[0, 1]], [False], False
    for k in range(len(points) - 1):
        x0, y0, dx, dy = points[k, 0], points[k, 1], points[k + 1, 0] - points[k, 0], points[k + 1, 1] - points[k, 1]
        low, high = min(y0, y0 + dy), max(y0, y0 + dy)
        shares = [0.0]
        touched = k == 0
        for e in range(np.searchsorted(lows, low - tallest), np.searchsorted(lows, high, side="right")):
            ax, ay, bx, by = sides[e]
            side_a, side_b = dx * (ay - y0) - dy * (ax - x0), dx * (by - y0) - dy * (bx - x0)
            if (side_a > 0) != (side_b > 0):
                along = side_a / (side_a - side_b)
                share = ((ax + along * (bx - ax) - x0) * dx + (ay + along * (by - ay) - y0) * dy) / (dx * dx + dy * dy)
                touched = touched or -SNAP <= share <= 1.0 + SNAP
                if SNAP < share < 1.0 - SNAP:
                    shares.append(share)
        shares.sort()
        shares.append(1.0)
        for s in range(len(shares) - 1):
            if touched:
                middle = 0.5 * (shares[s] + shares[s + 1])
                within = inside(sides, x0 + middle * dx, y0 + middle * dy)
            xs.append(x0 + shares[s + 1] * dx)
            ys.append(y0 + shares[s + 1] * dy)
            marks.append(within)
        xs[-1], ys[-1] = points[k + 1, 0], points[k + 1, 1]
    return np.column_stack((np.array(xs), np.array(ys))), np.array(marks[1:])
