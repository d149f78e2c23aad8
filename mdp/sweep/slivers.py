"""Slivers: distance of a plane from surfaces that it would cut too thin to print, and from thin walls.

A surface nearly level with the plane and close to it becomes a sliver. A fin, a bridge or a plate is thin by itself: a plane
through it leaves an interface no wider than its thickness. A face is thin if a ray from its centre into the solid soon meets a
face with the opposite normal; near an acute edge the other face is not opposite, so that is not a thin wall.
"""

import numpy as np

from mdp.kernels.arrays import floats
from mdp.kernels.kernel import helper, no_nrt
from mdp.mesh import Floats
from mdp.overhang import Mask
from mdp.plane import Plane
from mdp.sweep.crossing import OffsetGrid, column_over
from mdp.sweep.facets import Facets, Layout
from mdp.sweep.rays import TriangleTree, faces_met

THIN_MM = 1.0  # walls and rods of two lines or less are fragile where a plane crosses them
SLIVER_COSINE = 0.92  # a surface within 23 degrees of the plane becomes a sliver if the plane comes too near
OPPOSITE_COSINE = 0.8  # the two faces of a wall or rod have opposite normals, within 37 degrees


@no_nrt
def _note(cosine: float, height: float, n: int, above: Floats, below: Floats) -> None:
    b = min(column_over(height), n)
    if cosine < 0.0:
        below[b] = max(below[b], height)
    elif b > 0:
        above[b - 1] = min(above[b - 1], height)


@helper
def find_slivers(layout: Layout, grid: OffsetGrid, cosines: Floats, fragile: Floats) -> None:
    """Distance from each offset up to the next surface facing along the direction, and down to the next one facing against it.

    Where the surface is smooth the normal of a vertex gives its orientation, at an edge or corner the normals of its faces.
    cosines: (n,) of vertex normals and the direction.
    """
    d, heights, n, step = grid.direction, grid.heights, grid.columns, grid.step_mm
    corners, normals, flatness = layout.faces.corners, layout.faces.normals, layout.flatness
    above, below = floats(n + 1, np.inf), floats(n + 1, -np.inf)
    for v in range(len(heights)):
        if abs(cosines[v]) > SLIVER_COSINE and flatness[v] > SLIVER_COSINE:
            _note(cosines[v], heights[v], n, above, below)
    for corner in layout.sharp:
        f = corner // 3
        cosine = normals[0, f] * d[0] + normals[1, f] * d[1] + normals[2, f] * d[2]
        if abs(cosine) > SLIVER_COSINE:
            _note(cosine, heights[corners[corner % 3, f]], n, above, below)
    nearest = np.inf
    for column in range(n - 1, -1, -1):
        nearest = min(nearest, above[column])
        fragile[column] = (nearest - column) * step
    nearest = -np.inf
    for column in range(n):
        nearest = max(nearest, below[column])
        fragile[column] = min(fragile[column], (column - nearest) * step)


def thin_faces(tree: TriangleTree, thickness_mm: float) -> Mask:
    """(m,) whether the solid under the centre of each face is thinner than thickness_mm."""
    a, b, c = (tree.vertices[tree.faces[:, k]] for k in range(3))
    return faces_met(tree, np.stack([(a + b + c) / 3.0, -tree.normals], axis=1), thickness_mm, OPPOSITE_COSINE) >= 0


def least_distance_mm(corners: Floats, plane: Plane) -> float:
    """Distance from a plane to the nearest of some triangles, (k, 3, 3) corners; 0 if it meets one, infinite for no triangles."""
    heights = corners @ plane.normal - plane.offset_mm
    low, high = heights.min(axis=1, initial=np.inf), heights.max(axis=1, initial=-np.inf)
    return float(np.maximum(np.maximum(low, -high), 0.0).min(initial=np.inf))


def sliver_mm(facets: Facets, limb: Mask, plane: Plane, across: Floats) -> float:
    """Thickness of the sliver that a cut of a limb leaves: distance from the plane up to the next surface of the limb facing
    along its normal, or down to the next one straight below it facing against it. limb (n,): its vertices; across (2, 3): vectors
    across the normal.
    """
    vertices, faces = facets.mesh.vertices, facets.mesh.faces
    heights, cosines = plane.heights_mm(vertices), facets.mesh.normals @ plane.normal
    along, against = (np.zeros(len(vertices), np.bool_) for _ in range(2))
    along[faces[cosines > SLIVER_COSINE]] = True
    against[faces[cosines < -SLIVER_COSINE]] = True
    up = float(heights[limb & along].min(initial=np.inf))
    passed = faces[limb[faces].any(axis=1) & ~limb[faces].all(axis=1)]
    if len(passed) == 0:
        return up
    flat = vertices @ across.T
    low, high = flat[passed].reshape(-1, 2).min(axis=0), flat[passed].reshape(-1, 2).max(axis=0)
    below = (heights <= 0.0) & against & ((flat >= low) & (flat <= high)).all(axis=1)
    return min(up, float(-heights[below].max(initial=-np.inf)))
