"""Seam: where a wall that runs round begins and ends.

Every outer wall begins at the place of least cost: the distance to a target (the seam of the layer below, the rear, the tip),
less a reward for corners, which hide a seam. Places near the edge of an interface are out of the question. Inner walls begin
beside their outer wall.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from mdp.kernel import kernel, part
from mdp.mesh import Floats
from profiles.process import Process
from slicer.bead import Bead
from slicer.paths import Kind
from slicer.polygons import turned

WALLS = (Kind.OUTER_WALL, Kind.INNER_WALL)
REACH_MM = 3.0  # a seam of the layer below that lies nearer than this to a wall is continued
ARM_MM = 1.0  # a corner's angle is measured between points this far before and after it, so that noise is none
SMOOTH_DEG, SHARP_DEG = 20.0, 90.0  # from where on a turn hides a seam at all, and from where on it does so fully
ANYWHERE = (1000.0, 300.0)  # a sharp inner or outer corner is worth this way, mm: inner before outer before none
NEARBY = (2.0, 1.0)  # the same where a seam is continued: it moves into a corner that it passes
NO_CORNER = (0.0, 0.0)
SAMPLE_MM = 2.0  # straight sides are tried at this distance when their ends are too near an interface
GOLDEN = 0.6180339887498949
FORBIDDEN = 1e6


@dataclass(frozen=True, eq=False)
class Surroundings:
    """What the seams of a layer heed. rear: (2,) a point behind the part; before: (k, 2) outer seams of the layer below.

    tip: (2,) where the nozzle comes from. interfaces: (n, 6) segments of their edges, z_mm: the layer's middle. layer: number.
    """

    rear: Floats
    before: Floats
    tip: Floats
    interfaces: Floats
    z_mm: float
    layer: int


def rear_of(bounds_mm: Floats) -> Floats:
    """(2,) a point behind the middle of a part, as far as the part is deep; bounds_mm: (2, 3)."""
    low, high = bounds_mm
    return np.array([0.5 * (low[0] + high[0]), 2.0 * high[1] - low[1]])


def seamed(beads: Sequence[Bead], process: Process, around: Surroundings) -> tuple[list[Bead], Floats]:
    """The beads with their walls begun at their seams, and the (k, 2) seams of the outer walls.

    The walls come as loops (n, 2), solid on their left, and become polylines. A wall stops short of its beginning by
    seam_gap of its width. An outer wall that is near an interface's edge all round begins and ends a line width inside
    instead, over its inner walls.
    """
    edges = _at_height(around, process.interface_seam_mm)
    seams: dict[int, Floats] = {}
    out = list(beads)
    for kind in WALLS:
        known = np.array(list(seams.values())).reshape(-1, 2)
        for k, bead in enumerate(beads):
            if bead.kind is kind:
                begun, free = _begun(np.ascontiguousarray(bead.points), known, kind, process, around, edges)
                seams |= {k: begun[0]} if kind is Kind.OUTER_WALL else {}
                led = kind is Kind.OUTER_WALL and not free
                out[k] = replace(bead, points=_ended(begun, process.seam_gap * bead.width_mm, bead.width_mm if led else 0.0))
    return out, np.array(list(seams.values())).reshape(-1, 2)


def begun_at_rear(loop: Floats) -> Floats:
    """A loop (n, 2) closed and begun at its rearmost point, the leftmost of several."""
    at = int(np.lexsort((loop[:, 0], -loop[:, 1]))[0])
    return np.concatenate([loop[at:], loop[: at + 1]])


def _at_height(around: Surroundings, keep_mm: float) -> Floats:
    """Segments of interface edges within reach of a layer."""
    z = around.interfaces[:, [2, 5]] - around.z_mm
    return np.ascontiguousarray(around.interfaces[(z.min(axis=1) < keep_mm) & (z.max(axis=1) > -keep_mm)])


def _begun(loop: Floats, outer: Floats, kind: Kind, process: Process, around: Surroundings, edges: Floats) -> tuple[Floats, bool]:
    """The loop (n, 2) begun at its seam, and whether that is clear of interface edges."""
    if kind is Kind.INNER_WALL:
        place = _nearest(loop, outer, np.inf)
        target, corners, edges = (place if place[0] < np.inf else (0.0, *loop[0])), NO_CORNER, edges[:0]
    else:
        target, corners = _target(loop, process, around)
    at, share, free = _best(
        loop, target[1], target[2], *corners, edges, around.z_mm, process.interface_seam_mm, float(np.cos(np.radians(SMOOTH_DEG)))
    )
    if share > 0.0:
        new = loop[at] + share * (loop[(at + 1) % len(loop)] - loop[at])
        return np.concatenate([new[None], loop[at + 1 :], loop[: at + 1]]), free
    return turned(loop, at), free


def _target(loop: Floats, process: Process, around: Surroundings) -> tuple[tuple[float, float, float], tuple[float, float]]:
    """Where an outer wall's seam is drawn to, as (distance, x, y), and what inner and outer corners are worth."""
    rear = (0.0, float(around.rear[0]), float(around.rear[1]))
    if process.seam == "rear":
        return rear, NO_CORNER
    if process.seam == "nearest":
        return (0.0, float(around.tip[0]), float(around.tip[1])), NO_CORNER
    if process.seam == "random":
        return (0.0, *_along(loop, (GOLDEN * (around.layer + 1)) % 1.0)), NO_CORNER
    before = _nearest(loop, around.before, REACH_MM)
    if process.seam == "corner":
        return (before if before[0] < np.inf else rear), ANYWHERE
    return (before, NEARBY) if before[0] < np.inf else (rear, ANYWHERE)


