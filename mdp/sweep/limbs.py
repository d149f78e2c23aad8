"""Limbs: the pieces above a plane that are worth cutting off alone, the effect of such a cut, and the faces of each piece.
mdp.sweep.pieces traces the pieces (numba kernels).
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import Any, NamedTuple

import numpy as np

from mdp.kernels.arrays import dot, flags, ints
from mdp.kernels.kernel import helper, kernel, no_nrt
from mdp.kernels.threads import in_threads
from mdp.mesh import Floats, Indices, Ints, Mesh
from mdp.overhang import Mask
from mdp.plane import Plane, normals_and_offsets
from mdp.sweep.components import LEAST_CONTACT_AREA_MM2, before
from mdp.sweep.crossing import find_heights
from mdp.sweep.cylinders import Cylinder, crossed_by
from mdp.sweep.facets import Blemishes, Layout
from mdp.sweep.pieces import (
    AREAS,
    MOMENT,
    NONE,
    RESIDUAL,
    RIM,
    SECTION,
    STAIRS,
    STAIRS_UP,
    SUMS,
    UP,
    Pieces,
    begin,
    descend,
    make_pieces,
    value,
    volume,
)
from mdp.sweep.sweep import Remainder, blemishes_of
from mdp.topology.components import root

MOST_JOINED = 6  # limbs that one plane cuts off together
MOST_ROWS = 48  # candidates per direction
SPAN = 8  # only the best of this many adjacent offsets is kept per limb: the head may collide at the best of all
TRADE_OFF = 2.0  # weight of finally lost area against saved area when the planes of a limb are compared
SAME_MM2 = 1e-6  # squared distance within which a point of a plane is a vertex
KEPT = 8  # cached vertex masks of the last planes: one check of a plane needs its mask several times
# For planes: (k,) offsets, the points of their limbs (k, MOST_JOINED, 3), infinite if unused, and the least height of a limb that
# needs a contact area.
PointedPlanes = tuple[Floats, Floats, float]
# The best candidates of k directions: the numbers of their offsets and their keys, lower is better, infinite if unused (k,
# MOST_ROWS), and the highest vertex of each limb that the plane cuts off (k, MOST_ROWS, MOST_JOINED), NONE if unused.
LimbRows = tuple[Ints, Floats, Ints]
CONTACT, LOWEST, EXISTS, ALONE = range(len(SUMS), len(SUMS) + 4)  # further columns besides the SUMS


class LimbGrid(NamedTuple):
    """Search grid for limbs and its constraints. directions (k, 3); step_mm of their offsets. For each direction: least_height_mm
    (k,) least z of the limb; keep_mm (k, s, 2) offsets that planes must avoid. seam_mm, cut_mm2: see CostTerms.
    least_interface_mm2: least contact area of a limb that is at least `fragment` steps high.
    """

    directions: Floats
    step_mm: float
    least_height_mm: Floats
    keep_mm: Floats
    seam_mm: float
    cut_mm2: float
    least_gain_mm2: float
    least_volume_mm3: float
    least_interface_mm2: float
    fragment: float


class LimbCandidates(NamedTuple):
    """Limbs that may be worth a cut, best first: (r,) row of the direction, (r,) offset, and (r, MOST_JOINED) the highest vertex
    of each limb that the plane cuts off, in the order of the facets, NONE if unused.
    """

    direction: Ints
    offset_mm: Floats
    tops: Ints


def find_limbs(remainder: Remainder, grid: LimbGrid, risky_below: float) -> LimbCandidates:
    """The limbs that are worth cutting off alone. Planes with a single piece above them are ordinary cuts and left out."""
    count = len(grid.directions)
    column, keys = np.zeros((count, MOST_ROWS), np.int32), np.full((count, MOST_ROWS), np.inf)
    tops = np.full((count, MOST_ROWS, MOST_JOINED), NONE, np.int32)
    surface = blemishes_of(remainder, grid.directions, risky_below), remainder.layout
    in_threads(_find_limbs, count, surface, grid, (column, keys, tops))
    direction, place = np.nonzero(np.isfinite(keys))
    order = np.lexsort((place, direction, keys[direction, place]))
    direction, place = direction[order], place[order]
    offset: Floats = column[direction, place] * np.float64(grid.step_mm)
    return LimbCandidates(direction.astype(np.int32), offset, tops[direction, place])


@dataclass(frozen=True, eq=False)
class LimbSums:
    """Sums for cuts of limbs, (r,) each, named as in sweep.Gains and sweep.Sweep. contact_mm2: least contact area of a limb that
    is not a fragment; exists: whether every limb still has something above its plane; alone: whether nothing else lies above it.
    """

    up_mm2: Floats
    residual_mm2: Floats
    stairs_up_mm2: Floats
    stairs_mm2: Floats
    section_mm2: Floats
    volume_mm3: Floats
    rim_mm: Floats
    contact_mm2: Floats
    lowest_mm: Floats
    exists: Mask
    alone: Mask
    crossed: Floats


def sum_limbs(remainder: Remainder, planes: Sequence[Plane], risky_below: float, fragment_mm: float) -> LimbSums:
    """Sums over the limbs of planes, without cutting. The points of the limbs must be vertices of them; limbs lower than
    fragment_mm may have any contact area.
    """
    sums = np.zeros((len(planes), ALONE + 1))
    surface = blemishes_of(remainder, normals_and_offsets(planes)[0], risky_below), remainder.layout
    in_threads(_sum_limbs, len(planes), surface, _pointed(planes, fragment_mm), sums)
    crossed = [crossed_by(cylinders_cut(remainder, remainder.cylinders, plane), plane) for plane in planes]
    columns: list[Any] = [*sums.T[:EXISTS], sums[:, EXISTS] > 0.0, sums[:, ALONE] > 0.0, np.array(crossed)]
    return LimbSums(*columns)


def _pointed(planes: Sequence[Plane], fragment_mm: float) -> PointedPlanes:
    points = np.full((len(planes), MOST_JOINED, 3), np.inf)
    for row, plane in enumerate(planes):
        if plane.limbs_mm is not None:
            points[row, : len(plane.limbs_mm)] = plane.limbs_mm
    return normals_and_offsets(planes)[1], points, fragment_mm


@lru_cache(KEPT)
def limb_vertices(remainder: Remainder, plane: Plane) -> Mask:
    """(n,) vertices that a plane cuts off a solid, in the order of its facets; read-only. A limb is the piece with the vertex
    nearest to its point.
    """
    if plane.limbs_mm is None:
        marked: Mask = plane.heights_mm(remainder.facets.mesh.vertices) > 0.0
    else:
        blemishes = blemishes_of(remainder, plane.normal[None], 0.0)
        marked = _mark_limbs(blemishes, remainder.layout, _pointed([plane], 0.0))
    marked.setflags(write=False)
    return marked


def limb_faces(remainder: Remainder, plane: Plane) -> Mask:
    """(m,) faces of a solid, in the order of its mesh, that extend into the part that a plane cuts off."""
    return _faces_with(remainder, limb_vertices(remainder, plane))


def limb_mesh(remainder: Remainder, plane: Plane) -> Mesh:
    """The faces of a solid that extend into the part that a plane cuts off, not trimmed at the plane: the mesh is open below."""
    used, faces = np.unique(remainder.mesh.faces[limb_faces(remainder, plane)], return_inverse=True)
    return Mesh(remainder.mesh.vertices[used], faces.reshape(-1, 3).astype(np.int32))


def limb_reach(remainder: Remainder, plane: Plane) -> Mask:
    """(m,) faces of a solid, in the order of its mesh, that a plane may cut when it is moved a little: those of its limbs, and
    faces below it from which the steepest ascent leads into a limb; all faces for a plane without limbs.
    """
    if plane.limbs_mm is None:
        return np.ones(len(remainder.mesh.faces), np.bool_)
    facets = remainder.facets
    heights, marked = plane.heights_mm(facets.mesh.vertices), limb_vertices(remainder, plane).copy()
    _spread_down(np.argsort(-heights, kind="stable"), heights, remainder.layout, marked)
    return _faces_with(remainder, marked)


def _faces_with(remainder: Remainder, marked: Mask) -> Mask:
    """(m,) faces of a solid, in the order of its mesh, with any marked vertex. marked: (n,) in the order of its facets."""
    facets = remainder.facets
    faces = np.zeros(len(remainder.mesh.faces), np.bool_)
    faces[facets.order] = marked[facets.mesh.faces].any(axis=1)
    return faces


@kernel
def _spread_down(highest_first: Indices, heights: Floats, layout: Layout, marked: Mask) -> None:
    """Give each vertex below the plane the mark of its highest neighbour."""
    for v in highest_first:
        if heights[v] <= 0.0:
            highest = v
            for at in range(layout.starts[v], layout.starts[v + 1]):
                if before(heights, layout.neighbours[at], highest, True):
                    highest = np.int64(layout.neighbours[at])
            marked[v] = highest != v and marked[highest]


def cylinders_cut(remainder: Remainder, cylinders: tuple[Cylinder, ...], plane: Plane) -> tuple[Cylinder, ...]:
    """The cylinders with a face in the part that a plane cuts off."""
    if plane.limbs_mm is None or not cylinders:
        return cylinders
    sources = np.unique(remainder.faces.sources[limb_faces(remainder, plane)])
    return tuple(cylinder for cylinder in cylinders if np.isin(cylinder.faces, sources).any())


@no_nrt
def _costs(pieces: Pieces, piece: int, seam_mm: float) -> tuple[float, float]:
    """Gain and loss of cutting off a piece, without the cost per cut. seam_mm: cost of a RIM in steps."""
    stairs, seam = value(pieces, piece, STAIRS), seam_mm * value(pieces, piece, RIM)
    residual = value(pieces, piece, RESIDUAL) + stairs + seam
    stairs_up = value(pieces, piece, STAIRS_UP)
    return float(value(pieces, piece, UP) + stairs_up - residual), float(residual - min(stairs, stairs_up))


@no_nrt
def _keep_row(out: LimbRows, row: int, key: float, column: int, tops: Ints) -> None:
    """Keep a candidate if it is the best of its limbs within a span of offsets; in a full table it replaces the worst one. A
    candidate with an infinite key is dropped.
    """
    columns, keys, kept_tops = out[0][row], out[1][row], out[2][row]
    same, worst = NONE, 0
    for k in range(MOST_ROWS):
        alike = columns[k] // SPAN == column // SPAN
        for limb in range(len(tops)):
            alike = alike and kept_tops[k, limb] == tops[limb]
        same = k if alike else same
        worst = k if keys[k] > keys[worst] else worst
    place = worst if same == NONE else same
    if key < keys[place]:
        keys[place], columns[place] = key, column
        for limb in range(len(tops)):
            kept_tops[place, limb] = tops[limb]


@no_nrt
def _is_allowed(grid: LimbGrid, row: int, offset_mm: float) -> bool:
    """Whether a plane avoids the [[keep]] zones."""
    allowed = True
    for span in range(grid.keep_mm.shape[1]):
        allowed = allowed and not (grid.keep_mm[row, span, 0] < offset_mm and offset_mm < grid.keep_mm[row, span, 1])
    return allowed


@no_nrt
def _may_be_cut(pieces: Pieces, piece: int, column: int, grid: LimbGrid, least_mm: float) -> bool:
    """Whether the head clears the table under a piece and its contact area is large enough."""
    if min(pieces.low[piece, 0], pieces.low[piece, 1]) < least_mm:
        pieces.low[piece, 0] = -np.inf  # below this column it never clears the table again
    high = pieces.heights[pieces.top[piece]] - column >= grid.fragment
    stands = value(pieces, piece, SECTION) >= (grid.least_interface_mm2 if high else LEAST_CONTACT_AREA_MM2)
    return bool(stands and pieces.low[piece, 0] > -np.inf)


@no_nrt
def _rank(gain: float, lost: float, grid: LimbGrid) -> float:
    """The key of a candidate, infinite if it gains too little. gain, lost: without the cost per cut."""
    gain, lost = gain - grid.cut_mm2, lost + grid.cut_mm2
    return TRADE_OFF * lost - gain if gain >= grid.least_gain_mm2 else np.inf


@no_nrt
def _offer_pieces(out: LimbRows, place: tuple[int, int], pieces: Pieces, grid: LimbGrid, tops: tuple[Ints, Ints]) -> None:
    """Keep every piece above a column that gains enough, and all gaining pieces together if they are several but not all.

    place: row and column; tops: scratch arrays for the vertices of several limbs and of one.
    """
    (row, column), (several, single) = place, tops
    seam_mm = grid.seam_mm / grid.step_mm
    gain, lost, cubic, many = 0.0, 0.0, 0.0, 0
    for limb in range(len(several)):
        several[limb] = NONE
    for at in range(pieces.counts[0]):
        piece = pieces.live[at]
        if not _may_be_cut(pieces, piece, column, grid, grid.least_height_mm[row]):
            continue
        own_gain, own_lost = _costs(pieces, piece, seam_mm)
        own_cubic = volume(pieces, piece, column) * grid.step_mm
        if own_cubic >= grid.least_volume_mm3:
            single[0] = pieces.top[piece]
            _keep_row(out, row, _rank(own_gain, own_lost, grid), column, single)
        if own_gain > 0.0 and many < len(several):
            several[many] = pieces.top[piece]
            many += 1
            gain += own_gain
            lost += own_lost
            cubic += own_cubic
    if 1 < many < pieces.counts[0] and cubic >= grid.least_volume_mm3:
        _keep_row(out, row, _rank(gain, lost, grid), column, several)


@kernel
def _find_limbs(begin_row: int, end_row: int, surface: tuple[Blemishes, Layout], grid: LimbGrid, out: LimbRows) -> None:
    """Fill the candidates of a range of directions."""
    blemishes, layout = surface
    pieces, tops, step_mm = make_pieces(blemishes, layout), (ints(MOST_JOINED, NONE), ints(MOST_JOINED, NONE)), grid.step_mm
    for row in range(begin_row, end_row):
        first, n = find_heights(layout.faces.points, grid.directions[row], step_mm, pieces.heights)
        if n == 0 or not np.isfinite(grid.least_height_mm[row]):
            continue
        order = begin(pieces, row, n)
        for column in range(n - 1, -1, -1):
            descend(pieces, column, order)
            if pieces.counts[0] > 1 and _is_allowed(grid, row, (first + column) * step_mm):
                _offer_pieces(out, (row, column), pieces, grid, tops)
        for place in range(MOST_ROWS):
            out[0][row, place] += first


@kernel
def _sum_limbs(begin_row: int, end_row: int, surface: tuple[Blemishes, Layout], planes: PointedPlanes, out: Floats) -> None:
    """Fill the rows of a range of planes with the SUMS over their limbs and the further columns of LimbSums."""
    pieces = make_pieces(surface[0], surface[1])
    for row in range(begin_row, end_row):
        chosen = _find_chosen(pieces, row, planes, SAME_MM2)
        contact, lowest = np.inf, np.inf
        for piece in chosen:
            for which in range(AREAS):
                out[row, which] += value(pieces, piece, which)
            out[row, RIM] += value(pieces, piece, RIM)
            out[row, MOMENT] += volume(pieces, piece, 0)
            lowest = min(lowest, pieces.low[piece, 0], pieces.low[piece, 1])
            if pieces.heights[pieces.top[piece]] >= planes[2]:
                contact = min(contact, value(pieces, piece, SECTION))
        out[row, CONTACT], out[row, LOWEST] = contact, lowest
        out[row, EXISTS] = 1.0 if len(chosen) > 0 else 0.0
        out[row, ALONE] = 1.0 if len(chosen) == pieces.counts[0] else 0.0


@kernel
def _mark_limbs(blemishes: Blemishes, layout: Layout, planes: PointedPlanes) -> Mask:
    """(n,) vertices of the limbs of one plane."""
    pieces = make_pieces(blemishes, layout)
    marked, chosen = flags(len(pieces.heights)), _find_chosen(pieces, 0, planes, np.inf)
    for v in range(len(marked)):
        if pieces.parent[v] >= 0:
            own = root(pieces.parent, v)
            for piece in chosen:
                marked[v] = marked[v] or own == piece
    return marked


@helper
def _find_chosen(pieces: Pieces, row: int, planes: PointedPlanes, farthest_mm2: float) -> Ints:
    """The pieces selected by the points of a plane, descended to its offset; empty if a point has no piece within the given
    squared distance.
    """
    d, points, heights = pieces.blemishes.directions[row], pieces.layout.faces.points, pieces.heights
    offsets_mm, limb_points, _ = planes
    dot(points[0], points[1], points[2], d, heights)
    for v in range(len(heights)):
        heights[v] -= offsets_mm[row]
    descend(pieces, 0, begin(pieces, row, 1))
    chosen, count = ints(MOST_JOINED, NONE), 0
    for limb in range(limb_points.shape[1]):
        if not np.isfinite(limb_points[row, limb, 0]):
            continue
        v = _nearest(limb_points[row, limb], points, pieces.parent, farthest_mm2)
        if v < 0:
            return chosen[:0]
        own, known = root(pieces.parent, v), False
        for other in range(count):
            known = known or chosen[other] == own
        if not known:
            chosen[count] = own
            count += 1
    return chosen[:count]


@no_nrt
def _nearest(point: Floats, points: Floats, parent: Ints, farthest_mm2: float) -> int:
    """The vertex above the plane that is nearest to a point; NONE if none is within the distance."""
    nearest, least = NONE, farthest_mm2
    for v in range(len(parent)):
        if parent[v] >= 0:
            x, y, z = points[0, v] - point[0], points[1, v] - point[1], points[2, v] - point[2]
            distance = x * x + y * y + z * z
            if distance < least:
                nearest, least = v, distance
    return nearest
