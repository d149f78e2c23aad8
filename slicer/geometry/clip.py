"""Clip: open lines clipped to the inside of polygons, each piece with the edges of the border on which it ends."""

from math import cos, radians, sin
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from mdp.kernels.arrays import floats, longs
from mdp.kernels.kernel import borrower, kernel, part
from mdp.kernels.sorting import sort_into_bins
from mdp.mesh import Floats
from slicer.geometry.polygons import Polygons, contours, edges_of
from slicer.geometry.segments import Segment, crossing, edge

Indices = NDArray[np.int64]
EDGES_A_BAND = 4  # the border is sorted into bands of about so many edges, which is what a segment is compared with


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


class _Bands(NamedTuple):
    """Horizontal bands of one height from low up, into which the edges of the border are sorted."""

    low: float
    height: float
    number: int


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

    Every line must begin and end outside. Fastest for lines that run along x.
    """
    if not len(edges) or not len(starts):
        return NO_PIECES
    low, high = float(edges[:, 1::2].min()), float(edges[:, 1::2].max())
    count = max(len(edges) // EDGES_A_BAND, 1)
    bounds, bands = np.append(starts, len(points)), _Bands(low, max((high - low) / count, 1e-9), count)
    n, room = -1, 4 * len(points) + 2 * len(edges) + 64
    while n < 0:
        out = Pieces(np.empty((room, 2)), np.empty(room + 1, np.int64), np.empty((room, 2), np.int64))
        n, pieces = _clip(points, bounds, edges, bands, out)
        room *= 4
    return Pieces(out.points[:n].copy(), out.starts[: pieces + 1].copy(), out.ends[:pieces].copy())


def merge_pieces(several: list[Pieces]) -> Pieces:
    """Pieces of several bundles of lines as one bundle."""
    if len(several) < 2:
        return several[0] if several else NO_PIECES
    sizes = np.concatenate([np.diff(pieces.starts) for pieces in several])
    starts = np.concatenate([[0], np.cumsum(sizes)])
    return Pieces(np.concatenate([p.points for p in several]), starts, np.concatenate([p.ends for p in several]))


@part
def _sort_edges(edges: Floats, bands: _Bands) -> tuple[Indices, Indices]:
    """Where each band's edges begin in the list, and the edges listed."""
    first, last = longs(len(edges), 0), longs(len(edges), 0)
    for e in range(len(edges)):
        first[e] = min(int((min(edges[e, 1], edges[e, 3]) - bands.low) / bands.height), bands.number - 1)
        last[e] = min(int((max(edges[e, 1], edges[e, 3]) - bands.low) / bands.height), bands.number - 1)
    return sort_into_bins(first, last, bands.number)


@part
def _touched(bands: _Bands, y0: float, y1: float) -> tuple[int, int]:
    """First and last band that what lies between two heights touches; the last below the first: none."""
    first, last = int(np.floor((min(y0, y1) - bands.low) / bands.height)), int(np.floor((max(y0, y1) - bands.low) / bands.height))
    if last < 0 or first > bands.number:
        return 0, -1
    return min(max(first, 0), bands.number - 1), min(last, bands.number - 1)


@borrower
def _crossing(segment: Segment, side: Segment) -> float:
    """Where (0..1) a segment crosses an edge; -1 where it does not, which is most often seen by x alone."""
    if max(side.x0, side.x1) < min(segment.x0, segment.x1) or min(side.x0, side.x1) > max(segment.x0, segment.x1):
        return -1.0
    return crossing(segment, side)


@kernel
def _clip(points: Floats, bounds: Indices, edges: Floats, bands: _Bands, out: Pieces) -> tuple[int, int]:
    """Fills in the pieces; returns the number of points and of pieces, -1 where there is no room for them."""
    offsets, listed = _sort_edges(edges, bands)
    seen, shares, crossed = longs(len(edges), -1), floats(len(edges), 0.0), longs(len(edges), 0)
    n = count = 0
    for line in range(len(bounds) - 1):
        within = False
        for k in range(bounds[line], bounds[line + 1] - 1):
            ax, ay, bx, by = points[k, 0], points[k, 1], points[k + 1, 0], points[k + 1, 1]
            segment = Segment(ax, ay, bx, by)
            first, last = _touched(bands, ay, by)
            many = 0
            for band in range(first, last + 1):
                for at in range(offsets[band], offsets[band + 1]):
                    e = listed[at]
                    share = _crossing(segment, edge(edges, e)) if seen[e] != k else -1.0
                    seen[e] = k
                    if share >= 0.0:
                        i = many
                        while i > 0 and (shares[i - 1] > share or (shares[i - 1] == share and crossed[i - 1] > e)):
                            shares[i], crossed[i] = shares[i - 1], crossed[i - 1]
                            i -= 1
                        shares[i], crossed[i] = share, e
                        many += 1
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
