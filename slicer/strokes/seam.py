"""Z-seams: start and end of closed walls.

Every outer wall begins at the point of least cost: the distance to a target (a planned point, the seam of the layer below, the
rear, the tip), less a reward for corners, which hide a seam. Points near the edge of an interface are excluded. Inner walls begin
beside their outer wall. If no point of an outer wall is allowed, it begins and ends inside, over its inner walls (its lead).
"""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from mdp.kernels.kernel import helper, kernel
from mdp.mesh import Floats
from profiles.process import Process
from slicer.bead import Bead
from slicer.geometry.polygons import start_at
from slicer.geometry.polyline import Segment, nearest_share
from slicer.paths import Kind
from slicer.strokes.seam_plan import NO_LIMITS, SeamLimits, corner_strength, is_clear
from slicer.strokes.strokes import RINGS

REACH_MM = 3.0  # a seam of the layer below that is closer to a wall than this is continued
ANYWHERE = (1000.0, 300.0)  # reward for a sharp inner or outer corner, mm of distance: inner before outer before none
NEARBY = (2.0, 1.0)  # that reward when a seam is continued: it moves into a corner that it passes
PLANNED = (1.0, 1.0)  # that reward beside a planned point, whose corner of the outline a thin wall may lack
NO_CORNER = (0.0, 0.0)  # no reward for corners
# a planned point this close to the seam below attracts it by this share of the distance, outside corners
FOLLOW_MM, FOLLOW = 2.0, 0.3
KEPT = 0.25  # corner strength above which a planned corner is used however far the seam below is
GOLDEN = 0.6180339887498949  # (sqrt(5) - 1) / 2: its multiples scatter seams most evenly for any number of layers
FORBIDDEN = 1e6  # mm, above any distance: chosen only if all of a loop is forbidden
NO_SEAMS = np.zeros((0, 2))
# Target point of a seam, and the rewards of inner and outer corners, mm.
Target = tuple[float, float, float, float]
SAMPLE_MM = 2.0  # points on straight sides are tried at this spacing, too
OFF_WALL = 0.7  # share of its length that a lead must extend inside so that the tip passes clear of the outer wall


@dataclass(frozen=True, eq=False)
class Surroundings:
    """The surroundings of a layer's seams. rear: (2,) a point behind the part; before: (k, 2) outer seams of the layer below.

    tip: (2,) position of the nozzle before the layer. limits: edges that seams avoid. layer: number. planned: (m, 2) best hidden
    points, which aligned seams follow.
    """

    rear: Floats
    before: Floats
    tip: Floats
    limits: SeamLimits
    layer: int
    planned: Floats = field(default_factory=lambda: NO_SEAMS)


def place_seams(beads: Sequence[Bead], process: Process, around: Surroundings) -> tuple[list[Bead], Floats]:
    """The beads with walls that start at their seams, and the (k, 2) seams of the outer walls.

    Closed walls are given as loops (n, 2), solid on their left, and become polylines that end seam_gap of their width before
    their start. An outer wall that is near an interface's edge all around, or on which the user wants no seam anywhere, begins
    and ends a line width inside instead, over its inner walls.
    """
    seams: dict[int, Floats] = {}
    out = list(beads)
    for kind in RINGS:
        known = np.array(list(seams.values())).reshape(-1, 2)
        for k, bead in enumerate(beads):
            if bead.kind is kind and not bead.line:
                loop = np.ascontiguousarray(bead.points)
                if kind is Kind.INNER_WALL:
                    distance, *nearest = _nearest(loop, known, np.inf)
                    x, y = nearest if distance < np.inf else loop[0].tolist()
                    at, share, free = _best(loop, (x, y, *NO_CORNER), NO_LIMITS)
                else:
                    at, share, free = _best(loop, _target(loop, process, around), around.limits)
                loop, lead_mm = _begin_at(loop, at, share), 0.0 if free else bead.width_mm
                loop = loop if free else _begin_with_room(loop, lead_mm)
                if kind is Kind.OUTER_WALL:
                    seams[k] = loop[0]
                out[k] = replace(bead, points=_open(loop, process.seam_gap * bead.width_mm, lead_mm))
    return out, np.array(list(seams.values())).reshape(-1, 2)


