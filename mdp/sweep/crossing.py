"""Crossing: the share of a triangle above a plane, from the heights of its corners; the rim of a cut, made of the chords of the
crossed triangles; and the sums over all faces above each offset plane of a direction.

The share of the area above a plane at height c is quadratic in c on either side of the middle corner; its chord in the plane is
linear. A `Ramp` holds the heights and the factors of a triangle on either side, computed once per direction. The integral of the
chord over the extent across the planes is the area times the sine of the angle between face and plane.

Along a direction heights are in steps above its first offset: offset column c lies at height c, column c is below a vertex at
height t when c < t.
"""

from math import cos, radians
from typing import NamedTuple

import numpy as np

from mdp.kernels import arrays
from mdp.kernels.arrays import floats, table
from mdp.kernels.kernel import helper, kernel, no_nrt
from mdp.mesh import Floats, Ints, Mesh
from mdp.overhang import step_share
from mdp.plane import Plane
from mdp.sweep.facets import Blemishes, Indices, Layout, class_along

THIRD = 1.0 / 3.0
COT_30 = 3.0**0.5
FEATHER_COSINE = cos(radians(20.0))  # cosine between face and plane: the edge between them is thin enough to be reported
ROUNDING_MM = 1e-9  # a corner created by a cut lies in its plane
BLOCK = 128  # faces that are processed together, so that their data stays in the cache
AHEAD = 3  # columns of a face that are computed without testing whether it crosses them: avoids mispredicted branches
KINDS = 8  # kinds of faces, see _kind_of; the first needs no support
SUMS = STAIRS_UP, STAIRS, RIM = KINDS, KINDS + 1, KINDS + 2  # sums besides those of each kind
Ramp = tuple[float, float, float, float, float]  # heights of the corners, lowest first, and the two factors


@no_nrt
def ramp_of(p: float, q: float, r: float) -> Ramp:
    """The ramp of a triangle with corners at three heights; a factor is 0 if that side of the triangle is flat."""
    low, middle, high = min(p, q, r), max(min(p, q), min(max(p, q), r)), max(p, q, r)
    extent = high - low
    lower, upper = (middle - low) * extent, (high - middle) * extent
    return low, middle, high, 1.0 / lower if lower > 0.0 else 0.0, 1.0 / upper if upper > 0.0 else 0.0


@no_nrt
def share_above(c: float, ramp: Ramp) -> float:
    """Share of a face above an offset that crosses it."""
    low, middle, high, rise, fall = ramp
    return 1.0 - (c - low) * (c - low) * rise if c < middle else (high - c) * (high - c) * fall


@no_nrt
def moment_above(c: float, ramp: Ramp) -> float:
    """First moment, about an offset, of the share of a face above it."""
    low, middle, high, rise, fall = ramp
    mean, up, down = (low + middle + high) * THIRD, c - low, high - c
    return mean - c + up * up * rise * up * THIRD if c < middle else down * down * fall * down * THIRD


@no_nrt
def chord_at(c: float, ramp: Ramp) -> float:
    """Length of a face's chord at an offset that crosses it, relative to its longest chord times its extent."""
    low, middle, high, rise, fall = ramp
    return (c - low) * rise if c < middle else (high - c) * fall


@kernel
def areas_above(faces: Ints, heights: Floats, areas_mm2: Floats) -> Floats:
    """(m,) area above height 0 of each of (m, 3) faces, for (n,) vertex heights."""
    above = floats(len(faces), 0.0)
    for f in range(len(faces)):
        ramp = ramp_of(heights[faces[f, 0]], heights[faces[f, 1]], heights[faces[f, 2]])
        if ramp[0] >= 0.0 and ramp[2] > 0.0:
            above[f] = areas_mm2[f]
        elif ramp[2] > 0.0:
            above[f] = areas_mm2[f] * share_above(0.0, ramp)
    return above


@no_nrt
def weigh_chord(cosine: float, feather: float) -> float:
    """Weight of a chord on a face whose normal has the given cosine with the plane's, times the sine of the angle between them.

    A feather edge, where face and plane meet at less than 30 degrees, counts 1 + feather (cot angle - cot 30) times.
    """
    facing = abs(cosine)
    sine: float = np.sqrt(max(1.0 - facing * facing, 0.0))
    return sine + feather * max(facing - COT_30 * sine, 0.0)


