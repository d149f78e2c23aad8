"""Distance field: how far points lie inside an area, by numbers alone, where a boolean would have to look at all its contours."""

from math import sqrt

from mdp.kernels.arrays import floats
from mdp.kernels.kernel import kernel
from mdp.mesh import Floats
from slicer.geometry.segments import inside, squared_distance_to_any


@kernel
def signed_distances(points: Floats, edges: Floats) -> Floats:
    """(n,) mm from points (n, 2) to the nearest of an area's edges (k, 4), x0 y0 x1 y1; negative outside."""
    out: Floats = floats(len(points), 0.0)
    for i in range(len(points)):
        distance = sqrt(squared_distance_to_any(edges, points[i, 0], points[i, 1]))
        out[i] = distance if inside(edges, points[i, 0], points[i, 1]) else -distance
    return out


@kernel
def distances(points: Floats, edges: Floats) -> Floats:
    """(n,) mm from points (n, 2) to the nearest of (k, 4) edges, on either side."""
    out: Floats = floats(len(points), 0.0)
    for i in range(len(points)):
        out[i] = sqrt(squared_distance_to_any(edges, points[i, 0], points[i, 1]))
    return out
