"""Clip: open lines cut to the inside of polygons, each piece knowing on which edges of the border it ends."""

from dataclasses import dataclass
from math import cos, radians, sin

import numpy as np
from numpy.typing import NDArray

from mdp.kernel import floats, kernel, longs, part
from mdp.mesh import Floats
from slicer.polygons import Polygons, contours

Indices = NDArray[np.int64]
EDGES_A_BAND = 4  # the border is sorted into bands of about so many edges, which is what a segment is compared with


@dataclass(frozen=True, eq=False)
class Border:
    """edges: (m, 4) mm, x0 y0 x1 y1, contour after contour; offsets: (contours + 1,) where each contour begins."""

    edges: Floats
    offsets: Indices

    def turned(self, angle_deg: float) -> Floats:
        """The edges in a frame turned by the angle, in which lines of that direction are horizontal."""
        return np.ascontiguousarray((self.edges.reshape(-1, 2) @ turn(angle_deg)).reshape(-1, 4))


@dataclass(frozen=True, eq=False)
class Pieces:
    """points: (n, 2) mm; starts: (k,) first point of each piece; ends: (k, 2) edges on which its two ends lie."""

    points: Floats
    starts: Indices
    ends: Indices


NO_PIECES = Pieces(np.zeros((0, 2)), np.zeros(0, np.int64), np.zeros((0, 2), np.int64))


def border_of(polygons: Polygons) -> Border:
    """The border of polygons."""
    loops = contours(polygons)
    offsets = np.cumsum([0, *(len(loop) for loop in loops)], dtype=np.int64)
    if not loops:
        return Border(np.zeros((0, 4)), offsets)
    points = np.concatenate(loops)
    following = np.arange(1, len(points) + 1)
    following[offsets[1:] - 1] = offsets[:-1]
    return Border(np.hstack([points, points[following]]), offsets)


def turn(angle_deg: float) -> Floats:
    """(2, 2) rotation of row vectors by -angle."""
    c, s = cos(radians(angle_deg)), sin(radians(angle_deg))
    return np.array([[c, -s], [s, c]])


