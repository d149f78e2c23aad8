"""Standing: what stands beside a limb while it is printed, and how high the tip must be for the head to pass clear of it.

The head is taken as everything above its underside: the silhouette turned about the nozzle, and boxes, which count as far as the
nozzle. A point that stands at a height t, r aside from the tip, asks for a tip at t - h(r), where h is the height of the underside
at that radius. h does not fall with r, so in every layer the outline asks for more than any place inside it: only the surfaces of
the limb and of what stands are compared, as triangles so small that it does not matter where on one a place lies.
"""

from dataclasses import dataclass
from math import hypot

import numpy as np

from mdp.head import Head, head_of, lowest_of_hot_end
from mdp.kernels.arrays import flags, floats, table
from mdp.kernels.kernel import borrower, kernel
from mdp.mesh import Floats, Indices
from mdp.overhang import Mask
from mdp.pose import Pose, rotation
from profiles.machine import Machine

CELLS_MM = (2.0, 0.6, 0.2)  # sides of the cells in which pieces of both surfaces are compared; finer where coarse leave doubt
MOST_TRIANGLES, MOST_PAIRS = 100_000, 2_000_000  # of one surface, and of cells of both, that are compared
EVEN_MM = 1e-4  # what lies no higher above the base plane is the face on which the limb stands
NOTHING = -1e9
MOST_TRIED = 1000  # corners of either surface that are compared first


@dataclass(frozen=True, eq=False)
class Standing:
    """points_mm (k, 3): places of the part's frame and heights up to which something stands there, the highest first; slack_mm:
    how far it may reach beyond each; clearance_mm: what the head keeps from it."""

    points_mm: Floats
    slack_mm: float
    head: Head
    clearance_mm: float

    @classmethod
    def of(cls, points_mm: Floats, slack_mm: float, machine: Machine) -> "Standing":
        """What stands at (k, 3) points of the part's frame at the pose in which it is printed."""
        highest_first = np.argsort(-points_mm[:, 2], kind="stable")
        return cls(np.ascontiguousarray(points_mm[highest_first]), slack_mm, head_of(machine), machine.clearance_mm)

    def least_tip_mm(self, places_mm: Floats, known_mm: float = NOTHING) -> Floats:
        """(n,) least heights of the tip over (n, 2) places; NOTHING where nothing asks for one. known_mm: a height that the tip
        has in any case: where no more than that is asked for, less or nothing may be told."""
        count = int(np.searchsorted(-self.points_mm[:, 2], self.slack_mm - known_mm))
        places, points = np.ascontiguousarray(places_mm), self.points_mm[:count]
        return _least_tip(places, points, self.slack_mm, self.head, self.clearance_mm)


def highest_in_cells(points_mm: Floats, cell_mm: float) -> Floats:
    """(c, 3) the middles of the cells of a lattice over X and Y in which any of (n, 3) points lie, and their greatest heights."""
    cells, inverse = np.unique(np.floor(points_mm[:, :2] / cell_mm).astype(np.int64), axis=0, return_inverse=True)
    highest = np.full(len(cells), -np.inf)
    np.maximum.at(highest, inverse.ravel(), points_mm[:, 2])
    return np.column_stack([(cells + 0.5) * cell_mm, highest])


@borrower
def _asked(across: float, along: float, top: float, beyond: float, head: Head, clearance: float) -> float:
    """The height of the tip that what stands up to `top`, so far aside, asks for; beyond: how much nearer it may be."""
    asked, square, widest = NOTHING, across * across + along * along, head.silhouette[len(head.silhouette) - 1, 0] + beyond
    if square <= widest * widest:
        under = lowest_of_hot_end(max(np.sqrt(square) - beyond, 0.0), head.silhouette)
        asked = top - max(under - clearance, 0.0)
    for k in range(len(head.boxes)):
        inside = min(head.boxes[k, 0], 0.0) - beyond <= across and across <= max(head.boxes[k, 3], 0.0) + beyond
        if inside and min(head.boxes[k, 1], 0.0) - beyond <= along and along <= max(head.boxes[k, 4], 0.0) + beyond:
            asked = max(asked, top - max(head.boxes[k, 2] - clearance, 0.0))
    return float(asked)


@kernel
def _least_tip(places: Floats, points: Floats, slack: float, head: Head, clearance: float) -> Floats:
    least = floats(len(places), NOTHING)
    for i in range(len(places)):
        for j in range(len(points)):
            top = points[j, 2] + slack
            if top <= least[i]:
                break
            asked = _asked(points[j, 0] - places[i, 0], points[j, 1] - places[i, 1], top, slack + clearance, head, clearance)
            least[i] = max(least[i], asked)
    return least


