"""Components: whether the solid below each offset of a direction is connected to the build plate, and the contact area of each
piece of the solid above it (kernels of the sweep).

The surface below a rising plane gains a component at a vertex without a lower neighbour and components join only at a vertex
whose lower neighbours form several runs around it (PL Morse theory, ties of height broken by number); all other vertices are
regular and are skipped. So the components form a merge tree: its leaves are the local minima, and a vertex belongs to the leaf
reached by descending from it. A local minimum with solid beneath it is the floor of a void or bowl, not a floating piece: it is
joined to its anchor, the lower surface that a ray into the solid meets. Solids join only where surfaces join, so the count of
pieces is exact for the solid, closed voids and handles included.

From the top the leaves are the local maxima, and when two components join at a saddle on the way down, the one with the higher
leaf continues. So every leaf is a separate piece in one run of columns, and the sections of all pieces take one number for each
column of each run. Only the requested columns with several pieces are evaluated: a single piece stands on the whole section.
"""

from typing import NamedTuple

import numpy as np

from mdp.kernels.arrays import floats, int_table, ints, table
from mdp.kernels.kernel import helper, no_nrt
from mdp.kernels.sorting import counting_sort
from mdp.mesh import Floats, Ints
from mdp.overhang import PLATE_TOLERANCE_MM
from mdp.sweep.crossing import OffsetGrid, column_over
from mdp.sweep.facets import UNKNOWN, Layout
from mdp.sweep.rays import ANY_FACE, first_hit
from mdp.topology.components import root, singletons

LEAST_CONTACT_AREA_MM2 = 1e-6  # a piece that stands on less floats, whatever the required interface


class MergeTree(NamedTuple):
    """A merge tree of a surface along one direction under construction, from below or from above (up): cosines (n,) of the vertex
    normals, the critical vertices, (n,) the leaf of each vertex (-1 if unknown), and (n,) scratch space for a path.
    """

    layout: Layout
    grid: OffsetGrid
    cosines: Floats
    critical: Ints
    leaf: Ints
    path: Ints
    up: bool


@no_nrt
def find_critical(layout: Layout, heights: Floats, cosines: Floats, critical: Ints) -> int:
    """List the critical vertices: those that are not regular or have no single ring of neighbours; returns their number. cosines:
    of vertex normals and direction.
    """
    starts, neighbours, flatness, many = layout.starts, layout.neighbours, layout.flatness, 0
    for v in range(len(heights)):
        if abs(cosines[v]) >= flatness[v]:
            turns = 0
            last = before(heights, neighbours[starts[v + 1] - 1], v, False) if starts[v] < starts[v + 1] else False
            for at in range(starts[v], starts[v + 1]):
                lower = before(heights, neighbours[at], v, False)
                turns += int(lower != last)
                last = lower
            if turns != 2 or flatness[v] < 0.0:
                critical[many] = v
                many += 1
    return many


@no_nrt
def before(heights: Floats, a: int, b: int, up: bool) -> bool:
    """Whether vertex a comes before b: strictly lower, ties by number; the reverse for a sweep from the top (up)."""
    lower: bool = heights[a] < heights[b] or (heights[a] == heights[b] and a < b)
    return lower != up


@helper
def plant_tree(layout: Layout, grid: OffsetGrid, cosines: Floats, critical: Ints, up: bool) -> MergeTree:
    """An empty merge tree."""
    return MergeTree(layout, grid, cosines, critical, ints(len(cosines), -1), ints(len(cosines), 0), up)


@no_nrt
def find_leaf(tree: MergeTree, v: int) -> int:
    """The leaf of a vertex; also labels all vertices on the path. Leaves must be labelled already."""
    heights, starts, neighbours = tree.grid.heights, tree.layout.starts, tree.layout.neighbours
    leaf, path, up = tree.leaf, tree.path, tree.up
    length = 0
    while leaf[v] < 0:
        path[length] = v
        length += 1
        for at in range(starts[v], starts[v + 1]):
            if before(heights, neighbours[at], v, up):
                v = int(neighbours[at])
                break
    for k in range(length):
        leaf[path[k]] = leaf[v]
    return int(leaf[v])


