"""Orientation: how a whole model prints best in one piece, the baseline of every decomposition.

A model may rest on a facet of its convex hull (`facet_orientations`), or stand straight on a rounded end, along a side of the
file's box or a principal axis (`straight_orientations`). In most directions spread over the whole sphere only a raft could hold
it. A cube balanced on a corner has no risky face at all, so such orientations give a lower bound of the area rather than advice:
by default `best_orientation` chooses an orientation that rests.

`azimuth_rad` is a bearing about z that turns with the model, so that a search does not depend on how the model is turned.
"""

from collections.abc import Callable
from dataclasses import dataclass
from functools import update_wrapper
from math import atan2, cos, degrees, factorial, hypot, pi, radians, sin
from typing import Concatenate, ParamSpec, TypeVar
from weakref import WeakKeyDictionary

import numpy as np

from mdp.cut import convex_hull
from mdp.directions.unit_vectors import spread
from mdp.kernels.arrays import floats
from mdp.kernels.kernel import kernel
from mdp.kernels.threads import in_threads
from mdp.mesh import Floats, Ints, Mesh, dot
from mdp.overhang import PLATE_TOLERANCE_MM, UP, step_share, threshold

LEAN_DEG = 5.0  # a model rests if it can be leaned by this much before it tips over
SAME_FACET_DEG = 0.5
LYING_DEG = 15.0  # a model that leans less lies on a side
SPREAD = 1000
SAME_MOMENT = 0.02  # share of the largest second moment: axes whose moments differ by less are indistinguishable
MOST_FACETS = 1000
MOST_CORNERS = 1000
EQUAL_MM2 = 1e-6  # smaller differences of area are rounding
HIGHEST = 6  # order of the highest moment that is measured
PLAIN = 1e-3  # share of the greatest possible moment: smaller values are rounding or a symmetry
SIDES = np.stack([np.cos(np.arange(64) * pi / 32), np.sin(np.arange(64) * pi / 32)])


@dataclass(frozen=True, eq=False)
class Orientation:
    """A model turned as a whole: rotation (3, 3), risky area, the angle by which it can be tilted before it tips over (negative
    if it tips over by itself), height, stair-stepping (each face's area times the height of its steps), and area of its shadow,
    in which overlapping surfaces all count.
    """

    rotation: Floats
    risky_mm2: float
    lean_deg: float
    height_mm: float
    stairs_mm2: float
    shadow_mm2: float

    @property
    def stable(self) -> bool:
        """Whether the model stays upright when it is tilted slightly."""
        return self.lean_deg >= LEAN_DEG

    @property
    def turns_deg(self) -> tuple[float, float]:
        """The rotation as turns about x, then y (process.rotate_deg takes them), degrees."""
        return _turns(self.rotation[2])


P = ParamSpec("P")
T = TypeVar("T")


def cached_with_mesh(measure: Callable[Concatenate[Mesh, P], T]) -> Callable[Concatenate[Mesh, P], T]:
    """Decorator that caches a measurement of a mesh for as long as the mesh exists."""
    known: WeakKeyDictionary[Mesh, dict[object, T]] = WeakKeyDictionary()

    def measured(mesh: Mesh, /, *args: P.args, **kwargs: P.kwargs) -> T:
        of_mesh = known.setdefault(mesh, {})
        key = args, *sorted(kwargs.items())
        if key not in of_mesh:
            of_mesh[key] = measure(mesh, *args, **kwargs)
        return of_mesh[key]

    update_wrapper(measured, measure)
    return measured


@cached_with_mesh
def best_orientation(mesh: Mesh, angle_deg: float, resting: bool = True) -> Orientation:
    """The orientation with the least risky area. resting: only orientations that rest, if there are any; False: also those that
    only a raft could hold.

    The present orientation is a candidate, so the result is never worse than printing the model straight up. Among equal areas
    one that rests wins, then the least turned. A model that rests nowhere (a ball) gets the best of all.
    """
    candidates = facet_orientations(mesh, angle_deg)
    resting_ones = [orientation for orientation in candidates if orientation.stable]
    if resting and resting_ones:
        return min(resting_ones, key=_rank)
    return min([*candidates, *_measure(mesh, angle_deg, spread(SPREAD))], key=_rank)


def resting_orientations(mesh: Mesh, angle_deg: float) -> list[Orientation]:
    """The orientations in which the model rests on a facet of its hull, least risky first, including the present one if it
    rests.
    """
    return sorted((orientation for orientation in facet_orientations(mesh, angle_deg) if orientation.stable), key=_rank)


