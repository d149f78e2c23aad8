"""Trial cuts: planes tried one after the other, fast enough for moving them by hand, with figures for every cut or the reason why
it is impossible.

The figures of all parts are summed over the model's surface without cutting. Whether a plane is feasible depends on the remainder
after the cuts before it, so all cuts but the last are made for that: in the background, one after the other, and those shared
with the previous trial are reused. While a plane is dragged, the cuts before it stay the same.
"""

from bisect import bisect_left
from collections.abc import Sequence
from dataclasses import dataclass, replace
from math import inf

import numpy as np

from mdp.clearance import collision_points, lowest_body
from mdp.cost.forecast import Forecast, PartForecast
from mdp.cut import Solid, above, below, cut, mesh_of, passing_places
from mdp.mesh import Floats, Mesh
from mdp.overhang import PLATE_TOLERANCE_MM, UP
from mdp.pedestal import on_pedestal
from mdp.plane import Plane
from mdp.pose import poses, rotation, shift
from mdp.ranking.candidates import COPLANAR_MM, Reason
from mdp.ranking.node import Node
from mdp.search.by_hand import Rejection, name_limbs, planes_near, rejection, try_planes
from mdp.search.neck import find_neck
from mdp.search.problem import Problem, with_search
from mdp.sweep.limbs import limb_faces
from mdp.sweep.slivers import SLIVER_COSINE
from mdp.zone import NO_ZONES, Zone, Zones
from profiles.frozen import Vector
from profiles.profile import Profile

MOST_TRIED = 16  # feasible positions of a plane, by the sweep, that are tried
# share of the model's height along the plane's normal: distance from rejected positions to the next one that is tried;
APART_SHARE = 0.01
# once a position is feasible, those skipped before it are searched by bisection
MOST_PLACES = 20  # points marked on an obstacle

Key = tuple[float, ...]


@dataclass(frozen=True)
class Touch:
    """The head at the point where one of its bodies would touch the table, in the workpiece frame.

    tip_mm: the tip; rotation: rows of the rotation from the workpiece frame to the machine's; body: its name; touched_mm: the
    point on the table.
    """

    body: str
    tip_mm: Vector
    rotation: tuple[Vector, ...]
    touched_mm: Vector


@dataclass(frozen=True)
class Obstacle:
    """The cause of a plane's rejection. places_mm: its points in the workpiece frame; touch: the head that would meet the
    table.
    """

    places_mm: tuple[Vector, ...] = ()
    touch: Touch | None = None


@dataclass(frozen=True)
class Trial:
    """Result of a trial. parts: the parts from the second in print order, None for those that cannot be cut off. rejected_part,
    rejected: the number of the part that cannot be cut and the reason, "" if all can; obstacle: where; support_area_mm2, seam_mm:
    totals over all parts, if all can be cut. unchecked: number of parts, from the second, that have not been checked yet: they
    may still be rejected, but the figures are final.
    """

    parts: tuple[PartForecast | None, ...]
    rejected_part: int = 0
    rejected: str = ""
    support_area_mm2: float | None = None
    seam_mm: float | None = None
    obstacle: Obstacle | None = None
    unchecked: int = 0