@helper
def number_leaves(tree: MergeTree) -> Ints:
    """Number the leaves, the vertices at which components begin; returns them."""
    starts, neighbours = tree.layout.starts, tree.layout.neighbours
    leaves, size = ints(len(tree.critical), 0), 0
    for v in tree.critical:
        first = starts[v] < starts[v + 1]
        for at in range(starts[v], starts[v + 1]):
            first = first and not before(tree.grid.heights, neighbours[at], v, tree.up)
        if first:
            tree.leaf[v], leaves[size] = size, v
            size += 1
    return leaves[:size]


@helper
def anchor_of(layout: Layout, v: int) -> int:
    """The face that a ray from a vertex into the solid meets; -1 if none."""
    if layout.anchors[v] == UNKNOWN:
        # Threads may look up the same vertex twice; the result does not depend on the direction.
        triangles, inward = layout.triangles, table(2, 3)
        for axis in range(3):
            inward[0, axis], inward[1, axis] = triangles.vertices[v, axis], -layout.vertex_normals[axis, v]
        layout.anchors[v] = first_hit(triangles, inward, np.inf, v, ANY_FACE, 0.0)
    return int(layout.anchors[v])


@helper
def _anchor_beyond(tree: MergeTree, v: int) -> int:
    """A vertex, passed earlier, of the face that a ray from the first vertex of a void into the solid meets; -1 if none."""
    faces, heights, cosine = tree.layout.triangles.faces, tree.grid.heights, tree.cosines[v]
    face = anchor_of(tree.layout, v) if cosine != 0.0 and (cosine < 0.0) == tree.up else -1
    if face < 0:
        return -1
    w = faces[face, 0]
    for corner in (1, 2):
        if before(heights, faces[face, corner], w, tree.up):
            w = faces[face, corner]
    return int(w) if before(heights, w, v, tree.up) else -1


@helper
def join_leaves(tree: MergeTree, leaves: Ints) -> Ints:
    """(j, 3) joins: two leaves whose components join, and the vertex where they do, a saddle or, through solid, the first vertex
    of a void.
    """
    starts, neighbours, most, size = tree.layout.starts, tree.layout.neighbours, len(leaves), 0
    for v in tree.critical:
        most += starts[v + 1] - starts[v]
    joins = int_table(most, 3)
    for v in tree.critical:
        last = -1
        for at in range(starts[v], starts[v + 1]):
            if before(tree.grid.heights, neighbours[at], v, tree.up):
                leaf = find_leaf(tree, int(neighbours[at]))
                if last >= 0 and leaf != last:
                    joins[size, 0], joins[size, 1], joins[size, 2] = last, leaf, v
                    size += 1
                last = leaf
    for leaf in range(len(leaves)):
        w = _anchor_beyond(tree, int(leaves[leaf]))
        if w >= 0:
            joins[size, 0], joins[size, 1], joins[size, 2] = leaf, find_leaf(tree, w), leaves[leaf]
            size += 1
    return joins[:size]


@helper
def join_columns(joins: Ints, grid: OffsetGrid) -> Ints:
    """(j,) first column that is not below each join."""
    columns = ints(len(joins), 0)
    for k in range(len(joins)):
        columns[k] = min(column_over(grid.heights[joins[k, 2]]), grid.columns)
    return columns


@no_nrt
def _stands_on(tree: MergeTree, v: int) -> bool:
    """Whether a neighbour further down also stands on the plate, so that v's component stands there already."""
    layout = tree.layout
    for at in range(layout.starts[v], layout.starts[v + 1]):
        w = layout.neighbours[at]
        if layout.triangles.vertices[w, 2] <= PLATE_TOLERANCE_MM and before(tree.grid.heights, w, v, False):
            return True
    return False


