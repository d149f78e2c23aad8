"""Pieces: strokes of varying width in pieces of one width each, printed one after the other without a travel."""

from dataclasses import replace
from math import ceil
from typing import NamedTuple

import numpy as np

from mdp.kernels.arrays import flags, table
from mdp.kernels.kernel import helper, kernel
from mdp.mesh import Floats, Indices
from mdp.overhang import Mask
from slicer.bead import EVEN_MM
from slicer.paths import bead_area_mm2
from slicer.strokes.strokes import Strokes

MOST_OVER_MM = 0.022  # by which a piece is wider than its narrowest place: half of it reaches over the section there
SHORTEST_MM = 0.2  # a piece that ends because widths change by EVEN_MM is no shorter,
MOST_SPREAD_MM, LEAST_MM = 0.03, 0.045  # but for one where they change by that much, which is no shorter than this


class _Pieces(NamedTuple):
    """Buffers for pieces: points (n, 3); starts: (k + 1,); source: (k,) the stroke of each; width_mm: (k,)."""

    points: Floats
    starts: Indices
    source: Indices
    width_mm: Floats


def in_pieces(strokes: Strokes, height_mm: float) -> Strokes:
    """The strokes in the same order, those of varying width in pieces whose widths are the means of their stretches.

    height_mm: of the layer; the pieces together hold the plastic of the whole.
    """
    if not strokes.varies.any():
        return strokes
    changes = np.abs(np.diff(strokes.points[:, 2]))
    room = 2 * (len(strokes.points) + int(np.ceil(changes / EVEN_MM).sum()))
    pieces = _Pieces(np.empty((room, 3)), np.empty(room, np.int64), np.empty(room, np.int64), np.empty(room))
    count = _part(strokes.points, strokes.starts, strokes.varies, strokes.width_mm, pieces)
    starts, source, width_mm = pieces.starts[: count + 1].copy(), pieces.source[:count], pieces.width_mm[:count].copy()
    out = strokes.refined(pieces.points[: starts[-1]].copy(), starts, source)
    whole, own = bead_area_mm2(out.width_mm, height_mm), bead_area_mm2(width_mm, height_mm)
    flow = np.where(out.varies, 1.0 + (out.flow - 1.0) * whole / own, out.flow)
    return replace(out, width_mm=width_mm, flow=flow)


@kernel
def _part(points: Floats, starts: Indices, varies: Mask, width_mm: Floats, out: _Pieces) -> int:
    """Fills in the pieces and returns how many there are."""
    count = n = 0
    out.starts[0] = 0
    for k in range(len(starts) - 1):
        a, b = starts[k], starts[k + 1]
        if not varies[k]:
            for i in range(a, b):
                for axis in range(3):
                    out.points[n, axis] = points[i, axis]
                n += 1
            out.source[count], out.width_mm[count], out.starts[count + 1] = k, width_mm[k], n
            count += 1
            continue
        line = _with_small_steps(points[a:b])
        ends = _ends(line)
        begin = 0
        for end in range(1, len(line)):
            if not ends[end]:
                continue
            least, total, weights = line[begin, 2], 0.0, 0.0
            for i in range(begin, end):
                step = max(np.hypot(line[i + 1, 0] - line[i, 0], line[i + 1, 1] - line[i, 1]), 1e-9)
                total, weights = total + 0.5 * (line[i + 1, 2] + line[i, 2]) * step, weights + step
                least = min(least, line[i + 1, 2])
            for i in range(begin, end + 1):
                for axis in range(3):
                    out.points[n, axis] = line[i, axis]
                n += 1
            out.source[count], out.width_mm[count], out.starts[count + 1] = k, min(total / weights, least + MOST_OVER_MM), n
            count, begin = count + 1, end
    return count


@helper
def _with_small_steps(points: Floats) -> Floats:
    """The line (n, 3) with points added where its width changes by more than EVEN_MM from one to the next."""
    size = 1
    for i in range(len(points) - 1):
        size += max(ceil(abs(points[i + 1, 2] - points[i, 2]) / EVEN_MM), 1)
    out = table(size, 3)
    n = 0
    for i in range(len(points) - 1):
        steps = max(ceil(abs(points[i + 1, 2] - points[i, 2]) / EVEN_MM), 1)
        for s in range(steps):
            for axis in range(3):
                out[n, axis] = points[i, axis] + s / steps * (points[i + 1, axis] - points[i, axis])
            n += 1
    for axis in range(3):
        out[n, axis] = points[len(points) - 1, axis]
    return out


@helper
def _ends(line: Floats) -> Mask:
    """(n,) True for the points of a line (n, 3) at which a piece ends: pieces are as long as the widths allow."""
    ends = flags(len(line))
    left = 0.0
    for i in range(len(line) - 1):
        left += np.hypot(line[i + 1, 0] - line[i, 0], line[i + 1, 1] - line[i, 1])
    length = 0.0
    low = high = 0.5 * (line[1, 2] + line[0, 2])
    for i in range(len(line) - 1):
        step = np.hypot(line[i + 1, 0] - line[i, 0], line[i + 1, 1] - line[i, 1])
        width = 0.5 * (line[i + 1, 2] + line[i, 2])
        spread = max(high, width) - min(low, width)
        least_mm = LEAST_MM if spread > MOST_SPREAD_MM else SHORTEST_MM
        if spread > EVEN_MM and length >= least_mm and left >= least_mm:
            ends[i] = True
            length, low, high = 0.0, width, width
        length, left = length + step, left - step
        low, high = min(low, width), max(high, width)
    ends[len(line) - 1] = True
    return ends
