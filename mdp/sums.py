"""Sums: what a direction's offsets add up to, face by face (numba kernels of the sweep).

Heights are in steps above the direction's first offset: offset column c lies at height c, column c is below a vertex at height t
when c < t. Faces are taken in blocks: what every face needs is worked out in plain loops over the block, which the compiler turns
into vector instructions, then added to the columns one face after the other.
"""

import numpy as np

from mdp.kernel import floats, inlined, int_table, part, table, vector_part

BLOCK = 128
AHEAD = 3  # columns of a face that are worked out for the whole block; the few faces that cross more are finished singly
THIRD = 1.0 / 3.0


@vector_part
def find_heights(x, y, z, d, step, heights):  # type: ignore[no-untyped-def]
    """Fill the heights of all vertices; returns the first offset's number and the count of offsets in between."""
    d0, d1, d2 = d[0], d[1], d[2]
    for v in range(len(heights)):
        heights[v] = (x[v] * d0 + y[v] * d1 + z[v] * d2) / step
    least, most = _range(heights)
    begin = int(np.floor(least)) + 1
    shift = float(begin)
    for v in range(len(heights)):
        heights[v] -= shift
    return begin, max(int(np.ceil(most)) - begin, 0)


@vector_part
def _range(values):  # type: ignore[no-untyped-def]
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


@inlined
def column_over(height):  # type: ignore[no-untyped-def]
    """The number of offsets strictly below a height: the first column that is not below it."""
    return max(int(np.ceil(height)), 0)


@vector_part
def _sorted_heights(a, b, c, heights, low, middle, high):  # type: ignore[no-untyped-def]
    for k in range(len(low)):
        p, q, r = heights[a[k]], heights[b[k]], heights[c[k]]
        least, most = min(p, q), max(p, q)
        low[k], high[k] = min(least, r), max(most, r)
        middle[k] = max(least, min(most, r))


@vector_part
def dot(x, y, z, d0, d1, d2, out):  # type: ignore[no-untyped-def]
    """Products of (n,) vectors given by their coordinates with one vector."""
    for k in range(len(out)):
        out[k] = x[k] * d0 + y[k] * d1 + z[k] * d2


@vector_part
def _ramps(low, middle, high, rise, fall, column, crossed):  # type: ignore[no-untyped-def]
    """The first column each face crosses and how many, and the two factors of its share above an offset."""
    for k in range(len(low)):
        extent = high[k] - low[k]
        lower, upper = (middle[k] - low[k]) * extent, (high[k] - middle[k]) * extent
        rise[k] = 1.0 / lower if lower > 0.0 else 0.0
        fall[k] = 1.0 / upper if upper > 0.0 else 0.0
        first = max(np.ceil(low[k]), 0.0)
        column[k] = np.int32(first)
        crossed[k] = np.int32(max(np.ceil(high[k]), 0.0)) - np.int32(first)


@inlined
def _share(c, low, middle, high, rise, fall):  # type: ignore[no-untyped-def]
    """Share of a face above an offset that it crosses."""
    return 1.0 - (c - low) * (c - low) * rise if c < middle else (high - c) * (high - c) * fall


@inlined
def _moment(c, low, middle, high, rise, fall):  # type: ignore[no-untyped-def]
    """First moment about an offset of the share of a face above it."""
    mean, up, down = (low + middle + high) * THIRD, c - low, high - c
    return mean - c + up * up * rise * up * THIRD if c < middle else down * down * fall * down * THIRD


@vector_part
def _weigh(ahead, low, middle, high, rise, fall, weight, area, moment):  # type: ignore[no-untyped-def]
    for k in range(len(low)):
        c = max(np.ceil(low[k]), 0.0) + ahead
        inside = weight[k] if c < high[k] else 0.0
        area[k] = inside * _share(c, low[k], middle[k], high[k], rise[k], fall[k])
        moment[k] = inside * _moment(c, low[k], middle[k], high[k], rise[k], fall[k])


@vector_part
def _add_volumes(column, crossed, low, middle, high, rise, fall, weight, parts, sums):  # type: ignore[no-untyped-def]
    for k in range(len(low)):
        b = np.uint32(column[k])
        sums[b, 0] += weight[k]
        sums[b, 1] += weight[k] * ((low[k] + middle[k] + high[k]) * THIRD)
        sums[b, 2] += parts[0, k]
        sums[b, 3] += parts[1, k]
        sums[b + 1, 2] += parts[2, k]
        sums[b + 1, 3] += parts[3, k]
        sums[b + 2, 2] += parts[4, k]
        sums[b + 2, 3] += parts[5, k]
        for ahead in range(AHEAD, crossed[k]):
            c = float(b) + ahead
            sums[b + ahead, 2] += weight[k] * _share(c, low[k], middle[k], high[k], rise[k], fall[k])
            sums[b + ahead, 3] += weight[k] * _moment(c, low[k], middle[k], high[k], rise[k], fall[k])


