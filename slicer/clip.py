"""Clip: open lines cut to the inside of polygons, each piece knowing on which edges of the border it ends."""

from dataclasses import dataclass
from math import cos, radians, sin

import numpy as np
from numba import njit
from numpy.typing import NDArray

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
    return Pieces(*_trimmed(points, np.append(starts, len(points)), edges, *_bands(edges)))


def together(several: list[Pieces]) -> Pieces:
    """Pieces of several bundles of lines as one bundle."""
    if len(several) < 2:
        return several[0] if several else NO_PIECES
    before = np.cumsum([0, *(len(pieces.points) for pieces in several[:-1])])
    starts = np.concatenate([pieces.starts + shift for pieces, shift in zip(several, before, strict=True)])
    return Pieces(np.concatenate([p.points for p in several]), starts, np.concatenate([p.ends for p in several]))


@njit(cache=True)
def _bands(edges: Floats) -> tuple[float, float, Indices, Indices]:
    """Lower end and height of horizontal bands, offsets of each band's edges and the edges listed."""
    low, high = min(edges[:, 1].min(), edges[:, 3].min()), max(edges[:, 1].max(), edges[:, 3].max())
    count = max(len(edges) // EDGES_A_BAND, 1)
    height = max((high - low) / count, 1e-9)
    offsets = np.zeros(count + 1, np.int64)
    first, last = np.empty(len(edges), np.int64), np.empty(len(edges), np.int64)
    for e in range(len(edges)):
        first[e] = min(int((min(edges[e, 1], edges[e, 3]) - low) / height), count - 1)
        last[e] = min(int((max(edges[e, 1], edges[e, 3]) - low) / height), count - 1)
        for band in range(first[e], last[e] + 1):
            offsets[band + 1] += 1
    offsets = np.cumsum(offsets)
    listed, place = np.empty(offsets[-1], np.int64), offsets.copy()
    for e in range(len(edges)):
        for band in range(first[e], last[e] + 1):
            listed[place[band]] = e
            place[band] += 1
    return low, height, offsets, listed


@njit(cache=True)
def _side(ax: float, ay: float, bx: float, by: float, x: float, y: float) -> bool:
    """Whether a point lies to the left of a line; the same for both edges, or both segments, that meet in the point."""
    return bool((bx - ax) * (y - ay) - (by - ay) * (x - ax) > 0.0)


@njit(cache=True)
def _crossings(
    a: Floats, b: Floats, edges: Floats, low: float, height: float, offsets: Indices, listed: Indices, seen: Indices, mark: int
) -> list[tuple[float, int]]:
    """Where a segment crosses edges: shares of its length, rising, with the edges."""
    found = [(0.0, 0) for _ in range(0)]
    bands = len(offsets) - 1
    first, last = int(np.floor((min(a[1], b[1]) - low) / height)), int(np.floor((max(a[1], b[1]) - low) / height))
    left, right = min(a[0], b[0]), max(a[0], b[0])
    if last < 0 or first > bands:
        return found
    for band in range(min(max(first, 0), bands - 1), min(last, bands - 1) + 1):
        for at in range(offsets[band], offsets[band + 1]):
            e = listed[at]
            if seen[e] == mark:
                continue
            seen[e] = mark
            px, py, qx, qy = edges[e]
            if max(px, qx) < left or min(px, qx) > right:
                continue
            if _side(a[0], a[1], b[0], b[1], px, py) == _side(a[0], a[1], b[0], b[1], qx, qy):
                continue
            if _side(px, py, qx, qy, a[0], a[1]) == _side(px, py, qx, qy, b[0], b[1]):
                continue
            along_a = (qx - px) * (a[1] - py) - (qy - py) * (a[0] - px)
            along_b = (qx - px) * (b[1] - py) - (qy - py) * (b[0] - px)
            found.append((along_a / (along_a - along_b), e))
    found.sort()
    return found


@njit(cache=True)
def _trimmed(
    points: Floats, bounds: Indices, edges: Floats, low: float, height: float, offsets: Indices, listed: Indices
) -> tuple[Floats, Indices, Indices]:
    seen = np.full(len(edges), -1, np.int64)
    room = 2 * len(points) + 64
    out, starts, ends = np.empty((room, 2)), np.empty(room, np.int64), np.empty((room, 2), np.int64)
    n = count = 0
    for line in range(len(bounds) - 1):
        within = False
        for k in range(bounds[line], bounds[line + 1] - 1):
            a, b = points[k], points[k + 1]
            found = _crossings(a, b, edges, low, height, offsets, listed, seen, k)
            if n + 2 * len(found) + 2 > len(out):
                more = len(out) + 2 * len(found)
                out, starts = np.concatenate((out, np.empty((more, 2)))), np.concatenate((starts, np.empty(more, np.int64)))
                ends = np.concatenate((ends, np.empty((more, 2), np.int64)))
            for share, e in found:
                within = not within
                if within:
                    starts[count], ends[count, 0] = n, e
                else:
                    ends[count, 1] = e
                    count += 1
                out[n] = a + share * (b - a)
                n += 1
            if within:
                out[n] = b
                n += 1
        if within:
            n = starts[count]
    return out[:n], starts[:count], ends[:count]
