"""Clearance: how high the tip must be for the head to pass clear of the table at a pose, and of the parts that stand beside a
limb.

A body point at b from the tip is n . b + z above the table, n the table's normal in the machine frame and z the tip's height
above the table; with the table unbounded, z >= max over the bodies of -n . b keeps all of them clear. For one body reaching y
across the tilt axis on the rising side at height h this is z >= y sin t - h cos t. Clips, and a part of the cradle that rises
above the table, are not under that plane: they are tested against the head at every position of the tip.

A part cut off by a whole plane has nothing printed above its base plane. A limb has: other pieces stand beside it. The head is
modelled as everything above its underside: the silhouette turned about the nozzle, and boxes that are extended to the nozzle. A
printed point at height t and distance r from the nozzle axis requires the tip to be at t - h(r) or higher, where h(r) is the
height of the underside. h never decreases with r, so the outline of a layer is its worst case and comparing the two surfaces
suffices. Both are divided into triangles small enough for the slack to cover every point of them.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from math import hypot

import numpy as np

from mdp.head import Head, bodies, corners, directions, head_of, lowest_of_hot_end
from mdp.kernels.arrays import flags, floats, table
from mdp.kernels.kernel import kernel, no_nrt
from mdp.mesh import Floats, Indices
from mdp.overhang import Mask
from mdp.pose import UP, Pose, poses, rotation, shift
from profiles.frozen import Vector
from profiles.machine import Machine

CELLS_MM = (2.0, 0.6, 0.2)  # cell sizes, coarse to fine: only pairs that may collide are compared again with finer cells
MOST_TRIANGLES, MOST_PAIRS = 250_000, 20_000_000  # triangles per surface, pairs of cells; larger problems are rejected
EVEN_MM = 1e-4  # up to this height above the base plane is the cut face itself
NOTHING = -1e9
Share = tuple[int, int]
MOST_TRIED = 1000  # corners sampled per surface for the quick first test


# The body of the head that determines the least height of the tip above the table: that height with clearance, the body's name,
# and its point nearest to the table, mm from the tip in the machine frame.
LowestBody = tuple[float, str, Vector]


def least_tip_height_mm(machine: Machine, pose: Pose) -> float:
    """Least height of the tip above the table's plane at a pose; 0 at a level table."""
    return lowest_body(machine, pose)[0]


def lowest_body(machine: Machine, pose: Pose) -> LowestBody:
    """The body of the head that determines the least height of the tip above the table's plane at a pose."""
    p, q, r = (rotation(machine, pose) @ UP).tolist()
    across = hypot(p, q)
    if across < 1e-9:
        return 0.0, "nozzle tip", (0.0, 0.0, 0.0)
    needed: list[LowestBody] = []
    for radius, height in machine.head.silhouette_mm:
        needed.append((radius * across - height * r, "hot end", (-radius * p / across, -radius * q / across, height)))
    for box in machine.head.boxes:
        x, y, z = (most if n < 0.0 else least for n, least, most in zip((p, q, r), box.min_mm, box.max_mm, strict=True))
        needed.append((-(x * p + y * q + z * r), box.name, (x, y, z)))
    needed_mm, name, point_mm = max(needed)
    return max(0.0, needed_mm + machine.clearance_mm), name, point_mm


def least_height_mm(machine: Machine, direction: Floats) -> float:
    """Least height at which material can be printed along a direction, over the poses that reach it; infinite if no pose does."""
    return min((least_tip_height_mm(machine, pose) for pose in poses(machine, direction)), default=np.inf)


def allowed_poses(machine: Machine, direction: Floats, points_mm: Floats, near_turn_deg: float | None = None) -> list[Pose]:
    """Poses at which a part with these (n, 3) workpiece points can be printed: clear of the table and within the limits of X, Y
    and Z.
    """
    return [pose for pose in poses(machine, direction, near_turn_deg) if find_obstacle(machine, pose, points_mm) is None]