class Rim(NamedTuple):
    """The rim of a plane on the faces that count: its length, its weighted length, and the length of feather edges below 20
    degrees, mm.
    """

    length_mm: float
    weighted_mm: float
    feathered_mm: float

    @property
    def feather_share(self) -> float:
        """Share of the rim that is a feather edge; 0 if no rim is visible."""
        return self.feathered_mm / self.length_mm if self.length_mm > 0.0 else 0.0


NO_RIM = Rim(0.0, 0.0, 0.0)  # rim of a part on the build plate


def measure_rim(mesh: Mesh, weights: Floats, plane: Plane, feather: float) -> Rim:
    """The rim of a cut through a mesh, as in the sweep but for one plane. weights: (m,) weight of a mm of rim on each face."""
    faces = mesh.faces, mesh.normals, mesh.areas_mm2, weights
    return sum_chords(faces, plane.heights_mm(mesh.vertices), plane.normal, feather)


@kernel
def sum_chords(faces: tuple[Ints, Floats, Floats, Floats], heights: Floats, normal: Floats, feather: float) -> Rim:
    """The rim of a plane with a normal, above which the vertices have (n,) heights, on faces given by corners (m, 3), normals (m,
    3), areas and weights (m,).
    """
    corners, normals, areas_mm2, weights = faces
    length, weighted, feathered = 0.0, 0.0, 0.0
    for f in range(len(corners)):
        p, q, r = heights[corners[f, 0]], heights[corners[f, 1]], heights[corners[f, 2]]
        if weights[f] <= 0.0 or min(p, q, r) >= -ROUNDING_MM or max(p, q, r) <= ROUNDING_MM:
            continue
        cosine = normals[f, 0] * normal[0] + normals[f, 1] * normal[1] + normals[f, 2] * normal[2]
        chord = 2.0 * areas_mm2[f] * chord_at(0.0, ramp_of(p, q, r))
        length += chord * weigh_chord(cosine, 0.0)
        weighted += chord * weights[f] * weigh_chord(cosine, feather)
        if abs(cosine) > FEATHER_COSINE:
            feathered += chord * weigh_chord(cosine, 0.0)
    return Rim(length, weighted, feathered)


class OffsetGrid(NamedTuple):
    """The offset planes of one direction: (3,) direction, (n,) heights of all vertices in steps above the first plane, the number
    of planes (columns), and their step.
    """

    direction: Floats
    heights: Floats
    columns: int
    step_mm: float


@no_nrt
def find_heights(points: Floats, d: Floats, step: float, heights: Floats) -> tuple[int, int]:
    """Fill the heights of all vertices; returns the first offset's number and the count of offsets between the extremes."""
    (x, y, z), d0, d1, d2 = (points[0], points[1], points[2]), d[0], d[1], d[2]
    least, most = 1e300, -1e300
    for v in range(len(heights)):
        heights[v] = (x[v] * d0 + y[v] * d1 + z[v] * d2) / step
        least, most = min(least, heights[v]), max(most, heights[v])
    begin = int(np.floor(least)) + 1
    shift = float(begin)
    for v in range(len(heights)):
        heights[v] -= shift
    return begin, max(int(np.ceil(most)) - begin, 0)


@no_nrt
def column_over(height: float) -> int:
    """The number of offsets strictly below a height, which is the first column not below it."""
    return max(int(np.ceil(height)), 0)


@no_nrt
def _lay_ramps(corners: Indices, heights: Floats, ramps: Floats) -> None:
    """Fill the ramps (5, k) of (3, k) corners; without branches, so that the compiler vectorises the loop."""
    for k in range(ramps.shape[1]):
        ramp = ramp_of(heights[corners[0, k]], heights[corners[1, k]], heights[corners[2, k]])
        ramps[0, k], ramps[1, k], ramps[2, k], ramps[3, k], ramps[4, k] = ramp