def _ended(loop: Floats, gap_mm: float, lead_mm: float) -> Floats:
    """The loop as a polyline that ends a gap before its beginning; lead_mm: both ends are drawn inside by that."""
    points = np.concatenate([loop, loop[:1]])
    steps = np.hypot(*np.diff(points, axis=0).T)
    if gap_mm > 0.0 and steps.sum() > 4.0 * gap_mm:
        beyond = np.cumsum(steps[::-1])[::-1]  # from each point to the end
        last = int(np.flatnonzero(beyond > gap_mm)[-1])
        share = (beyond[last] - gap_mm) / steps[last]
        points = np.concatenate([points[: last + 1], (points[last] + share * (points[last + 1] - points[last]))[None]])
    if lead_mm > 0.0:
        inward = _inward(loop) * lead_mm
        points = np.concatenate([(points[0] + inward)[None], points, (points[-1] + 0.5 * inward)[None]])
    return points


def _inward(loop: Floats) -> Floats:
    """Unit vector to the left of the loop at its beginning, where the solid is."""
    steps = np.array([loop[0] - loop[-1], loop[1] - loop[0]])
    steps /= np.maximum(np.hypot(*steps.T), 1e-12)[:, None]
    along = steps.sum(axis=0)
    length = float(np.hypot(*along))
    along = along / length if length > 1e-6 else steps[1]
    return np.array([-along[1], along[0]])


@kernel
def _along(loop: Floats, share: float) -> tuple[float, float]:
    """The point at a share of a loop's length, counted from its least point, so that it does not depend on the loop's start."""
    n = len(loop)
    first = 0
    for i in range(n):
        if loop[i, 0] < loop[first, 0] or (loop[i, 0] == loop[first, 0] and loop[i, 1] < loop[first, 1]):
            first = i
    total = 0.0
    for i in range(n):
        total += np.hypot(loop[i, 0] - loop[i - 1, 0], loop[i, 1] - loop[i - 1, 1])
    left = share * total
    for i in range(first, first + n):
        ax, ay = loop[i % n, 0], loop[i % n, 1]
        dx, dy = loop[(i + 1) % n, 0] - ax, loop[(i + 1) % n, 1] - ay
        step = np.hypot(dx, dy)
        if step >= left:
            along = left / step if step > 0.0 else 0.0
            return ax + along * dx, ay + along * dy
        left -= step
    return loop[first, 0], loop[first, 1]


@part
def _projected(loop: Floats, x: float, y: float) -> tuple[float, int, float]:
    """Distance from a point to a loop, the side that is nearest and how far along it."""
    least, at, share = np.inf, 0, 0.0
    n = len(loop)
    for i in range(n):
        ax, ay = loop[i, 0], loop[i, 1]
        dx, dy = loop[(i + 1) % n, 0] - ax, loop[(i + 1) % n, 1] - ay
        square = dx * dx + dy * dy
        t = min(max(((x - ax) * dx + (y - ay) * dy) / square, 0.0), 1.0) if square > 0.0 else 0.0
        distance = np.hypot(ax + t * dx - x, ay + t * dy - y)
        if distance < least:
            least, at, share = distance, i, t
    return least, at, share