def find_obstacle(machine: Machine, pose: Pose, points_mm: Floats) -> str | None:
    """Why a part with these (n, 3) workpiece points cannot be printed at a pose; None if it can."""
    reached = points_mm @ rotation(machine, pose).T + shift(machine, pose)
    low, high = reached.min(axis=0), reached.max(axis=0)
    for axis, letter in enumerate("XYZ"):
        least, most = (machine.x, machine.y, machine.z)[axis].limits_mm
        if low[axis] < least or high[axis] > most:
            return f"{letter} would go from {low[axis]:.1f} to {high[axis]:.1f} mm, {least:g} to {most:g} is allowed"
    lowest, (needed, body, _) = float(points_mm[:, 2].min()), lowest_body(machine, pose)
    if lowest < needed:
        return f"the head's {body} would meet the table: the part begins {lowest:.1f} mm above it, {needed:.1f} mm are needed"
    return _find_box(machine, pose, reached)


def _find_box(machine: Machine, pose: Pose, tips_mm: Floats) -> str | None:
    """Which body of the head could meet which clip or box of the cradle with the tip anywhere in the hull of (n, 3) machine
    points; None if a separating direction exists for each pair. Only boxes that rise above the table are tested.
    """
    unturned = Pose(pose.tilt_deg, machine.turn.zero_deg)  # the cradle does not turn with the table
    higher = [("cradle", unturned, box) for box in machine.cradle if box.max_mm[2] > 0.0]
    higher += [("plate", pose, box) for box in machine.table.clips]
    if not higher:
        return None
    tried = directions(rotation(machine, pose) @ UP)
    least = (tried @ tips_mm.T).min(axis=1)
    for owner, at, box in higher:
        reached = corners(box.min_mm, box.max_mm) @ rotation(machine, at).T + shift(machine, at)
        reach = (tried @ reached.T).max(axis=1)
        for body in bodies(machine):
            if float((least + body.least(tried) - reach).max()) < body.need_mm:
                return f"the head's {body.name} would meet the {owner}'s {box.name}"
    return None


@dataclass(frozen=True, eq=False)
class StandingColumns:
    """The parts that stand beside a limb, and the head that must pass them. points_mm (k, 3): x, y and top of each printed column
    in the part frame, highest first; slack_mm: how far a column may extend beyond its point.
    """

    points_mm: Floats
    slack_mm: float
    head: Head

    @classmethod
    def of(cls, points_mm: Floats, slack_mm: float, machine: Machine) -> "StandingColumns":
        """Columns for (k, 3) points in the part frame."""
        highest_first = np.argsort(-points_mm[:, 2], kind="stable")
        return cls(np.ascontiguousarray(points_mm[highest_first]), slack_mm, head_of(machine))

    def least_tip_mm(self, places_mm: Floats, known_mm: float = NOTHING) -> Floats:
        """(n,) least safe heights of the tip at (n, 2) positions, mm; NOTHING where any height is safe.

        known_mm: a lower bound of the tip's height; results at or below it may be too low.
        """
        count = int(np.searchsorted(-self.points_mm[:, 2], self.slack_mm - known_mm))
        return _least_tip(np.ascontiguousarray(places_mm), self.points_mm[:count], self.slack_mm, self.head)


def highest_in_cells(points_mm: Floats, cell_mm: float) -> Floats:
    """(c, 3) the highest of (n, 3) points in each cell of a lattice over X and Y, moved to the centre of the cell."""
    return _per_cell(points_mm[:, :2], points_mm[:, 2], cell_mm, np.maximum)[0]


