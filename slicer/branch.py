"""Branch: a piece of support on its way down; it shrinks to a trunk, and trunks lean towards each other until they are one."""

from collections.abc import Sequence
from dataclasses import dataclass
from math import cos, hypot, pi, radians, tan

import numpy as np

from mdp.mesh import Floats
from profiles.process import Process
from slicer.depth import depths
from slicer.polygons import Polygons, contours, edges, grown, sealed, united
from slicer.room import EVEN_MM, FINE_MM, LEAST_MM2, SLIVER_MM, SMOOTH_MM, Room, carried, leaning, solid

CORNERS = 12  # of a trunk's outline
THICKEST_MM = 2.5  # a trunk's radius: enough for any part that fits a machine
MEETING = 0.8  # trunks lean towards each other only if they meet in this share of the height that is left
FATTER = 3.0  # times the usual growth: how fast a branch that had to be thin recovers
THIN_MM = 0.1  # radius of the places of a branch between obstacles: hardly more than one place
TIDIED = 4  # slits and slivers of branches in the way of something are seen to in every so many layers
DRAWN_IN = 0.7  # of the lean: then right corners move by the lean


@dataclass(frozen=True, eq=False)
class Branch:
    """The places of a branch's middle in one layer, all within `radius` of x, y; top_mm: where the branch ends.

    full: the area has every place within the radius.
    """

    area: Polygons
    x: float
    y: float
    radius: float
    top_mm: float
    full: bool = False

    @property
    def reach_mm(self) -> float:
        """How far from x, y its farthest place is."""
        return self.radius / cos(pi / CORNERS) if self.full else self.radius

    def shrunk(self, radius: float) -> "Branch":
        """Every place moved towards the middle, by no more than the radius becomes less."""
        share = radius / self.radius
        matrix = np.array([[share, 0.0, (1.0 - share) * self.x], [0.0, share, (1.0 - share) * self.y]])
        return Branch(self.area.transform(matrix), self.x, self.y, radius, self.top_mm)


def branch_of(area: Polygons, top_mm: float) -> Branch:
    """A branch through all places of an area."""
    points = np.concatenate(contours(area))
    x, y = 0.5 * (points.min(axis=0) + points.max(axis=0))
    return Branch(area, float(x), float(y), float(np.hypot(points[:, 0] - x, points[:, 1] - y).max()), top_mm)


def trunk(x: float, y: float, radius: float, top_mm: float) -> Branch:
    """A round branch."""
    around = Polygons.circle(radius / cos(pi / CORNERS), CORNERS)
    return Branch(around.translate((x, y)), x, y, radius, top_mm, True)


@dataclass(frozen=True, eq=False)
class Growth:
    """How thick trunks are: radius of their places at the top, its growth per mm downward."""

    least_mm: float
    per_mm: float

    @classmethod
    def of(cls, process: Process, radius_mm: float) -> "Growth":
        """The growth of a process whose beads reach radius_mm around each place."""
        slope = tan(radians(process.support_branch_growth_deg))
        return cls(max(0.5 * process.support_branch_mm - radius_mm, 0.1 * radius_mm), slope)

    def radius_mm(self, branch: Branch, z_mm: float) -> float:
        """Of a trunk at a height."""
        return min(self.least_mm + self.per_mm * max(branch.top_mm - z_mm, 0.0), max(THICKEST_MM, self.least_mm))


def lowered(branches: Sequence[Branch], room: Room, layer: int, growth: Growth) -> list[Branch]:
    """The branches of a layer in the layer below: every place of the former is within the lean of one of the latter, or
    on ground.
    """
    z, lean, reached = float(room.top_mm[layer - 1]), float(room.lean_mm[layer]), room.reached[layer - 1]
    wished = _wished(branches, z, lean, float(room.top_mm[layer]) - z, growth)
    borders = edges(reached)
    free = _depths(wished, borders) >= np.array([branch.reach_mm for branch in wished])
    doubtful = [branch.area for branch, is_free in zip(wished, free, strict=True) if not is_free]
    bad = united(doubtful) - reached
    if bad.area() < LEAST_MM2:
        return _apart(wished)
    low: list[Branch] = []
    left: list[Branch] = []
    for old, new, is_free, depth in zip(branches, wished, free, _depths(branches, borders), strict=True):
        if is_free or (new.area ^ bad).area() < LEAST_MM2:
            low.append(new)
            continue
        narrow = _narrowed(old, reached, borders, float(depth), lean)
        if narrow is not None:
            low.append(narrow)
        elif not old.full or not _rests(old, room.ground[layer]):
            left.append(old)
    return _apart(low + _aside(left, room, layer))


def _depths(branches: Sequence[Branch], borders: Floats) -> Floats:
    """How deep the middles of branches lie inside an area with those edges."""
    found: Floats = depths(np.array([[branch.x, branch.y] for branch in branches]).reshape(-1, 2), borders)
    return found