@no_nrt
def _weigh(ahead: int, weights: Floats, ramps: Floats, sums: Floats) -> None:
    """Weighted share and moment (2, k) of faces above the column `ahead` columns after the first that they cross."""
    for k in range(len(weights)):
        ramp = ramps[0, k], ramps[1, k], ramps[2, k], ramps[3, k], ramps[4, k]
        height = max(np.ceil(ramp[0]), 0.0) + ahead
        inside = weights[k] if height < ramp[2] else 0.0
        sums[0, k], sums[1, k] = inside * share_above(height, ramp), inside * moment_above(height, ramp)


@helper
def integrate_volume(layout: Layout, grid: OffsetGrid, section: Floats, volume: Floats) -> None:
    """Cross-section at each offset, mm2, and volume above it, mm3, by the divergence theorem."""
    corners, vectors, n = layout.faces.corners, layout.vectors_mm2, grid.columns
    sums = table(n + AHEAD + 1, 4)  # areas and moments of the faces wholly above, and of the shares of crossing faces
    block = table(6 + 2 * AHEAD, BLOCK)
    for begin in range(0, corners.shape[1], BLOCK):
        end = min(begin + BLOCK, corners.shape[1])
        ramps, weights, shares = block[:5, : end - begin], block[5, : end - begin], block[6:, : end - begin]
        _lay_ramps(corners[:, begin:end], grid.heights, ramps)
        arrays.dot(vectors[0, begin:end], vectors[1, begin:end], vectors[2, begin:end], grid.direction, weights)
        for ahead in range(AHEAD):
            _weigh(ahead, weights, ramps, shares[2 * ahead : 2 * ahead + 2])
        _add_volumes(weights, ramps, shares, sums)
    area, first_moment = 0.0, 0.0
    for column in range(n - 1, -1, -1):
        area += sums[column + 1, 0]
        first_moment += sums[column + 1, 2]
        section[column] = sums[column, 1] + area
        volume[column] = (sums[column, 3] + first_moment - column * area) * grid.step_mm


@no_nrt
def _add_volumes(weights: Floats, ramps: Floats, shares: Floats, sums: Floats) -> None:
    """Add a block of faces to the sums of the columns. shares: results of _weigh for each of AHEAD columns, two rows each."""
    for k in range(len(weights)):
        ramp = ramps[0, k], ramps[1, k], ramps[2, k], ramps[3, k], ramps[4, k]
        first, end = column_over(ramp[0]), column_over(ramp[2])
        sums[first, 0] += weights[k]
        sums[first, 2] += weights[k] * ((ramp[0] + ramp[1] + ramp[2]) * THIRD)
        for ahead in range(AHEAD):
            sums[first + ahead, 1] += shares[2 * ahead, k]
            sums[first + ahead, 3] += shares[2 * ahead + 1, k]
        for column in range(first + AHEAD, end):
            sums[column, 1] += weights[k] * share_above(float(column), ramp)
            sums[column, 3] += weights[k] * moment_above(float(column), ramp)


@no_nrt
def _kind_of(blemishes: Blemishes, row: int, f: int, cosine: float) -> int:
    """Kind of a face by its support need: 0: none, 1: only when printed upright, 2: only along the direction, 3: both; 4 and 5:
    as 2 and 3, but unsupportable along the direction; 6 and 7: as 3 and 5, but no cut can save it.
    """
    kind = int(blemishes.faces.risky[f]) + 2 * class_along(blemishes, row, f) * int(cosine < blemishes.risky_below)
    if len(blemishes.unavoidable) > 0 and blemishes.unavoidable[f]:
        kind = 6 if kind == 3 else 7 if kind == 5 else kind
    return kind


@no_nrt
def _share(ahead: int, ramps: Floats, shares: Floats) -> None:
    """Share above, and chord at (2, k), the column `ahead` columns after the first that each face crosses."""
    for k in range(ramps.shape[1]):
        ramp = ramps[0, k], ramps[1, k], ramps[2, k], ramps[3, k], ramps[4, k]
        height = max(np.ceil(ramp[0]), 0.0) + ahead
        inside = 1.0 if height < ramp[2] else 0.0
        shares[0, k], shares[1, k] = inside * share_above(height, ramp), inside * chord_at(height, ramp)