def resting_facets(mesh: Mesh) -> list[tuple[Floats, Floats]]:
    """The facets of the hull, its triangles grouped by plane, on which the model rests without tipping over, largest first:
    outward normal (3,) and the corners of its triangles (k, 3, 3), mm.
    """
    hull, directions = convex_hull(mesh.vertices), np.concatenate([_facets(mesh), UP[None]])
    directions = directions[_lean_deg(mesh, directions) >= LEAN_DEG]
    if len(directions) == 0:
        return []
    along = hull.normals @ -directions.T
    nearest = np.where(along.max(axis=1) >= cos(radians(SAME_FACET_DEG)), along.argmax(axis=1), -1)
    facets = [(-direction, hull.vertices[hull.faces[nearest == k]]) for k, direction in enumerate(directions)]
    return [(normal, corners) for normal, corners in facets if len(corners)]


def set_on_plate(mesh: Mesh, rotation: Floats | None) -> Mesh:
    """The mesh turned by a rotation, set on z = 0 and centred about the turn axis; unchanged for None."""
    if rotation is None:
        return mesh
    turned = mesh.transform(rotation)
    low, high = turned.bounds_mm
    middle = 0.5 * (low + high)
    return turned.transform(np.eye(3), (-middle[0], -middle[1], -low[2]))


def motion_between(before: Mesh, after: Mesh) -> tuple[Floats, Floats]:
    """The rotation (3, 3) and the shift that move a mesh from one placement to another (W. Kabsch, 1976)."""
    first, second = before.vertices.mean(axis=0), after.vertices.mean(axis=0)
    left, _, right = np.linalg.svd((after.vertices - second).T @ (before.vertices - first))
    rotation: Floats = left @ np.diag([1.0, 1.0, np.linalg.det(left @ right)]) @ right
    return rotation, second - rotation @ first


RISKY, STAIRS, SHADOW = range(3)
Surface = tuple[Floats, Ints, Floats, Floats, float]  # vertices, faces, normals, areas, and the cosine below which one is risky


def face_areas(mesh: Mesh, directions: Floats, angle_deg: float) -> Floats:
    """(k, 3) areas, mm2, of the model printed along (k, 3) unit directions: overhanging faces that do not stand on the plate; all
    faces, each times the height of its steps as a share of a layer; and the shadow.
    """
    areas_mm2 = np.zeros((len(directions), 3))
    surface = mesh.vertices, mesh.faces, mesh.normals, mesh.areas_mm2, threshold(angle_deg)
    in_threads(_sum_faces, len(directions), surface, np.ascontiguousarray(directions), areas_mm2)
    return areas_mm2


@kernel
def _sum_faces(begin: int, end: int, surface: Surface, directions: Floats, sums_mm2: Floats) -> None:
    vertices, corners, normals, areas_mm2, limit = surface
    heights = floats(len(vertices), 0.0)
    for k in range(begin, end):
        x, y, z = directions[k, 0], directions[k, 1], directions[k, 2]
        lowest = np.inf
        for v in range(len(heights)):
            heights[v] = vertices[v, 0] * x + vertices[v, 1] * y + vertices[v, 2] * z
            lowest = min(lowest, heights[v])
        level = lowest + PLATE_TOLERANCE_MM
        for f in range(len(normals)):
            cosine = normals[f, 0] * x + normals[f, 1] * y + normals[f, 2] * z
            sums_mm2[k, STAIRS] += step_share(cosine) * areas_mm2[f]
            sums_mm2[k, SHADOW] += 0.5 * abs(cosine) * areas_mm2[f]
            if cosine < limit and max(heights[corners[f, 0]], heights[corners[f, 1]], heights[corners[f, 2]]) > level:
                sums_mm2[k, RISKY] += areas_mm2[f]


@cached_with_mesh
def facet_orientations(mesh: Mesh, angle_deg: float) -> tuple[Orientation, ...]:
    """The present orientation, and those on each facet of the hull, whether or not the model rests there."""
    return tuple(_measure(mesh, angle_deg, np.concatenate([UP[None], _facets(mesh)])))


@cached_with_mesh
def straight_orientations(mesh: Mesh, angle_deg: float) -> tuple[Orientation, ...]:
    """The orientations on each side of the bounding box of the model's file and along its principal axes, which suit a model that
    stands on a rounded end; without the present one.
    """
    axes = np.concatenate([np.eye(3), _principal_axes(mesh)])
    directions = np.concatenate([axes, -axes])
    return tuple(_measure(mesh, angle_deg, directions[directions @ UP < cos(radians(SAME_FACET_DEG))]))


