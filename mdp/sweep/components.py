"""Components: whether the solid below each offset of a direction hangs together with the platform.

The surface below a rising plane gains a component at a vertex without a lower neighbour and components join only at a vertex
whose lower neighbours form several runs around it (PL Morse theory, ties of height broken by number); all other vertices are
regular and need no look. So the components form a merge tree: its leaves are the lowest vertices, and a vertex belongs to the
leaf that walking down from it leads to. A lowest vertex around which solid lies beneath is the floor of a void or bowl, not a
floating piece: it is joined to its anchor, the surface that a ray into the solid meets, which lies lower. Solids join only where
surfaces join, so the count of pieces is exact for the solid, closed voids and handles included.
"""

from typing import NamedTuple

import numpy as np

from mdp.kernels.arrays import floats, int_table, ints
from mdp.kernels.kernel import helper, no_nrt
from mdp.kernels.sorting import counting_sort
from mdp.mesh import Floats, Ints
from mdp.overhang import PLATFORM_TOLERANCE_MM
from mdp.sweep.facets import UNKNOWN, Layout, Rings
from mdp.sweep.integrals import OffsetGrid, column_over
from mdp.sweep.rays import ANY_FACE, first_hit
from mdp.topology.components import root, singletons


class View(NamedTuple):
    """A solid seen along one direction: offsets, (n,) cosines of the vertex normals, and the vertices that are not regular."""

    grid: OffsetGrid
    cosines: Floats
    critical: Ints


class MergeTree(NamedTuple):
    """A merge tree under construction, from below or from above (up): heights of the vertices and the rings around them, the
    vertices that are not regular, (n,) the leaf that each vertex belongs to (-1: not known), and (n,) room for a path."""

    heights: Floats
    rings: Rings
    critical: Ints
    leaf: Ints
    path: Ints
    up: bool


@no_nrt
def find_critical(cosines: Floats, flatness: Floats, heights: Floats, rings: Rings, critical: Ints) -> int:
    """Vertices that are not regular, or have no single ring of neighbours; returns how many. cosines: of vertex normals and d."""
    starts, neighbours = rings.starts, rings.neighbours
    many = 0
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
    """Whether a comes before b: strictly lower, ties by number; the reverse for a sweep from the top (up)."""
    lower: bool = heights[a] < heights[b] or (heights[a] == heights[b] and a < b)
    return lower != up


@helper
def grow_tree(view: View, rings: Rings, up: bool) -> MergeTree:
    """A merge tree of which nothing is known yet."""
    heights = view.grid.heights
    return MergeTree(heights, rings, view.critical, ints(len(heights), -1), ints(len(heights), 0), up)


@no_nrt
def find_leaf(tree: MergeTree, v: int) -> int:
    """The leaf of a vertex; labels all vertices on the way. The vertices that are leaves are labelled already."""
    heights, starts, neighbours = tree.heights, tree.rings.starts, tree.rings.neighbours
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
    """Number the vertices at which components begin; returns them."""
    starts, neighbours = tree.rings.starts, tree.rings.neighbours
    leaves = ints(len(tree.critical), 0)
    size = 0
    for v in tree.critical:
        first = starts[v] < starts[v + 1]
        for at in range(starts[v], starts[v + 1]):
            first = first and not before(tree.heights, neighbours[at], v, tree.up)
        if first:
            tree.leaf[v], leaves[size] = size, v
            size += 1
    return leaves[:size]


@helper
def anchor_of(layout: Layout, v: int) -> int:
    """The face that a ray from a vertex into the solid meets; below 0: none."""
    if layout.anchors[v] == UNKNOWN:
        # Threads may look up the same vertex twice; the answer does not depend on the direction.
        triangles, inward = layout.triangles, floats(3, 0.0)
        for axis in range(3):
            inward[axis] = -layout.vertex_normals[axis, v]
        layout.anchors[v] = first_hit(triangles, triangles.vertices[v], inward, np.inf, v, ANY_FACE)
    return int(layout.anchors[v])