@helper
def integrate_blemishes(blemishes: Blemishes, row: int, grid: OffsetGrid) -> Floats:
    """(n + AHEAD + 1, KINDS + 3) sums of the faces above each offset (rows from n are unused): area by kind, see _kind_of,
    stair-stepping printed straight up and along the direction, and the weighted rim at the offset times the step.
    """
    faces, n = blemishes.faces, grid.columns
    corners, normals = faces.corners, faces.normals
    wholes, sums, block = table(n + 1, KINDS + 3), table(n + AHEAD + 1, KINDS + 3), table(6 + 2 * AHEAD, BLOCK)
    for begin in range(0, corners.shape[1], BLOCK):
        end = min(begin + BLOCK, corners.shape[1])
        ramps, cosines, shares = block[:5, : end - begin], block[5, : end - begin], block[6:, : end - begin]
        _lay_ramps(corners[:, begin:end], grid.heights, ramps)
        arrays.dot(normals[0, begin:end], normals[1, begin:end], normals[2, begin:end], grid.direction, cosines)
        for ahead in range(AHEAD):
            _share(ahead, ramps, shares[2 * ahead : 2 * ahead + 2])
        _add_blemishes(blemishes, (row, begin), block, wholes, sums)
    for column in range(n - 1, -1, -1):
        for which in range(KINDS + 3):
            sums[column, which] += wholes[column + 1, which]
            wholes[column, which] += wholes[column + 1, which]
    return sums


@no_nrt
def _add_blemishes(blemishes: Blemishes, place: tuple[int, int], block: Floats, wholes: Floats, sums: Floats) -> None:
    """Add a block of faces to the sums of the columns. place: row of the direction, first face of the block."""
    faces, (row, begin) = blemishes.faces, place
    seams, stairs = len(faces.seam_weights) > 0, len(faces.seam_weights) > 0 and len(faces.stair_weights) > 0
    for f in range(begin, min(begin + BLOCK, faces.corners.shape[1])):
        k = f - begin
        ramp, cosine = (block[0, k], block[1, k], block[2, k], block[3, k], block[4, k]), block[5, k]
        kind, first, end = _kind_of(blemishes, row, f, cosine), column_over(ramp[0]), column_over(ramp[2])
        counted, upright, leaning, chord = faces.areas_mm2[f] * faces.counts[f], 0.0, 0.0, 0.0
        if seams:
            chord = 2.0 * faces.areas_mm2[f] * faces.seam_weights[f] * weigh_chord(cosine, blemishes.feather)
        if stairs:
            stair = faces.areas_mm2[f] * faces.stair_weights[f]
            upright, leaning = stair * step_share(faces.normals[2, f]), stair * step_share(cosine)
        wholes[first, kind] += counted
        wholes[first, STAIRS_UP] += upright
        wholes[first, STAIRS] += leaning
        for ahead in range(AHEAD):
            share, column = block[6 + 2 * ahead, k], first + ahead
            sums[column, kind] += counted * share
            sums[column, STAIRS_UP] += upright * share
            sums[column, STAIRS] += leaning * share
            sums[column, RIM] += chord * block[7 + 2 * ahead, k]
        for column in range(first + AHEAD, end):
            share = share_above(float(column), ramp)
            sums[column, kind] += counted * share
            sums[column, STAIRS_UP] += upright * share
            sums[column, STAIRS] += leaning * share
            sums[column, RIM] += chord * chord_at(float(column), ramp)


@helper
def find_lowest(z: Floats, edges: Indices, grid: OffsetGrid, watched: float, lowest: Floats) -> None:
    """Least z above each offset, among vertices and crossings of edges, exact below the watched height. edges: sorted by their
    lower end.
    """
    heights, n = grid.heights, grid.columns
    known = 0  # columns before it have their least z, from a vertex above them met earlier
    for e in range(edges.shape[1]):
        v, w = edges[0, e], edges[1, e]
        if known >= n or z[v] >= watched:
            break
        if heights[v] > known:
            known = column_over(heights[v])
            lowest[known - 1] = min(lowest[known - 1], z[v])
        if heights[w] > known:
            rise = (z[w] - z[v]) / (heights[w] - heights[v])
            for column in range(known, column_over(heights[w])):
                lowest[column] = min(lowest[column], z[v] + rise * (column - heights[v]))
    for column in range(n - 2, -1, -1):
        lowest[column] = min(lowest[column], lowest[column + 1])
