"""Clip: open lines clipped to the inside of polygons, each piece with the edges of the border on which it ends."""

from math import cos, radians, sin
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from mdp.kernels.arrays import floats, longs
from mdp.kernels.kernel import kernel
from mdp.mesh import Floats
from slicer.geometry.cells import crossings, sort_edges
from slicer.geometry.polygons import Polygons, contours, edges_of
from slicer.geometry.segments import Segment

Indices = NDArray[np.int64]


class Border(NamedTuple):
    """edges: (m, 4) mm, x0 y0 x1 y1, contour after contour; offsets: (contours + 1,) where each contour begins."""

    edges: Floats
    offsets: Indices

    def turned(self, angle_deg: float) -> Floats:
        """The edges in a frame turned by the angle, in which lines of that direction are horizontal."""
        return np.ascontiguousarray((self.edges.reshape(-1, 2) @ rotation_2d(angle_deg)).reshape(-1, 4))


class Pieces(NamedTuple):
    """points: (n, 2) mm; starts: (k + 1,) first point of each piece, and n; ends: (k, 2) edges on which its two ends lie."""

    points: Floats
    starts: Indices
    ends: Indices


NO_PIECES = Pieces(np.zeros((0, 2)), np.zeros(1, np.int64), np.zeros((0, 2), np.int64))


def border_of(polygons: Polygons) -> Border:
    """The border of polygons."""
    loops = contours(polygons)
    return Border(edges_of(loops), np.cumsum([0, *(len(loop) for loop in loops)], dtype=np.int64))


def rotation_2d(angle_deg: float) -> Floats:
    """(2, 2) rotation of row vectors by -angle."""
    c, s = cos(radians(angle_deg)), sin(radians(angle_deg))
    return np.array([[c, -s], [s, c]])


def clip_lines(points: Floats, starts: Indices, edges: Floats) -> Pieces:
    """What of open lines (n, 2) lies inside the polygons of (m, 4) edges, by the even-odd rule.

    Every line must begin and end outside.
    """
    if not len(edges) or not len(starts):
        return NO_PIECES
    bounds = np.append(starts, len(points))
    n, room = -1, 4 * len(points) + 2 * len(edges) + 64
    while n < 0:
        out = Pieces(np.empty((room, 2)), np.empty(room + 1, np.int64), np.empty((room, 2), np.int64))
        n, pieces = _clip(points, bounds, edges, out)
        room *= 4
    return Pieces(out.points[:n].copy(), out.starts[: pieces + 1].copy(), out.ends[:pieces].copy())


def merge_pieces(several: list[Pieces]) -> Pieces:
    """Pieces of several bundles of lines as one bundle."""
    if len(several) < 2:
        return several[0] if several else NO_PIECES
    sizes = np.concatenate([np.diff(pieces.starts) for pieces in several])
    starts = np.concatenate([[0], np.cumsum(sizes)])
    return Pieces(np.concatenate([p.points for p in several]), starts, np.concatenate([p.ends for p in several]))


@kernel
def _clip(points: Floats, bounds: Indices, edges: Floats, out: Pieces) -> tuple[int, int]:
    """Fills in the pieces; returns the number of points and of pieces, -1 where there is no room for them."""
    cells, shares, crossed = sort_edges(edges, longs(0, 0), longs(0, 0)), floats(len(edges), 0.0), longs(len(edges), 0)
    n = count = 0
    for line in range(len(bounds) - 1):
        within = False
        for k in range(bounds[line], bounds[line + 1] - 1):
            ax, ay, bx, by = points[k, 0], points[k, 1], points[k + 1, 0], points[k + 1, 1]
            many = crossings(cells, Segment(ax, ay, bx, by), shares, crossed)
            if n + many + 1 > len(out.points):
                return -1, 0
            for i in range(many):
                within = not within
                if within:
                    out.starts[count], out.ends[count, 0] = n, crossed[i]
                else:
                    out.ends[count, 1] = crossed[i]
                    count += 1
                out.points[n, 0], out.points[n, 1] = ax + shares[i] * (bx - ax), ay + shares[i] * (by - ay)
                n += 1
            if within:
                out.points[n, 0], out.points[n, 1] = bx, by
                n += 1
        if within:
            n = out.starts[count]
    out.starts[count] = n
    return n, count