def trimmed(points: Floats, starts: Indices, edges: Floats) -> Pieces:
    """What of open lines (n, 2) lies inside the polygons of (m, 4) edges, by the even-odd rule.

    Every line must begin and end outside. Fastest for lines that run along x.
    """
    if not len(edges) or not len(starts):
        return NO_PIECES
    low, high = float(edges[:, 1::2].min()), float(edges[:, 1::2].max())
    count = max(len(edges) // EDGES_A_BAND, 1)
    bounds, height = np.append(starts, len(points)), max((high - low) / count, 1e-9)
    n, room = -1, 4 * len(points) + 2 * len(edges) + 64
    while n < 0:
        out, begins, ends = np.empty((room, 2)), np.empty(room, np.int64), np.empty((room, 2), np.int64)
        n, pieces = _trimmed(points, bounds, edges, low, height, count, out, begins, ends)
        room *= 4
    return Pieces(out[:n].copy(), begins[:pieces].copy(), ends[:pieces].copy())


def together(several: list[Pieces]) -> Pieces:
    """Pieces of several bundles of lines as one bundle."""
    if len(several) < 2:
        return several[0] if several else NO_PIECES
    before = np.cumsum([0, *(len(pieces.points) for pieces in several[:-1])])
    starts = np.concatenate([pieces.starts + shift for pieces, shift in zip(several, before, strict=True)])
    return Pieces(np.concatenate([p.points for p in several]), starts, np.concatenate([p.ends for p in several]))


@part
def _bands(edges: Floats, low: float, height: float, count: int) -> tuple[Indices, Indices]:
    """Where each horizontal band's edges begin in the list, and the edges listed."""
    offsets, place = longs(count + 1, 0), longs(count + 1, 0)
    first, last = longs(len(edges), 0), longs(len(edges), 0)
    for e in range(len(edges)):
        first[e] = min(int((min(edges[e, 1], edges[e, 3]) - low) / height), count - 1)
        last[e] = min(int((max(edges[e, 1], edges[e, 3]) - low) / height), count - 1)
        for band in range(first[e], last[e] + 1):
            offsets[band + 1] += 1
    for band in range(count):
        offsets[band + 1] += offsets[band]
        place[band + 1] = offsets[band + 1]
    listed = longs(offsets[count], 0)
    for e in range(len(edges)):
        for band in range(first[e], last[e] + 1):
            listed[place[band]] = e
            place[band] += 1
    return offsets, listed


@part
def _side(ax: float, ay: float, bx: float, by: float, x: float, y: float) -> bool:
    """Whether a point lies to the left of a line; the same for both edges, or both segments, that meet in the point."""
    return bool((bx - ax) * (y - ay) - (by - ay) * (x - ax) > 0.0)


@part
def _crossing(ax: float, ay: float, bx: float, by: float, edges: Floats, e: int) -> float:
    """Where (0..1) a segment crosses an edge; -1 where it does not."""
    px, py, qx, qy = edges[e, 0], edges[e, 1], edges[e, 2], edges[e, 3]
    if max(px, qx) < min(ax, bx) or min(px, qx) > max(ax, bx):
        return -1.0
    if _side(ax, ay, bx, by, px, py) == _side(ax, ay, bx, by, qx, qy):
        return -1.0
    if _side(px, py, qx, qy, ax, ay) == _side(px, py, qx, qy, bx, by):
        return -1.0
    along_a = (qx - px) * (ay - py) - (qy - py) * (ax - px)
    along_b = (qx - px) * (by - py) - (qy - py) * (bx - px)
    return float(along_a / (along_a - along_b))


@kernel
def _trimmed(
    points: Floats,
    bounds: Indices,
    edges: Floats,
    low: float,
    height: float,
    bands: int,
    out: Floats,
    starts: Indices,
    ends: Indices,
) -> tuple[int, int]:
    """Fills in the pieces; returns the number of points and of pieces, -1 where there is no room for them."""
    offsets, listed = _bands(edges, low, height, bands)
    seen, shares, crossed = longs(len(edges), -1), floats(len(edges), 0.0), longs(len(edges), 0)
    n = count = 0
    for line in range(len(bounds) - 1):
        within = False
        for k in range(bounds[line], bounds[line + 1] - 1):
            ax, ay, bx, by = points[k, 0], points[k, 1], points[k + 1, 0], points[k + 1, 1]
            first, last = int(np.floor((min(ay, by) - low) / height)), int(np.floor((max(ay, by) - low) / height))
            if last < 0 or first > bands:
                first, last = 0, -1
            many = 0
            for band in range(min(max(first, 0), bands - 1), min(last, bands - 1) + 1):
                for at in range(offsets[band], offsets[band + 1]):
                    e = listed[at]
                    share = _crossing(ax, ay, bx, by, edges, e) if seen[e] != k else -1.0
                    seen[e] = k
                    if share >= 0.0:
                        i = many
                        while i > 0 and (shares[i - 1] > share or (shares[i - 1] == share and crossed[i - 1] > e)):
                            shares[i], crossed[i] = shares[i - 1], crossed[i - 1]
                            i -= 1
                        shares[i], crossed[i] = share, e
                        many += 1
            if n + many + 1 > len(out):
                return -1, 0
            for i in range(many):
                within = not within
                if within:
                    starts[count], ends[count, 0] = n, crossed[i]
                else:
                    ends[count, 1] = crossed[i]
                    count += 1
                out[n, 0], out[n, 1] = ax + shares[i] * (bx - ax), ay + shares[i] * (by - ay)
                n += 1
            if within:
                out[n, 0], out[n, 1] = bx, by
                n += 1
        if within:
            n = starts[count]
    return n, count
