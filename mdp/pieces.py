"""Pieces: whether the solid below each offset of a direction hangs together with the platform.

The surface below a rising plane gains a component at a vertex without a lower neighbour and components join only at a vertex
whose lower neighbours form several runs around it (PL Morse theory, ties of height broken by number); all other vertices are
regular and need no look. A component is named after the lowest vertex that walking down leads to: its basin. A lowest vertex
around which solid lies beneath is the floor of a void or bowl, not a floating piece: it is joined to its anchor, the surface
that a ray into the solid meets, which lies lower. Solids join only where surfaces join, so the count of pieces is exact for the
solid, closed voids and handles included.
"""

import numpy as np

from mdp.kernel import inlined, int_table, ints, part
from mdp.overhang import PLATFORM_TOLERANCE_MM
from mdp.rays import first_hit
from mdp.sums import column_over

UNKNOWN = -2


@part
def find_critical(cosines, flatness, heights, links, found):  # type: ignore[no-untyped-def]
    """Vertices that are not regular, or have no single ring of neighbours; returns how many. cosines: of vertex normals and d."""
    starts, neighbours = links
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
                found[many] = v
                many += 1
    return many


@inlined
def before(heights, a, b, up):  # type: ignore[no-untyped-def]
    """Whether a comes before b: strictly lower, ties by number; the reverse for a sweep from the top (up)."""
    lower = heights[a] < heights[b] or (heights[a] == heights[b] and a < b)
    return lower != up


@part
def walk(v, heights, links, label, path, up):  # type: ignore[no-untyped-def]
    """The basin of a vertex; labels all vertices on the way. The vertices at which basins begin are labelled already."""
    starts, neighbours = links
    length = 0
    while label[v] < 0:
        path[length] = v
        length += 1
        for at in range(starts[v], starts[v + 1]):
            if before(heights, neighbours[at], v, up):
                v = int(neighbours[at])
                break
    for k in range(length):
        label[path[k]] = label[v]
    return label[v]


@part
def begin_basins(found, heights, links, label, up):  # type: ignore[no-untyped-def]
    """Number the vertices at which basins begin; returns them."""
    starts, neighbours = links
    seeds = ints(len(found), 0)
    size = 0
    for v in found:
        first = starts[v] < starts[v + 1]
        for at in range(starts[v], starts[v + 1]):
            first = first and not before(heights, neighbours[at], v, up)
        if first:
            label[v], seeds[size] = size, v
            size += 1
    return seeds[:size]


@part
def saddle_joins(found, heights, links, label, path, up):  # type: ignore[no-untyped-def]
    """(j, 3): two basins that meet, and the vertex at which they do."""
    starts, neighbours = links
    room = 0
    for v in found:
        room += starts[v + 1] - starts[v]
    joins = int_table(room, 3)
    size = 0
    for v in found:
        last = -1
        for at in range(starts[v], starts[v + 1]):
            if before(heights, neighbours[at], v, up):
                basin = walk(int(neighbours[at]), heights, links, label, path, up)
                if last >= 0 and basin != last:
                    joins[size, 0], joins[size, 1], joins[size, 2] = last, basin, v
                    size += 1
                last = basin
    return joins[:size]


@part
def anchor_joins(seeds, surface, tree, anchor, cosines, heights, links, label, path, up):  # type: ignore[no-untyped-def]
    """(j, 3): the basin of a void's first vertex, that of the surface which the ray from it meets, and the vertex."""
    vertices, faces, normals, vertex_normals = surface
    low, high = tree
    joins = int_table(len(seeds), 3)
    size = 0
    for basin in range(len(seeds)):
        v = seeds[basin]
        if cosines[v] == 0.0 or (cosines[v] < 0.0) != up:
            continue
        if anchor[v] == UNKNOWN:
            # Threads may look up the same vertex twice; the answer does not depend on the direction.
            anchor[v] = first_hit(vertices[v], -vertex_normals[v], np.inf, v, -2.0, vertices, faces, normals, low, high)
        if anchor[v] < 0:
            continue
        w = faces[anchor[v], 0]
        for corner in (1, 2):
            if before(heights, faces[anchor[v], corner], w, up):
                w = faces[anchor[v], corner]
        if before(heights, w, v, up):
            joins[size, 0], joins[size, 2] = basin, v
            joins[size, 1] = walk(int(w), heights, links, label, path, up)
            size += 1
    return joins[:size]