def _principal_axes(mesh: Mesh) -> Floats:
    """(k, 3) principal axes of the surface, those whose moment differs from the others'."""
    corners = mesh.vertices[mesh.faces]
    centres = corners.mean(axis=1)
    middle = np.average(centres, axis=0, weights=mesh.areas_mm2)
    # Over a triangle with the corners v and the centre g, x x^T integrates to A / 12 times the sum of v v^T + 9 g g^T.
    points = np.concatenate([corners - middle, 3.0 * (centres - middle)[:, None]], axis=1)
    moments, axes = np.linalg.eigh(np.einsum("i,ijk,ijl->kl", mesh.areas_mm2, points, points))
    differ = np.diff(moments) > SAME_MOMENT * moments[-1]
    own: Floats = axes.T[np.concatenate([[True], differ]) & np.concatenate([differ, [True]])]
    return own


def _measure(mesh: Mesh, angle_deg: float, directions: Floats) -> list[Orientation]:
    areas_mm2 = face_areas(mesh, directions, angle_deg)
    lean_deg, corners = _lean_deg(mesh, directions), convex_hull(mesh.vertices).vertices
    return [
        Orientation(
            rotation=_rotation(direction),
            risky_mm2=float(areas_mm2[k, RISKY]),
            lean_deg=float(lean_deg[k]),
            height_mm=float(np.ptp(dot(corners, direction))),
            stairs_mm2=float(areas_mm2[k, STAIRS]),
            shadow_mm2=float(areas_mm2[k, SHADOW]),
        )
        for k, direction in enumerate(directions)
    ]


def _rank(orientation: Orientation) -> tuple[float, bool, float, tuple[float, float]]:
    x_deg, y_deg = orientation.turns_deg
    area = round(orientation.risky_mm2 / EQUAL_MM2) * EQUAL_MM2
    return area, not orientation.stable, round(abs(x_deg) + abs(y_deg), 6), (-round(x_deg, 6), -round(y_deg, 6))


def _facets(mesh: Mesh) -> Floats:
    """(k, 3) printing directions in which the model lies on a facet of its convex hull, without duplicates, largest facets
    first.
    """
    hull = convex_hull(mesh.vertices)
    order = np.lexsort((*hull.normals.T, -np.round(hull.areas_mm2, 6)))
    same = cos(radians(SAME_FACET_DEG))
    directions = np.zeros((0, 3))
    for direction in -hull.normals[order[hull.areas_mm2[order] > 0]]:
        if len(directions) == MOST_FACETS:
            break
        if direction @ UP < same and not np.any(directions @ direction > same):
            directions = np.concatenate([directions, direction[None]])
    return directions


def _lean_deg(mesh: Mesh, directions: Floats) -> Floats:
    """(k,) the least angle by which the model, leaned to any side, has its centre of mass over the edge of its base; below 0
    where it is not over the base to begin with.

    The base extends to each of 64 sides as far as the vertices within the tolerance of the plate.
    """
    hull = convex_hull(mesh.vertices)
    centre = centre_of_mass(mesh)
    lean_deg = np.zeros(len(directions))
    for k, direction in enumerate(directions):
        heights = hull.vertices @ direction
        lowest = float(heights.min())
        base = hull.vertices[heights <= lowest + PLATE_TOLERANCE_MM] - centre
        lean_deg[k] = tipping_angle_deg(base @ _rotation(direction)[:2].T, float(centre @ direction) - lowest)
    return lean_deg


def tipping_angle_deg(base: Floats, height_mm: float) -> float:
    """The least angle by which a body, leaned to any of 64 sides, has its centre of mass over the edge of its base; below 0 where
    it is not over the base to begin with. base: (n, 2) points of it, measured from below the centre; height_mm: of the centre
    above it.
    """
    return degrees(atan2(float((base @ SIDES).max(axis=0).min()), height_mm))


