"""Symmetry: the vertical mirror planes of a model, and the mirror images of planes.

A mirror plane holds the centroid of the surface and is square to one of its principal axes, most often x or y. Moments that are
odd across it vanish; where they do, the surface itself is compared with its mirror image.
"""

from dataclasses import dataclass
from itertools import product
from math import radians, sin

import numpy as np
from numpy.typing import NDArray

from mdp.directions.unit_vectors import frame_across
from mdp.mesh import Floats, Mesh
from mdp.plane import Plane

UPRIGHT = 0.02  # greatest z of a mirror plane's normal: only vertical planes are useful above a table
ODD = 0.02  # odd moments of a model that may be symmetric, as shares of the even moments of the same order
SAMPLES, TRIED = 10000, 2000  # points on the surface, and how many of them are compared with the mirror image
CELL = 0.012  # share of the diagonal: tolerance between a surface and its mirror image
ALIKE_SHARE = 0.97  # share of the surface that has a mirror image
DIRECTIONS = np.array([[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.5**0.5, 0.5**0.5, 0.0], [0.5**0.5, -(0.5**0.5), 0.0]])
OFF_DEG = 15.0  # a plane that leans less across a mirror plane is meant to be square to it


@dataclass(frozen=True, eq=False)
class Mirror:
    """A mirror plane: its unit normal and its offset along it."""

    normal: Floats
    offset_mm: float

    def image(self, plane: Plane) -> Plane:
        """A plane's mirror image."""
        across, limbs_mm = float(plane.normal @ self.normal), plane.limbs_mm
        if limbs_mm is not None:
            limbs_mm = limbs_mm - 2.0 * (limbs_mm @ self.normal - self.offset_mm)[:, None] * self.normal
        return Plane(plane.normal - 2.0 * across * self.normal, plane.offset_mm - 2.0 * across * self.offset_mm, limbs_mm)

    def upright(self, plane: Plane, middle: Floats) -> Plane | None:
        """The nearest plane that is its own mirror image and meets the given one near `middle`; None if it would lean by more
        than OFF_DEG.
        """
        across = float(plane.normal @ self.normal)
        if not 0.0 < abs(across) < sin(radians(OFF_DEG)):
            return None
        normal = plane.normal - across * self.normal
        on_plane = middle - plane.heights_mm(middle[None])[0] * plane.normal
        normal = normal / np.linalg.norm(normal)
        return Plane(normal, float(normal @ on_plane), plane.limbs_mm)


def find_mirrors(mesh: Mesh) -> list[Mirror]:
    """The vertical mirror planes of a model, those across x and y first; a round model gets some of its many."""
    points, areas = _quadrature(mesh)
    centre = (points * areas[:, None]).sum(axis=0) / areas.sum()
    around = points - centre
    _, axes = np.linalg.eigh((around * areas[:, None]).T @ around)
    mirrors: list[Mirror] = []
    for axis in (*DIRECTIONS, *axes.T):
        fresh = all(abs(float(axis @ mirror.normal)) < 1.0 - 1e-3 for mirror in mirrors)
        if abs(axis[2]) < UPRIGHT and fresh and _is_even(around, areas, axis) and _is_mirrored(mesh, centre, axis):
            mirrors.append(Mirror(axis, float(axis @ centre)))
    return mirrors


def _quadrature(mesh: Mesh) -> tuple[Floats, Floats]:
    """(4 m, 3) points and (4 m,) areas whose sums are the surface's moments up to the third order, four points a face (Strang and
    Fix 1973).
    """
    corners = mesh.vertices[mesh.faces]
    shares = np.array([[1 / 3, 1 / 3, 1 / 3], [0.6, 0.2, 0.2], [0.2, 0.6, 0.2], [0.2, 0.2, 0.6]])
    points = np.einsum("pk,mki->pmi", shares, corners).reshape(-1, 3)
    areas: Floats = np.outer([-27 / 48, 25 / 48, 25 / 48, 25 / 48], mesh.areas_mm2).ravel()
    return points, areas


def _is_even(around: Floats, areas: Floats, axis: Floats) -> bool:
    """Whether the moments of the surface that are odd along an axis nearly vanish."""
    x, (y, z) = around @ axis, frame_across(axis) @ around.T
    for odd in (x * y, x * z, x**3, x * y * y, x * z * z, x * y * z):
        if abs(float((odd * areas).sum())) > ODD * float((np.abs(odd) * np.abs(areas)).sum()):
            return False
    return True


def _is_mirrored(mesh: Mesh, centre: Floats, axis: Floats) -> bool:
    """Whether nearly every point of the surface has its mirror image in a cell of space with surface, or in a neighbouring
    cell.
    """
    points = _spread(mesh) - centre
    size_mm = CELL * float(np.linalg.norm(mesh.bounds_mm[1] - mesh.bounds_mm[0]))
    image = points[:: SAMPLES // TRIED]
    image = image - 2.0 * (image @ axis)[:, None] * axis
    held = np.unique(_cells(points, size_mm))
    near = np.zeros(len(image), dtype=np.bool_)
    for shift in product((-1, 0, 1), repeat=3):
        near |= np.isin(_cells(image + size_mm * np.array(shift), size_mm), held)
    return float(near.mean()) >= ALIKE_SHARE


def _cells(points: Floats, size_mm: float) -> NDArray[np.int64]:
    """(n,) the number of each point's cell."""
    cells = np.floor(points / size_mm).astype(np.int64) + 1024
    numbers: NDArray[np.int64] = cells @ np.array([1, 4096, 4096 * 4096])
    return numbers


def _spread(mesh: Mesh) -> Floats:
    """(SAMPLES, 3) points spread evenly over the surface by area, deterministically."""
    along = np.cumsum(mesh.areas_mm2)
    index = np.arange(SAMPLES) + 0.5
    face = np.minimum(np.searchsorted(along, index / SAMPLES * along[-1]), len(along) - 1)
    u, v = (index * 0.7548776662466927) % 1.0, (index * 0.5698402909980532) % 1.0  # the sequence R2 of Roberts
    folded = u + v > 1.0
    u, v = np.where(folded, 1.0 - u, u), np.where(folded, 1.0 - v, v)
    a, b, c = (mesh.vertices[mesh.faces[face, k]] for k in range(3))
    points: Floats = a + u[:, None] * (b - a) + v[:, None] * (c - a)
    return points