@part
def together(some, more):  # type: ignore[no-untyped-def]
    """The joins of two lists in one."""
    both = int_table(len(some) + len(more), 3)
    for k in range(len(some)):
        for which in range(3):
            both[k, which] = some[k, which]
    for k in range(len(more)):
        for which in range(3):
            both[len(some) + k, which] = more[k, which]
    return both


@part
def join_columns(joins, heights, n):  # type: ignore[no-untyped-def]
    """The first column that is not below each join."""
    columns = ints(len(joins), 0)
    for k in range(len(joins)):
        columns[k] = min(column_over(heights[joins[k, 2]]), n)
    return columns


@part
def alone(size):  # type: ignore[no-untyped-def]
    """The parents of basins none of which have been joined."""
    parent = ints(size, 0)
    for basin in range(size):
        parent[basin] = basin
    return parent


@inlined
def root(parent, v):  # type: ignore[no-untyped-def]
    """The basin that stands for all that v has been joined with."""
    while parent[v] != v:
        parent[v] = parent[parent[v]]
        v = parent[v]
    return v


@part
def _stands_on(v, vertices, heights, links):  # type: ignore[no-untyped-def]
    """Whether a neighbour further down stands on the platform too: then v's component stands there already."""
    starts, neighbours = links
    for at in range(starts[v], starts[v + 1]):
        w = neighbours[at]
        if vertices[w, 2] <= PLATFORM_TOLERANCE_MM and before(heights, w, v, False):
            return True
    return False


@part
def count_pieces(surface, standing, links, found, tree, anchor, cosines, heights, n, pieces):  # type: ignore[no-untyped-def]
    """Components below each offset that do not reach the platform."""
    label, path = ints(len(heights), -1), ints(len(heights), 0)
    up = n < 0  # a constant would have all these functions compiled once for every value of it
    seeds = begin_basins(found, heights, links, label, up)
    saddles = saddle_joins(found, heights, links, label, path, up)
    anchored = anchor_joins(seeds, surface, tree, anchor, cosines, heights, links, label, path, up)
    size = len(seeds)
    begun, grounded_at = ints(size, 0), ints(size, n + 1)
    for basin in range(size):
        begun[basin] = min(column_over(heights[seeds[basin]]), n)
    for k in range(len(standing)):
        v = int(standing[k])
        if not _stands_on(v, surface[0], heights, links):
            basin = walk(v, heights, links, label, path, up)
            grounded_at[basin] = min(grounded_at[basin], min(column_over(heights[v]), n))
    joins = together(saddles, anchored)
    columns = join_columns(joins, heights, n)
    _count(begun, grounded_at, joins, columns, n, pieces)


@part
def by_column(columns, n):  # type: ignore[no-untyped-def]
    """Indices in the order of their columns, and where each column's begin."""
    starts, place = ints(n + 3, 0), ints(n + 3, 0)
    for k in range(len(columns)):
        starts[columns[k] + 1] += 1
    for b in range(n + 2):
        starts[b + 1] += starts[b]
        place[b + 1] = starts[b + 1]
    sequence = ints(len(columns), 0)
    for k in range(len(columns)):
        sequence[place[columns[k]]] = k
        place[columns[k]] += 1
    return sequence, starts


@part
def _count(begun, grounded_at, joins, columns, n, pieces):  # type: ignore[no-untyped-def]
    """Join basins in the order of the offsets and count those that hang free."""
    size = len(begun)
    parent, grounded = alone(size), ints(size, 0)
    _, birth = by_column(begun, n)
    landed, landing = by_column(grounded_at, n + 1)
    joined, joining = by_column(columns, n)
    floating = 0
    for b in range(n):
        floating += birth[b + 1] - birth[b]
        for at in range(joining[b], joining[b + 1]):
            k = joined[at]
            p, q = root(parent, joins[k, 0]), root(parent, joins[k, 1])
            if p != q:
                if grounded[p] == 0 or grounded[q] == 0:
                    floating -= 1
                parent[max(p, q)] = min(p, q)
                grounded[min(p, q)] = max(grounded[p], grounded[q])
        for at in range(landing[b], landing[b + 1]):
            here = root(parent, landed[at])
            if grounded[here] == 0:
                grounded[here] = 1
                floating -= 1
        pieces[b] = floating