@helper
def count_pieces(tree: MergeTree, pieces: Ints) -> None:
    """Count the components below each offset that do not reach the plate, by a tree from below."""
    heights, n, standing = tree.grid.heights, tree.grid.columns, tree.layout.standing
    leaves = number_leaves(tree)
    joins, size = join_leaves(tree, leaves), len(leaves)
    begun, standing_from = ints(size, 0), ints(size, n + 1)
    for leaf in range(size):
        begun[leaf] = min(column_over(heights[leaves[leaf]]), n)
    for k in range(len(standing)):
        v = int(standing[k])
        if not _stands_on(tree, v):
            leaf = find_leaf(tree, v)
            standing_from[leaf] = min(standing_from[leaf], min(column_over(heights[v]), n))
    _count(begun, standing_from, joins, join_columns(joins, tree.grid), pieces[:n])


@helper
def _count(begun: Ints, standing_from: Ints, joins: Ints, columns: Ints, pieces: Ints) -> None:
    """Join leaves in the order of the offsets and count the floating components."""
    size, n = len(begun), len(pieces)
    parent, stands = singletons(size), ints(size, 0)
    birth, _ = counting_sort(begun, n + 2)
    landing, landed = counting_sort(standing_from, n + 2)
    joining, joined = counting_sort(columns, n + 2)
    floating = 0
    for b in range(n):
        floating += birth[b + 1] - birth[b]
        for at in range(joining[b], joining[b + 1]):
            k = joined[at]
            p, q = root(parent, joins[k, 0]), root(parent, joins[k, 1])
            if p != q:
                if stands[p] == 0 or stands[q] == 0:
                    floating -= 1
                parent[max(p, q)] = min(p, q)
                stands[min(p, q)] = max(stands[p], stands[q])
        for at in range(landing[b], landing[b + 1]):
            here = root(parent, landed[at])
            if stands[here] == 0:
                stands[here] = 1
                floating -= 1
        pieces[b] = floating


@helper
def find_contact_areas(tree: MergeTree, fragment: float, wanted: Ints, contact_area: Floats) -> None:
    """Reduce each offset's contact area, initially its section, to the least section of a piece above it that is at least
    `fragment` steps high, by a tree from above.

    Only at the requested (n,) offsets.
    """
    grid, corners = tree.grid, tree.layout.faces.corners
    heights, n, points = grid.heights, grid.columns, tree.layout.faces.points
    leaves = number_leaves(tree)
    if len(leaves) == 1:
        return
    joins = join_leaves(tree, leaves)
    begun, ended, elder = _find_lifetimes(leaves, joins, grid)
    several = _count_several(begun, ended, wanted)
    if several[n] == 0:
        return
    starts = ints(len(leaves) + 1, 0)
    for leaf in range(len(leaves)):
        starts[leaf + 1] = starts[leaf] + max(begun[leaf] - ended[leaf], 0)
    areas, ends = floats(starts[len(leaves)], 0.0), table(2, 3)
    for f in range(corners.shape[1]):
        i, j, k = corners[0, f], corners[1, f], corners[2, f]
        p, q, r = heights[i], heights[j], heights[k]
        first, last = column_over(min(p, q, r)), column_over(max(p, q, r))
        if several[min(first, n)] == several[last]:
            continue
        top = i if p >= max(q, r) else (j if q >= r else k)
        leaf = int(tree.leaf[top])
        if leaf < 0:
            leaf = find_leaf(tree, int(np.int64(top)))  # same type as in other calls, so that one compilation serves all
        for column in range(first, last):
            if several[column] < several[column + 1]:
                piece = leaf
                while ended[piece] > column:
                    piece = elder[piece]
                areas[starts[piece] + column - ended[piece]] += _section(points, (i, j, k), grid, column, ends)
    for piece in range(len(leaves)):
        for column in range(ended[piece], min(begun[piece], int(heights[leaves[piece]] - fragment) + 1)):
            if several[column] < several[column + 1]:
                contact_area[column] = min(contact_area[column], areas[starts[piece] + column - ended[piece]])


@helper
def _find_lifetimes(leaves: Ints, joins: Ints, grid: OffsetGrid) -> tuple[Ints, Ints, Ints]:
    """For every leaf: the column below which it begins, the column below which it has ended, and the leaf that it joins."""
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
    """(n + 1,) number of requested columns before each column that have several pieces above them."""
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
    """A face's share of the area within the section's outline: half the parallelogram of its crossing segment and the origin."""
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
