r"""Tree support: support as branches; contacts that begin near each other grow down as one branch.

A branch is stored as the area of its centres; discs around all of them are printed. First, from the ground up, the possible
centres are computed (`reachable`): beside the part, and within the lean of a reachable centre in the layer below, or on ground.
Then, from the top down, each layer's branches are derived from those above, always within the reachable area, so none ends in the
air.

    _____________________________________
    | hangs               |             |   add_contact: the overhang is cut along squares of CELL_MM, each begins a branch
    `------+------+-------+-----.  part |
     \    / \    / \    /       |       |   lower: a wide branch shrinks to its middle, in every layer by the lean,
      \  /   \  /   \  /        |       |
       \ \   / /     ||         |       |   then it is a trunk, round: nearest ones go to meet each other, half way each,
        \ \_/ /      ||    .----'       |   where the height that is left is enough,
         \   /        \\   |            |   it gets thicker afterwards (sturdy.thicken);
          | |         ||   |            |   what comes in its way a branch passes as it is or thinner, moves aside from
         /   \        ||   |            |   within the lean, or ends on where the part may be stood on (`placeable`)
    ____/_____\______/__\__|____________|____

Invariant of every step: each centre of a branch has a centre below it within the lean, or stands on ground. Afterwards
support.stand keeps the support that stands and is wide enough for a bead, and find_missed lists the overhangs that are not held.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import product
from math import cos, floor, hypot, pi

import numpy as np

from mdp.mesh import Floats
from profiles.process import Process
from slicer.geometry.edge_index import EdgeIndex, depths, index_edges
from slicer.geometry.polygons import Polygons, closing, contours, islands, offset, union
from slicer.heights import SAME_MM
from slicer.support.reachable import FINE_MM, LEAST_MM2, SLIVER_MM, SMOOTH_MM, ReachableAreas, dilate, drop_slivers

CELL_MM = 10.0  # wider contacts get a branch for every square of this size: its centre is down after half of that
JOIN_MM = 0.8  # columns with a smaller gap than twice this are merged: sturdier, and no more plastic than two outlines
CORNERS = 12  # corners of a trunk's outline
MEETING = 0.8  # trunks lean towards each other only if they meet within this share of the remaining height
THIN_MM = 0.1  # radius of the centres of a branch between obstacles: hardly more than one point
TIDY_EVERY = 4  # layers between two removals of slits and slivers from branches at an obstacle
INSET = 0.7  # share of the lean: then right corners move by the lean
STEPS = (0.3, 0.6, 1.0)  # shares of the lean: distances by which support moves aside, kept short, since it widens by as much
WIDEST = 1.3  # factor on the distance: limit for corners of widened areas; corners sharper than 100 degrees are cut off


@dataclass(frozen=True, eq=False)
class Branch:
    """The centres of a branch in one layer, all within `radius` of x, y. full: whether every point within it is one."""

    area: Polygons
    x: float
    y: float
    radius: float
    full: bool = False

    @property
    def reach_mm(self) -> float:
        """Greatest distance of a centre from x, y, mm."""
        return self.radius / cos(pi / CORNERS) if self.full else self.radius

    def shrink(self, radius: float) -> "Branch":
        """The branch with every centre moved towards the middle, by at most the reduction of the radius."""
        share = radius / self.radius
        matrix = np.array([[share, 0.0, (1.0 - share) * self.x], [0.0, share, (1.0 - share) * self.y]])
        return Branch(self.area.transform(matrix), self.x, self.y, radius)


def branch_of(area: Polygons) -> Branch:
    """A branch with all points of an area as centres."""
    points = np.concatenate(contours(area))
    x, y = 0.5 * (points.min(axis=0) + points.max(axis=0))
    return Branch(area, float(x), float(y), float(np.hypot(points[:, 0] - x, points[:, 1] - y).max()))


def trunk(x: float, y: float, radius: float) -> Branch:
    """A round branch."""
    around = Polygons.circle(radius / cos(pi / CORNERS), CORNERS)
    return Branch(around.translate((x, y)), x, y, radius, True)


def add_contact(branches: Sequence[Branch], contact: Polygons, reachable: Polygons) -> list[Branch]:
    """The branches of a layer with the contacts that begin in it; a contact joins its square's branch unless that is a trunk."""
    grown = list(branches)
    young = {_cell(branch.x, branch.y): k for k, branch in enumerate(branches) if not branch.full}
    for cell, piece in _pieces(contact):
        k = young.get(cell, len(grown))
        area = grown[k].area + piece if k < len(grown) else piece
        area = closing(area, JOIN_MM).simplify(SMOOTH_MM) ^ reachable
        if area.area() > LEAST_MM2:
            grown[k : k + 1] = [branch_of(area)]
    return grown