def _per_cell(places: Floats, heights: Floats, cell_mm: float, extreme: np.ufunc) -> tuple[Floats, Indices]:
    """(c, 3) centres of the cells that hold any of (n, 2) positions, with the extreme (np.minimum or np.maximum) of their heights
    as z, and (n,) the cell of each position.
    """
    cells = np.floor(places / cell_mm).astype(np.int64)
    _, first, of_place = np.unique(cells[:, 0] * 1_000_003 + cells[:, 1], return_index=True, return_inverse=True)
    reached = heights[first]
    extreme.at(reached, of_place, heights)
    return np.column_stack([(cells[first] + 0.5) * cell_mm, reached]), of_place


@no_nrt
def _height_under_hot_end(square: float, top: float, beyond: float, head: Head) -> float:
    """Least safe height of the tip beside a column that ends at `top`. square: squared distance to the column's point; beyond:
    how much nearer the column may be.
    """
    widest = head.silhouette[len(head.silhouette) - 1, 0] + beyond
    if square > widest * widest:
        return NOTHING
    under = lowest_of_hot_end(max(np.sqrt(square) - beyond, 0.0), head.silhouette)
    return float(top - max(under - head.clearance_mm, 0.0))


@no_nrt
def _is_under(box: Floats, across: float, along: float, beyond: float) -> bool:
    """Whether a point at an offset from the tip lies under a box enlarged by `beyond`."""
    inside = box[0] - beyond <= across and across <= box[3] + beyond
    return bool(inside and box[1] - beyond <= along and along <= box[4] + beyond)


@kernel
def _least_tip(places: Floats, points: Floats, slack: float, head: Head) -> Floats:
    least, beyond = floats(len(places), NOTHING), slack + head.clearance_mm
    for i in range(len(places)):
        for j in range(len(points)):
            top = points[j, 2] + slack
            if top <= least[i]:
                break
            across, along = points[j, 0] - places[i, 0], points[j, 1] - places[i, 1]
            square = across * across + along * along
            least[i] = max(least[i], _height_under_hot_end(square, top, beyond, head))
            for k in range(len(head.boxes)):
                if _is_under(head.boxes[k], across, along, beyond):
                    least[i] = max(least[i], top - max(head.boxes[k, 2] - head.clearance_mm, 0.0))
    return least


def _within_reach(head: Head, around_mm: Floats, points: Floats, slack_mm: float) -> Mask:
    """(j,) whether the head might hit each of (j, 3) standing points while the tip is on the limb's base plane within its
    bounding box (2, 3).
    """
    outside = np.maximum(np.maximum(around_mm[0] - points, points - around_mm[1]), 0.0)
    met = _under_boxes(head, around_mm, points, slack_mm)
    met &= points[:, None, 2] > np.maximum(head.boxes[:, 2] - head.clearance_mm, 0.0)
    squares, tops = (outside[:, :2] ** 2).sum(axis=1), np.ascontiguousarray(points[:, 2])
    reached: Mask = _under_hot_end(squares, tops, slack_mm + head.clearance_mm, head) | met.any(axis=1)
    return reached


def _under_boxes(head: Head, around_mm: Floats, points: Floats, slack_mm: float) -> Mask:
    """(j, b) whether each of (j, 3) points lies under each box of the head for some tip position in the limb's bounding box."""
    boxes, beyond = head.boxes, slack_mm + head.clearance_mm
    low, high = around_mm[0, :2] + boxes[:, :2] - beyond, around_mm[1, :2] + boxes[:, 3:5] + beyond
    under: Mask = np.all((points[:, None, :2] >= low) & (points[:, None, :2] <= high), axis=2)
    return under


def _may_collide(head: Head, around_mm: Floats, tips: Floats, points: Floats, slack_mm: float) -> tuple[Mask, Mask]:
    """(i,) tip positions at which the head may hit any of (j, 3) standing points, and (j,) the points that it hits.

    The tips lie on the limb's surface only. Extending every box to the nozzle makes the outline the worst case inside the limb,
    too; a box is tested only against points that it can reach from somewhere in the limb's bounding box, around_mm (2, 3).
    """
    wide = head.boxes.copy()
    wide[:, :2], wide[:, 3:5] = np.minimum(head.boxes[:, :2], 0.0), np.maximum(head.boxes[:, 3:5], 0.0)
    return _find_collisions(tips, points, slack_mm, head._replace(boxes=wide), _under_boxes(head, around_mm, points, slack_mm))


