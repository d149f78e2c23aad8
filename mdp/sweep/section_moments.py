"""Section moments: area, first and second moments of a plane section, and how much bending stresses it (numba kernels).

A bending moment M about the section's centroid, in the worst direction, stresses its point p, from the centroid, by M |J^-1 p|, J
the second moments of area: the general formula of unsymmetric bending. The moments are sums over the section's outline by Green's
theorem.
"""

import numpy as np

from mdp.kernels.arrays import floats
from mdp.kernels.kernel import kernel, part
from mdp.mesh import Floats

MOMENTS = AREA, X, Y, XX, YY, XY = 0, 1, 2, 3, 4, 5


@kernel
def greatest_stress_per_moment(edges: Floats) -> float:
    """The greatest stress in a section for each unit of a bending moment in the worst direction, 1/mm3: the inverse of its least
    section modulus; infinite where it has no area.

    edges: (n, 4) of its outlines, x, y, x, y in mm, the section on the left of each.
    """
    moments, greatest = floats(len(MOMENTS), 0.0), 0.0
    for k in range(len(edges)):
        add_edge(edges[k], moments)
    for k in range(len(edges)):
        greatest = max(greatest, stress_per_moment(moments, edges[k, 0], edges[k, 1]))
    return greatest if len(edges) > 0 else np.inf


@part
def add_edge(edge: Floats, moments: Floats) -> None:
    """Add what an edge, x, y, x, y, has of a section's MOMENTS."""
    p, q, r, s = edge[0], edge[1], edge[2], edge[3]
    twice = p * s - r * q
    moments[AREA] += twice / 2.0
    moments[X] += (p + r) * twice / 6.0
    moments[Y] += (q + s) * twice / 6.0
    moments[XX] += (p * p + p * r + r * r) * twice / 12.0
    moments[YY] += (q * q + q * s + s * s) * twice / 12.0
    moments[XY] += (p * s + 2.0 * p * q + 2.0 * r * s + r * q) * twice / 24.0


@part
def stress_per_moment(moments: Floats, x: float, y: float) -> float:
    """|J^-1 p| of a point p of a section, 1/mm3; infinite where the section has no second moments."""
    area = moments[AREA]
    if area <= 0.0:
        return np.inf
    a, b = moments[X] / area, moments[Y] / area
    xx, yy, xy = moments[XX] - area * a * a, moments[YY] - area * b * b, moments[XY] - area * a * b
    determinant = xx * yy - xy * xy
    if determinant <= 0.0:
        return np.inf
    u, v = x - a, y - b
    return float(np.sqrt((yy * u - xy * v) ** 2 + (xx * v - xy * u) ** 2) / determinant)
