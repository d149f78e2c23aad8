"""Pieces: the connected pieces of a solid above a plane that moves down through it, and the sums over each (numba kernels).

A vertex that has been passed joins its neighbours above the plane (union-find). A face wholly above adds its sums to those of its
piece; faces that cross the plane add their shares above it at every offset. The first vertex of a void has solid above it and
joins the surface that a ray into the solid meets. The work per direction is linear in vertices, faces and crossings, as in the
sweep.
"""

from typing import NamedTuple

import numpy as np

from mdp.kernels.arrays import floats, ints, table
from mdp.kernels.kernel import helper, no_nrt
from mdp.kernels.sorting import counting_sort
from mdp.mesh import Floats, Indices, Ints
from mdp.overhang import step_share
from mdp.sweep.components import anchor_of, before
from mdp.sweep.crossing import Ramp, chord_at, column_over, moment_above, ramp_of, share_above, weigh_chord
from mdp.sweep.facets import Blemishes, Layout, times_along
from mdp.topology.components import root

NONE = -1
SUMS = UP, RESIDUAL, STAIRS_UP, STAIRS, SECTION, MOMENT, RIM = 0, 1, 2, 3, 4, 5, 6
Sorted = tuple[Indices, Indices]  # the starts of each column, and all items, column by column
Order = tuple[Sorted, Sorted]  # vertices and faces in the order in which the plane passes them
AREAS = 5  # the first five sums are areas: a face that crosses the plane adds the share above it


class Pieces(NamedTuple):
    """The pieces of a solid above a plane, and its blemishes. For each vertex: heights (n,) along the direction in steps; cosines
    (n,) of its normal with the direction; parent (n,) by union-find, NONE while it lies below the plane.

    weights (m, 7): contribution of each face to the SUMS. For the representative vertex of a piece: whole (n, 7) the SUMS of its
    faces wholly above; crossing (n, 7) the SUMS of the shares of crossing faces; top (n,) its highest vertex; low (n, 2) its
    least z, among vertices and on the plane. live: vertices that represent a piece, or did once; active: the faces that cross the
    plane; counts (2,): of live and active.
    """

    blemishes: Blemishes
    layout: Layout
    heights: Floats
    cosines: Floats
    parent: Ints
    weights: Floats
    whole: Floats
    crossing: Floats
    top: Ints
    low: Floats
    live: Ints
    active: Ints
    counts: Ints


@helper
def make_pieces(blemishes: Blemishes, layout: Layout) -> Pieces:
    """Empty arrays for the pieces of a solid."""
    size, faces = layout.faces.points.shape[1], layout.faces.corners.shape[1]
    heights, cosines, parent, top, low = floats(size, 0.0), floats(size, 0.0), ints(size, NONE), ints(size, 0), table(size, 2)
    weights, whole, crossing = table(faces, len(SUMS)), table(size, len(SUMS)), table(size, len(SUMS))
    live, active, counts = ints(size, 0), ints(faces, 0), ints(2, 0)
    return Pieces(blemishes, layout, heights, cosines, parent, weights, whole, crossing, top, low, live, active, counts)


@helper
def begin(pieces: Pieces, row: int, columns: int) -> Order:
    """Sort vertices and faces along a direction of the blemishes, with the plane above all of them. pieces.heights must be
    set."""
    normals, corners, d = pieces.layout.vertex_normals, pieces.layout.faces.corners, pieces.blemishes.directions[row]
    over, face_over = ints(len(pieces.heights), 0), ints(corners.shape[1], 0)
    for v in range(len(over)):
        over[v] = min(column_over(pieces.heights[v]), columns)
        pieces.cosines[v] = normals[0, v] * d[0] + normals[1, v] * d[1] + normals[2, v] * d[2]
        pieces.parent[v] = NONE
    for f in range(len(face_over)):
        face_over[f] = max(over[corners[0, f]], over[corners[1, f]], over[corners[2, f]])
    pieces.counts[0] = pieces.counts[1] = 0
    _weigh_faces(pieces.blemishes, row, d, pieces.weights)
    return counting_sort(over, columns + 1), counting_sort(face_over, columns + 1)


@helper
def descend(pieces: Pieces, column: int, order: Order) -> None:
    """Move the plane down to the next column."""
    (starts, vertices), (face_starts, faces) = order
    _enter(pieces, vertices[starts[column + 1] : starts[column + 2]])
    for at in range(face_starts[column + 1], face_starts[column + 2]):
        pieces.active[pieces.counts[1]] = faces[at]
        pieces.counts[1] += 1
    _cross(pieces, column)


@no_nrt
def value(pieces: Pieces, piece: int, which: int) -> float:
    """One of the SUMS of a piece; for MOMENT see `volume`."""
    total: float = pieces.whole[piece, which] + pieces.crossing[piece, which]
    return total


@no_nrt
def volume(pieces: Pieces, piece: int, column: int) -> float:
    """Volume of a piece above a column, in steps times mm2."""
    return float(value(pieces, piece, MOMENT) - column * pieces.whole[piece, SECTION])


@no_nrt
def _add(sums: Floats, a: int, other: Floats, b: int) -> None:
    for which in range(len(SUMS)):
        sums[a, which] += other[b, which]


