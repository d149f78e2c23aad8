"""Holes: rims of a surface, and filling of small holes."""

import numpy as np

from mdp.formats.surface import Surface
from mdp.mesh import Floats, Indices, areas_of
from mdp.repair.winding import format_point, pair_half_edges
from mdp.topology.edges import edges_of
from profiles.errors import MeshError

# A hole is a defect if it is small relative to the model; the opening of a cup is intended, and a lid on it would change the
# model.
RIM_SHARE = 0.5  # longest rim of a hole, as a share of the diagonal of the model's box
HOLE_SHARE = 0.02  # largest area of one filling, as a share of the surface's area
FACET_SHARE = 0.1  # that share for a rim of three or four edges: one or two facets missing from a coarse model
TOTAL_SHARE = 0.1  # share for all fillings together
LONGEST = 400  # corners of a rim; the table of chords grows with the square, the computing time with the cube


def fill_holes(surface: Surface) -> tuple[Surface, list[str]]:
    """The surface with its small holes filled, and a note about them.

    Raises MeshError if a hole is too large, with the number of open edges and a point on its rim.
    """
    loops = rim_loops(surface)
    if not loops:
        return surface, []
    size = float(np.linalg.norm(np.ptp(surface.vertices, axis=0)))
    area = float(areas_of(surface.vertices, surface.faces).sum())
    caps: list[Indices] = []
    total, longest = 0.0, 0.0
    for loop in loops:
        points = surface.vertices[loop]
        rim = float(np.linalg.norm(np.roll(points, -1, axis=0) - points, axis=1).sum())
        if len(loop) > LONGEST or (len(loop) > 4 and rim > RIM_SHARE * size):
            raise _too_large(loops, surface, loop, rim)
        cap = loop[triangulate_loop(points)] if len(loop) > 2 else np.zeros((0, 3), dtype=np.int64)
        cap_area = float(areas_of(surface.vertices, cap).sum())
        total, longest = total + cap_area, max(longest, rim)
        facet = len(loop) <= 4 and cap_area <= FACET_SHARE * area
        if (not facet and (rim > RIM_SHARE * size or cap_area > HOLE_SHARE * area)) or total > TOTAL_SHARE * area:
            raise _too_large(loops, surface, loop, rim)
        caps.append(cap)
    note = f"filled {len(loops)} small hole{'s' * (len(loops) > 1)} (longest rim {longest:.3g} mm, {total:.3g} mm² in all)"
    return Surface(surface.vertices, np.concatenate([surface.faces, *caps])), [note]


def _too_large(loops: list[Indices], surface: Surface, loop: Indices, rim: float) -> MeshError:
    open_edges = sum(len(rim) for rim in loops)
    where: Floats = surface.vertices[loop[0]]
    return MeshError(
        f"is not closed: {open_edges} open edges around {len(loops)} hole{'s' * (len(loops) > 1)}, one with a {rim:.4g} mm rim "
        f"through {format_point(where)}; only holes that are small beside the model are filled"
    )


def rim_loops(surface: Surface) -> list[Indices]:
    """Simple loops of vertices around the holes, oriented like a face that would fill the hole."""
    edges = edges_of(surface.faces)
    free = np.ones(len(edges.edge), dtype=bool)
    free[pair_half_edges(surface, edges).ravel()] = False
    numbers = np.flatnonzero(free)
    onward: dict[int, list[int]] = {}
    for start, end in zip(edges.ends[numbers[::-1]].tolist(), edges.starts[numbers[::-1]].tolist(), strict=True):
        onward.setdefault(start, []).append(end)
    loops: list[Indices] = []
    for first in edges.ends[numbers].tolist():
        path = [first]
        index_on_path = {first: 0}
        while onward.get(path[-1]):
            vertex = onward[path[-1]].pop()
            if vertex not in index_on_path:
                index_on_path[vertex] = len(path)
                path.append(vertex)
                continue
            loops.append(np.array(path[index_on_path[vertex] :], dtype=np.int64))
            for left in path[index_on_path[vertex] + 1 :]:
                del index_on_path[left]
            del path[index_on_path[vertex] + 1 :]
    return loops


def triangulate_loop(points: Floats) -> Indices:
    """(n - 2, 3) triangles of minimal total area over the (n, 3) corners, wound like the loop.

    Dynamic programming over the loop's chords: G. T. Klincsek, Minimal triangulations of polygonal domains (1980); O(n^3).
    """
    n = len(points)
    if n > LONGEST:
        raise ValueError(f"a loop of {n} corners")
    cost = np.zeros((n, n))
    split = np.zeros((n, n), dtype=np.int64)
    for span in range(2, n):
        first = np.arange(n - span)
        last = first + span
        middle = first[:, None] + np.arange(1, span)[None, :]
        a, b, c = points[first][:, None], points[middle], points[last][:, None]
        area = 0.5 * np.linalg.norm(np.cross(b - a, c - a), axis=2)
        total = cost[first[:, None], middle] + cost[middle, last[:, None]] + area
        best = total.argmin(axis=1)
        split[first, last] = middle[first, best]
        cost[first, last] = total[first, best]
    triangles, pending = [], [(0, n - 1)]
    while pending:
        first_corner, last_corner = pending.pop()
        if last_corner - first_corner >= 2:
            between = int(split[first_corner, last_corner])
            triangles.append((first_corner, between, last_corner))
            pending += [(between, last_corner), (first_corner, between)]
    return np.array(triangles, dtype=np.int64)