def _cell(x: float, y: float) -> tuple[int, int]:
    return floor(x / CELL_MM), floor(y / CELL_MM)


def _pieces(area: Polygons) -> list[tuple[tuple[int, int], Polygons]]:
    """An area cut along a fixed lattice, with the lattice indices."""
    pieces: dict[tuple[int, int], list[Polygons]] = {}
    square = Polygons.square((CELL_MM, CELL_MM))
    for island in islands(area):
        x0, y0, x1, y1 = island.bounds()
        (i0, j0), (i1, j1) = _cell(x0, y0), _cell(x1, y1)
        for i, j in product(range(i0, i1 + 1), range(j0, j1 + 1)):
            piece = island if (i0, j0) == (i1, j1) else island ^ square.translate((i * CELL_MM, j * CELL_MM))
            if piece.area() > LEAST_MM2:
                pieces.setdefault((i, j), []).append(piece)
    return [(cell, Polygons.compose(several)) for cell, several in sorted(pieces.items())]


def trunk_radius_mm(process: Process, radius_mm: float) -> float:
    """Radius of a trunk's centres, mm. radius_mm: extent of beads around a centre."""
    return max(0.5 * process.support_branch_mm - radius_mm, 0.1 * radius_mm)


def lower_branches(branches: Sequence[Branch], areas: ReachableAreas, layer: int) -> list[Branch]:
    """The branches of a layer lowered to the layer below: each centre is within the lean of a centre there, or on ground."""
    lean, reachable = float(areas.lean_mm[layer]), areas.reachable[layer - 1]
    targets = _target_branches(branches, areas, layer)
    borders = index_edges(reachable)
    free = _depths(targets, borders) >= np.array([branch.reach_mm for branch in targets])
    doubtful = [branch.area for branch, is_free in zip(targets, free, strict=True) if not is_free]
    bad = union(doubtful) - reachable
    if bad.area() < LEAST_MM2:
        return _drop_enclosed(targets)
    low, left = list[Branch](), list[Branch]()
    for old, new, is_free, depth in zip(branches, targets, free, _depths(branches, borders), strict=True):
        if is_free or (new.area ^ bad).area() < LEAST_MM2:
            low.append(new)
            continue
        narrow = _narrow(old, reachable, borders, float(depth), lean)
        if narrow is not None:
            low.append(narrow)
        elif not old.full or 2.0 * (old.area - areas.placeable[layer]).area() >= old.area.area():
            left.append(old)  # less than half of it has reached ground
    return _drop_enclosed(low + _move_aside(left, areas, layer))


def _depths(branches: Sequence[Branch], borders: EdgeIndex) -> Floats:
    """Depth of the middles of branches inside an area with the given edges, mm."""
    depths_mm: Floats = depths(np.array([[branch.x, branch.y] for branch in branches]).reshape(-1, 2), borders)
    return depths_mm


def _target_branches(branches: Sequence[Branch], areas: ReachableAreas, layer: int) -> list[Branch]:
    """Unobstructed positions of the branches in the layer below: wide ones shrink, trunks go to meet the nearest trunk."""
    z_mm, lean = float(areas.heights.tip_mm[layer - 1]), float(areas.lean_mm[layer])
    rise, thick = float(areas.heights.tip_mm[layer]) - z_mm, trunk_radius_mm(areas.process, areas.radius_mm)
    trunks = [k for k, branch in enumerate(branches) if branch.radius <= thick + SAME_MM]
    goals = _goals(np.array([[branches[k].x, branches[k].y] for k in trunks]), z_mm * lean / rise)
    goal_of = dict(zip(trunks, goals, strict=True))
    targets = []
    for k, branch in enumerate(branches):
        if branch.radius - lean > thick:
            targets.append(branch.shrink(branch.radius - lean))
            continue
        x, y = goal_of.get(k, (branch.x, branch.y))
        away = hypot(x - branch.x, y - branch.y)
        share = 1.0 if away <= lean else lean / away
        x, y = branch.x + share * (x - branch.x), branch.y + share * (y - branch.y)
        targets.append(trunk(x, y, thick))
    return targets


def _goals(at: Floats, reach_mm: float) -> list[tuple[float, float]]:
    """For each trunk the point half way to the nearest other one, or its own position. reach_mm: its greatest lean down to the
    ground.
    """
    if len(at):
        apart = np.hypot(at[:, None, 0] - at[None, :, 0], at[:, None, 1] - at[None, :, 1])
        np.fill_diagonal(apart, np.inf)
        nearest = apart.argmin(axis=1)
        meet = apart[np.arange(len(at)), nearest] <= 2.0 * MEETING * reach_mm
        at = np.where(meet[:, None], 0.5 * (at + at[nearest]), at)
    return [(float(x), float(y)) for x, y in at]


