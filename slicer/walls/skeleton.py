"""Skeleton: the medial axis of polygons as the circumcentres of their Delaunay triangles, with the ribs from it to the boundary.

The triangles of closely sampled contours are the nodes of the axis, their inner sides its edges (Kuipers et al. 2020, section
3.1, take the Voronoi diagram of the segments: samples need no parabolas and no exact arithmetic). A corner of a triangle is named
by the half-edge that begins there.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from mdp.kernels.arrays import flags, floats, ints, table
from mdp.kernels.kernel import kernel, no_nrt
from mdp.mesh import Floats
from slicer.geometry.segments import Segment, nearest_share, orientation
from slicer.geometry.triangulation import Triangulation

SLOPE = 0.2164  # sine of 12.5 deg: sides that meet at less than 25 deg enclose a place that narrows, others a corner
OPPOSITE = -0.8  # cosine of the angle between the ways to opposite sides, at most
ON_SIDE_MM2 = 1e-9  # rounding: a node on a side is in both triangles
TIE_MM = 1e-9  # rounding: of two feet as near, on the sides of a point of a circle round the node, the first is taken every time
MOST_STEPS = 1000  # triangles on the way from one to its centre; usually none


class Skeleton(NamedTuple):
    """m nodes. centres: (m, 2); radii: (m,) distance to the boundary; feet: (3 m, 2) the points of the boundary nearest to each.

    central: (3 m,) inner sides across which the axis runs between two opposite sides of the polygon, not into a corner of it.
    """

    centres: Floats
    radii: Floats
    feet: Floats
    central: NDArray[np.bool_]


@no_nrt
def after(h: int) -> int:
    """The next half-edge of the same triangle."""
    return h - 2 if h % 3 == 2 else h + 1


@no_nrt
def before(h: int) -> int:
    """The half-edge before in the same triangle."""
    return h + 2 if h % 3 == 0 else h - 1


@kernel
def skeleton_of(triangulation: Triangulation) -> Skeleton:
    """The skeleton of a triangulated polygon."""
    points, tails, across, _ = triangulation
    following, preceding = ints(len(points), 0), ints(len(points), 0)
    for h in range(len(tails)):
        if across[h] < 0:
            following[tails[h]], preceding[tails[after(h)]] = tails[after(h)], tails[h]
    count = len(tails) // 3
    out = Skeleton(table(count, 2), floats(count, 0.0), table(len(tails), 2), flags(len(tails)))
    for t in range(count):
        _put_at_circumcentre(triangulation, t, out)
        centred = in_middle = False
        while True:
            near, far, least, most = 3 * t, 3 * t, np.inf, -1.0
            for h in range(3 * t, 3 * t + 3):
                away = _foot(points, (preceding[tails[h]], tails[h], following[tails[h]]), h, out)
                if away < least:
                    near, least = h, away
                if away > most:
                    far, most = h, away
            out.radii[t] = 0.0 if in_middle else least
            if in_middle:
                break
            if not centred:
                centred = True
                if _centre(out, (near, far), least, most):
                    continue
            if not _leaves(triangulation, t, out.centres[t, 0], out.centres[t, 1]):
                break
            _put_in_middle(triangulation, t, out)
            in_middle = True
    for h in range(len(tails)):
        twin = across[h]
        if twin > h:
            out.central[h] = 0.5 * (_slope2(out, h) + _slope2(out, twin)) < SLOPE * SLOPE
            out.central[twin] = out.central[h]
    return out


@no_nrt
def _leaves(triangulation: Triangulation, t: int, x: float, y: float) -> bool:
    """Whether a node lies beyond the boundary, seen from its triangle: needles in a neck have their centres anywhere."""
    points, tails, across, _ = triangulation
    for _ in range(MOST_STEPS):
        onward = -1
        for h in range(3 * t, 3 * t + 3):
            a, b = tails[h], tails[after(h)]
            beside = orientation(Segment(points[a, 0], points[a, 1], points[b, 0], points[b, 1]), x, y)
            if beside <= 0.0 and across[h] < 0:
                return True
            if beside < -ON_SIDE_MM2:
                onward = across[h]
        if onward < 0:
            return False
        t = onward // 3
    return True


@no_nrt
def _put_at_circumcentre(triangulation: Triangulation, t: int, out: Skeleton) -> None:
    """Fills in the circumcentre of a triangle."""
    points, tails, _, _ = triangulation
    a, b, c = tails[3 * t], tails[3 * t + 1], tails[3 * t + 2]
    bx, by = points[b, 0] - points[a, 0], points[b, 1] - points[a, 1]
    cx, cy = points[c, 0] - points[a, 0], points[c, 1] - points[a, 1]
    doubled = 2.0 * (bx * cy - by * cx)
    if abs(doubled) < 1e-12:
        _put_in_middle(triangulation, t, out)
        return
    b2, c2 = bx * bx + by * by, cx * cx + cy * cy
    out.centres[t, 0] = points[a, 0] + (cy * b2 - by * c2) / doubled
    out.centres[t, 1] = points[a, 1] + (bx * c2 - cx * b2) / doubled


@no_nrt
def _put_in_middle(triangulation: Triangulation, t: int, out: Skeleton) -> None:
    """Puts a node into its triangle, where that has no circumcentre of use."""
    points, tails, _, _ = triangulation
    a, b, c = tails[3 * t], tails[3 * t + 1], tails[3 * t + 2]
    for axis in range(2):
        out.centres[t, axis] = (points[a, axis] + points[b, axis] + points[c, axis]) / 3.0


@no_nrt
def _foot(points: Floats, around: tuple[int, int, int], h: int, out: Skeleton) -> float:
    """Fills in the foot of a corner, on the two sides that meet there; returns how far it is from its node."""
    x, y = out.centres[h // 3, 0], out.centres[h // 3, 1]
    least = np.inf
    for k in range(2):
        a, b = around[k], around[k + 1]
        side = Segment(points[a, 0], points[a, 1], points[b, 0], points[b, 1])
        share = nearest_share(side, x, y)
        fx, fy = side.x0 + share * (side.x1 - side.x0), side.y0 + share * (side.y1 - side.y0)
        away = np.hypot(fx - x, fy - y)
        if away < least - TIE_MM:
            least = away
            out.feet[h, 0], out.feet[h, 1] = fx, fy
    return least


@no_nrt
def _centre(out: Skeleton, ends: tuple[int, int], short: float, long: float) -> bool:
    """Moves a node between two opposite sides to their middle, for samples do not lie right across from each other.

    ends: the corners with the nearest and the farthest foot; short, long: how far these are. Returns whether it moved.
    """
    near, far = ends
    t = near // 3
    ax, ay = out.feet[near, 0] - out.centres[t, 0], out.feet[near, 1] - out.centres[t, 1]
    bx, by = out.feet[far, 0] - out.centres[t, 0], out.feet[far, 1] - out.centres[t, 1]
    if short <= 0.0 or ax * bx + ay * by >= OPPOSITE * short * long:
        return False
    share = 0.5 * (long - short) / short
    out.centres[t, 0], out.centres[t, 1] = out.centres[t, 0] - share * ax, out.centres[t, 1] - share * ay
    return True


@no_nrt
def _slope2(out: Skeleton, h: int) -> float:
    """Square of how fast the radius changes along the axis across side h: cosine of half the angle between its two ribs."""
    t, next_side = h // 3, after(h)
    ax, ay = out.feet[h, 0] - out.centres[t, 0], out.feet[h, 1] - out.centres[t, 1]
    bx, by = out.feet[next_side, 0] - out.centres[t, 0], out.feet[next_side, 1] - out.centres[t, 1]
    long = np.hypot(ax, ay) * np.hypot(bx, by)
    return 0.5 * (1.0 + (ax * bx + ay * by) / long) if long > 1e-12 else 1.0