def _target(loop: Floats, process: Process, around: Surroundings) -> Target:
    """The target of an outer wall's seam."""
    rear = float(around.rear[0]), float(around.rear[1])
    if process.seam == "rear":
        return (*rear, *NO_CORNER)
    if process.seam == "nearest":
        return (float(around.tip[0]), float(around.tip[1]), *NO_CORNER)
    if process.seam == "random":
        return (*_point_at(loop, (GOLDEN * (around.layer + 1)) % 1.0), *NO_CORNER)
    distance, x, y = _nearest(loop, around.before, REACH_MM)
    planned, px, py = _nearest(loop, around.planned, REACH_MM)
    if planned < np.inf:
        beside = (px, py, *PLANNED)
        if distance == np.inf or np.hypot(px - x, py - y) >= FOLLOW_MM or _in_corner(loop, beside):
            return beside
        return (x + FOLLOW * (px - x), y + FOLLOW * (py - y), *PLANNED)
    if distance == np.inf:
        return (*rear, *ANYWHERE)
    return (x, y, *(ANYWHERE if process.seam == "corner" else NEARBY))


@kernel
def _point_at(loop: Floats, share: float) -> tuple[float, float]:
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


@kernel
def _nearest(loop: Floats, points: Floats, reach_mm: float) -> tuple[float, float, float]:
    """The point nearest to a loop as (distance, x, y); the distance is infinite if none is within reach."""
    low_x, high_x, low_y, high_y = loop[0, 0], loop[0, 0], loop[0, 1], loop[0, 1]
    for i in range(len(loop)):
        low_x, high_x = min(low_x, loop[i, 0]), max(high_x, loop[i, 0])
        low_y, high_y = min(low_y, loop[i, 1]), max(high_y, loop[i, 1])
    best, bx, by = np.inf, 0.0, 0.0
    for p in range(len(points)):
        x, y = points[p, 0], points[p, 1]
        out = np.hypot(max(low_x - x, 0.0, x - high_x), max(low_y - y, 0.0, y - high_y))
        if out < min(best, reach_mm):
            distance = _project(loop, x, y)[0]
            if distance < min(best, reach_mm):
                best, bx, by = distance, x, y
    return best, bx, by


@helper
def _project(loop: Floats, x: float, y: float) -> tuple[float, int, float]:
    """Distance from a point to a loop, the nearest side, and the position along it (0..1)."""
    least, at, share = np.inf, 0, 0.0
    for i in range(len(loop)):
        side = _side(loop, i)
        t = nearest_share(side, x, y)
        distance = np.hypot(side.x0 + t * (side.x1 - side.x0) - x, side.y0 + t * (side.y1 - side.y0) - y)
        if distance < least:
            least, at, share = distance, i, t
    return least, at, share


@helper
def _side(loop: Floats, i: int) -> Segment:
    """The side from a vertex of a loop to the next one."""
    after = (i + 1) % len(loop)
    return Segment(loop[i, 0], loop[i, 1], loop[after, 0], loop[after, 1])


def _begin_at(loop: Floats, at: int, share: float) -> Floats:
    """The loop (n, 2) started at a share of one of its sides."""
    begun: Floats = (loop[at] + share * (loop[(at + 1) % len(loop)] - loop[at]))[None]
    return np.concatenate([begun, loop[at + 1 :], loop[: at + 1]]) if share > 0.0 else start_at(loop, at)


@kernel
def _best(loop: Floats, target: Target, interfaces: SeamLimits) -> tuple[int, float, bool]:
    """The point of least cost as (side, share of it), and whether it is clear of interface edges."""
    n, (x, y, inner_mm, outer_mm) = len(loop), target
    distance, at, share = _project(loop, x, y)
    if share >= 1.0 - 1e-6:
        at, share = (at + 1) % n, 0.0
    elif share <= 1e-6:
        share = 0.0
    side = _side(loop, at)
    free = is_clear(interfaces, side.x0 + share * (side.x1 - side.x0), side.y0 + share * (side.y1 - side.y0))
    least = distance + (0.0 if free else FORBIDDEN)
    if inner_mm == 0.0 and outer_mm == 0.0 and free:
        return at, share, free
    for i in range(n):
        side = _side(loop, i)
        dx, dy = side.x1 - side.x0, side.y1 - side.y0
        count = 1 if free and len(interfaces.edges) == 0 else int(np.hypot(dx, dy) / SAMPLE_MM) + 1
        for s in range(count):
            cx, cy = side.x0 + s / count * dx, side.y0 + s / count * dy
            cost = np.hypot(cx - x, cy - y) + 1e-6 * cx
            if s == 0 and inner_mm > 0.0:
                strength = corner_strength(loop, i)
                cost -= strength * inner_mm if strength > 0.0 else -strength * outer_mm
            if cost < least:
                clear = is_clear(interfaces, cx, cy)
                if clear or not free:
                    cost += 0.0 if clear else FORBIDDEN
                    if cost < least:
                        least, at, share, free = cost, i, s / count, clear
    return at, share, free


