"""Lightning: infill that only supports the solid areas above it.

Trees grow out of the walls so that every point of the sparse infill under a solid area lies near a branch. Planned from the top
down, a branch becomes shorter at its tip and straighter in every layer, by no more than the overhang limit, until it is gone; so
each layer prints over the one below (Tricard et al., "Ribbed Support Vaults for 3D Printing of Hollowed Objects", 2019).
"""

from collections.abc import Sequence
from math import radians, tan

import numpy as np

from mdp.kernels.arrays import flags, floats, longs, table
from mdp.kernels.kernel import helper, kernel
from mdp.mesh import Floats, Indices
from slicer.geometry.edge_index import EdgeIndex, Grid, crossings, depths, index_edges, lie_within, nearest, within
from slicer.geometry.polygons import Polygons, contours
from slicer.geometry.polyline import Segment

LEAN_DEG = 40.0  # from the vertical, by which a tip may extend beyond the layer below
STEP = 0.5  # cells between the nodes of a branch, and between target points
NEAR = 0.5  # cells within which a branch or a wall supports a point
ON_WALL_MM = 1e-3  # a node this close to the wall stands on it


# The trees of a layer: nodes (n, 2), and the number of each node's parent, which comes before it; -1 for a root.
Trees = tuple[Floats, Indices]
NO_TREES = np.zeros((0, 2)), np.zeros(0, np.int64)


def lightning_lines(
    insides: Sequence[Polygons], solid: Sequence[Polygons], cell_mm: float, heights_mm: Floats
) -> list[list[Floats]]:
    """The lines (n, 2), from root to tip, of every layer of a part, lowest layer first.

    insides: area for infill in each layer; solid: solid area of each layer, which the layer below must support; cell_mm: distance
    between branches below it; heights_mm: (n,) layer heights.
    """
    trees, lines = NO_TREES, []
    for layer in range(len(insides) - 1, -1, -1):
        lean_mm = float(heights_mm[layer]) * tan(radians(LEAN_DEG))
        over = insides[layer] ^ solid[layer + 1] if layer + 1 < len(solid) else Polygons()
        trees = _lower(trees, insides[layer], _wanting(over, cell_mm), (lean_mm, cell_mm))
        lines.append(_chains(trees))
    return lines[::-1]


def _wanting(over: Polygons, cell_mm: float) -> Floats:
    """(n, 2) target points for branches: along the outlines of an area, then on a grid inside."""
    if over.is_empty():
        return np.zeros((0, 2))
    step_mm = STEP * cell_mm
    outlines = [_every(loop, step_mm) for loop in contours(over)]
    x0, y0, x1, y1 = over.bounds()
    x, y = (step_mm * (np.arange(np.floor(low / step_mm), np.ceil(high / step_mm)) + 0.5) for low, high in ((x0, x1), (y0, y1)))
    grid = np.stack(np.meshgrid(x, y), axis=-1).reshape(-1, 2)
    return np.concatenate([*outlines, grid[lie_within(index_edges(over), grid)]])


def _every(loop: Floats, step_mm: float) -> Floats:
    """Points along a loop (n, 2), at most step_mm apart."""
    steps = np.roll(loop, -1, axis=0) - loop
    many = np.maximum(np.ceil(np.hypot(*steps.T) / step_mm), 1.0).astype(np.int64)
    which = np.repeat(np.arange(len(loop)), many)
    share = (np.arange(len(which)) - np.repeat(np.cumsum(many) - many, many)) / many[which]
    way = np.concatenate([[0.0], np.cumsum(np.hypot(*steps.T))[:-1]])[which] + share * np.hypot(*steps[which].T)
    kept = np.concatenate([[True], np.diff(np.floor(way / step_mm)) > 0])
    points: Floats = (loop[which] + share[:, None] * steps[which])[kept]
    return points


def _lower(trees: Trees, inside: Polygons, wanting: Floats, sizes_mm: tuple[float, float]) -> Trees:
    """The trees of the layer below: shorter and straighter, clipped to its inside, with new branches to target points without
    one. sizes_mm: lean of a tip, and cell size.
    """
    nodes, parent = trees
    if inside.is_empty() or not len(nodes) + len(wanting):
        return NO_TREES
    border, (lean_mm, cell_mm) = index_edges(inside), sizes_mm
    nodes, parent = _prune(_straighten(nodes, parent, lean_mm), parent, lean_mm)
    if len(nodes):
        nodes, parent = _ground(nodes, parent, border, STEP * cell_mm)
    if len(wanting):
        deep_mm = depths(wanting, border)
        wanting = wanting[np.argsort(deep_mm, kind="stable")][np.sort(deep_mm) > NEAR * cell_mm]
        nodes, parent = _grow(nodes, parent, wanting, border, (NEAR * cell_mm, STEP * cell_mm))
    return nodes, parent