@cached_with_mesh
def diameter_mm(mesh: Mesh) -> float:
    """The greatest distance between two vertices of the convex hull; of a fine hull only a sample is compared."""
    corners = convex_hull(mesh.vertices).vertices
    corners = corners[:: max(1, len(corners) // MOST_CORNERS)]
    return float(np.sqrt(((corners[:, None] - corners) ** 2).sum(axis=2).max()))


def centre_of_mass(mesh: Mesh) -> Floats:
    """(3,) centre of mass by the divergence theorem: tetrahedra from the box's centre to every face."""
    middle = 0.5 * (mesh.bounds_mm[0] + mesh.bounds_mm[1])
    a, b, c = (mesh.vertices[mesh.faces[:, k]] - middle for k in range(3))
    volumes = np.einsum("ij,ij->i", a, np.cross(b, c)) / 6.0
    centre: Floats = middle + volumes @ (a + b + c) / (4.0 * volumes.sum())
    return centre


def azimuth_rad(mesh: Mesh) -> float:
    """Bearing of the first nonzero moment of a mesh, radians. The integral over the surface of (x + i y)^m about the centre of
    mass points in m directions at once, of which the higher moments choose one; 0 if all vanish, as for a body of revolution.

    Over a triangle with the corners a, b, c as complex numbers it is 2 A m! / (m + 2)! times the sum of all a^i b^j c^k with i +
    j + k = m, A its area.
    """
    moments = _moments(mesh)
    order = next((m for m in range(1, HIGHEST + 1) if abs(moments[m - 1]) > PLAIN), 0)
    if order == 0:
        return 0.0
    bearings = (np.angle(moments[order - 1]) + 2.0 * np.pi * np.arange(order)) / order
    powers = np.arange(1, HIGHEST + 1)
    along = np.real(np.exp(-1j * np.outer(bearings, powers)) @ moments)
    return float(bearings[int(np.argmax(np.round(along, 6)))])


def _moments(mesh: Mesh) -> np.ndarray:
    """(6,) moments, each as a share of its greatest possible value."""
    centre = centre_of_mass(mesh)
    z = (mesh.vertices[:, 0] - centre[0]) + 1j * (mesh.vertices[:, 1] - centre[1])
    z /= np.abs(z).max()
    sums = [np.ones(len(mesh.faces), complex), *np.zeros((HIGHEST, len(mesh.faces)), complex)]
    for corner in z[mesh.faces].T:  # complete homogeneous polynomials, one more variable in each pass
        for m in range(1, HIGHEST + 1):
            sums[m] = sums[m] + corner * sums[m - 1]
    total = mesh.areas_mm2.sum()
    scale = [2.0 * factorial(m) / factorial(m + 2) for m in range(1, HIGHEST + 1)]
    return np.array([scale[m - 1] * (mesh.areas_mm2 @ sums[m]) / total for m in range(1, HIGHEST + 1)])


def _turns(direction: Floats) -> tuple[float, float]:
    """Turns about x, then y, degrees, that bring a unit direction upright."""
    x, y, z = (float(value) for value in direction)
    across = hypot(y, z)
    about_x = atan2(y, z) if across > 1e-6 else 0.0
    return degrees(about_x), degrees(atan2(-x, across))


def _rotation(direction: Floats) -> Floats:
    """(3, 3) rotation that brings a unit direction upright by turns about x, then y."""
    x, y = (radians(value) for value in _turns(direction))
    about_x = np.array([[1.0, 0.0, 0.0], [0.0, cos(x), -sin(x)], [0.0, sin(x), cos(x)]])
    about_y = np.array([[cos(y), 0.0, sin(y)], [0.0, 1.0, 0.0], [-sin(y), 0.0, cos(y)]])
    rotation: Floats = about_y @ about_x
    return rotation


def side_in_words(orientation: Orientation) -> str:
    """The side on which the model lies, named by an observer in front of its present orientation; "" if it leans."""
    faces = {(0, 0, 1): "upside down", (0, 0, -1): "as it stands", (1, 0, 0): "on its right side", (-1, 0, 0): "on its left side"}
    faces |= {(0, 1, 0): "on its back", (0, -1, 0): "on its front"}
    down = -orientation.rotation[2]
    side = max(faces, key=lambda face: float(np.dot(down, face)))
    return faces[side] if float(np.dot(down, side)) >= cos(radians(LYING_DEG)) else ""


def in_words(orientation: Orientation, held: bool = False) -> str:
    """How the model is turned, in the order of process.rotate_deg, and whether it needs a raft. held: the plate holds it."""
    turns = [(f"{round(angle, 1) + 0.0:g}", axis) for angle, axis in zip(orientation.turns_deg, "xy", strict=True)]
    words = ", then ".join(f"{angle} about {axis}" for angle, axis in turns if angle != "0")
    return (f"turned {words}" if words else "as it stands") + (
        "" if held or orientation.stable else ", rests nowhere without a raft"
    )