def _wished(branches: Sequence[Branch], z_mm: float, lean: float, rise: float, growth: Growth) -> list[Branch]:
    """Where the branches would go if nothing was in their way: wide ones shrink, trunks go to meet the nearest trunk."""
    thick = [growth.radius_mm(branch, z_mm) for branch in branches]
    trunks = [k for k, branch in enumerate(branches) if branch.radius <= thick[k] + EVEN_MM]
    goals = _goals(np.array([[branches[k].x, branches[k].y] for k in trunks]), z_mm * lean / rise)
    goal_of = dict(zip(trunks, goals, strict=True))
    wished = []
    for k, branch in enumerate(branches):
        if branch.radius - lean > thick[k]:
            wished.append(branch.shrunk(branch.radius - lean))
            continue
        x, y = goal_of.get(k, (branch.x, branch.y))
        away = hypot(x - branch.x, y - branch.y)
        share = 1.0 if away <= lean else lean / away
        x, y = branch.x + share * (x - branch.x), branch.y + share * (y - branch.y)
        radius = max(growth.least_mm, branch.radius + FATTER * growth.per_mm * rise)
        wished.append(trunk(x, y, min(thick[k], radius), branch.top_mm))
    return wished


def _goals(at: Floats, reach_mm: float) -> list[tuple[float, float]]:
    """For each trunk half way to the nearest other one, or its own place; reach_mm: how far it can lean down to the ground."""
    if len(at) < 2:
        return [(float(x), float(y)) for x, y in at]
    apart = np.hypot(at[:, None, 0] - at[None, :, 0], at[:, None, 1] - at[None, :, 1])
    np.fill_diagonal(apart, np.inf)
    nearest = apart.argmin(axis=1)
    meet = apart[np.arange(len(at)), nearest] <= 2.0 * MEETING * reach_mm
    goals = np.where(meet[:, None], 0.5 * (at + at[nearest]), at)
    return [(float(x), float(y)) for x, y in goals]


def _narrowed(branch: Branch, reached: Polygons, borders: Floats, depth_mm: float, lean: float) -> Branch | None:
    """The branch where it is, as thick as it was or by the lean thinner, if that is free.

    borders: edges of the reached places; depth_mm: how deep inside them the branch's middle lies.
    """
    if branch.full and depth_mm >= branch.reach_mm:
        return branch
    if branch.radius <= THIN_MM:
        return None
    if branch.full or branch.radius - lean <= THIN_MM:
        thin = trunk(branch.x, branch.y, max(branch.radius - lean, THIN_MM), branch.top_mm)
        return thin if depth_mm >= thin.reach_mm else None
    thin = branch.shrunk(branch.radius - lean)
    if depth_mm >= thin.radius:
        return thin
    if depths(contours(thin.area)[0][:1], borders)[0] < 0.0:
        return None
    return thin if (thin.area - reached).area() < LEAST_MM2 else None


def _rests(branch: Branch, ground: Polygons) -> bool:
    """Whether most of a branch has come to ground."""
    return bool(2.0 * (branch.area - ground).area() < branch.area.area())


def _aside(branches: Sequence[Branch], room: Room, layer: int) -> list[Branch]:
    """Branches in the way of something: what of them has a place below stays, the rest goes aside, or ends on ground."""
    if not branches:
        return []
    reached, lean = room.reached[layer - 1], float(room.lean_mm[layer])
    area = united([branch.area for branch in branches])
    tidy = layer % TIDIED == 0
    area = sealed(area, SMOOTH_MM) if tidy else area
    kept = carried(area, reached, room.ground[layer], lean)
    kept = _thinned(kept, lean) if tidy and (area - reached).is_empty() else kept
    islands = _tidied(kept, reached).decompose() if tidy else _followed(kept, reached)
    top = max(branch.top_mm for branch in branches)
    return [branch_of(island, top) for island in islands if island.area() >= LEAST_MM2]


def _tidied(places: Polygons, reached: Polygons) -> Polygons:
    """Places whose slivers are wide enough to be followed down."""
    thick = solid(places)
    return thick.simplify(FINE_MM) + (leaning(places - thick, THIN_MM) ^ reached)


def _followed(places: Polygons, reached: Polygons) -> list[Polygons]:
    """The islands of places, wider where all of an island is a sliver: what is just a thin limb of one can wait."""
    islands: list[Polygons] = []
    for island in places.decompose():
        islands += (leaning(island, THIN_MM) ^ reached).decompose() if _sliver(island) else [island.simplify(FINE_MM)]
    return islands


def _sliver(island: Polygons) -> bool:
    """Whether an island is on average narrower than a sliver, as far as its box tells."""
    x0, y0, x1, y1 = island.bounds()
    return bool(island.area() < 2.0 * SLIVER_MM * hypot(x1 - x0, y1 - y0))


def _thinned(area: Polygons, lean: float) -> Polygons:
    """The area with its edges drawn in; what is too narrow for that stays."""
    thinned = []
    for island in area.decompose():
        core = grown(island, -DRAWN_IN * lean)
        bits = [] if core.is_empty() else (island - leaning(core, lean)).decompose()
        thinned += [island] if core.is_empty() else [core, *(bit for bit in bits if bit.area() >= lean**2)]
    return united(thinned)


def _apart(branches: list[Branch]) -> list[Branch]:
    """Without branches that lie wholly inside a trunk."""
    if len(branches) < 2:
        return branches
    x, y, radius, full = np.array([[b.x, b.y, b.radius, b.full] for b in branches]).T
    deep = radius[None, :] - radius[:, None] - np.hypot(x[:, None] - x[None, :], y[:, None] - y[None, :])
    rank = np.arange(len(branches))
    inside = (deep >= -1e-9) & (full[None, :] > 0) & ((radius[None, :] > radius[:, None]) | (rank[None, :] < rank[:, None]))
    return [branches[k] for k in np.flatnonzero(~inside.any(axis=1))]