def _straighten(nodes: Floats, parent: Indices, most: float) -> Floats:
    """The nodes with every one-child node moved towards the middle between its neighbours, by at most a length."""
    moved, held, child = nodes.copy(), np.flatnonzero(parent >= 0), np.zeros_like(parent)
    child[parent[held]] = held
    held = held[np.bincount(parent[held], minlength=len(nodes))[held] == 1]
    way = 0.5 * (nodes[parent[held]] + nodes[child[held]]) - nodes[held]
    moved[held] += np.minimum(1.0, most / np.maximum(np.hypot(*way.T), 1e-12))[:, None] * way
    return moved


@kernel
def _prune(nodes: Floats, parent: Indices, length: float) -> tuple[Floats, Indices]:
    """The trees shortened by a length at every tip; roots without branches are removed."""
    n = len(nodes)
    children, cut, keep = longs(n, 0), floats(n, -1.0), flags(n)
    for k in range(n):
        if parent[k] >= 0:
            children[parent[k]] += 1
    for k in range(n):
        if children[k] == 0:
            cut[k] = length
    for k in range(n - 1, -1, -1):
        p = parent[k]
        if children[k] > 0 or p < 0:
            keep[k] = children[k] > 0
            continue
        left = max(cut[k], 0.0)
        long = np.hypot(nodes[k, 0] - nodes[p, 0], nodes[k, 1] - nodes[p, 1])
        if left >= long:
            children[p] -= 1
            cut[p] = min(cut[p], left - long) if cut[p] >= 0.0 else left - long  # the longest of its branches counts
            continue
        keep[k] = True
        for axis in range(2):
            nodes[k, axis] += left / long * (nodes[p, axis] - nodes[k, axis])
    number, left, out, above = longs(n, -1), 0, table(n, 2), longs(n, -1)
    for k in range(n):
        if keep[k]:  # and so is its parent
            out[left, 0], out[left, 1] = nodes[k, 0], nodes[k, 1]
            above[left] = number[parent[k]] if parent[k] >= 0 else -1
            number[k], left = left, left + 1
    return out[:left].copy(), above[:left].copy()


@kernel
def _ground(nodes: Floats, parent: Indices, border: EdgeIndex, step: float) -> tuple[Floats, Indices]:
    """The trees clipped to a border: a branch that is cut stands on the wall at the cut, and a root away from all walls is
    connected to the nearest wall.
    """
    n, room = len(nodes), 0
    ends = table(n, 2)  # crossing of a node's line to its parent with the wall, or the wall point to which a root is connected
    inside, cut = flags(n), flags(n)
    shares, crossed = floats(len(border.edges) + 1, 0.0), longs(len(border.edges) + 1, 0)
    for k in range(n):
        x, y, p = nodes[k, 0], nodes[k, 1], parent[k]
        inside[k] = within(border, x, y)
        if not inside[k]:
            continue
        if p >= 0:
            many = crossings(border, Segment(x, y, nodes[p, 0], nodes[p, 1]), shares, crossed)
            cut[k] = many > 0 or not inside[p]
            share = shares[0] if many > 0 else 1.0
            ends[k, 0], ends[k, 1] = x + share * (nodes[p, 0] - x), y + share * (nodes[p, 1] - y)
        else:
            ends[k, 0], ends[k, 1] = _on_wall(border, x, y)
            cut[k] = np.hypot(ends[k, 0] - x, ends[k, 1] - y) > ON_WALL_MM
        if cut[k]:
            room += 2 + int(np.hypot(ends[k, 0] - x, ends[k, 1] - y) / step)
    out, above, number, m = table(n + room, 2), longs(n + room, -1), longs(n, -1), 0
    for k in range(n):
        if not inside[k]:
            continue
        if cut[k]:
            m = _branch(out, above, m, -1, (ends[k, 0], ends[k, 1]), (nodes[k, 0], nodes[k, 1]), step)
        else:
            out[m, 0], out[m, 1] = nodes[k, 0], nodes[k, 1]
            above[m] = number[parent[k]] if parent[k] >= 0 else -1
            m += 1
        number[k] = m - 1
    return out[:m].copy(), above[:m].copy()


@helper
def _on_wall(border: EdgeIndex, x: float, y: float) -> tuple[float, float]:
    """The nearest point of a border."""
    reach = border.grid.size_mm
    while reach < 1e7:
        nx, ny, which = nearest(border, x, y, reach)
        if which >= 0:
            return nx, ny
        reach *= 2.0
    return x, y