class Trials:
    """Trials on one model."""

    def __init__(self, mesh: Mesh, profile: Profile, zones: Zones = NO_ZONES) -> None:
        """mesh: a closed mesh standing on the build plate. All seams count in full here: the reduction for hidden seams affects
        none of a trial's figures, and takes longer to compute than all the rest.
        """
        lifted = on_pedestal(mesh, profile.search.pedestal_mm)
        self._problem = problem = Problem(lifted, with_search(profile, hidden_seam_share=1.0), zones)
        self._node = root = problem.root  # after the cuts of the last trial
        self._surface = Forecast.of(root.remainder, problem.terms, root.seam_weights)
        self._keys: list[Key] = []  # keys of the planes of these cuts, as they were given
        self._aside: frozenset[Key] = frozenset()
        self.uncut_support_mm2 = self._surface.parts([])[1]  # support of the model in one piece

    def set_aside(self, planes: Sequence[Plane]) -> None:
        """Set infeasible planes that further trials cut without a check, so that the planes after them are tried all the same."""
        self._aside = frozenset(_key(plane) for plane in planes)

    def attempt(self, planes: Sequence[Plane], most_cuts: float = inf) -> Trial:
        """Try the base planes of the parts from the second, in print order. most_cuts: limit on the number of cuts made; parts
        beyond it stay unchecked.
        """
        order = planes[::-1]
        self._keep_common_cuts(order)
        known = len(self._keys)
        rejected = self._cut_off(order[known : int(min(known + most_cuts, len(order) - 1))])
        done = len(self._keys)
        if rejected is None and done < len(order):
            rejected = self._look(order[done])
        if rejected is not None:
            parts, _ = self._surface.parts(self._named(order[:done]))
            obstacle = obstacle_of(self._problem, rejected, order[done])
            unknown = [None] * (len(order) - done)
            return Trial((*unknown, *parts[::-1]), len(order) + 1 - done, rejected.text, obstacle=obstacle)
        parts, left_mm2 = self._surface.parts(self._named(order))
        support_mm2, seam_mm = left_mm2 + sum(part.support_mm2 for part in parts), sum(part.rim_mm for part in parts)
        return Trial(parts[::-1], 0, "", support_mm2, seam_mm, unchecked=max(len(order) - 1 - done, 0))

    def warm(self) -> None:
        """Precompute what the first trial needs of the whole model."""
        low, high = (float(z) for z in self._problem.mesh.bounds_mm[:, 2])
        self.attempt((Plane(UP, 0.5 * (low + high)),), 0)

    def neck(self, planes: Sequence[Plane], number: int, reach_mm: float) -> Plane | None:
        """The neck near the plane of a part, on the remainder after later parts are cut off; None if there is none or those cuts
        are impossible. planes: as in attempt.
        """
        if not self._cut_later(planes, number):
            return None
        plane = planes[number - 2]
        neck = find_neck(self._node.remainder.mesh, self._node.seam_weights, plane, reach_mm)
        return None if neck is None else replace(neck, limbs_mm=plane.limbs_mm)

    def nearest(self, planes: Sequence[Plane], number: int) -> Plane | None:
        """The plane of a part at the nearest position along its normal where all planes are feasible, or else leaning by a few
        degrees; None if there is none among MOST_TRIED positions. planes: as in attempt.
        """
        if not self.attempt(planes).rejected:
            return planes[number - 2]
        if not self._cut_later(planes, number):
            return None
        apart_mm = APART_SHARE * float(np.ptp(self._problem.mesh.vertices @ planes[number - 2].normal))
        rejected, passed_over = list[Plane](), list[Plane]()
        for plane in planes_near(self._problem, self._node, planes[number - 2]):
            if any(_are_near(plane, other, apart_mm) for other in rejected):
                passed_over.append(plane)
            elif self._can_take(planes, number, plane):
                nearer = [other for other in passed_over if _are_near(plane, other, apart_mm)]
                first = bisect_left(nearer, True, key=lambda other: self._can_take(planes, number, other))
                return (*nearer, plane)[first]
            else:
                rejected.append(plane)
                if len(rejected) == MOST_TRIED:
                    break
        return None

    def _can_take(self, planes: Sequence[Plane], number: int, plane: Plane) -> bool:
        """Whether all planes are feasible with another plane for one part."""
        return not self.attempt((*planes[: number - 2], plane, *planes[number - 1 :])).rejected

    def _cut_later(self, planes: Sequence[Plane], number: int) -> bool:
        """Cut off the parts printed after a given part; returns whether that is possible."""
        later = planes[number - 1 :][::-1]
        self._keep_common_cuts(later)
        return self._cut_off(later[len(self._keys) :]) is None

    def _keep_common_cuts(self, order: Sequence[Plane]) -> None:
        """Drop the cuts from the first one that differs from these planes."""
        alike = 0
        while alike < min(len(order), len(self._keys)):
            key = _key(order[alike])
            if self._keys[alike] != (key in self._aside, *key):
                break
            alike += 1
        self._node = self._node.path[alike]
        del self._keys[alike:]

    def _cut_off(self, planes: Sequence[Plane]) -> Rejection | None:
        """Make further cuts, or return the rejection of one."""
        for plane in planes:
            aside = _key(plane) in self._aside
            reached = _cut_anyway(self._problem, self._node, plane) if aside else try_planes(self._problem, self._node, [plane])
            if isinstance(reached, Rejection):
                return reached
            self._node = reached
            self._keys.append((aside, *_key(plane)))
        return None

    def _named(self, order: Sequence[Plane]) -> list[Plane]:
        """Planes in the order of their cuts, with their limbs named by vertices where possible."""
        made = self._node.planes[: len(order)]
        others = [(plane, name_limbs(self._node, plane)) for plane in order[len(made) :]]
        return [*made, *(plane if isinstance(named, Rejection) else named for plane, named in others)]

    def _look(self, plane: Plane) -> Rejection | None:
        """The rejection of a plane at the current node, or None. Only limbs are actually cut, since their remainder may float."""
        if _key(plane) in self._aside:
            return None
        if plane.limbs_mm is None:
            return rejection(self._problem, self._node, plane)
        child = try_planes(self._problem, self._node, [plane])
        return child if isinstance(child, Rejection) else None


def _are_near(plane: Plane, other: Plane, apart_mm: float) -> bool:
    """Whether two planes have the same normal and lie less than apart_mm apart."""
    return abs(plane.offset_mm - other.offset_mm) < apart_mm and np.array_equal(plane.normal, other.normal)


def _key(plane: Plane) -> Key:
    limbs_mm = () if plane.limbs_mm is None else tuple(plane.limbs_mm.ravel().tolist())
    return *plane.normal.tolist(), plane.offset_mm, *limbs_mm


def _cut_anyway(problem: Problem, node: Node, plane: Plane) -> Node:
    """The node after a cut by an infeasible plane; its solid is unchanged if the plane does not divide it."""
    named, rest = name_limbs(node, plane), node.solid
    if isinstance(named, Plane):
        plane, left = named, below(rest, named) if named.limbs_mm is None else cut(rest, named)[1]
        rest = rest if left.is_empty() else left
    return Node(rest, problem.terms, node.places, node, plane)


