"""Depth: how far points lie inside an area, by numbers alone, where a boolean would have to look at all of its contours."""

from math import inf, sqrt

from mdp.kernel import floats, kernel
from mdp.mesh import Floats


@kernel
def depths(points: Floats, edges: Floats) -> Floats:
    """(n,) mm from points (n, 2) to the nearest of an area's edges (k, 4), x0 y0 x1 y1; negative outside."""
    found: Floats = floats(len(points), -inf)
    for i in range(len(points)):
        x, y = points[i, 0], points[i, 1]
        least, inside = inf, False
        for j in range(len(edges)):
            ax, ay = edges[j, 0] - x, edges[j, 1] - y
            bx, by = edges[j, 2] - x, edges[j, 3] - y
            dx, dy = bx - ax, by - ay
            t = min(max(-(ax * dx + ay * dy), 0.0), dx * dx + dy * dy)
            share = t / max(dx * dx + dy * dy, 1e-30)
            px, py = ax + share * dx, ay + share * dy
            least = min(least, px * px + py * py)
            if (ay > 0.0) != (by > 0.0) and (ay * dx - ax * dy > 0.0) == (dy > 0.0):
                inside = not inside
        found[i] = sqrt(least) if inside else -sqrt(least)
    return found
