"""Surfaces of revolution: the axis of a model that is mostly a turned body, such as a wheel, a vase or a chess piece.

A rotation about an axis c through q moves a point p by c x (p - q). It maps a surface of revolution to itself, so the motion is
square to the normal n everywhere: n . (m + c x p) = 0 with m = -c x q, which is linear in (c, m). The axis is found by least
squares (Pottmann and Wallner, Computational Line Geometry, 2001), with the weight of faces that do not fit reduced in each round.
"""

from dataclasses import dataclass
from math import cos, pi, radians, sin

import numpy as np

from mdp.directions.orientation import cached_with_mesh, centre_of_mass
from mdp.directions.unit_vectors import frame_across
from mdp.mesh import Floats, Ints, Mesh
from mdp.overhang import Mask

OFF = sin(radians(4.0))  # sine of the angle between a face and the motion: a thread climbs by 3 degrees
CAP = cos(radians(4.0))  # cosine of the angle between a face's normal and the axis: level faces fit every rotation
LEAST_SHARE = 0.5  # share of the surface, caps excluded, that is turned about the axis
MOSTLY = 0.8  # that share in a model that is hardly anything else
LEAST_SIDE = 0.15  # least share of the whole surface: less is the edge of a plate
ROUNDS = 12  # iterations of least squares
SECTORS, MOST_SECTORS, LEAST_SECTOR = 12, 10, 0.01  # around the axis; required sectors with faces, each with a share of the area
BESIDE_HANDLES = 0.95  # share of the area: the ends of handles and arms face away from the axis, too
SAME = cos(radians(10.0))  # cosine of the angle between axes that count as equal
LEVEL_DEG = 5.0  # tolerance of an axis: the fit to half a shell is some 2 degrees off


@dataclass(frozen=True, eq=False)
class Revolution:
    """A turned body that makes up most of a model: unit axis (3,), its centre (3,), radius and half length, mm, (k,) its faces,
    their area, and their share of the surface without level caps.
    """

    axis: Floats
    middle: Floats
    radius_mm: float
    half_mm: float
    faces: Ints
    area_mm2: float
    share: float

    @property
    def is_all(self) -> bool:
        """Whether the model is hardly anything else."""
        return self.share >= MOSTLY

    def is_square_to(self, direction: Floats) -> bool:
        """Whether the axis is vertical or horizontal for a printing direction."""
        return self.is_upright_along(direction) or abs(float(self.axis @ direction)) <= sin(radians(LEVEL_DEG))

    def is_upright_along(self, direction: Floats) -> bool:
        """Whether the axis is vertical for a printing direction."""
        return abs(float(self.axis @ direction)) >= cos(radians(LEVEL_DEG))


@cached_with_mesh
def find_revolution(mesh: Mesh) -> Revolution | None:
    """The turned body that makes up most of a closed mesh, searched from the principal axes of its surface; None if there is
    none, or if several axes fit, as on a ball.
    """
    middles, areas = mesh.vertices[mesh.faces].mean(axis=1), mesh.areas_mm2
    centre = centre_of_mass(mesh)
    points, normals = middles - centre, mesh.normals
    spread = (points * areas[:, None]).T @ points
    fits = [_fit(points, normals, areas, axis) for axis in np.linalg.eigh(spread)[1].T]
    share, axis, moment = max(fits, key=lambda fit: fit[0])
    if share < LEAST_SHARE or any(other >= LEAST_SHARE and abs(float(axis @ across)) < SAME for other, across, _ in fits):
        return None
    through = np.cross(axis, moment)
    faces = np.flatnonzero(_fits(points, normals, axis, moment)).astype(np.int32)
    corners = mesh.vertices[mesh.faces[faces]] - centre - through
    along = corners @ axis
    radii = np.linalg.norm(corners - along[..., None] * axis, axis=2).max(axis=1)
    order = np.argsort(radii, kind="stable")
    most = np.searchsorted(np.cumsum(areas[faces][order]), BESIDE_HANDLES * float(areas[faces].sum()))
    middle = centre + through + 0.5 * (along.min() + along.max()) * axis
    radius_mm, half_mm = float(radii[order[most]]), 0.5 * float(np.ptp(along))
    return Revolution(axis, middle, radius_mm, half_mm, faces, float(areas[faces].sum()), share)


def _fit(points: Floats, normals: Floats, areas: Floats, axis: Floats) -> tuple[float, Floats, Floats]:
    """Fit an axis from an initial one: the share of the surface without caps that is turned about it, the axis, and the moment m
    of its line.
    """
    moment = np.zeros(3)
    for _ in range(ROUNDS):
        off = _off(points, normals, axis, moment)
        weights = areas / (1.0 + (off / OFF) ** 2) ** 2
        axis, moment = _least_squares(points, normals, weights, axis)
    side = np.abs(normals @ axis) < CAP
    fits = _fits(points, normals, axis, moment)
    turned, beside = float(areas[fits].sum()), float(areas[side].sum())
    round_about = turned >= LEAST_SIDE * float(areas.sum()) and _surrounds(normals[fits], areas[fits], axis)
    return (turned / beside if round_about else 0.0), axis, moment


def _surrounds(normals: Floats, areas: Floats, axis: Floats) -> bool:
    """Whether faces point in nearly all directions around an axis."""
    across = normals @ frame_across(axis).T
    sectors = np.floor((np.arctan2(across[:, 1], across[:, 0]) / (2.0 * pi) % 1.0) * SECTORS).astype(np.int64) % SECTORS
    shares = np.bincount(sectors, areas, SECTORS) / float(areas.sum())
    return int((shares >= LEAST_SECTOR).sum()) >= MOST_SECTORS


def _least_squares(points: Floats, normals: Floats, weights: Floats, axis: Floats) -> tuple[Floats, Floats]:
    """The axis and moment that fit the weighted faces best; among equally good axes the one nearest to the present one."""
    rows = np.hstack([np.cross(points, normals), normals])
    matrix = (rows * weights[:, None]).T @ rows
    about, mixed, along = matrix[:3, :3], matrix[:3, 3:], matrix[3:, 3:]
    solved = np.linalg.pinv(along) @ mixed.T
    values, vectors = np.linalg.eigh(about - mixed @ solved)
    alike = vectors[:, values <= values[0] + 1e-6 * max(values[2], 0.0)]
    found = alike @ (alike.T @ axis)
    length = float(np.linalg.norm(found))
    found = vectors[:, 0] if length < 1e-6 else found / length
    moment = -solved @ found
    return found, moment - float(moment @ found) * found


def _off(points: Floats, normals: Floats, axis: Floats, moment: Floats) -> Floats:
    """(m,) the sine of the angle between each face and its motion about the axis."""
    motion = moment + np.cross(axis, points)
    length = np.linalg.norm(motion, axis=1)
    sines: Floats = np.abs((normals * motion).sum(axis=1)) / np.where(length > 0.0, length, 1.0)
    return sines


def _fits(points: Floats, normals: Floats, axis: Floats, moment: Floats) -> Mask:
    """(m,) whether each face is turned about the axis and is not a cap."""
    return (_off(points, normals, axis, moment) <= OFF) & (np.abs(normals @ axis) < CAP)
