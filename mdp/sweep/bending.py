"""Bending: how much the base of what lies above a plane is stressed when its top is pushed sideways (a numba kernel).

Every piece above the plane is a beam held at its section. A push F at its top, lever L above the plane, in the worst direction,
stresses the point p of the section (from the section's centroid) by F L |J^-1 p|, J the second moments of area: the general
formula of unsymmetric bending. The section's moments are sums over its outline by Green's theorem.
"""

import numpy as np

from mdp.kernels.arrays import floats, ints, table
from mdp.kernels.kernel import kernel, part
from mdp.mesh import Floats, Ints, Mesh
from mdp.plane import Plane

AREA, X, Y, XX, YY, XY = range(6)  # columns of the sums over a piece's section


def stress_per_newton(mesh: Mesh, plane: Plane, crumb_mm: float) -> float:
    """The greatest stress at a plane, MPa for every newton that pushes the top of a piece above it sideways; infinite where a
    piece hangs on nothing. Pieces lower than crumb_mm are crumbs."""
    side = np.cross(plane.normal, np.eye(3)[int(np.argmin(np.abs(plane.normal)))])
    side = side / np.linalg.norm(side)
    across = (mesh.vertices - mesh.vertices[0]) @ np.stack([side, np.cross(plane.normal, side)], axis=1)
    return _most_stress(mesh.faces, plane.heights_mm(mesh.vertices), np.ascontiguousarray(across), crumb_mm)


@kernel
def _most_stress(faces: Ints, heights: Floats, across: Floats, crumb: float) -> float:
    piece, sums, ends = _find_pieces(faces, heights), table(len(heights), 6), table(2, 2)
    tops, farthest = floats(len(heights), 0.0), floats(len(heights), 0.0)
    for v in range(len(heights)):
        if heights[v] > 0.0:
            tops[piece[v]] = max(tops[piece[v]], heights[v])
    for f in range(len(faces)):
        v = _cross(faces, f, heights, across, ends)
        if v >= 0:
            _add(ends, sums[piece[v]])
    for f in range(len(faces)):
        v = _cross(faces, f, heights, across, ends)
        if v >= 0:
            root = piece[v]
            for end in range(2):
                farthest[root] = max(farthest[root], _stress(sums[root], ends[end, 0], ends[end, 1]))
    most = 0.0
    for v in range(len(heights)):
        if piece[v] == v and tops[v] >= crumb:
            most = max(most, tops[v] * farthest[v] if farthest[v] > 0.0 else np.inf)
    return most


@part
def _find_pieces(faces: Ints, heights: Floats) -> Ints:
    """(n,) for vertices above 0 one that stands for all that edges above 0 join them with, -1 for the others."""
    piece = ints(len(heights), -1)
    for v in range(len(heights)):
        if heights[v] > 0.0:
            piece[v] = v
    for f in range(len(faces)):
        for k in range(3):
            v, w = faces[f, k], faces[f, k - 2]
            if piece[v] >= 0 and piece[w] >= 0:
                a, b = _root(piece, v), _root(piece, w)
                piece[max(a, b)] = min(a, b)
    for v in range(len(heights)):
        if piece[v] >= 0:
            piece[v] = _root(piece, v)
    return piece


@part
def _root(piece: Ints, v: int) -> int:
    while piece[v] != v:
        piece[v] = piece[piece[v]]
        v = piece[v]
    return int(v)


@part
def _cross(faces: Ints, f: int, heights: Floats, across: Floats, ends: Floats) -> int:
    """Put the segment in which a face crosses height 0 into `ends`, the solid on its left seen from above; a vertex of the face
    above 0, -1 where it does not cross."""
    found = -1
    for k in range(3):
        v, w = faces[f, k], faces[f, k - 2]
        if (heights[v] > 0.0) != (heights[w] > 0.0):
            share = heights[v] / (heights[v] - heights[w])
            rising = heights[w] > 0.0
            found = int(w) if rising else int(v)
            for axis in range(2):
                ends[int(rising), axis] = across[v, axis] + share * (across[w, axis] - across[v, axis])
    return found


@part
def _add(ends: Floats, sums: Floats) -> None:
    """Add a segment's share of a section's area and of its first and second moments."""
    p, q, r, s = ends[0, 0], ends[0, 1], ends[1, 0], ends[1, 1]
    twice = p * s - r * q
    sums[AREA] += twice / 2.0
    sums[X] += (p + r) * twice / 6.0
    sums[Y] += (q + s) * twice / 6.0
    sums[XX] += (p * p + p * r + r * r) * twice / 12.0
    sums[YY] += (q * q + q * s + s * s) * twice / 12.0
    sums[XY] += (p * s + 2.0 * p * q + 2.0 * r * s + r * q) * twice / 24.0


@part
def _stress(sums: Floats, x: float, y: float) -> float:
    """|J^-1 p| of a point p of a section, 1/mm3; infinite where the section has no second moments."""
    area = sums[AREA]
    if area <= 0.0:
        return np.inf
    a, b = sums[X] / area, sums[Y] / area
    xx, yy, xy = sums[XX] - area * a * a, sums[YY] - area * b * b, sums[XY] - area * a * b
    determinant = xx * yy - xy * xy
    if determinant <= 0.0:
        return np.inf
    u, v = x - a, y - b
    return float(np.sqrt((yy * u - xy * v) ** 2 + (xx * v - xy * u) ** 2) / determinant)