@no_nrt
def _join(pieces: Pieces, a: int, b: int) -> None:
    """Join the pieces of two vertices; the lesser of their representatives represents both."""
    p, q = root(pieces.parent, a), root(pieces.parent, b)
    if p == q:
        return
    if q < p:
        p, q = q, p
    pieces.parent[q] = p
    _add(pieces.whole, p, pieces.whole, q)
    pieces.low[p, 0] = min(pieces.low[p, 0], pieces.low[q, 0])
    if before(pieces.heights, pieces.top[q], pieces.top[p], True):
        pieces.top[p] = pieces.top[q]


@helper
def _enter(pieces: Pieces, vertices: Indices) -> None:
    """Begin a piece at each vertex that the plane has passed, and join it to its neighbours above."""
    layout = pieces.layout
    starts, neighbours = layout.starts, layout.neighbours
    for v in vertices:
        pieces.parent[v], pieces.top[v] = v, v
        pieces.low[v, 0] = layout.triangles.vertices[v, 2]
        for which in range(len(SUMS)):
            pieces.whole[v, which] = 0.0
        pieces.live[pieces.counts[0]] = v
        pieces.counts[0] += 1
    for v in vertices:
        highest = True
        for at in range(starts[v], starts[v + 1]):
            w = neighbours[at]
            if pieces.parent[w] >= 0:
                highest = highest and not before(pieces.heights, w, v, True)
                _join(pieces, v, w)
        if highest and pieces.cosines[v] < 0.0:
            face = anchor_of(layout, int(v))
            if face >= 0:
                for corner in range(3):
                    w = layout.triangles.faces[face, corner]
                    if pieces.parent[w] >= 0:
                        _join(pieces, v, w)


@helper
def _weigh_faces(blemishes: Blemishes, row: int, d: Floats, weights: Floats) -> None:
    """Contribution of each face, when it lies wholly above, to the SUMS of its piece; without MOMENT; RIM is a weight."""
    faces = blemishes.faces
    normals, areas = faces.normals, faces.areas_mm2
    for f in range(len(areas)):
        cosine, counted = normals[0, f] * d[0] + normals[1, f] * d[1] + normals[2, f] * d[2], areas[f] * faces.counts[f]
        weights[f, UP] = counted if faces.risky[f] else 0.0
        weights[f, RESIDUAL] = counted * times_along(blemishes, row, f) if cosine < blemishes.risky_below else 0.0
        weights[f, SECTION] = areas[f] * cosine
        weights[f, STAIRS_UP], weights[f, STAIRS], weights[f, RIM] = 0.0, 0.0, 0.0
        if len(faces.seam_weights) > 0:
            weights[f, RIM] = 2.0 * areas[f] * faces.seam_weights[f] * weigh_chord(cosine, blemishes.feather)
        if len(faces.stair_weights) > 0:
            weights[f, STAIRS_UP] = areas[f] * faces.stair_weights[f] * step_share(normals[2, f])
            weights[f, STAIRS] = areas[f] * faces.stair_weights[f] * step_share(cosine)


@no_nrt
def _cross(pieces: Pieces, column: int) -> None:
    """Add the faces that now lie wholly above a column to their pieces, and the shares of those that cross it."""
    surface, heights, c = pieces.layout.triangles, pieces.heights, float(column)
    faces, points = surface.faces, surface.vertices
    _forget_crossing(pieces)
    still = 0
    for at in range(pieces.counts[1]):
        f = pieces.active[at]
        i, j, k = faces[f, 0], faces[f, 1], faces[f, 2]
        p, q, r = heights[i], heights[j], heights[k]
        ramp = ramp_of(p, q, r)
        own = root(pieces.parent, i if p == ramp[2] else (j if q == ramp[2] else k))
        if ramp[0] > c:
            _add(pieces.whole, own, pieces.weights, f)
            pieces.whole[own, MOMENT] += pieces.weights[f, SECTION] * (p + q + r) / 3.0
            pieces.whole[own, RIM] = 0.0  # only crossing faces have a rim
            continue
        pieces.active[still] = f
        still += 1
        _add_share(pieces, own, f, c, ramp)
        for corner in range(3):
            v, w = faces[f, corner], faces[f, corner - 2]
            if (heights[v] > c) != (heights[w] > c):
                at_z = points[v, 2] + (c - heights[v]) / (heights[w] - heights[v]) * (points[w, 2] - points[v, 2])
                pieces.low[own, 1] = min(pieces.low[own, 1], at_z)
    pieces.counts[1] = still


@no_nrt
def _forget_crossing(pieces: Pieces) -> None:
    """Clear the contributions of crossing faces, and drop vertices that no longer represent a piece."""
    still = 0
    for at in range(pieces.counts[0]):
        v = pieces.live[at]
        if pieces.parent[v] == v:
            pieces.live[still] = v
            still += 1
            pieces.low[v, 1] = np.inf
            for which in range(len(SUMS)):
                pieces.crossing[v, which] = 0.0
    pieces.counts[0] = still


@no_nrt
def _add_share(pieces: Pieces, piece: int, f: int, c: float, ramp: Ramp) -> None:
    """Add the share of a face above c to its piece."""
    crossing, weights, share = pieces.crossing, pieces.weights, share_above(c, ramp)
    for which in range(AREAS):
        crossing[piece, which] += weights[f, which] * share
    crossing[piece, MOMENT] += weights[f, SECTION] * moment_above(c, ramp)
    crossing[piece, RIM] += weights[f, RIM] * chord_at(c, ramp)
