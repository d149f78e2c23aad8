"""Holes: the rims of a surface, and small ones filled."""

import numpy as np

from mdp.loop import LONGEST, filled
from mdp.mesh import Floats
from mdp.repair.edges import areas_of, edges_of
from mdp.repair.winding import paired, point
from mdp.surface import Indices, Surface
from profiles.errors import MeshError

# A hole is a defect when it is small beside the model; the opening of a cup is meant, and a lid on it would be another model.
RIM_SHARE = 0.5  # longest rim of a hole, of the diagonal of the model's box
HOLE_SHARE = 0.02  # largest area of one filling, of the surface's area
FACET_SHARE = 0.1  # the same for a rim of three or four edges: a facet or two lost from a coarse model
TOTAL_SHARE = 0.1  # all fillings together


def without_holes(surface: Surface) -> tuple[Surface, list[str]]:
    """The surface with its small holes filled, and a sentence about them.

    Raises MeshError when a hole is too large: how many edges are open, and a point on a rim.
    """
    loops = rims(surface)
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
        cap = loop[filled(points)] if len(loop) > 2 else np.zeros((0, 3), dtype=np.int64)
        cap_area = float(areas_of(surface.vertices, cap).sum())
        total, longest = total + cap_area, max(longest, rim)
        facet = len(loop) <= 4 and cap_area <= FACET_SHARE * area
        if (not facet and (rim > RIM_SHARE * size or cap_area > HOLE_SHARE * area)) or total > TOTAL_SHARE * area:
            raise _too_large(loops, surface, loop, rim)
        caps.append(cap)
    note = f"filled {len(loops)} small hole{'s' * (len(loops) > 1)} (longest rim {longest:.3g} mm, {total:.3g} mm2 in all)"
    return Surface(surface.vertices, np.concatenate([surface.faces, *caps])), [note]


def _too_large(loops: list[Indices], surface: Surface, loop: Indices, rim: float) -> MeshError:
    open_edges = sum(len(each) for each in loops)
    where: Floats = surface.vertices[loop[0]]
    return MeshError(
        f"is not closed: {open_edges} open edges around {len(loops)} hole{'s' * (len(loops) > 1)}, one with a {rim:.4g} mm rim "
        f"through {point(where)}; only holes that are small beside the model are filled"
    )


def rims(surface: Surface) -> list[Indices]:
    """Simple loops of vertices around the holes, each running so that a face wound like it fits in."""
    edges = edges_of(surface.faces)
    free = np.ones(len(edges.edge), dtype=bool)
    free[paired(surface, edges).ravel()] = False
    numbers = np.flatnonzero(free)
    onward: dict[int, list[int]] = {}
    for start, end in zip(edges.ends[numbers[::-1]].tolist(), edges.starts[numbers[::-1]].tolist(), strict=True):
        onward.setdefault(start, []).append(end)
    loops: list[Indices] = []
    for first in edges.ends[numbers].tolist():
        path = [first]
        place = {first: 0}
        while onward.get(path[-1]):
            vertex = onward[path[-1]].pop()
            if vertex not in place:
                place[vertex] = len(path)
                path.append(vertex)
                continue
            loops.append(np.array(path[place[vertex] :], dtype=np.int64))
            for left in path[place[vertex] + 1 :]:
                del place[left]
            del path[place[vertex] + 1 :]
    return loops
