"""Deposit: how much of the deposited plastic lies inside the model, or within a tolerance of it."""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from machine.dryrun.dryrun import DryRun
from mdp.kernels.arrays import floats, longs
from mdp.kernels.kernel import helper, kernel
from mdp.mesh import Floats, Mesh
from slicer.geometry.polyline import squared_distance_in_space
from slicer.paths import Kind

AROUND = (Kind.SKIRT.value, Kind.SUPPORT.value, Kind.SUPPORT_INTERFACE.value, Kind.PURGE.value)
PIECE_MM = 1.0
ASIDE = np.array([3.1e-7, 1.7e-7])  # keeps upright rays off the edges of CAD faces


@dataclass(frozen=True, eq=False)
class Share:
    """Extruded length within tolerance of the model, of all that belongs to it; outside: (m,) segments that are not."""

    inside_mm: float
    total_mm: float
    farthest_mm: float
    outside: NDArray[np.bool_]

    @property
    def share(self) -> float:
        """0..1; 1 when nothing was extruded."""
        return self.inside_mm / self.total_mm if self.total_mm > 0 else 1.0


def inside_share(run: DryRun, mesh: Mesh, tolerance_mm: float) -> Share:
    """The share of extruded length, skirt and support aside, that lies in the solid or within tolerance_mm of it.

    Judged by the midpoints of pieces of at most 1 mm. mesh: the closed model in the workpiece frame. farthest_mm: the
    greatest distance of a midpoint outside the model, looked for up to four tolerances and at least 1 mm.
    """
    own = np.flatnonzero([name not in AROUND for name in run.segment_type])
    middles, lengths, which = _pieces(run.deposited.segments(own))
    outside = outside_mm(middles, mesh, max(4.0 * tolerance_mm, 1.0))
    within = outside <= tolerance_mm
    marked = np.zeros(len(run.segment_row), dtype=np.bool_)
    marked[own[which[~within]]] = True
    return Share(float(lengths[within].sum()), float(lengths.sum()), float(outside.max(initial=0.0)), marked)


def _pieces(segments: Floats) -> tuple[Floats, Floats, NDArray[np.int64]]:
    """Midpoints and lengths of (m, 2, 3) segments cut into pieces of at most PIECE_MM, and which segment each is of."""
    steps = segments[:, 1] - segments[:, 0]
    length = np.linalg.norm(steps, axis=1)
    counts = np.maximum(np.ceil(length / PIECE_MM), 1).astype(np.int64)
    which = np.repeat(np.arange(len(segments)), counts)
    place = np.arange(len(which)) - np.repeat(np.cumsum(counts) - counts, counts)
    middles: Floats = segments[which, 0] + ((place + 0.5) / counts[which])[:, None] * steps[which]
    return middles, length[which] / counts[which], which


def outside_mm(points: Floats, mesh: Mesh, most_mm: float) -> Floats:
    """(n,) distances of (n, 3) points from a closed mesh's solid: 0 inside, at most most_mm (farther is not looked for)."""
    corners = mesh.vertices[mesh.faces]
    distances = np.zeros(len(points))
    out = np.flatnonzero(~inside(points, mesh))
    near = _columns(corners, max(most_mm, _column_mm(mesh)), most_mm)
    distances[out], _ = _nearest(points[out], corners, near, most_mm)
    return distances


def nearest_faces(points: Floats, mesh: Mesh, most_mm: float) -> tuple[Floats, NDArray[np.int64]]:
    """(n,) distances of (n, 3) points from a mesh's surface, at most most_mm, and (n,) its nearest faces (0: none is near)."""
    corners = mesh.vertices[mesh.faces]
    return _nearest(points, corners, _columns(corners, max(most_mm, _column_mm(mesh)), most_mm), most_mm)


def signed(points: Floats, distances: Floats, mesh: Mesh) -> Floats:
    """(n,) distances of (n, 3) points from the surface, below 0 inside."""
    return np.where(inside(points, mesh), -distances, distances)


def inside(points: Floats, mesh: Mesh) -> NDArray[np.bool_]:
    """(n,) whether (n, 3) points lie in a closed mesh's solid."""
    corners = mesh.vertices[mesh.faces]
    size = max(_column_mm(mesh), float(np.ptp(mesh.vertices[:, :2], axis=0).max()) / 400.0)
    within: NDArray[np.bool_] = _winding(points, corners, _columns(corners, size, 0.0), ASIDE) > 0
    return within


def _column_mm(mesh: Mesh) -> float:
    """Side of a column in which few faces lie one above the other."""
    return float(np.sqrt(np.ptp(mesh.vertices[:, :2], axis=0).prod() / max(len(mesh.faces), 1)))


