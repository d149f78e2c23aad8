"""Obstacle: where a person's plane is in the way of something: the head at the place where it would touch, or places marked."""

from dataclasses import dataclass

import numpy as np

from mdp.clearance import lowest_body, places_met
from mdp.cut import Solid, above, below, mesh_of, passing_places
from mdp.mesh import Floats, Mesh
from mdp.overhang import PLATFORM_TOLERANCE_MM
from mdp.plane import Plane
from mdp.pose import poses, rotation, shift
from mdp.ranking.candidates import COPLANAR_MM, Reason
from mdp.search.by_hand import Refusal, name_limbs
from mdp.search.node import Node
from mdp.search.problem import Problem
from mdp.sweep.limbs import limb_faces
from mdp.sweep.slivers import SLIVER_COSINE
from mdp.zone import Zone
from profiles.frozen import Vector

MOST_PLACES = 20


@dataclass(frozen=True)
class Touch:
    """The head at the place where one of its bodies would touch the table. All in the workpiece frame, mm: tip_mm; rotation: rows
    of what turns the workpiece frame into the machine's there; body: its name; touched_mm: the place on the table."""

    body: str
    tip_mm: Vector
    rotation: tuple[Vector, ...]
    touched_mm: Vector


@dataclass(frozen=True)
class Obstacle:
    """places_mm: of the workpiece frame, where what a plane is refused for lies; touch: the head that would meet the table."""

    places_mm: tuple[Vector, ...] = ()
    touch: Touch | None = None


def find_refused(problem: Problem, node: Node, plane: Plane, refusal: Refusal) -> Obstacle | None:
    """Where a plane that may not cut a node is in the way; None: nobody knows."""
    named = name_limbs(node, plane)
    if isinstance(named, Refusal):
        return None
    plane = named
    match refusal.reason:
        case Reason.CLEARANCE:
            return Obstacle(touch=_touch(problem, node, plane))
        case Reason.PLATFORM:
            centre, radius = problem.platform_disc
            across = plane.normal[:2] / max(float(np.hypot(*plane.normal[:2])), 1e-12)
            return Obstacle((_vector([*(centre + radius * across), 0.0]),))
        case Reason.FLOATING:
            return _lowest(below(node.solid, plane), np.array([0.0, 0.0, 1.0]), PLATFORM_TOLERANCE_MM)
        case Reason.INTERFACE:
            return _lowest(above(node.solid, plane), plane.normal, plane.offset_mm + COPLANAR_MM)
        case Reason.FRAGILE:
            return _sliver(node.remainder.mesh, plane)
        case Reason.KEEP:
            zone = problem.zones.keep[(problem.zones.crossed(plane) or 1) - 1]
            corners = zone.corners if isinstance(zone, Zone) else zone.points
            return Obstacle((_vector(0.5 * (corners.min(axis=0) + corners.max(axis=0))),))
        case Reason.WEAK:
            section = passing_places(node.remainder.mesh, plane)
            return Obstacle((_vector(0.5 * (section.min(axis=0) + section.max(axis=0))),))
        case Reason.STANDING:
            return _standing(problem, node, plane)
        case Reason.REACH:
            return _outside(problem, problem.corners_cut(node, plane), plane)
    return None


def _standing(problem: Problem, node: Node, plane: Plane) -> Obstacle | None:
    """The places of what stands above a plane that ask for a higher tip than the limbs beside them have."""
    mesh, limb = node.remainder.mesh, limb_faces(node.remainder, plane)
    corners = mesh.vertices[mesh.faces]
    for pose in poses(problem.machine, plane.normal)[:1]:
        places = places_met(problem.machine, pose, corners[limb], corners[~limb], plane.offset_mm)
        return Obstacle(tuple(_vector(place) for place in places[:MOST_PLACES])) if len(places) else None
    return None


def _touch(problem: Problem, node: Node, plane: Plane) -> Touch | None:
    """The head at the lowest place of what is cut off, at the pose that needs least."""
    machine = problem.machine
    options = [(*lowest_body(machine, pose), pose) for pose in poses(machine, plane.normal)]
    if not options:
        return None
    _, body, point, pose = min(options, key=lambda option: option[0])
    printed = problem.corners_cut(node, plane)
    if len(printed) == 0:
        return None
    tip, turned = printed[int(np.argmin(printed[:, 2]))], rotation(machine, pose)
    x, y, _ = tip + np.array(point) @ turned
    return Touch(body, _vector(tip), tuple(_vector(row) for row in turned), (float(x), float(y), 0.0))


def _sliver(mesh: Mesh, plane: Plane) -> Obstacle | None:
    """The place of the surface nearly level with a plane that it comes nearest to on the solid's side: there a sliver is left."""
    cosines, heights = mesh.normals @ plane.normal, plane.heights_mm(mesh.vertices)[mesh.faces]
    outward = np.where(cosines > 0.0, 1.0, -1.0)[:, None] * heights
    outward[(np.abs(cosines) <= SLIVER_COSINE)[:, None] | (outward < 0.0)] = np.inf
    face, corner = np.unravel_index(int(np.argmin(outward)), outward.shape)
    return Obstacle((_vector(mesh.vertices[mesh.faces[face, corner]]),)) if np.isfinite(outward[face, corner]) else None


def _lowest(solid: Solid, upward: Floats, base_mm: float) -> Obstacle | None:
    """The lowest place, along a direction, of every piece of a solid that does not reach down to its base."""
    places = []
    for piece in solid.decompose():
        if piece.volume() <= 0.0:
            continue  # a closed void
        vertices = mesh_of(piece).vertices
        heights = vertices @ upward
        if heights.min() > base_mm:
            places.append(_vector(vertices[int(np.argmin(heights))]))
    return Obstacle(tuple(places[:MOST_PLACES])) if places else None


def _outside(problem: Problem, points: Floats, plane: Plane) -> Obstacle | None:
    """The places of a part that the axes do not reach, the farthest for each axis and side."""
    machine, outside = problem.machine, []
    for pose in poses(machine, plane.normal)[:1] if len(points) else []:
        reached = (points + problem.place_mm) @ rotation(machine, pose).T + shift(machine, pose)
        for axis, limits in enumerate(axis.limits_mm for axis in (machine.x, machine.y, machine.z)):
            low, high = int(np.argmin(reached[:, axis])), int(np.argmax(reached[:, axis]))
            outside += [points[low]] if reached[low, axis] < limits[0] else []
            outside += [points[high]] if reached[high, axis] > limits[1] else []
    return Obstacle(tuple(_vector(point) for point in outside)) if outside else None


def _vector(values: object) -> Vector:
    x, y, z = (float(value) for value in np.asarray(values, dtype=np.float64))
    return x, y, z
