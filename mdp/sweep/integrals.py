"""Integrals: what the faces add up to above each offset plane of a direction (numba kernels of the sweep).

Heights are in steps above the direction's first offset: offset column c lies at height c, column c is below a vertex at height t
when c < t. Faces are taken in blocks: what every face needs is worked out in plain loops over the block, which the compiler turns
into vector instructions, then added to the columns one face after the other.
"""

from typing import NamedTuple

import numpy as np

from mdp.kernels.arrays import dot, floats, int_table, ints, table
from mdp.kernels.kernel import helper, no_nrt
from mdp.mesh import Floats, Ints
from mdp.sweep.crossing import THIRD, Ramp, moment_above, share_above, slopes
from mdp.sweep.facets import FaceTable, Indices, Layout, Scars, class_along

BLOCK = 128
AHEAD = 3  # columns of a face that are worked out for the whole block; the few faces that cross more are finished singly
KINDS = 8  # of faces, see _select; the first is none


class OffsetGrid(NamedTuple):
    """The offset planes of one direction: (3,) direction, (n,) heights of all vertices in steps above the first plane, how many
    planes (columns) there are, and the step between them."""

    direction: Floats
    heights: Floats
    columns: int
    step_mm: float


class Block(NamedTuple):
    """Some faces: sorted heights of their corners, the two factors of their share above an offset, their weight, the first
    column each crosses and how many it does."""

    low: Floats
    middle: Floats
    high: Floats
    rise: Floats
    fall: Floats
    weight: Floats
    column: Ints
    crossed: Ints


@no_nrt
def find_heights(points: Floats, d: Floats, step: float, heights: Floats) -> tuple[int, int]:
    """Fill the heights of all vertices; returns the first offset's number and the count of offsets in between."""
    (x, y, z), d0, d1, d2 = (points[0], points[1], points[2]), d[0], d[1], d[2]
    for v in range(len(heights)):
        heights[v] = (x[v] * d0 + y[v] * d1 + z[v] * d2) / step
    least, most = _range(heights)
    begin = int(np.floor(least)) + 1
    shift = float(begin)
    for v in range(len(heights)):
        heights[v] -= shift
    return begin, max(int(np.ceil(most)) - begin, 0)


@no_nrt
def _range(values: Floats) -> tuple[float, float]:
    """Least and greatest value; four of each, for one alone waits for the value before."""
    a, b, c, d = 1e300, 1e300, 1e300, 1e300
    p, q, r, s = -1e300, -1e300, -1e300, -1e300
    whole = len(values) // 4 * 4
    for v in range(0, whole, 4):
        a, b, c, d = min(a, values[v]), min(b, values[v + 1]), min(c, values[v + 2]), min(d, values[v + 3])
        p, q, r, s = max(p, values[v]), max(q, values[v + 1]), max(r, values[v + 2]), max(s, values[v + 3])
    for v in range(whole, len(values)):
        a, p = min(a, values[v]), max(p, values[v])
    return min(a, b, c, d), max(p, q, r, s)


@no_nrt
def column_over(height: float) -> int:
    """The number of offsets strictly below a height: the first column that is not below it."""
    return max(int(np.ceil(height)), 0)


@helper
def lay_block(values: Floats, places: Ints, corners: tuple[Indices, Indices, Indices], heights: Floats) -> Block:
    """A block of faces with (k,) corners in (6, BLOCK) and (2, BLOCK) arrays; their weights, values[5], stay as they are."""
    size = len(corners[0])
    low, middle, high = values[0, :size], values[1, :size], values[2, :size]
    block = Block(low, middle, high, values[3, :size], values[4, :size], values[5, :size], places[0, :size], places[1, :size])
    _sort_heights(corners, heights, block)
    _find_ramps(block)
    return block


@no_nrt
def _sort_heights(corners: tuple[Indices, Indices, Indices], heights: Floats, block: Block) -> None:
    (a, b, c), low, middle, high = corners, block.low, block.middle, block.high
    for k in range(len(low)):
        p, q, r = heights[a[k]], heights[b[k]], heights[c[k]]
        least, most = min(p, q), max(p, q)
        low[k], high[k] = min(least, r), max(most, r)
        middle[k] = max(least, min(most, r))