class Columns(NamedTuple):
    """A lattice over x and y with the faces of each cell: those of cell k are faces[first[k] : first[k + 1]]."""

    origin: Floats
    size: float
    shape: NDArray[np.int64]
    first: NDArray[np.int64]
    faces: NDArray[np.int64]


def _columns(corners: Floats, size: float, grow: float) -> Columns:
    """Columns of a size; a face belongs to those that its box, grown, touches."""
    low, high = corners[:, :, :2].min(axis=1), corners[:, :, :2].max(axis=1)
    origin = low.min(axis=0) - 1e-3
    shape = (np.floor((high.max(axis=0) + 1e-3 - origin) / size) + 1).astype(np.int64)
    a = np.clip(np.floor((low - grow - origin) / size), 0, shape - 1).astype(np.int64)
    b = np.clip(np.floor((high + grow - origin) / size), 0, shape - 1).astype(np.int64)
    wide = b - a + 1
    counts = wide[:, 0] * wide[:, 1]
    face = np.repeat(np.arange(len(low)), counts)
    step = np.arange(len(face)) - np.repeat(np.cumsum(counts) - counts, counts)
    cell = (a[face, 0] + step % wide[face, 0]) * shape[1] + a[face, 1] + step // wide[face, 0]
    order = np.argsort(cell, kind="stable")
    return Columns(origin, size, shape, np.searchsorted(cell[order], np.arange(shape.prod() + 1)), face[order])


@kernel
def _winding(points: Floats, corners: Floats, columns: Columns, aside: Floats) -> NDArray[np.int64]:
    """(n,) how often the surface winds about each point: signed crossings of the ray straight up."""
    winding = longs(len(points), 0)
    origin, size, shape, first, faces = columns
    for i in range(len(points)):
        x, y, z = points[i, 0] + aside[0], points[i, 1] + aside[1], points[i, 2]
        cx, cy = int(np.floor((x - origin[0]) / size)), int(np.floor((y - origin[1]) / size))
        if cx < 0 or cy < 0 or cx >= shape[0] or cy >= shape[1]:
            continue
        cell = cx * shape[1] + cy
        for k in range(first[cell], first[cell + 1]):
            a, b, c = corners[faces[k], 0], corners[faces[k], 1], corners[faces[k], 2]
            u = (b[0] - x) * (c[1] - y) - (b[1] - y) * (c[0] - x)
            v = (c[0] - x) * (a[1] - y) - (c[1] - y) * (a[0] - x)
            w = (a[0] - x) * (b[1] - y) - (a[1] - y) * (b[0] - x)
            hit = (u > 0 and v > 0 and w > 0) or (u < 0 and v < 0 and w < 0)
            if hit and (u * a[2] + v * b[2] + w * c[2]) / (u + v + w) > z:
                winding[i] += 1 if u > 0 else -1
    return winding


@kernel
def _nearest(points: Floats, corners: Floats, columns: Columns, most: float) -> tuple[Floats, NDArray[np.int64]]:
    """(n,) distance of each point to the nearest face, at most `most`, and that face."""
    distances, nearest = floats(len(points), most), longs(len(points), 0)
    origin, size, shape, first, faces = columns
    for i in range(len(points)):
        p = points[i]
        cx = min(max(int(np.floor((p[0] - origin[0]) / size)), 0), shape[0] - 1)
        cy = min(max(int(np.floor((p[1] - origin[1]) / size)), 0), shape[1] - 1)
        cell = cx * shape[1] + cy
        for k in range(first[cell], first[cell + 1]):
            d = _to_triangle(p, corners[faces[k], 0], corners[faces[k], 1], corners[faces[k], 2])
            if d < distances[i]:
                distances[i], nearest[i] = d, faces[k]
    return distances, nearest


@helper
def _to_triangle(p: Floats, a: Floats, b: Floats, c: Floats) -> float:
    """Distance of a point from a triangle: inside its prism the height, else the nearest edge."""
    ab, ac, ap = b - a, c - a, p - a
    n = _cross(ab, ac)
    nn = _dot(n, n)
    if nn > 1e-24:
        v, w = _dot(_cross(ap, ac), n), _dot(_cross(ab, ap), n)
        if v >= 0 and w >= 0 and v + w <= nn:
            return float(abs(_dot(ap, n)) / np.sqrt(nn))
    nearest = min(squared_distance_in_space(p, a, b), squared_distance_in_space(p, b, c), squared_distance_in_space(p, c, a))
    return float(np.sqrt(nearest))


@helper
def _dot(a: Floats, b: Floats) -> float:
    return float(a[0] * b[0] + a[1] * b[1] + a[2] * b[2])


@helper
def _cross(a: Floats, b: Floats) -> Floats:
    return np.array([a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]])