@helper
def _branch(
    out: Floats, above: Indices, m: int, since: int, begin: tuple[float, float], end: tuple[float, float], step: float
) -> int:
    """Add the nodes of a branch from a node, or from a new root if `since` is -1, to a point; returns the new number of nodes."""
    if since < 0:
        out[m, 0], out[m, 1], above[m] = begin[0], begin[1], -1
        since, m = m, m + 1
    many = 1 + int(np.hypot(end[0] - begin[0], end[1] - begin[1]) / step)
    for k in range(1, many + 1):
        for axis in range(2):
            out[m, axis] = begin[axis] + k / many * (end[axis] - begin[axis])
        above[m] = since
        since, m = m, m + 1
    return m


@helper
def _cell(grid: Grid, x: float, y: float) -> int:
    """The number of a point's cell; outside the grid, of the nearest cell."""
    column, row = int((x - grid.x) / grid.size_mm), int((y - grid.y) / grid.size_mm)
    return min(max(row, 0), grid.rows - 1) * grid.columns + min(max(column, 0), grid.columns - 1)


@helper
def _nearest_node(
    out: Floats, first: Indices, after: Indices, grid: Grid, place: tuple[float, float], lengths: tuple[float, float]
) -> tuple[int, bool]:
    """The node nearest to a point, the first among equals, and whether any node supports the point.

    first, after: the last node of each cell of the grid, and for each node the one before it in its cell, -1 if none. lengths:
    greatest distance for supporting the point, and for being the nearest; the node is -1 if none is near enough.
    """
    (x, y), (near, most) = place, lengths
    reach = max(near, grid.size_mm)
    while True:
        best, which, is_held = most, -1, False
        low, high = _cell(grid, x - reach, y - reach), _cell(grid, x + reach, y + reach)
        for r in range(low // grid.columns, high // grid.columns + 1):
            for c in range(r * grid.columns + low % grid.columns, r * grid.columns + high % grid.columns + 1):
                node = first[c]
                while node >= 0:
                    far = np.hypot(out[node, 0] - x, out[node, 1] - y)
                    is_held = is_held or far <= near
                    if far < best or (far == best and node < which):
                        best, which = far, node
                    node = after[node]
        if best <= reach or reach >= most:
            return which, is_held
        reach *= 2.0


@kernel
def _grow(
    nodes: Floats, parent: Indices, wanting: Floats, border: EdgeIndex, sizes: tuple[float, float]
) -> tuple[Floats, Indices]:
    """The trees with a branch from the nearest node or wall to every target point that no branch supports.

    sizes: distance within which a branch supports a point, and distance of nodes.
    """
    near, step = sizes
    ways = table(len(wanting), 2)
    room = len(nodes)
    for k in range(len(wanting)):
        ways[k, 0], ways[k, 1] = _on_wall(border, wanting[k, 0], wanting[k, 1])
        room += 2 + int(np.hypot(ways[k, 0] - wanting[k, 0], ways[k, 1] - wanting[k, 1]) / step)
    out, above, m = table(room, 2), longs(room, -1), len(nodes)
    for k in range(m):
        out[k, 0], out[k, 1], above[k] = nodes[k, 0], nodes[k, 1], parent[k]
    grid = border.grid
    first, after, sorted_in = longs(grid.columns * grid.rows, -1), longs(room, -1), 0
    for k in range(len(wanting)):
        for node in range(sorted_in, m):
            c = _cell(grid, out[node, 0], out[node, 1])
            first[c], after[node] = node, first[c]
        sorted_in = m
        x, y = wanting[k, 0], wanting[k, 1]
        far = np.hypot(ways[k, 0] - x, ways[k, 1] - y)
        which, is_held = _nearest_node(out, first, after, grid, (x, y), (near, far))
        if is_held:
            continue
        begin = (ways[k, 0], ways[k, 1]) if which < 0 else (out[which, 0], out[which, 1])
        m = _branch(out, above, m, which, begin, (x, y), step)
    return out[:m].copy(), above[:m].copy()


def _chains(trees: Trees) -> list[Floats]:
    """The trees as lines from root to tip, longest first; every other line begins on the line that it leaves."""
    nodes, parent = trees
    if not len(nodes):
        return []
    long_mm, after = np.zeros(len(nodes)), np.full(len(nodes), -1)
    for k in range(len(nodes) - 1, -1, -1):
        p = parent[k]
        if p >= 0:
            reach_mm = long_mm[k] + float(np.hypot(*(nodes[k] - nodes[p])))
            if after[p] < 0 or reach_mm > long_mm[p]:
                long_mm[p], after[p] = reach_mm, k
    lines = []
    for k in range(len(nodes)):
        p = parent[k]
        if p >= 0 and after[p] == k:
            continue
        chain = [k] if p < 0 else [p, k]
        while after[chain[-1]] >= 0:
            chain.append(int(after[chain[-1]]))
        if len(chain) > 1:
            lines.append(nodes[chain])
    return lines