def passes_clear(machine: Machine, pose: Pose, limb: Floats, standing: Floats, base_mm: float) -> bool:
    """Whether the head passes clear of what stands while a limb is printed.

    limb, standing: (m, 3, 3) corners of the faces of both surfaces in the workpiece frame; base_mm: the base plane's offset. What
    of them lies below the base plane is left out. Surfaces that would take long to compare are not taken to be clear.
    """
    turn, head = rotation(machine, pose), head_of(machine)
    down, even = np.array([0.0, 0.0, base_mm]), np.array([0.0, 0.0, EVEN_MM])
    tips, stands = np.ascontiguousarray(limb @ turn.T - down), np.ascontiguousarray(standing @ turn.T - down - even)
    if _surely_meets(_few(tips), _few(stands), head, machine.clearance_mm):
        return False
    for cell_mm in CELLS_MM:
        if max(count_divided(corners, cell_mm) for corners in (tips, stands)) > MOST_TRIANGLES:
            return False
        tips, stands = (_above(subdivide(corners, cell_mm)) for corners in (tips, stands))
        if len(tips) == 0 or len(stands) == 0:
            return True
        (low, of_tip), (high, of_stand) = _in_cells(tips, cell_mm, 1.0), _in_cells(stands, cell_mm, -1.0)
        if len(low) * len(high) > MOST_PAIRS:
            return False
        slack_mm = hypot(cell_mm, cell_mm) + 2.0 * cell_mm  # of the middles of two cells, and of two triangles
        close_tips, close_stands = _find_close(low, high, slack_mm, head, machine.clearance_mm)
        tips, stands = tips[close_tips[of_tip]], stands[close_stands[of_stand]]
    return len(tips) == 0


def _above(corners: Floats) -> Floats:
    """The triangles that reach above the base plane."""
    above: Floats = corners[corners[:, :, 2].max(axis=1, initial=0.0) > 0.0]
    return above


def _few(corners: Floats) -> Floats:
    """(k, 3) up to MOST_TRIED corners above the base plane."""
    points = corners.reshape(-1, 3)
    points = points[points[:, 2] >= 0.0]
    return np.ascontiguousarray(points[:: len(points) // MOST_TRIED + 1])


@kernel
def _surely_meets(tips: Floats, points: Floats, head: Head, clearance: float) -> bool:
    """Whether the head meets one of some points at one of some places of the tip."""
    for i in range(len(tips)):
        for j in range(len(points)):
            if points[j, 2] > tips[i, 2]:
                across, along = points[j, 0] - tips[i, 0], points[j, 1] - tips[i, 1]
                if _asked(across, along, points[j, 2], clearance, head, clearance) > tips[i, 2]:
                    return True
    return False


def _in_cells(corners: Floats, cell_mm: float, sign: float) -> tuple[Floats, Indices]:
    """(c, 3) the middles of the cells in which (m, 3, 3) triangles begin and their least height in each, sign -1: the greatest, and
    (m,) the cell of each triangle."""
    cells = np.floor(corners[:, 0, :2] / cell_mm).astype(np.int64)
    _, first, inverse = np.unique(cells[:, 0] * 1_000_003 + cells[:, 1], return_index=True, return_inverse=True)
    heights = np.full(len(first), np.inf)
    np.minimum.at(heights, inverse, (sign * np.maximum(corners[:, :, 2], 0.0)).min(axis=1))
    return np.column_stack([(cells[first] + 0.5) * cell_mm, sign * heights]), inverse


@kernel
def _find_close(tips: Floats, points: Floats, slack: float, head: Head, clearance: float) -> tuple[Mask, Mask]:
    """The cells of tips in which the head may meet a cell of points, and those cells."""
    close_tips, close_points = flags(len(tips)), flags(len(points))
    for i in range(len(tips)):
        for j in range(len(points)):
            if points[j, 2] > tips[i, 2]:
                across, along = points[j, 0] - tips[i, 0], points[j, 1] - tips[i, 1]
                if _asked(across, along, points[j, 2], slack + clearance, head, clearance) > tips[i, 2]:
                    close_tips[i], close_points[j] = True, True
    return close_tips, close_points


@kernel
def count_divided(corners: Floats, longest: float) -> int:
    """How many triangles `subdivide` makes."""
    count = 0
    for f in range(len(corners)):
        count += _divisions(corners[f], longest) ** 2
    return count


@kernel
def subdivide(corners: Floats, longest: float) -> Floats:
    """(k, 3, 3) the triangles that (m, 3, 3) triangles are divided into, each like it, so that no edge is longer than that."""
    count = 0
    for f in range(len(corners)):
        count += _divisions(corners[f], longest) ** 2
    parts, at = table(9 * count, 1), 0
    for f in range(len(corners)):
        n = _divisions(corners[f], longest)
        for i in range(n):
            for j in range(n - i):
                at = _put(parts, at, corners[f], (i, j, i + 1, j, i, j + 1, n))
                if i + j < n - 1:
                    at = _put(parts, at, corners[f], (i + 1, j, i + 1, j + 1, i, j + 1, n))
    return parts.reshape(count, 3, 3)


@borrower
def _put(parts: Floats, at: int, corners: Floats, places: tuple[int, int, int, int, int, int, int]) -> int:
    """Put a triangle at a place of a list of numbers: its corners lie so many nth parts along two edges; the next place."""
    for corner in range(3):
        i, j, n = places[2 * corner], places[2 * corner + 1], places[6]
        for axis in range(3):
            p, q, r = corners[0, axis], corners[1, axis], corners[2, axis]
            parts[at, 0] = p + (i * (q - p) + j * (r - p)) / n
            at += 1
    return at


@borrower
def _divisions(corners: Floats, most: float) -> int:
    """Into how many pieces the edges of a triangle are divided."""
    longest = 0.0
    for k in range(3):
        square = 0.0
        for axis in range(3):
            square += (corners[k, axis] - corners[k - 1, axis]) ** 2
        longest = max(longest, square)
    return max(1, int(np.ceil(np.sqrt(longest) / most)))