@kernel
def _in_corner(loop: Floats, target: Target) -> bool:
    """Whether the point of least cost is a corner sharp enough to be kept."""
    at, share, _ = _best(loop, target, NO_LIMITS)
    return share == 0.0 and abs(corner_strength(loop, at)) > KEPT


def _begin_with_room(loop: Floats, lead_mm: float) -> Floats:
    """The loop started at the nearest point with room for a lead off its outer wall, or else at the point with most room: in a
    sharp corner, the inward direction runs along the wall.
    """
    counts = (np.hypot(*(start_at(loop, 1) - loop).T) / SAMPLE_MM).astype(np.int64) + 1
    places = [_begin_at(loop, i, s / count) for i, count in enumerate(counts.tolist()) for s in range(count)]
    deepest, most = loop, -1.0
    for begun in sorted(places, key=lambda begun: float(np.hypot(*(begun[0] - loop[0])))):
        depth, _, _ = _nearest(begun, (begun[0] + lead_in(begun, lead_mm))[None], np.inf)
        if depth > most:
            deepest, most = begun, depth
        if depth >= OFF_WALL * lead_mm:
            break
    return deepest


def lead_in(loop: Floats, lead_mm: float) -> Floats:
    """(2,) vector from the loop's start to the start of a lead inside, as far as there is room."""
    steps = np.array([loop[0] - loop[-1], loop[1] - loop[0]])
    steps /= np.maximum(np.hypot(*steps.T), 1e-12)[:, None]
    along = steps.sum(axis=0)
    length = float(np.hypot(*along))
    along = along / length if length > 1e-6 else steps[1]
    way = np.array([-along[1], along[0]])  # to the left, where the solid is
    lead: Floats = way * min(lead_mm, 0.5 * _room_mm(loop, way))
    return lead


def _room_mm(loop: Floats, way: Floats) -> float:
    """Extent of the inside of a loop (n, 2) from its start along a unit vector, mm; 0 if that points outside."""
    sides, beside = start_at(loop, 1) - loop, (loop - loop[0]) @ np.array([-way[1], way[0]])
    following = start_at(beside, 1)
    crossed = np.flatnonzero((beside > 0.0) != (following > 0.0))
    share = beside[crossed] / (beside[crossed] - following[crossed])
    along = (loop[crossed] + share[:, None] * sides[crossed] - loop[0]) @ way
    along = along[along > 1e-6]
    return float(along.min()) if len(along) % 2 else 0.0


def _open(loop: Floats, gap_mm: float, lead_mm: float) -> Floats:
    """The loop as a polyline that ends a gap before its start. lead_mm: both ends are moved inside by this, as far as there is
    room.
    """
    points = np.concatenate([loop, loop[:1]])
    steps = np.hypot(*np.diff(points, axis=0).T)
    if gap_mm > 0.0 and steps.sum() > 4.0 * gap_mm:
        beyond = np.cumsum(steps[::-1])[::-1]  # from each point to the end
        last = int(np.flatnonzero(beyond > gap_mm)[-1])
        share = (beyond[last] - gap_mm) / steps[last]
        points = np.concatenate([points[: last + 1], (points[last] + share * (points[last + 1] - points[last]))[None]])
    if lead_mm > 0.0:
        inward = lead_in(loop, lead_mm)
        points = np.concatenate([(points[0] + inward)[None], points, (points[-1] + 0.5 * inward)[None]])
    return points
