"""Footing: the area that each piece of the solid above a plane stands on (kernels of the sweep).

The sweep of mdp.pieces from the top: basins begin at the highest vertices and join at saddles on the way down; of two that join
the higher one goes on. So every basin is a piece of its own in one run of columns, and the sections of all pieces take one
number for each column of each run. Only wanted columns with several pieces are looked at: a single piece stands on the whole
section.
"""

from mdp.kernel import floats, ints, part, table
from mdp.pieces import alone, anchor_joins, before, begin_basins, by_column, join_columns, root, saddle_joins, together, walk
from mdp.sums import column_over


@part
def find_footing(solid, d, heights, crumb, wanted, footing):  # type: ignore[no-untyped-def]
    """Lower each offset's footing, given as its section, to the least section of a piece at least `crumb` steps high above it.

    Only at the wanted (n,) offsets.
    """
    points, corners, surface, links, found, tree, anchor, cosines = solid
    n = len(wanted)
    label, path = ints(len(heights), -1), ints(len(heights), 0)
    up = n >= 0
    seeds = begin_basins(found, heights, links, label, up)
    if len(seeds) == 1:
        return
    saddles = saddle_joins(found, heights, links, label, path, up)
    anchored = anchor_joins(seeds, surface, tree, anchor, cosines, heights, links, label, path, up)
    joins = together(saddles, anchored)
    begun, ended, elder = _lifetimes(seeds, joins, heights, n)
    several = _several(begun, ended, wanted)
    if several[n] == 0:
        return
    starts = ints(len(seeds) + 1, 0)
    for basin in range(len(seeds)):
        starts[basin + 1] = starts[basin] + max(begun[basin] - ended[basin], 0)
    areas, ends = floats(starts[len(seeds)], 0.0), table(2, 3)
    lowest, highest = 0, n - 1
    while several[lowest + 1] == 0:
        lowest += 1
    while several[highest] == several[n]:
        highest -= 1
    for f in range(corners.shape[1]):
        i, j, k = corners[0, f], corners[1, f], corners[2, f]
        p, q, r = heights[i], heights[j], heights[k]
        if max(p, q, r) <= lowest or min(p, q, r) > highest:
            continue
        first, last = column_over(min(p, q, r)), column_over(max(p, q, r))
        if several[min(first, n)] == several[last]:
            continue
        top = i if p >= max(q, r) else (j if q >= r else k)
        basin = walk(int(top), heights, links, label, path, up)
        for column in range(first, last):
            if several[column] < several[column + 1]:
                piece = basin
                while ended[piece] > column:
                    piece = elder[piece]
                areas[starts[piece] + column - ended[piece]] += _section(points, i, j, k, heights, d, column, ends)
    for piece in range(len(seeds)):
        for column in range(ended[piece], min(begun[piece], int(heights[seeds[piece]] - crumb) + 1)):
            if several[column] < several[column + 1]:
                footing[column] = min(footing[column], areas[starts[piece] + column - ended[piece]])


@part
def _lifetimes(seeds, joins, heights, n):  # type: ignore[no-untyped-def]
    """For every basin: the column below which it begins, the one below which it has gone, and the basin it goes into."""
    size = len(seeds)
    begun, ended, elder, parent = ints(size, 0), ints(size, 0), alone(size), alone(size)
    for basin in range(size):
        begun[basin] = min(column_over(heights[seeds[basin]]), n)
    columns = join_columns(joins, heights, n)
    sequence, _ = by_column(columns, n)
    for place in range(len(sequence) - 1, -1, -1):
        k = sequence[place]
        a, b = root(parent, joins[k, 0]), root(parent, joins[k, 1])
        if a != b:
            if before(heights, seeds[a], seeds[b], n >= 0):
                a, b = b, a
            parent[a], elder[a], ended[a] = b, b, columns[k]
    return begun, ended, elder


@part
def _several(begun, ended, wanted):  # type: ignore[no-untyped-def]
    """(n + 1,) how many of the wanted columns before each have several pieces above them."""
    n = len(wanted)
    pieces, several = ints(n + 1, 0), ints(n + 1, 0)
    for basin in range(len(begun)):
        if begun[basin] > ended[basin]:
            pieces[ended[basin]] += 1
            pieces[begun[basin]] -= 1
    here = 0
    for column in range(n):
        here += pieces[column]
        several[column + 1] = several[column] + int(here > 1 and wanted[column])
    return several


@part
def _section(points, i, j, k, heights, d, column, ends):  # type: ignore[no-untyped-def]
    """A face's share of the area within the section's outline: half the triangle of its crossing segment and the origin."""
    for v, w in ((i, j), (j, k), (k, i)):
        if (heights[v] > column) != (heights[w] > column):
            part = (column - heights[v]) / (heights[w] - heights[v])
            end = int(heights[w] > column)
            for axis in range(3):
                ends[end, axis] = points[axis, v] + part * (points[axis, w] - points[axis, v])
    x = ends[0, 1] * ends[1, 2] - ends[0, 2] * ends[1, 1]
    y = ends[0, 2] * ends[1, 0] - ends[0, 0] * ends[1, 2]
    z = ends[0, 0] * ends[1, 1] - ends[0, 1] * ends[1, 0]
    return 0.5 * (x * d[0] + y * d[1] + z * d[2])
