"""Contact area: the area that each piece of the solid above a plane stands on (kernels of the sweep).

The merge tree of mdp.sweep.components from the top: its leaves are the highest vertices, their components join at saddles on the
way down, and of two that join the one of the higher leaf goes on. So every leaf is a piece of its own in one run of columns, and
the sections of all pieces take one number for each column of each run. Only wanted columns with several pieces are looked at: a
single piece stands on the whole section.
"""

import numpy as np

from mdp.kernels.arrays import floats, ints, table
from mdp.kernels.kernel import helper, no_nrt
from mdp.kernels.sorting import counting_sort
from mdp.mesh import Floats, Ints
from mdp.sweep.components import View, before, find_leaf, grow_tree, join_columns, join_leaves, number_leaves
from mdp.sweep.facets import Layout
from mdp.sweep.integrals import OffsetGrid, column_over
from mdp.topology.components import root, singletons

LEAST_CONTACT_AREA_MM2 = 1e-6  # a piece that stands on less floats in the air, whatever interface is asked for


@helper
def find_contact_areas(layout: Layout, view: View, crumb: float, wanted: Ints, contact_area: Floats) -> None:
    """Lower each offset's contact area, given as its section, to the least section of a piece above it that is at least `crumb`
    steps high.

    Only at the wanted (n,) offsets.
    """
    grid, corners = view.grid, layout.faces.corners
    heights, n = grid.heights, grid.columns
    tree = grow_tree(view, layout.rings, n >= 0)
    leaves = number_leaves(tree)
    if len(leaves) == 1:
        return
    joins = join_leaves(tree, leaves, layout, view.cosines)
    begun, ended, elder = _find_lifetimes(leaves, joins, grid)
    several = _count_several(begun, ended, wanted)
    if several[n] == 0:
        return
    starts = ints(len(leaves) + 1, 0)
    for leaf in range(len(leaves)):
        starts[leaf + 1] = starts[leaf] + max(begun[leaf] - ended[leaf], 0)
    areas, ends = floats(starts[len(leaves)], 0.0), table(2, 3)
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
        leaf = int(tree.leaf[top])
        if leaf < 0:
            leaf = find_leaf(tree, int(np.int64(top)))  # of the type that other calls have: one compilation serves all
        for column in range(first, last):
            if several[column] < several[column + 1]:
                piece = leaf
                while ended[piece] > column:
                    piece = elder[piece]
                areas[starts[piece] + column - ended[piece]] += _section(layout.faces.points, (i, j, k), grid, column, ends)
    for piece in range(len(leaves)):
        for column in range(ended[piece], min(begun[piece], int(heights[leaves[piece]] - crumb) + 1)):
            if several[column] < several[column + 1]:
                contact_area[column] = min(contact_area[column], areas[starts[piece] + column - ended[piece]])


@helper
def _find_lifetimes(leaves: Ints, joins: Ints, grid: OffsetGrid) -> tuple[Ints, Ints, Ints]:
    """For every leaf: the column below which it begins, the one below which it has gone, and the leaf it goes into."""
    heights, n, size = grid.heights, grid.columns, len(leaves)
    begun, ended, elder, parent = ints(size, 0), ints(size, 0), singletons(size), singletons(size)
    for leaf in range(size):
        begun[leaf] = min(column_over(heights[leaves[leaf]]), n)
    columns = join_columns(joins, grid)
    _, sequence = counting_sort(columns, n + 1)
    for at in range(len(sequence) - 1, -1, -1):
        k = sequence[at]
        a, b = root(parent, joins[k, 0]), root(parent, joins[k, 1])
        if a != b:
            if before(heights, leaves[a], leaves[b], n >= 0):
                a, b = b, a
            parent[a], elder[a], ended[a] = b, b, columns[k]
    return begun, ended, elder


@helper
def _count_several(begun: Ints, ended: Ints, wanted: Ints) -> Ints:
    """(n + 1,) how many of the wanted columns before each have several pieces above them."""
    n = len(wanted)
    pieces, several = ints(n + 1, 0), ints(n + 1, 0)
    for leaf in range(len(begun)):
        if begun[leaf] > ended[leaf]:
            pieces[ended[leaf]] += 1
            pieces[begun[leaf]] -= 1
    here = 0
    for column in range(n):
        here += pieces[column]
        several[column + 1] = several[column] + int(here > 1 and wanted[column])
    return several


@no_nrt
def _section(points: Floats, face: tuple[int, int, int], grid: OffsetGrid, column: int, ends: Floats) -> float:
    """A face's share of the area within the section's outline: half the triangle of its crossing segment and the origin."""
    (i, j, k), heights, d = face, grid.heights, grid.direction
    for v, w in ((i, j), (j, k), (k, i)):
        if (heights[v] > column) != (heights[w] > column):
            share = (column - heights[v]) / (heights[w] - heights[v])
            end = int(heights[w] > column)
            for axis in range(3):
                ends[end, axis] = points[axis, v] + share * (points[axis, w] - points[axis, v])
    x = ends[0, 1] * ends[1, 2] - ends[0, 2] * ends[1, 1]
    y = ends[0, 2] * ends[1, 0] - ends[0, 0] * ends[1, 2]
    z = ends[0, 0] * ends[1, 1] - ends[0, 1] * ends[1, 0]
    area: float = 0.5 * (x * d[0] + y * d[1] + z * d[2])
    return area