# (m, 3, 3) corners of the faces of a limb, and of everything that stands, in the workpiece frame
Surfaces = tuple[Floats, Floats]


def passes_clear(machine: Machine, pose: Pose, surfaces: Surfaces, base_mm: float, cells_mm: Sequence[float] = CELLS_MM) -> bool:
    """Whether the head clears everything that stands while a limb is printed. base_mm: offset of the limb's base plane.

    Triangles below the base plane are ignored. Also False if there are too many triangles to compare, or if the finest of
    cells_mm cannot decide, which happens within five cells of a collision.
    """
    tips, stands, around_mm = _above_base(machine, pose, surfaces, base_mm)
    head = head_of(machine)
    if _may_collide(head, around_mm, _sample_points(tips), _sample_points(stands), 0.0)[0].any():
        return False
    for cell_mm in cells_mm:
        if max(count_divided(corners, cell_mm) for corners in (tips, stands)) > MOST_TRIANGLES:
            return False
        tips, stands = (_above(subdivide(corners, cell_mm)) for corners in (tips, stands))
        if len(tips) == 0 or len(stands) == 0:
            return True
        low, of_tip = _per_cell(tips[:, 0, :2], np.maximum(tips[:, :, 2], 0.0).min(axis=1), cell_mm, np.minimum)
        high, of_stand = _per_cell(stands[:, 0, :2], stands[:, :, 2].max(axis=1), cell_mm, np.maximum)
        slack_mm = hypot(cell_mm, cell_mm) + 2.0 * cell_mm  # two half diagonals of cells and two edges of triangles
        near = _within_reach(head, around_mm, high, slack_mm)
        if len(low) * int(near.sum()) > MOST_PAIRS:
            return False
        close_stands = np.zeros(len(high), np.bool_)
        close_tips, close_stands[near] = _may_collide(head, around_mm, low, high[near], slack_mm)
        tips, stands = tips[close_tips[of_tip]], stands[close_stands[of_stand]]
    return len(tips) == 0


def _above_base(machine: Machine, pose: Pose, surfaces: Surfaces, base_mm: float) -> tuple[Floats, Floats, Floats]:
    """Both surfaces above the base plane in the part frame, and the limb's bounding box (2, 3), the range of the tip."""
    turn, down = rotation(machine, pose), np.array([0.0, 0.0, base_mm])
    tips = _above(np.ascontiguousarray(surfaces[0] @ turn.T - down))
    stands = _above(np.ascontiguousarray(surfaces[1] @ turn.T - down - np.array([0.0, 0.0, EVEN_MM])))
    places = tips.reshape(-1, 3) if len(tips) else np.zeros((1, 3))
    return tips, stands, np.stack([places.min(axis=0), places.max(axis=0)])


def collision_points(machine: Machine, pose: Pose, surfaces: Surfaces, base_mm: float) -> Floats:
    """(k, 3) points of standing parts that the head certainly hits while a limb is printed, highest first; compare
    passes_clear.
    """
    tips, stands, around_mm = _above_base(machine, pose, surfaces, base_mm)
    if max(count_divided(corners, CELLS_MM[0]) for corners in (tips, stands)) <= MOST_TRIANGLES:
        tips, stands = (subdivide(corners, CELLS_MM[0]) for corners in (tips, stands))
    points = _sample_points(stands)
    _, met = _may_collide(head_of(machine), around_mm, _sample_points(tips), points, 0.0)
    places: Floats = (np.unique(points[met], axis=0) + np.array([0.0, 0.0, base_mm])) @ rotation(machine, pose)
    return places[np.argsort(-places[:, 2], kind="stable")]