@part
def sum_volumes(corners, vectors, d, heights, n, step, section, volume):  # type: ignore[no-untyped-def]
    """Cross-section at and volume above each offset, by the divergence theorem."""
    sums = table(n + AHEAD + 1, 4)
    rows, parts, places = table(6, BLOCK), table(2 * AHEAD, BLOCK), int_table(2, BLOCK)
    for begin in range(0, corners.shape[1], BLOCK):
        end = min(begin + BLOCK, corners.shape[1])
        size = end - begin
        low, middle, high = rows[0, :size], rows[1, :size], rows[2, :size]
        rise, fall, weight = rows[3, :size], rows[4, :size], rows[5, :size]
        _sorted_heights(corners[0, begin:end], corners[1, begin:end], corners[2, begin:end], heights, low, middle, high)
        dot(vectors[0, begin:end], vectors[1, begin:end], vectors[2, begin:end], d[0], d[1], d[2], weight)
        _ramps(low, middle, high, rise, fall, places[0, :size], places[1, :size])
        for ahead in range(AHEAD):
            _weigh(float(ahead), low, middle, high, rise, fall, weight, parts[2 * ahead, :size], parts[2 * ahead + 1, :size])
        _add_volumes(places[0, :size], places[1, :size], low, middle, high, rise, fall, weight, parts, sums)
    whole, first_moment = 0.0, 0.0
    for column in range(n - 1, -1, -1):
        whole += sums[column + 1, 0]
        first_moment += sums[column + 1, 1]
        section[column] = sums[column, 2] + whole
        volume[column] = (sums[column, 3] + first_moment - column * whole) * step


@part
def _select(normals, risky, d, risky_below, chosen, kind):  # type: ignore[no-untyped-def]
    """The faces that are risky either way, with 1: upright only, 2: along d only, 3: both; returns how many."""
    slopes = floats(BLOCK, 0.0)
    many = 0
    for begin in range(0, normals.shape[1], BLOCK):
        end = min(begin + BLOCK, normals.shape[1])
        dot(normals[0, begin:end], normals[1, begin:end], normals[2, begin:end], d[0], d[1], d[2], slopes[: end - begin])
        for f in range(begin, end):
            code = int(risky[f]) + 2 * int(slopes[f - begin] < risky_below)
            chosen[many], kind[many] = f, code
            many += int(code > 0)
    return many


@vector_part
def _pick(chosen, a, b, c, areas, p, q, r, weight):  # type: ignore[no-untyped-def]
    for k in range(len(chosen)):
        f = np.uint32(chosen[k])
        p[k], q[k], r[k] = a[f], b[f], c[f]
    for k in range(len(chosen)):
        weight[k] = areas[chosen[k]]


@vector_part
def _cover(ahead, low, middle, high, rise, fall, weight, area):  # type: ignore[no-untyped-def]
    for k in range(len(low)):
        c = max(np.ceil(low[k]), 0.0) + ahead
        inside = weight[k] if c < high[k] else 0.0
        area[k] = inside * _share(c, low[k], middle[k], high[k], rise[k], fall[k])


@vector_part
def _add_areas(kind, column, crossed, low, middle, high, rise, fall, weight, parts, sums):  # type: ignore[no-untyped-def]
    for k in range(len(low)):
        b, which = np.uint32(column[k]), 2 * np.uint32(kind[k])
        sums[b, which] += weight[k]
        sums[b, which + 1] += parts[0, k]
        sums[b + 1, which + 1] += parts[1, k]
        sums[b + 2, which + 1] += parts[2, k]
        for ahead in range(AHEAD, crossed[k]):
            c = float(b) + ahead
            sums[b + ahead, which + 1] += weight[k] * _share(c, low[k], middle[k], high[k], rise[k], fall[k])


@part
def sum_risks(corners, normals, areas, risky, d, heights, n, risky_below, room, up, residual):  # type: ignore[no-untyped-def]
    """Risky areas above each offset: printed straight up, and along d. Only the faces that are risky either way count.

    room: (2, m + 1) whole numbers to work in.
    """
    sums = table(n + AHEAD + 1, 8)
    chosen, kind = room[0], room[1]
    many = _select(normals, risky, d, risky_below, chosen, kind)
    rows, parts, places = table(6, BLOCK), table(AHEAD, BLOCK), int_table(2, BLOCK)
    picked = np.empty((3, BLOCK), np.uint32)
    for begin in range(0, many, BLOCK):
        end = min(begin + BLOCK, many)
        size = end - begin
        low, middle, high = rows[0, :size], rows[1, :size], rows[2, :size]
        rise, fall, weight = rows[3, :size], rows[4, :size], rows[5, :size]
        a, b, c = picked[0, :size], picked[1, :size], picked[2, :size]
        _pick(chosen[begin:end], corners[0], corners[1], corners[2], areas, a, b, c, weight)
        _sorted_heights(a, b, c, heights, low, middle, high)
        _ramps(low, middle, high, rise, fall, places[0, :size], places[1, :size])
        for ahead in range(AHEAD):
            _cover(float(ahead), low, middle, high, rise, fall, weight, parts[ahead, :size])
        _add_areas(kind[begin:end], places[0, :size], places[1, :size], low, middle, high, rise, fall, weight, parts, sums)
    whole = floats(4, 0.0)
    for column in range(n - 1, -1, -1):
        for which in range(1, 4):
            whole[which] += sums[column + 1, 2 * which]
        both = sums[column, 7] + whole[3]
        up[column] = sums[column, 3] + whole[1] + both
        residual[column] = sums[column, 5] + whole[2] + both


@part
def find_lowest(z, edges, heights, n, watched, lowest):  # type: ignore[no-untyped-def]
    """Least z above each offset, among vertices and crossings of edges, lowest first, below the watched height."""
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