@helper
def _anchor_beyond(tree: MergeTree, layout: Layout, v: int, cosine: float) -> int:
    """A vertex, passed before, of the face that a ray from the first one of a void into the solid meets; below 0: none."""
    faces, heights = layout.triangles.faces, tree.heights
    face = anchor_of(layout, v) if cosine != 0.0 and (cosine < 0.0) == tree.up else -1
    if face < 0:
        return -1
    w = faces[face, 0]
    for corner in (1, 2):
        if before(heights, faces[face, corner], w, tree.up):
            w = faces[face, corner]
    return int(w) if before(heights, w, v, tree.up) else -1


@helper
def join_leaves(tree: MergeTree, leaves: Ints, layout: Layout, cosines: Floats) -> Ints:
    """(j, 3): two leaves whose components join, and the vertex at which they do: a saddle, or through solid the first of a void.

    cosines: of vertex normals and the direction.
    """
    starts, neighbours, most, size = tree.rings.starts, tree.rings.neighbours, len(leaves), 0
    for v in tree.critical:
        most += starts[v + 1] - starts[v]
    joins = int_table(most, 3)
    for v in tree.critical:
        last = -1
        for at in range(starts[v], starts[v + 1]):
            if before(tree.heights, neighbours[at], v, tree.up):
                leaf = find_leaf(tree, int(neighbours[at]))
                if last >= 0 and leaf != last:
                    joins[size, 0], joins[size, 1], joins[size, 2] = last, leaf, v
                    size += 1
                last = leaf
    for leaf in range(len(leaves)):
        w = _anchor_beyond(tree, layout, int(leaves[leaf]), cosines[leaves[leaf]])
        if w >= 0:
            joins[size, 0], joins[size, 1], joins[size, 2] = leaf, find_leaf(tree, w), leaves[leaf]
            size += 1
    return joins[:size]


@helper
def join_columns(joins: Ints, grid: OffsetGrid) -> Ints:
    """The first column that is not below each join."""
    columns = ints(len(joins), 0)
    for k in range(len(joins)):
        columns[k] = min(column_over(grid.heights[joins[k, 2]]), grid.columns)
    return columns


@no_nrt
def _stands_on(tree: MergeTree, v: int, vertices: Floats) -> bool:
    """Whether a neighbour further down stands on the platform too: then v's component stands there already."""
    starts, neighbours = tree.rings.starts, tree.rings.neighbours
    for at in range(starts[v], starts[v + 1]):
        w = neighbours[at]
        if vertices[w, 2] <= PLATFORM_TOLERANCE_MM and before(tree.heights, w, v, False):
            return True
    return False


@helper
def count_pieces(layout: Layout, view: View, pieces: Ints) -> None:
    """Components below each offset that do not reach the platform."""
    heights, n = view.grid.heights, view.grid.columns
    tree = grow_tree(view, layout.rings, n < 0)  # a constant would have all these functions compiled once for every value of it
    leaves = number_leaves(tree)
    joins = join_leaves(tree, leaves, layout, view.cosines)
    size = len(leaves)
    begun, standing_from = ints(size, 0), ints(size, n + 1)
    for leaf in range(size):
        begun[leaf] = min(column_over(heights[leaves[leaf]]), n)
    for k in range(len(layout.standing)):
        v = int(layout.standing[k])
        if not _stands_on(tree, v, layout.triangles.vertices):
            leaf = find_leaf(tree, v)
            standing_from[leaf] = min(standing_from[leaf], min(column_over(heights[v]), n))
    _count(begun, standing_from, joins, join_columns(joins, view.grid), pieces[:n])


@helper
def _count(begun: Ints, standing_from: Ints, joins: Ints, columns: Ints, pieces: Ints) -> None:
    """Join leaves in the order of the offsets and count the components that hang free."""
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