def _above(corners: Floats) -> Floats:
    """The triangles that reach above the base plane."""
    above: Floats = corners[corners[:, :, 2].max(axis=1, initial=0.0) > 0.0]
    return above


def _sample_points(corners: Floats) -> Floats:
    """(k, 3) an even sample of about MOST_TRIED corners above the base plane."""
    points = corners.reshape(-1, 3)
    points = points[points[:, 2] >= 0.0]
    return np.ascontiguousarray(points[:: len(points) // MOST_TRIED + 1])


@kernel
def _find_collisions(tips: Floats, points: Floats, slack: float, head: Head, reached: Mask) -> tuple[Mask, Mask]:
    """Kernel of _may_collide. reached (j, b): the points that each box can reach."""
    close_tips, close_points, beyond = flags(len(tips)), flags(len(points)), slack + head.clearance_mm
    for i in range(len(tips)):
        for j in range(len(points)):
            top = points[j, 2]
            if top <= tips[i, 2]:
                continue
            across, along = points[j, 0] - tips[i, 0], points[j, 1] - tips[i, 1]
            meets = _height_under_hot_end(across * across + along * along, top, beyond, head) > tips[i, 2]
            for k in range(len(head.boxes)):
                if reached[j, k] and top - max(head.boxes[k, 2] - head.clearance_mm, 0.0) > tips[i, 2]:
                    meets = meets or _is_under(head.boxes[k], across, along, beyond)
            if meets:
                close_tips[i], close_points[j] = True, True
    return close_tips, close_points


@kernel
def _under_hot_end(squares: Floats, tops: Floats, beyond: float, head: Head) -> Mask:
    """(n,) whether columns at (n,) squared distances from the nearest tip position reach the hot end with the tip at height 0."""
    met = flags(len(tops))
    for i in range(len(tops)):
        met[i] = _height_under_hot_end(squares[i], tops[i], beyond, head) > 0.0
    return met


@kernel
def count_divided(corners: Floats, longest: float) -> int:
    """The number of triangles that `subdivide` returns."""
    return _count_divided(corners, longest)


@no_nrt
def _count_divided(corners: Floats, longest: float) -> int:
    count = 0
    for f in range(len(corners)):
        count += _divisions(corners[f], longest) ** 2
    return count


@kernel
def subdivide(corners: Floats, longest: float) -> Floats:
    """Divide (m, 3, 3) triangles into (k, 3, 3) similar ones whose edges are no longer than `longest`."""
    count, at = _count_divided(corners, longest), 0
    points = table(3 * count, 3)
    for f in range(len(corners)):
        n = _divisions(corners[f], longest)
        for i in range(n):
            for j in range(n - i):
                at = _put(points, at, corners[f], ((i, j), (i + 1, j), (i, j + 1)), n)
                if i + j < n - 1:
                    at = _put(points, at, corners[f], ((i + 1, j), (i + 1, j + 1), (i, j + 1)), n)
    return points.reshape(count, 3, 3)


@no_nrt
def _put(points: Floats, at: int, corners: Floats, shares: tuple[Share, Share, Share], n: int) -> int:
    """Write a triangle into three rows and return the next row. shares: its corners in nth parts of two edges of `corners`."""
    for i, j in shares:
        for axis in range(3):
            p, q, r = corners[0, axis], corners[1, axis], corners[2, axis]
            points[at, axis] = p + (i * (q - p) + j * (r - p)) / n
        at += 1
    return at


@no_nrt
def _divisions(corners: Floats, most: float) -> int:
    """The number of pieces into which each edge of a triangle is divided."""
    longest = 0.0
    for k in range(3):
        square = 0.0
        for axis in range(3):
            square += (corners[k, axis] - corners[k - 1, axis]) ** 2
        longest = max(longest, square)
    return max(1, int(np.ceil(np.sqrt(longest) / most)))