def obstacle_of(problem: Problem, rejected: Rejection, plane: Plane) -> Obstacle | None:
    """The obstacle that makes a plane infeasible at a node; None if unknown."""
    named = name_limbs(rejected.node, plane)
    if isinstance(named, Rejection):
        return None
    if rejected.reason == Reason.CLEARANCE:
        return Obstacle(touch=_touch(problem, rejected.node, named))
    places = _places_against(problem, rejected, named)
    return Obstacle(tuple(_vector(place) for place in places[:MOST_PLACES])) if len(places) else None


def _places_against(problem: Problem, rejected: Rejection, plane: Plane) -> Sequence[Floats]:
    """Points that show why a plane is infeasible; empty if unknown."""
    node = rejected.node
    match rejected.reason:
        case Reason.PLATFORM:
            centre, radius = problem.plate_disc
            across = plane.normal[:2] / max(float(np.hypot(*plane.normal[:2])), 1e-12)
            return [np.array([*(centre + radius * across), 0.0])]
        case Reason.FLOATING:
            return _lowest(below(node.solid, plane), UP, PLATE_TOLERANCE_MM)
        case Reason.INTERFACE:
            return _lowest(above(node.solid, plane), plane.normal, plane.offset_mm + COPLANAR_MM)
        case Reason.FRAGILE:
            return _sliver(node.remainder.mesh, plane)
        case Reason.KEEP:
            zone = problem.zones.keep[(problem.zones.crossed(plane) or 1) - 1]
            corners = zone.corners if isinstance(zone, Zone) else zone.points
            return [0.5 * (corners.min(axis=0) + corners.max(axis=0))]
        case Reason.WEAK:
            section = passing_places(node.remainder.mesh, plane)
            return [0.5 * (section.min(axis=0) + section.max(axis=0))]
        case Reason.STANDING:  # parts that require a higher tip than the limbs beside them
            corners, limb = node.remainder.mesh.vertices[node.remainder.mesh.faces], limb_faces(node.remainder, plane)
            for pose in poses(problem.machine, plane.normal)[:1]:
                return list(collision_points(problem.machine, pose, (corners[limb], corners[~limb]), plane.offset_mm))
        case Reason.REACH:
            return _outside(problem, node.corners_cut(plane), plane)
    return []


def _touch(problem: Problem, node: Node, plane: Plane) -> Touch | None:
    """The head at the lowest point of the part to be cut off, at the pose that needs the least height."""
    machine = problem.machine
    options = [(*lowest_body(machine, pose), pose) for pose in poses(machine, plane.normal)]
    printed = node.corners_cut(plane)
    if not options or len(printed) == 0:
        return None
    _, body, point, pose = min(options, key=lambda option: option[0])
    tip, turned = printed[int(np.argmin(printed[:, 2]))], rotation(machine, pose)
    x, y, _ = tip + np.array(point) @ turned
    return Touch(body, _vector(tip), tuple(_vector(row) for row in turned), (float(x), float(y), 0.0))


def _sliver(mesh: Mesh, plane: Plane) -> list[Floats]:
    """The point of the surface nearly level with a plane that is nearest to it on the solid's side, where a sliver would be
    left.
    """
    cosines, heights = mesh.normals @ plane.normal, plane.heights_mm(mesh.vertices)[mesh.faces]
    outward = np.where(cosines > 0.0, 1.0, -1.0)[:, None] * heights
    outward[(np.abs(cosines) <= SLIVER_COSINE)[:, None] | (outward < 0.0)] = np.inf
    face, corner = np.unravel_index(int(np.argmin(outward)), outward.shape)
    return [mesh.vertices[mesh.faces[face, corner]]] if np.isfinite(outward[face, corner]) else []


def _lowest(solid: Solid, upward: Floats, base_mm: float) -> list[Floats]:
    """The lowest point, along a direction, of every piece of a solid that does not reach its base."""
    bodies = [mesh_of(piece).vertices for piece in solid.decompose() if piece.volume() > 0.0]  # the others are voids
    return [vertices[int(np.argmin(vertices @ upward))] for vertices in bodies if (vertices @ upward).min() > base_mm]


def _outside(problem: Problem, points: Floats, plane: Plane) -> list[Floats]:
    """The points of a part out of the axes' reach, the farthest one for each axis and side."""
    machine, outside = problem.machine, []
    for pose in poses(machine, plane.normal)[:1] if len(points) else []:
        reached = (points + problem.place_mm) @ rotation(machine, pose).T + shift(machine, pose)
        for axis, limits in enumerate(axis.limits_mm for axis in (machine.x, machine.y, machine.z)):
            low, high = int(np.argmin(reached[:, axis])), int(np.argmax(reached[:, axis]))
            outside += [points[low]] if reached[low, axis] < limits[0] else []
            outside += [points[high]] if reached[high, axis] > limits[1] else []
    return outside


def _vector(values: object) -> Vector:
    x, y, z = (float(value) for value in np.asarray(values, dtype=np.float64))
    return x, y, z