@no_nrt
def _find_ramps(block: Block) -> None:
    """The first column each face crosses and how many, and the two factors of its share above an offset."""
    low, middle, high, rise, fall = block.low, block.middle, block.high, block.rise, block.fall
    column, crossed = block.column, block.crossed
    for k in range(len(low)):
        rise[k], fall[k] = slopes(low[k], middle[k], high[k])
        first = max(np.ceil(low[k]), 0.0)
        column[k] = np.int32(first)
        crossed[k] = np.int32(max(np.ceil(high[k]), 0.0)) - np.int32(first)


@no_nrt
def ramp_at(block: Block, k: int) -> Ramp:
    """The ramp of a face."""
    return block.low[k], block.middle[k], block.high[k], block.rise[k], block.fall[k]


@no_nrt
def find_shares(block: Block, shares: Floats) -> None:
    """(AHEAD, k) share of each face above the first columns that it crosses, 0 above those that it does not reach."""
    for ahead in range(AHEAD):
        for k in range(len(block.low)):
            c = max(np.ceil(block.low[k]), 0.0) + ahead
            shares[ahead, k] = share_above(c, ramp_at(block, k)) if c < block.high[k] else 0.0


@no_nrt
def add_areas(kind: Ints, block: Block, shares: Floats, sums: Floats) -> None:
    """Add weights of faces to two sums for each kind: of those wholly above, and of the shares of those crossed."""
    weight = block.weight
    for k in range(len(weight)):
        b, which = np.uint32(block.column[k]), 2 * np.uint32(kind[k])
        sums[b, which] += weight[k]
        sums[b, which + 1] += weight[k] * shares[0, k]
        sums[b + 1, which + 1] += weight[k] * shares[1, k]
        sums[b + 2, which + 1] += weight[k] * shares[2, k]
        for ahead in range(AHEAD, block.crossed[k]):
            sums[b + ahead, which + 1] += weight[k] * share_above(float(b) + ahead, ramp_at(block, k))


@no_nrt
def _find_moments(block: Block, moments: Floats) -> None:
    """(AHEAD, k) first moment of each share that find_shares finds."""
    for ahead in range(AHEAD):
        for k in range(len(block.low)):
            c = max(np.ceil(block.low[k]), 0.0) + ahead
            moments[ahead, k] = moment_above(c, ramp_at(block, k)) if c < block.high[k] else 0.0


@no_nrt
def _add_moments(block: Block, moments: Floats, sums: Floats) -> None:
    low, middle, high, weight = block.low, block.middle, block.high, block.weight
    for k in range(len(weight)):
        b = np.uint32(block.column[k])
        sums[b, 2] += weight[k] * ((low[k] + middle[k] + high[k]) * THIRD)
        sums[b, 3] += weight[k] * moments[0, k]
        sums[b + 1, 3] += weight[k] * moments[1, k]
        sums[b + 2, 3] += weight[k] * moments[2, k]
        for ahead in range(AHEAD, block.crossed[k]):
            sums[b + ahead, 3] += weight[k] * moment_above(float(b) + ahead, ramp_at(block, k))


@helper
def integrate_volume(layout: Layout, grid: OffsetGrid, section: Floats, volume: Floats) -> None:
    """Cross-section at (mm2) and volume above (mm3) each offset, by the divergence theorem."""
    corners, vectors, d, n = layout.faces.corners, layout.vectors_mm2, grid.direction, grid.columns
    sums, values, shares = table(n + AHEAD + 1, 4), table(6, BLOCK), table(AHEAD, BLOCK)
    places, kind = int_table(2, BLOCK), ints(BLOCK, 0)
    for begin in range(0, corners.shape[1], BLOCK):
        end = min(begin + BLOCK, corners.shape[1])
        a, b, c = corners[0, begin:end], corners[1, begin:end], corners[2, begin:end]
        block = lay_block(values, places, (a, b, c), grid.heights)
        dot(vectors[0, begin:end], vectors[1, begin:end], vectors[2, begin:end], d, block.weight)
        find_shares(block, shares)
        add_areas(kind, block, shares, sums)
        _find_moments(block, shares)
        _add_moments(block, shares, sums)
    area, first_moment = 0.0, 0.0
    for column in range(n - 1, -1, -1):
        area += sums[column + 1, 0]
        first_moment += sums[column + 1, 2]
        section[column] = sums[column, 1] + area
        volume[column] = (sums[column, 3] + first_moment - column * area) * grid.step_mm