def _narrow(branch: Branch, reachable: Polygons, borders: EdgeIndex, depth_mm: float, lean: float) -> Branch | None:
    """The branch in place, unchanged or thinner by the lean, if that is free; None if neither is.

    borders: edges of the reachable area; depth_mm: depth of the branch's middle inside it.
    """
    if branch.full and depth_mm >= branch.reach_mm:
        return branch
    if branch.radius <= THIN_MM:
        return None
    if branch.full or branch.radius - lean <= THIN_MM:
        thin = trunk(branch.x, branch.y, max(branch.radius - lean, THIN_MM))
        return thin if depth_mm >= thin.reach_mm else None
    thin = branch.shrink(branch.radius - lean)
    if depth_mm >= thin.radius:
        return thin
    if depths(contours(thin.area)[0][:1], borders)[0] < 0.0:
        return None
    return thin if (thin.area - reachable).area() < LEAST_MM2 else None


def _move_aside(branches: Sequence[Branch], areas: ReachableAreas, layer: int) -> list[Branch]:
    """Move branches around an obstacle: centres with a point below stay; the others move aside or end on the ground."""
    reachable, lean = areas.reachable[layer - 1], float(areas.lean_mm[layer])
    area = union([branch.area for branch in branches])
    tidy = layer % TIDY_EVERY == 0
    area = closing(area, SMOOTH_MM) if tidy else area
    carrying = carrying_area(area, reachable, areas.placeable[layer], lean)
    carrying = _draw_in(carrying, lean) if tidy and (area - reachable).is_empty() else carrying
    below: list[Polygons] = []
    if tidy:
        thick = drop_slivers(carrying)
        below = islands(thick.simplify(FINE_MM) + _widened(carrying - thick, reachable))
    for island in () if tidy else islands(carrying):  # a thin limb of a branch can wait
        x0, y0, x1, y1 = island.bounds()
        is_sliver = island.area() < 2.0 * SLIVER_MM * hypot(x1 - x0, y1 - y0)
        below += islands(_widened(island, reachable)) if is_sliver else [island.simplify(FINE_MM)]
    return [branch_of(island) for island in below if island.area() >= LEAST_MM2]


def _widened(slivers: Polygons, reachable: Polygons) -> Polygons:
    """Slivers widened enough to be followed down."""
    return (widen(slivers, THIN_MM) ^ reachable).simplify(FINE_MM)


def _draw_in(area: Polygons, lean: float) -> Polygons:
    """The area with its edges moved inward; parts too narrow for that stay."""
    drawn_in = []
    for island in islands(area):
        core = offset(island, -INSET * lean)
        bits = islands(island - dilate(core, lean))
        drawn_in += [island] if core.is_empty() else [core, *(bit for bit in bits if bit.area() >= lean**2)]
    return union(drawn_in)


def _drop_enclosed(branches: list[Branch]) -> list[Branch]:
    """The branches without those that lie wholly inside a trunk."""
    if len(branches) < 2:
        return branches
    x, y, radius, full = np.array([[b.x, b.y, b.radius, b.full] for b in branches]).T
    deep = radius[None, :] - radius[:, None] - np.hypot(x[:, None] - x[None, :], y[:, None] - y[None, :])
    rank = np.arange(len(branches))
    inside = (deep >= -1e-9) & (full[None, :] > 0) & ((radius[None, :] > radius[:, None]) | (rank[None, :] < rank[:, None]))
    return [branches[k] for k in np.flatnonzero(~inside.any(axis=1))]


def carrying_area(places: Polygons, reachable: Polygons, placeable: Polygons, lean_mm: float) -> Polygons:
    """Reachable points of a layer that carry the points of the layer above: straight below if possible, otherwise aside.
    Placeable points need none.
    """
    straight, rest = places ^ reachable, places - reachable
    if rest.area() >= LEAST_MM2:
        rest = rest - placeable
    if rest.area() >= LEAST_MM2:
        rest = rest - dilate(offset(straight, -SLIVER_MM), lean_mm)
    if rest.area() < LEAST_MM2:
        return straight
    for share in STEPS:
        aside = widen(rest, share * lean_mm) ^ reachable
        if share == STEPS[-1] or (rest - dilate(aside, lean_mm)).area() < LEAST_MM2:
            break
    return straight + aside


def widen(area: Polygons, distance_mm: float) -> Polygons:
    """The area grown by at least a distance, with hardly any new corners.

    An area that grows layer after layer must not get round corners, since each of them would become two in the next layer.
    """
    return offset(area, distance_mm, WIDEST)
