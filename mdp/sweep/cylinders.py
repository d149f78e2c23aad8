"""Cylinders: bores, pins and rounded corners of a model, fitted to its faces.

A cylinder in a mesh is a row of flat strips. Every edge between two strips runs along the axis, and the radius follows from its
fold and the widths of the strips: strips of the same width w that fold by an angle t lie on a circle of radius w / (2 sin(t /
2)).

        strip     edge
      ________ . ________           parallel edges of one strip that give the same
     /    w     t        \\          radius belong to one cylinder; a least-squares circle through
    /                     \\         all of them (Kasa 1976) verifies it
"""

from collections.abc import Sequence
from dataclasses import dataclass
from math import cos, radians

import numpy as np

from mdp.directions.revolution import find_revolution
from mdp.directions.unit_vectors import frame_across
from mdp.mesh import Floats, Indices, Ints, Mesh
from mdp.plane import Plane
from mdp.topology.components import connected_components
from mdp.topology.edges import opposites

# Cosines of the fold angles between strips: 45 degrees for a cylinder with eight sides, 0.4 for one with 900.
LEAST_FOLD, MOST_FOLD = cos(radians(0.4)), cos(radians(46.0))
PARALLEL = cos(radians(1.0))
SAME_RADIUS = 1.25  # greatest ratio of two radii given by edges of one strip: strips differ in width by at most a quarter
LEAST_ASKEW = 0.05  # sine of some 3 degrees
TOUCHED_MM = 0.05  # a plane that cuts no further into a cylinder leaves it intact
MOST_FACES = 200  # greatest number of faces in a strip; a strip cut by other bores has several, a wall or a plate many
TURNED_MM2 = 500.0  # area of a turned body that counts like a bore when it is cut askew; larger ones count more
SMOOTH = cos(radians(20.0))  # cosine of the folds between the pieces of a bent pipe, and beside a band of a round surface
SHORT = 0.15  # share of the radius: a hole in a thin sheet is shorter, too, but its rims are sharp
FEWEST = 4  # edges between strips: fewer are a chamfer, or a fillet of three facets
OFF_CIRCLE = 0.02  # share of the radius: the corners of a cylinder lie on it up to the rounding of a file
LEAST_TURN_DEG = 100.0  # covered by the strips: a quarter turn is a rounded edge, which needs no fit
LEAST_RADIUS_MM, MOST_BORE_MM, MOST_PIN_MM = 0.7, 25.0, 6.0  # sizes of screws, bearings, pegs; larger ones are the model's shape


@dataclass(frozen=True, eq=False)
class Cylinder:
    """A bore, a pin, or a whole turned body: unit axis (3,), its centre (3,), radius, half its length, whether the material
    surrounds it, (k,) its faces, and the weight of cutting it askew.
    """

    axis: Floats
    middle: Floats
    radius_mm: float
    half_mm: float
    is_bore: bool
    faces: Ints
    weight: float = 1.0

    def is_crossed(self, plane: Plane) -> bool:
        """Whether a plane cuts the cylinder visibly askew."""
        return crossed_by([self], plane) > LEAST_ASKEW

    def reaches_below(self, plane: Plane) -> bool:
        """Whether any of the cylinder lies below a plane."""
        cosine = abs(float(plane.normal @ self.axis))
        reach_mm = self.half_mm * cosine + self.radius_mm * float(np.sqrt(max(1.0 - cosine * cosine, 0.0)))
        return float(plane.normal @ self.middle) - plane.offset_mm < reach_mm

    @property
    def in_words(self) -> str:
        """Its kind and diameter in words.

        >>> Cylinder(np.array([0.0, 0, 1]), np.zeros(3), 4.0, 5.0, True, np.zeros(0, np.int32)).in_words
        'a bore of 8 mm'
        """
        kind = "bore" if self.is_bore else "turned body"
        return f"a {kind} of {round(2.0 * self.radius_mm, 1):g} mm"


@dataclass(frozen=True, eq=False)
class _Folds:
    """Edges between strips, one row each: the strips on both sides (e, 2), a face of each (e, 2), unit direction (e, 3), centre
    (e, 3) and the radius that each gives.
    """

    strips: Indices
    faces: Indices
    along: Floats
    middle: Floats
    radius_mm: Floats


def crossings(cylinders: Sequence[Cylinder], directions: Floats, offsets_mm: Floats) -> Floats:
    """(k, n) weighted number of cylinders cut askew by planes at (k, n) offsets along (k, 3) directions: each counts its weight
    times the sine of the angle between axis and direction, since a cut square to its axis keeps it round.

    >>> upright = Cylinder(np.array([0.0, 0, 1]), np.zeros(3), 4.0, 5.0, True, np.zeros(0, np.int32))
    >>> crossings([upright], np.array([[1.0, 0, 0], [0, 0, 1]]), np.array([[3.9, 4.1], [4.9, 5.1]])).tolist()
    [[1.0, 0.0], [0.0, 0.0]]
    """
    total = np.zeros(offsets_mm.shape)
    for cylinder in cylinders:
        cosines = np.abs(directions @ cylinder.axis)
        sines = np.sqrt(np.maximum(1.0 - cosines * cosines, 0.0))
        reach_mm = cylinder.half_mm * cosines + cylinder.radius_mm * sines - TOUCHED_MM
        cut = np.abs(offsets_mm - (directions @ cylinder.middle)[:, None]) < reach_mm[:, None]
        total += cut * (cylinder.weight * sines[:, None])
    return total