@kernel
def _nearest(loop: Floats, points: Floats, reach_mm: float) -> tuple[float, float, float]:
    """The point nearest to a loop as (distance, x, y); the distance is infinite when none is within reach."""
    low_x, high_x, low_y, high_y = loop[0, 0], loop[0, 0], loop[0, 1], loop[0, 1]
    for i in range(len(loop)):
        low_x, high_x = min(low_x, loop[i, 0]), max(high_x, loop[i, 0])
        low_y, high_y = min(low_y, loop[i, 1]), max(high_y, loop[i, 1])
    best, bx, by = np.inf, 0.0, 0.0
    for p in range(len(points)):
        x, y = points[p, 0], points[p, 1]
        out = np.hypot(max(low_x - x, 0.0, x - high_x), max(low_y - y, 0.0, y - high_y))
        if out < min(best, reach_mm):
            distance = _projected(loop, x, y)[0]
            if distance < min(best, reach_mm):
                best, bx, by = distance, x, y
    return best, bx, by


@kernel
def _best(
    loop: Floats, x: float, y: float, inner_mm: float, outer_mm: float, edges: Floats, z: float, keep: float, smooth: float
) -> tuple[int, float, bool]:
    """The place of least cost as (side, share of it), and whether it keeps clear of the edges."""
    n = len(loop)
    distance, at, share = _projected(loop, x, y)
    if share >= 1.0 - 1e-6:
        at, share = (at + 1) % n, 0.0
    elif share <= 1e-6:
        share = 0.0
    px = loop[at, 0] + share * (loop[(at + 1) % n, 0] - loop[at, 0])
    py = loop[at, 1] + share * (loop[(at + 1) % n, 1] - loop[at, 1])
    free = not _near(edges, px, py, z, keep)
    least = distance + (0.0 if free else FORBIDDEN)
    if inner_mm == 0.0 and outer_mm == 0.0 and free:
        return at, share, free
    for i in range(n):
        ax, ay = loop[i, 0], loop[i, 1]
        dx, dy = loop[(i + 1) % n, 0] - ax, loop[(i + 1) % n, 1] - ay
        count = 1 if free and len(edges) == 0 else int(np.hypot(dx, dy) / SAMPLE_MM) + 1
        for s in range(count):
            cx, cy = ax + s / count * dx, ay + s / count * dy
            cost = np.hypot(cx - x, cy - y) + 1e-6 * cx
            if s == 0 and inner_mm > 0.0:
                cost -= _reward(loop, i, inner_mm, outer_mm, smooth)
            if cost < least:
                clear = not _near(edges, cx, cy, z, keep)
                if clear or not free:
                    cost += 0.0 if clear else FORBIDDEN
                    if cost < least:
                        least, at, share, free = cost, i, s / count, clear
    return at, share, free


@part
def _reward(loop: Floats, i: int, inner_mm: float, outer_mm: float, smooth: float) -> float:
    """What the corner at a vertex is worth: nothing up to SMOOTH_DEG of turn, all from SHARP_DEG on."""
    px, py = _arm(loop, i, -1)
    qx, qy = _arm(loop, i, 1)
    bx, by, cx, cy = loop[i, 0] - px, loop[i, 1] - py, qx - loop[i, 0], qy - loop[i, 1]
    cross, dot = bx * cy - by * cx, bx * cx + by * cy
    if dot > smooth * np.hypot(bx, by) * np.hypot(cx, cy):
        return 0.0
    turn = np.degrees(np.arctan2(abs(cross), dot))
    strength = min((turn - SMOOTH_DEG) / (SHARP_DEG - SMOOTH_DEG), 1.0)
    return float(strength * (inner_mm if cross < 0.0 else outer_mm))


@part
def _arm(loop: Floats, i: int, way: int) -> tuple[float, float]:
    """The point ARM_MM along the loop from a vertex, forward or backward."""
    n, left, at = len(loop), ARM_MM, i
    for _ in range(n):
        ax, ay = loop[at % n, 0], loop[at % n, 1]
        dx, dy = loop[(at + way) % n, 0] - ax, loop[(at + way) % n, 1] - ay
        step = np.hypot(dx, dy)
        if step >= left:
            return ax + left / step * dx, ay + left / step * dy
        left -= step
        at += way
    return loop[at % n, 0], loop[at % n, 1]


@part
def _near(edges: Floats, x: float, y: float, z: float, keep: float) -> bool:
    """Whether a point in space lies within a distance of any of the (n, 6) segments."""
    for e in range(len(edges)):
        ax, ay, az, bx, by, bz = edges[e, 0], edges[e, 1], edges[e, 2], edges[e, 3], edges[e, 4], edges[e, 5]
        dx, dy, dz = bx - ax, by - ay, bz - az
        square = dx * dx + dy * dy + dz * dz
        t = min(max(((x - ax) * dx + (y - ay) * dy + (z - az) * dz) / square, 0.0), 1.0) if square > 0.0 else 0.0
        if (ax + t * dx - x) ** 2 + (ay + t * dy - y) ** 2 + (az + t * dz - z) ** 2 < keep * keep:
            return True
    return False