@helper
def _select(scars: Scars, row: int, d: Floats, chosen: Ints, kind: Ints) -> int:
    """The faces that need support either way, with 1: upright only, 2: along d only, 3: both, 4 and 5: as 2 and 3, and along d
    they are unsupportable, 6 and 7: as 3 and 5, and no cut can save them; returns how many."""
    normals, risky, hopeless = scars.faces.normals, scars.faces.risky, scars.hopeless
    with_hopeless = len(hopeless) > 0
    cosines = floats(BLOCK, 0.0)
    count = 0
    for begin in range(0, normals.shape[1], BLOCK):
        end = min(begin + BLOCK, normals.shape[1])
        dot(normals[0, begin:end], normals[1, begin:end], normals[2, begin:end], d, cosines[: end - begin])
        for f in range(begin, end):
            code = int(risky[f]) + 2 * (class_along(scars, row, f) if cosines[f - begin] < scars.risky_below else 0)
            if with_hopeless and hopeless[f]:
                code = 6 if code == 3 else 7 if code == 5 else code
            chosen[count], kind[count] = f, code
            count += int(code > 0)
    return count


@no_nrt
def _pick(chosen: Ints, faces: FaceTable, picked: Indices, weight: Floats) -> None:
    """Corners (3, k) and areas of the chosen faces as they count."""
    corners, areas, counts = faces.corners, faces.areas_mm2, faces.counts
    for k in range(len(chosen)):
        f = np.uint32(chosen[k])
        picked[0, k], picked[1, k], picked[2, k] = corners[0, f], corners[1, f], corners[2, f]
    for k in range(len(chosen)):
        weight[k] = areas[chosen[k]] * counts[chosen[k]]


@helper
def integrate_risky_area(scars: Scars, row: int, grid: OffsetGrid, scratch: Ints, out: tuple[Floats, Floats, Floats]) -> None:
    """Risky areas above each offset of a direction: printed straight up, along it, weighted by what the faces need, and what no
    cut can save.

    scratch: (2, m + 1) whole numbers to work in.
    """
    (up, residual, hopeless), (chosen, kind), n = out, (scratch[0], scratch[1]), grid.columns
    count = _select(scars, row, grid.direction, chosen, kind)
    sums, values, shares, places = table(n + AHEAD + 1, 2 * KINDS), table(6, BLOCK), table(AHEAD, BLOCK), int_table(2, BLOCK)
    picked = np.empty((3, BLOCK), np.uint32)
    for begin in range(0, count, BLOCK):
        end = min(begin + BLOCK, count)
        size = end - begin
        _pick(chosen[begin:end], scars.faces, picked, values[5])
        block = lay_block(values, places, (picked[0, :size], picked[1, :size], picked[2, :size]), grid.heights)
        find_shares(block, shares)
        add_areas(kind[begin:end], block, shares, sums)
    above = floats(KINDS, 0.0)
    for column in range(n - 1, -1, -1):
        for which in range(1, KINDS):
            above[which] += sums[column + 1, 2 * which]
        lost, airy_lost = sums[column, 13] + above[6], sums[column, 15] + above[7]
        both = sums[column, 7] + above[3] + lost
        airy_both = sums[column, 11] + above[5] + airy_lost
        up[column] = sums[column, 3] + above[1] + both + airy_both
        airy = sums[column, 9] + above[4] + airy_both
        residual[column] = sums[column, 5] + above[2] + both + scars.weight * airy
        hopeless[column] = lost + airy_lost


@helper
def find_lowest(z: Floats, edges: Indices, grid: OffsetGrid, watched: float, lowest: Floats) -> None:
    """Least z above each offset, among vertices and crossings of edges, lowest first, below the watched height."""
    heights, n = grid.heights, grid.columns
    known = 0  # columns before it have their least z: that of a vertex above them met earlier
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
