"""Limbs: the pieces of a solid above each plane, and what each of them would save if it were cut off alone (numba kernels).

A direction's offsets are passed from the top down. Vertices that come to lie above join their neighbours that do (union-find),
and a face that comes to lie wholly above adds its sums to those of its piece. At each offset the faces that cross it add their
shares. The first vertex of a void has solid above it: it joins the surface that a ray into the solid meets. So vertices, faces
and crossings are what a direction costs, as in the sweep.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from mdp.kernels.arrays import dot, flags, floats, ints, table
from mdp.kernels.kernel import borrower, inlined, kernel, part
from mdp.kernels.sorting import counting_sort
from mdp.kernels.threads import in_threads
from mdp.mesh import Floats, Ints
from mdp.overhang import Mask
from mdp.plane import Plane
from mdp.stairs import step_share
from mdp.support_need.patches import CARRIES_ITSELF, NEEDS_SUPPORT, UNSUPPORTABLE
from mdp.sweep.components import Topology, anchor_of, before
from mdp.sweep.cylinders import Cylinder, crossings
from mdp.sweep.facets import Rings
from mdp.sweep.integrals import OffsetGrid, column_over, find_heights, moment_above, share_above
from mdp.sweep.rims import chord_at, weigh_chord
from mdp.sweep.sweep import Remainder, Scars, scars_of
from mdp.topology.union_find import root

LEAST_CONTACT_MM2 = 1e-6  # a piece that stands on less floats in the air
MOST_JOINED = 6  # limbs that one plane cuts off together
MOST_ROWS = 48  # candidates of a direction
SPAN = 8  # offsets of which a limb's best is kept, for the head may be in the way of the best of all
TRADE_OFF = 2.0  # by which the best of a limb's planes is chosen: area left for ever counts as so many times area made safe
SAME_MM2 = 1e-6  # squared distance of a limb's point from the vertex that it names
NONE = -1
SUMS = UP, RESIDUAL, STAIRS_UP, STAIRS, SECTION, MOMENT, RIM = 0, 1, 2, 3, 4, 5, 6


class Pieces(NamedTuple):
    """The pieces above a plane on its way down. parent (n,): see union_find, NONE: the vertex lies below. Of the vertex that
    stands for a piece: whole (n, 7) the SUMS over its faces wholly above, crossing (n, 7) those over the shares of faces that
    cross the plane, top (n,) its highest vertex, low (n, 2) its least z among vertices and where edges cross the plane. live:
    the vertices that stand for pieces or once did; active: the faces that cross; counts: how many of both there are."""

    parent: Ints
    whole: Floats
    crossing: Floats
    top: Ints
    low: Floats
    live: Ints
    active: Ints
    counts: Ints


class LimbGrid(NamedTuple):
    """Where limbs are looked for and what they must respect. directions (k, 3), step_mm of their offsets; for each direction
    (k,) least_height_mm, the least z of what is cut off, and keep_mm (k, s, 2) spans that planes keep out of;
    seam_mm, cut_mm2: see CostTerms; least_gain_mm2, least_volume_mm3; least_interface_mm2: the area that a limb stands on at
    least, any when it is lower than crumb steps."""

    directions: Floats
    step_mm: float
    least_height_mm: Floats
    keep_mm: Floats
    seam_mm: float
    cut_mm2: float
    least_gain_mm2: float
    least_volume_mm3: float
    least_interface_mm2: float
    crumb: float


class PointedPlanes(NamedTuple):
    """Planes: (k, 3) normals, (k,) offsets, and (k, MOST_JOINED, 3) a point of each limb, infinite: fewer; crumb_mm: a limb lower
    than this may stand on any area; farthest_mm2: the square of the distance at which a vertex still stands for a point."""

    normals: Floats
    offsets_mm: Floats
    points: Floats
    crumb_mm: float
    farthest_mm2: float


class LimbRows(NamedTuple):
    """Candidates of k directions: how many of each (k,), their columns and keys (k, MOST_ROWS), the less the better, and the top
    vertices of the limbs that are cut off together (k, MOST_ROWS, MOST_JOINED), NONE: fewer. first (k,): number of the first
    offset."""

    first: Ints
    filled: Ints
    column: Ints
    key: Floats
    tops: Ints


@dataclass(frozen=True, eq=False)
class LimbCandidates:
    """Limbs that may be worth a cut, best first: (r,) rows of the directions, offsets, and (r, MOST_JOINED) the highest vertex of
    each limb in the order of the facets, NONE: fewer."""

    direction: Ints
    offset_mm: Floats
    tops: Ints


def find_limbs(remainder: Remainder, grid: LimbGrid, risky_below: float) -> LimbCandidates:
    """The limbs that would save something if they alone were cut off; planes that pass through a single limb are left out."""
    count = len(grid.directions)
    rows = LimbRows(
        first=np.zeros(count, np.int32),
        filled=np.zeros(count, np.int32),
        column=np.zeros((count, MOST_ROWS), np.int32),
        key=np.zeros((count, MOST_ROWS)),
        tops=np.full((count, MOST_ROWS, MOST_JOINED), NONE, np.int32),
    )
    in_threads(_find_limbs, count, scars_of(remainder, grid.directions, risky_below), remainder.topology, grid, rows)
    used = np.arange(MOST_ROWS) < rows.filled[:, None]
    direction, place = np.nonzero(used)
    order = np.lexsort((place, direction, rows.key[used]))
    direction, place = direction[order], place[order]
    offset: Floats = (rows.first[direction] + rows.column[direction, place]) * np.float64(grid.step_mm)
    return LimbCandidates(direction.astype(np.int32), offset, rows.tops[direction, place])


@dataclass(frozen=True, eq=False)
class LimbSums:
    """What cutting off limbs would do, (r,) each: as sweep.Gains and sweep.Sweep have it. contact_mm2: the least section of a
    limb that is no crumb; exists: whether every limb still reaches above its plane; alone: whether nothing else does."""

    up_mm2: Floats
    residual_mm2: Floats
    stairs_up_mm2: Floats
    stairs_mm2: Floats
    rim_mm: Floats
    volume_mm3: Floats
    section_mm2: Floats
    contact_mm2: Floats
    lowest_mm: Floats
    exists: Mask
    alone: Mask
    crossed: Floats


def sum_limbs(remainder: Remainder, planes: Sequence[Plane], risky_below: float, crumb_mm: float) -> LimbSums:
    """What cutting off the limbs of planes would do, nothing is cut. The points of a limb are vertices of it."""
    pointed = _pointed(planes, crumb_mm, SAME_MM2)
    sums = np.zeros((len(planes), len(SUMS) + 4))
    scars = scars_of(remainder, pointed.normals, risky_below)
    in_threads(_sum_limbs, len(planes), scars, remainder.topology, pointed, sums)
    contact, lowest, exists, alone = sums[:, len(SUMS) :].T
    return LimbSums(
        up_mm2=sums[:, UP],
        residual_mm2=sums[:, RESIDUAL],
        stairs_up_mm2=sums[:, STAIRS_UP],
        stairs_mm2=sums[:, STAIRS],
        rim_mm=sums[:, RIM],
        volume_mm3=sums[:, MOMENT],
        section_mm2=sums[:, SECTION],
        contact_mm2=contact,
        lowest_mm=lowest,
        exists=exists > 0.0,
        alone=alone > 0.0,
        crossed=np.array([_count_crossed(remainder, plane) for plane in planes]),
    )


def _count_crossed(remainder: Remainder, plane: Plane) -> float:
    cut = cylinders_cut(remainder, remainder.cylinders, plane)
    return float(crossings(cut, plane.normal[None], np.array([[plane.offset_mm]]))[0, 0]) if cut else 0.0


def _pointed(planes: Sequence[Plane], crumb_mm: float, farthest_mm2: float) -> PointedPlanes:
    points = np.full((len(planes), MOST_JOINED, 3), np.inf)
    for row, plane in enumerate(planes):
        if plane.limbs_mm is not None:
            points[row, : len(plane.limbs_mm)] = plane.limbs_mm
    normals = np.array([plane.normal for plane in planes], dtype=np.float64).reshape(-1, 3)
    return PointedPlanes(
        normals, np.array([plane.offset_mm for plane in planes], dtype=np.float64), points, crumb_mm, farthest_mm2
    )


def limb_faces(remainder: Remainder, plane: Plane) -> Mask:
    """(m,) the faces of a solid that reach into what a plane cuts off, in the order of its mesh."""
    facets = remainder.facets
    faces = np.zeros(len(remainder.mesh.faces), np.bool_)
    faces[facets.order] = limb_vertices(remainder, plane)[facets.mesh.faces].any(axis=1)
    return faces


def limb_vertices(remainder: Remainder, plane: Plane) -> Mask:
    """(n,) the vertices of a solid that a plane cuts off, in the order of its facets. A limb has the vertex that is nearest to
    its point."""
    if plane.limbs_mm is None:
        above: Mask = plane.heights_mm(remainder.facets.mesh.vertices) > 0.0
        return above
    return _mark_limbs(scars_of(remainder, plane.normal[None], 0.0), remainder.topology, _pointed([plane], 0.0, np.inf))


def limb_reach(remainder: Remainder, plane: Plane) -> Mask:
    """(m,) the faces that a plane may cut when it is moved a little, in the order of a solid's mesh: those of its limbs and,
    below it, those from which the steepest way up leads into one; without limbs all faces."""
    facets = remainder.facets
    if plane.limbs_mm is None:
        return np.ones(len(remainder.mesh.faces), np.bool_)
    heights = plane.heights_mm(facets.mesh.vertices)
    marked = limb_vertices(remainder, plane)
    _spread_down(np.argsort(-heights, kind="stable"), heights, facets.rings, marked)
    faces = np.zeros(len(remainder.mesh.faces), np.bool_)
    faces[facets.order] = marked[facets.mesh.faces].any(axis=1)
    return faces


@kernel
def _spread_down(highest_first: NDArray[np.int64], heights: Floats, rings: Rings, marked: Mask) -> None:
    """Mark vertices below the plane as the highest vertex next to them is."""
    for v in highest_first:
        if heights[v] <= 0.0:
            highest = v
            for at in range(rings.starts[v], rings.starts[v + 1]):
                if before(heights, rings.neighbours[at], highest, True):
                    highest = np.int64(rings.neighbours[at])
            marked[v] = highest != v and marked[highest]


def cylinders_cut(remainder: Remainder, cylinders: tuple[Cylinder, ...], plane: Plane) -> tuple[Cylinder, ...]:
    """Those of some bores that have something of what a plane cuts off."""
    if plane.limbs_mm is None or not cylinders:
        return cylinders
    sources = np.unique(remainder.sources[limb_faces(remainder, plane)])
    return tuple(cylinder for cylinder in cylinders if np.isin(cylinder.faces, sources).any())


@inlined
def _add(sums: Floats, a: int, other: Floats, b: int) -> None:
    for which in range(7):
        sums[a, which] += other[b, which]


@borrower
def _join(pieces: Pieces, heights: Floats, a: int, b: int) -> None:
    """Join the pieces of two vertices; the lesser of those that stand for them stands for both."""
    p, q = root(pieces.parent, a), root(pieces.parent, b)
    if p == q:
        return
    if q < p:
        p, q = q, p
    pieces.parent[q] = p
    _add(pieces.whole, p, pieces.whole, q)
    pieces.low[p, 0] = min(pieces.low[p, 0], pieces.low[q, 0])
    if before(heights, pieces.top[q], pieces.top[p], True):
        pieces.top[p] = pieces.top[q]


@part
def _enter(vertices: NDArray[np.int64], heights: Floats, cosines: Floats, topology: Topology, pieces: Pieces) -> None:
    """Have vertices that come to lie above the plane begin pieces and join those next to them."""
    starts, neighbours = topology.rings.starts, topology.rings.neighbours
    for v in vertices:
        pieces.parent[v], pieces.top[v] = v, v
        pieces.low[v, 0] = topology.triangles.vertices[v, 2]
        for which in range(7):
            pieces.whole[v, which] = 0.0
        pieces.live[pieces.counts[0]] = v
        pieces.counts[0] += 1
    for v in vertices:
        highest = True
        for at in range(starts[v], starts[v + 1]):
            w = neighbours[at]
            if pieces.parent[w] >= 0:
                highest = highest and not before(heights, w, v, True)
                _join(pieces, heights, v, w)
        if highest and cosines[v] < 0.0:
            face = anchor_of(topology, int(v))
            if face >= 0:
                for corner in range(3):
                    w = topology.triangles.faces[face, corner]
                    if pieces.parent[w] >= 0:
                        _join(pieces, heights, v, w)


@part
def _weigh_faces(scars: Scars, row: int, d: Floats, weights: Floats) -> None:
    """What a whole face adds to the SUMS of its piece, MOMENT left out, and to RIM its weight."""
    surface, needs, rims = scars.overhangs, scars.needs, scars.rims
    normals, classes, sources = surface.normals, needs.classes, needs.sources
    for f in range(len(surface.areas_mm2)):
        cosine = normals[0, f] * d[0] + normals[1, f] * d[1] + normals[2, f] * d[2]
        area = surface.areas_mm2[f]
        weights[f, UP] = area if surface.risky[f] else 0.0
        weights[f, RESIDUAL] = 0.0
        if cosine < surface.risky_below:
            kind = classes[row, sources[f]] if sources[f] >= 0 else NEEDS_SUPPORT
            if kind != CARRIES_ITSELF:
                weights[f, RESIDUAL] = area * (needs.weight if kind == UNSUPPORTABLE else 1.0)
        weights[f, SECTION] = rims.areas_mm2[f] * cosine
        weights[f, STAIRS_UP], weights[f, STAIRS], weights[f, RIM] = 0.0, 0.0, 0.0
        if len(rims.weights) > 0:
            weights[f, RIM] = 2.0 * rims.areas_mm2[f] * rims.weights[f] * weigh_chord(cosine, rims.feather)
        if len(rims.stair_areas_mm2) > 0:
            weights[f, STAIRS_UP] = rims.stairs_up_mm2[f]
            weights[f, STAIRS] = rims.stair_areas_mm2[f] * step_share(cosine)


@borrower
def _cross(column: int, heights: Floats, weights: Floats, topology: Topology, pieces: Pieces) -> None:
    """Add the faces that have come to lie wholly above a column to their pieces, and the shares of those that cross it."""
    faces, points, c = topology.triangles.faces, topology.triangles.vertices, float(column)
    parent, whole, crossing, low = pieces.parent, pieces.whole, pieces.crossing, pieces.low
    live, active, counts = pieces.live, pieces.active, pieces.counts
    still = 0
    for at in range(counts[0]):
        v = live[at]
        if parent[v] == v:
            live[still] = v
            still += 1
            low[v, 1] = np.inf
            for which in range(7):
                crossing[v, which] = 0.0
    counts[0] = still
    still = 0
    for at in range(counts[1]):
        f = active[at]
        i, j, k = faces[f, 0], faces[f, 1], faces[f, 2]
        p, q, r = heights[i], heights[j], heights[k]
        lowest, highest = min(p, q, r), max(p, q, r)
        own = root(parent, i if p == highest else (j if q == highest else k))
        if lowest > c:
            _add(whole, own, weights, f)
            whole[own, MOMENT] += weights[f, SECTION] * (p + q + r) / 3.0
            whole[own, RIM] = 0.0  # only faces that cross have a rim
            continue
        active[still] = f
        still += 1
        middle, extent = max(min(p, q), min(max(p, q), r)), highest - lowest
        lower, upper = (middle - lowest) * extent, (highest - middle) * extent
        rise, fall = 1.0 / lower if lower > 0.0 else 0.0, 1.0 / upper if upper > 0.0 else 0.0
        share = share_above(c, lowest, middle, highest, rise, fall)
        for which in range(5):
            crossing[own, which] += weights[f, which] * share
        crossing[own, MOMENT] += weights[f, SECTION] * moment_above(c, lowest, middle, highest, rise, fall)
        crossing[own, RIM] += weights[f, RIM] * chord_at(c, lowest, middle, highest, rise, fall)
        for corner in range(3):
            v, w = faces[f, corner], faces[f, corner - 2]
            if (heights[v] > c) != (heights[w] > c):
                at_z = points[v, 2] + (c - heights[v]) / (heights[w] - heights[v]) * (points[w, 2] - points[v, 2])
                low[own, 1] = min(low[own, 1], at_z)
    counts[1] = still


@inlined
def _value(pieces: Pieces, piece: int, which: int) -> float:
    value: float = pieces.whole[piece, which] + pieces.crossing[piece, which]
    return value


@borrower
def _volume(pieces: Pieces, piece: int, column: int) -> float:
    """Volume above a column in steps times mm2."""
    return float(_value(pieces, piece, MOMENT) - column * pieces.whole[piece, SECTION])


@inlined
def _costs(pieces: Pieces, piece: int, seam_mm: float) -> tuple[float, float]:
    """What cutting off a piece would gain and lose, the cut itself left out; seam_mm: for RIM in steps."""
    stairs, seam = _value(pieces, piece, STAIRS), seam_mm * _value(pieces, piece, RIM)
    residual = _value(pieces, piece, RESIDUAL) + stairs + seam
    stairs_up = _value(pieces, piece, STAIRS_UP)
    return float(_value(pieces, piece, UP) + stairs_up - residual), float(residual - min(stairs, stairs_up))


@borrower
def _keep_row(rows: LimbRows, row: int, key: float, column: int, tops: Ints) -> None:
    """Note a candidate: the best of its limbs within a span of offsets; of a full table the worst one makes room."""
    count, place, worst = rows.filled[row], NONE, 0
    for k in range(count):
        same = rows.column[row, k] // SPAN == column // SPAN
        for limb in range(len(tops)):
            same = same and rows.tops[row, k, limb] == tops[limb]
        if same:
            place = k
        if rows.key[row, k] > rows.key[row, worst]:
            worst = k
    if place == NONE:
        if count < MOST_ROWS:
            place = count
            rows.filled[row] += 1
        else:
            place = worst
            if key >= rows.key[row, worst]:
                return
    elif key >= rows.key[row, place]:
        return
    rows.key[row, place], rows.column[row, place] = key, column
    for limb in range(len(tops)):
        rows.tops[row, place, limb] = tops[limb]


@borrower
def _is_allowed(grid: LimbGrid, row: int, offset_mm: float) -> bool:
    """Whether a plane keeps out of the zones that stay whole."""
    allowed = True
    for span in range(grid.keep_mm.shape[1]):
        allowed = allowed and not (grid.keep_mm[row, span, 0] < offset_mm and offset_mm < grid.keep_mm[row, span, 1])
    return allowed


@borrower
def _may_be_cut(pieces: Pieces, piece: int, column: int, heights: Floats, grid: LimbGrid) -> bool:
    """Whether the head passes clear of the table under a piece and its base is large enough."""
    high = heights[pieces.top[piece]] - column >= grid.crumb
    stands = _value(pieces, piece, SECTION) >= (grid.least_interface_mm2 if high else LEAST_CONTACT_MM2)
    return bool(stands and pieces.low[piece, 0] > -np.inf)


@borrower
def _offer(out: LimbRows, row: int, column: int, tops: Ints, costs: tuple[float, float], grid: LimbGrid) -> None:
    """Note what gains enough. costs: what it gains and loses, the cut itself left out."""
    gain, lost = costs[0] - grid.cut_mm2, costs[1] + grid.cut_mm2
    if gain >= grid.least_gain_mm2:
        _keep_row(out, row, TRADE_OFF * lost - gain, column, tops)


@borrower
def _offer_pieces(
    out: LimbRows, place: tuple[int, int], heights: Floats, pieces: Pieces, grid: LimbGrid, tops: tuple[Ints, Ints]
) -> None:
    """Note every piece above a column that gains enough, and those that gain together where they are several and not all. place:
    row and column; tops: room for the vertices of several and of one."""
    (row, column), (several, single), least = place, tops, grid.least_height_mm[place[0]]
    seam_mm = grid.seam_mm / grid.step_mm
    gain, lost, volume, many = 0.0, 0.0, 0.0, 0
    for limb in range(len(several)):
        several[limb] = NONE
    for at in range(pieces.counts[0]):
        piece = pieces.live[at]
        if min(pieces.low[piece, 0], pieces.low[piece, 1]) < least:
            pieces.low[piece, 0] = -np.inf  # at every lower plane, too
        if not _may_be_cut(pieces, piece, column, heights, grid):
            continue
        own_gain, own_lost = _costs(pieces, piece, seam_mm)
        own_volume = _volume(pieces, piece, column) * grid.step_mm
        if own_volume >= grid.least_volume_mm3:
            single[0] = pieces.top[piece]
            _offer(out, row, column, single, (own_gain, own_lost), grid)
        if own_gain > 0.0 and many < len(several):
            several[many] = pieces.top[piece]
            many += 1
            gain += own_gain
            lost += own_lost
            volume += own_volume
    if 1 < many < pieces.counts[0] and volume >= grid.least_volume_mm3:
        _offer(out, row, column, several, (gain, lost), grid)


@kernel
def _find_limbs(begin_row: int, end_row: int, scars: Scars, topology: Topology, grid: LimbGrid, out: LimbRows) -> None:
    points, corners, step_mm = scars.overhangs.points, scars.overhangs.corners, grid.step_mm
    heights, room = floats(points.shape[1], 0.0), _make_room(points.shape[1], corners.shape[1])
    pieces, tops = room.pieces, (ints(MOST_JOINED, NONE), ints(MOST_JOINED, NONE))
    for row in range(begin_row, end_row):
        first, n = find_heights(points[0], points[1], points[2], grid.directions[row], step_mm, heights)
        out.first[row] = first
        if n == 0 or not np.isfinite(grid.least_height_mm[row]):
            continue
        _begin(scars, row, grid.directions[row], OffsetGrid(grid.directions[row], heights, n, step_mm), topology, room)
        starts, vertices = counting_sort(room.over, n + 1)
        face_starts, faces = counting_sort(room.face_over, n + 1)
        for column in range(n - 1, -1, -1):
            offset_mm = (first + column) * step_mm
            _enter(vertices[starts[column + 1] : starts[column + 2]], heights, room.cosines, topology, pieces)
            for at in range(face_starts[column + 1], face_starts[column + 2]):
                pieces.active[pieces.counts[1]] = faces[at]
                pieces.counts[1] += 1
            _cross(column, heights, room.weights, topology, pieces)
            if pieces.counts[0] > 1 and _is_allowed(grid, row, offset_mm):
                _offer_pieces(out, (row, column), heights, pieces, grid, tops)


@kernel
def _sum_limbs(begin_row: int, end_row: int, scars: Scars, topology: Topology, planes: PointedPlanes, out: Floats) -> None:
    size, many_faces = scars.overhangs.points.shape[1], scars.overhangs.corners.shape[1]
    heights, room, chosen = floats(size, 0.0), _make_room(size, many_faces), ints(MOST_JOINED, NONE)
    pieces = room.pieces
    for row in range(begin_row, end_row):
        many = _find_chosen(scars, row, topology, planes, heights, room, chosen)
        contact, lowest = np.inf, np.inf
        for limb in range(many):
            piece = chosen[limb]
            for which in range(5):
                out[row, which] += _value(pieces, piece, which)
            out[row, RIM] += _value(pieces, piece, RIM)
            out[row, MOMENT] += _volume(pieces, piece, 0)
            lowest = min(lowest, pieces.low[piece, 0], pieces.low[piece, 1])
            if heights[pieces.top[piece]] >= planes.crumb_mm:
                contact = min(contact, _value(pieces, piece, SECTION))
        out[row, 7], out[row, 8] = contact, lowest
        out[row, 9] = 1.0 if many > 0 else 0.0
        out[row, 10] = 1.0 if many == pieces.counts[0] else 0.0


@kernel
def _mark_limbs(scars: Scars, topology: Topology, planes: PointedPlanes) -> Mask:
    size = scars.overhangs.points.shape[1]
    heights, room, chosen, marked = (
        floats(size, 0.0),
        _make_room(size, scars.overhangs.corners.shape[1]),
        ints(MOST_JOINED, NONE),
        flags(size),
    )
    many = _find_chosen(scars, 0, topology, planes, heights, room, chosen)
    for v in range(size):
        if room.pieces.parent[v] >= 0:
            own = root(room.pieces.parent, v)
            for limb in range(many):
                marked[v] = marked[v] or own == chosen[limb]
    return marked


class Room(NamedTuple):
    """What the pieces of one direction are worked out in: the column below which each vertex (n,) and each face (m,) begins, the
    cosines (n,) of vertex normals and the direction, the weights (m, 7) of the faces, and the pieces."""

    over: Ints
    face_over: Ints
    cosines: Floats
    weights: Floats
    pieces: Pieces


@part
def _make_room(size: int, many_faces: int) -> Room:
    whole, crossing, low = table(size, 7), table(size, 7), table(size, 2)
    parent, top, live = ints(size, NONE), ints(size, 0), ints(size, 0)
    pieces = Pieces(parent, whole, crossing, top, low, live, ints(many_faces, 0), ints(2, 0))
    return Room(ints(size, 0), ints(many_faces, 0), floats(size, 0.0), table(many_faces, 7), pieces)


@part
def _begin(scars: Scars, row: int, d: Floats, grid: OffsetGrid, topology: Topology, room: Room) -> None:
    """Lay out vertices and faces along a direction; no piece has begun."""
    normals, corners, pieces = topology.vertex_normals, scars.overhangs.corners, room.pieces
    for v in range(len(room.over)):
        room.over[v] = min(column_over(grid.heights[v]), grid.columns)
        room.cosines[v] = normals[v, 0] * d[0] + normals[v, 1] * d[1] + normals[v, 2] * d[2]
        pieces.parent[v] = NONE
    for f in range(len(room.face_over)):
        room.face_over[f] = max(room.over[corners[0, f]], room.over[corners[1, f]], room.over[corners[2, f]])
    pieces.counts[0] = pieces.counts[1] = 0
    _weigh_faces(scars, row, d, room.weights)


@part
def _find_chosen(
    scars: Scars, row: int, topology: Topology, planes: PointedPlanes, heights: Floats, room: Room, chosen: Ints
) -> int:
    """Put the pieces that a plane's points lie on among the chosen; how many they are, 0 where one of the points is gone."""
    d, points, pieces = planes.normals[row], scars.overhangs.points, room.pieces
    dot(points[0], points[1], points[2], d, heights)
    for v in range(len(heights)):
        heights[v] -= planes.offsets_mm[row]
    _begin(scars, row, d, OffsetGrid(d, heights, 1, 1.0), topology, room)
    starts, vertices = counting_sort(room.over, 2)
    face_starts, faces = counting_sort(room.face_over, 2)
    _enter(vertices[starts[1] : starts[2]], heights, room.cosines, topology, pieces)
    for at in range(face_starts[1], face_starts[2]):
        pieces.active[pieces.counts[1]] = faces[at]
        pieces.counts[1] += 1
    _cross(0, heights, room.weights, topology, pieces)
    many = 0
    for limb in range(planes.points.shape[1]):
        if np.isfinite(planes.points[row, limb, 0]):
            v = _nearest(planes.points[row, limb], points, pieces.parent, planes.farthest_mm2)
            if v < 0:
                return 0
            own, known = root(pieces.parent, v), False
            for other in range(many):
                known = known or chosen[other] == own
            if not known:
                chosen[many] = own
                many += 1
    return many


@borrower
def _nearest(point: Floats, points: Floats, parent: Ints, farthest_mm2: float) -> int:
    """The vertex above the plane that is nearest to a point; NONE: there is none as near as that."""
    nearest, least = NONE, farthest_mm2
    for v in range(len(parent)):
        if parent[v] >= 0:
            x, y, z = points[0, v] - point[0], points[1, v] - point[1], points[2, v] - point[2]
            distance = x * x + y * y + z * z
            if distance < least:
                nearest, least = v, distance
    return nearest