def crossed_by(cylinders: Sequence[Cylinder], plane: Plane) -> float:
    """Weighted number of cylinders that one plane cuts askew, see crossings."""
    return float(crossings(cylinders, plane.normal[None], np.array([[plane.offset_mm]]))[0, 0])


def spoiled_by_cuts(mesh: Mesh) -> tuple[Cylinder, ...]:
    """The cylinders that cuts of a closed mesh should not pass askew: its bores, and the turned body that makes up nearly all of
    it. Pins are left out: the arms and struts of a model look the same, and are where it is cut.
    """
    bores = tuple(cylinder for cylinder in find_cylinders(mesh) if cylinder.is_bore)
    body = find_revolution(mesh)
    if body is None or not body.is_all:
        return bores
    weight = max(body.area_mm2 / TURNED_MM2, 1.0)
    return (*bores, Cylinder(body.axis, body.middle, body.radius_mm, body.half_mm, False, body.faces, weight))


def find_cylinders(mesh: Mesh) -> tuple[Cylinder, ...]:
    """The cylinders of a closed mesh, ordered by first face."""
    neighbours = opposites(mesh.faces).reshape(-1, 3) // 3
    strips, folds = _folds(mesh, neighbours)
    label = connected_components(len(folds.radius_mm), *_matching_folds(folds))
    order = np.argsort(label, kind="stable")
    rows = np.split(order, np.flatnonzero(np.diff(label[order])) + 1)
    fitted = (_fit(mesh, strips, folds, row) for row in rows if len(row) >= FEWEST)
    cylinders = [cylinder for cylinder in fitted if cylinder is not None and not _is_band(mesh, neighbours, cylinder)]
    bent = _bent(mesh, neighbours, cylinders)
    return tuple(
        sorted((c for place, c in enumerate(cylinders) if place not in bent), key=lambda cylinder: int(cylinder.faces.min()))
    )


def _is_band(mesh: Mesh, neighbours: Ints, cylinder: Cylinder) -> bool:
    """Whether a short cylinder is only a band of a round surface, which continues smoothly at its rims."""
    if 2.0 * cylinder.half_mm > SHORT * cylinder.radius_mm:
        return False
    inside = np.isin(neighbours[cylinder.faces], cylinder.faces)
    row, corner = np.nonzero(~inside)
    face = cylinder.faces[row]
    smooth = (mesh.normals[face] * mesh.normals[neighbours[face, corner]]).sum(axis=1) > SMOOTH
    return float(smooth.mean()) > 0.5


def _bent(mesh: Mesh, neighbours: Ints, cylinders: Sequence[Cylinder]) -> set[int]:
    """Indices of the cylinders that continue in another one of the same radius: pieces of a ring or a bent pipe."""
    owner = np.full(len(mesh.faces), -1, np.int32)
    for place, cylinder in enumerate(cylinders):
        owner[cylinder.faces] = place
    face, corner = np.nonzero((owner >= 0)[:, None] & (owner[neighbours] >= 0) & (owner[neighbours] != owner[:, None]))
    across = neighbours[face, corner]
    smooth = (mesh.normals[face] * mesh.normals[across]).sum(axis=1) > SMOOTH
    radii, axes = np.array([c.radius_mm for c in cylinders]), np.array([c.axis for c in cylinders])
    here, there = owner[face[smooth]], owner[across[smooth]]
    alike = (radii[here] < SAME_RADIUS * radii[there]) & (radii[there] < SAME_RADIUS * radii[here]) if len(here) else smooth[:0]
    turned = np.abs((axes[here] * axes[there]).sum(axis=1)) < PARALLEL if len(here) else smooth[:0]
    return set(here[alike & turned].tolist())


def _folds(mesh: Mesh, neighbours: Ints) -> tuple[Indices, _Folds]:
    """(m,) strip of each face, and the edges at which a surface folds as between the strips of a cylinder."""
    face, corner = np.nonzero(neighbours >= 0)
    across = neighbours[face, corner]
    once = face < across
    face, corner, across = face[once], corner[once], across[once]
    cosines = (mesh.normals[face] * mesh.normals[across]).sum(axis=1)
    strips = connected_components(len(mesh.faces), face[cosines >= LEAST_FOLD], across[cosines >= LEAST_FOLD])
    folded = (cosines < LEAST_FOLD) & (cosines > MOST_FOLD)
    face, corner, across, cosines = face[folded], corner[folded], across[folded], cosines[folded]
    start = mesh.vertices[mesh.faces[face, corner]]
    edge = mesh.vertices[mesh.faces[face, (corner + 1) % 3]] - start
    lengths = np.maximum(np.linalg.norm(edge, axis=1), 1e-9)
    pairs = np.stack([face, across], axis=1)
    widths = np.stack([_widths_mm(mesh, strips, side, edge / lengths[:, None]) for side in pairs.T])
    radius_mm = widths.mean(axis=0) / (2.0 * np.sqrt(0.5 * (1.0 - cosines)))
    even = (widths.max(axis=0) < SAME_RADIUS * widths.min(axis=0)) & (radius_mm < 2.0 * MOST_BORE_MM)
    pairs = pairs[even]
    return strips, _Folds(strips[pairs], pairs, (edge / lengths[:, None])[even], (start + 0.5 * edge)[even], radius_mm[even])


def _widths_mm(mesh: Mesh, strips: Indices, face: Indices, along: Floats) -> Floats:
    """(e,) width of the strips that faces belong to, across (e, 3) directions along them; infinite for a strip with too many
    faces.
    """
    order, counts = np.argsort(strips, kind="stable"), np.bincount(strips, minlength=len(strips))
    starts, size = (np.cumsum(counts) - counts)[strips[face]], counts[strips[face]]
    size = np.where(size <= MOST_FACES, size, 1)
    row = np.repeat(np.arange(len(face)), size)
    inside = order[starts[row] + np.arange(len(row)) - np.repeat(np.cumsum(size) - size, size)]
    across = np.cross(mesh.normals[face], along)
    heights = np.einsum("fci,fi->fc", mesh.vertices[mesh.faces[inside]], across[row])
    begins = np.cumsum(size) - size
    widths = np.maximum.reduceat(heights.max(axis=1), begins) - np.minimum.reduceat(heights.min(axis=1), begins)
    widths[counts[strips[face]] > MOST_FACES] = np.inf
    return widths


def _matching_folds(folds: _Folds) -> tuple[Indices, Indices]:
    """Pairs of edges that belong to one cylinder: of one strip, parallel, with equal radius."""
    strip, fold = folds.strips.ravel(), np.repeat(np.arange(len(folds.strips)), 2)
    order = np.argsort(strip, kind="stable")
    strip, fold = strip[order], fold[order]
    first, second = [], []
    for apart in range(1, 4):  # a region with more than four edges is usually no strip
        same = np.flatnonzero(strip[:-apart] == strip[apart:])
        a, b = fold[same], fold[same + apart]
        parallel = np.abs(np.einsum("ij,ij->i", folds.along[a], folds.along[b])) > PARALLEL
        ratio = folds.radius_mm[a] / folds.radius_mm[b]
        alike = parallel & (ratio < SAME_RADIUS) & (ratio > 1.0 / SAME_RADIUS)
        first.append(a[alike])
        second.append(b[alike])
    return np.concatenate(first), np.concatenate(second)


def _fit(mesh: Mesh, strips: Indices, folds: _Folds, rows: Indices) -> Cylinder | None:
    """The cylinder through some edges; None if they do not lie on one."""
    signs = np.sign(folds.along[rows] @ folds.along[rows[0]])
    axis = (folds.along[rows] * signs[:, None]).mean(axis=0)
    axis /= np.linalg.norm(axis)
    across = frame_across(axis)
    points = folds.middle[rows] @ across.T
    # Kasa: |p|^2 = 2 c.p + (r^2 - |c|^2) is linear in the centre c
    solved = np.linalg.lstsq(np.column_stack([2.0 * points, np.ones(len(points))]), (points**2).sum(axis=1), rcond=None)[0]
    centre = solved[:2]
    radius_mm = float(np.sqrt(max(solved[2] + centre @ centre, 0.0)))
    off_mm = np.abs(np.linalg.norm(points - centre, axis=1) - radius_mm)
    is_bore = bool((mesh.normals[folds.faces[rows, 0]] @ across.T * (points - centre)).sum() < 0.0)
    if not LEAST_RADIUS_MM <= radius_mm <= (MOST_BORE_MM if is_bore else MOST_PIN_MM) or off_mm.max() > OFF_CIRCLE * radius_mm:
        return None
    angles = np.sort(np.unique(np.round(np.degrees(np.arctan2(*(points - centre).T)), 3)))
    gaps = np.diff(np.append(angles, angles[0] + 360.0))
    if len(angles) < FEWEST or 360.0 - gaps.max() + np.median(gaps) < LEAST_TURN_DEG:
        return None
    faces = np.flatnonzero(np.isin(strips, np.unique(folds.strips[rows])))
    along = mesh.vertices[mesh.faces[faces]] @ axis
    middle = centre @ across + 0.5 * (along.min() + along.max()) * axis
    return Cylinder(axis, middle, radius_mm, 0.5 * float(np.ptp(along)), is_bore, faces.astype(np.int32))
