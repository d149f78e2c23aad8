"""Bending: stress at the base of the part above a plane when its top is pushed sideways (a numba kernel).

Every piece above the plane is a beam held at its section. A push F at its top, lever L above the plane, bends it there by M = F
L. In the worst direction that stresses a point p of the section, from its centroid, by M |J^-1 p|, J the second moments of area:
the general formula of unsymmetric bending. The moments are sums over the section's outline by Green's theorem.

The surface above the plane consists of shells. An outer shell encloses a positive volume between itself and the plane; the wall
of a void, or of a hole from below, encloses a negative one, and belongs to the piece whose section contains its own.
"""

import numpy as np

from mdp.directions.unit_vectors import frame_across
from mdp.kernels.arrays import floats, ints, table
from mdp.kernels.kernel import helper, kernel, no_nrt
from mdp.mesh import Floats, Ints, Mesh
from mdp.overhang import Mask
from mdp.plane import Plane
from mdp.sweep.facets import UNKNOWN
from mdp.topology.components import join, root

MOMENTS = AREA, X, Y, XX, YY, XY = 0, 1, 2, 3, 4, 5


# Segments x, y, x, y in which k faces cross the plane, the solid on the left of each seen from above (k, 4), and the shell of
# each (k,).
Section = tuple[Floats, Ints]


def stress_per_newton(mesh: Mesh, plane: Plane, fragment_mm: float, limb: Mask | None = None) -> float:
    """Greatest stress at a plane, MPa per newton that pushes the top of a piece above it sideways; infinite for a floating piece.
    Pieces lower than fragment_mm are fragments. limb: (n,) vertices of the pieces that count, None for all.
    """
    across = (mesh.vertices - mesh.vertices[0]) @ frame_across(plane.normal).T
    counted = np.zeros(0, np.bool_) if limb is None else limb
    return _most_stress(mesh.faces, plane.heights_mm(mesh.vertices), np.ascontiguousarray(across), fragment_mm, counted)


@kernel
def _most_stress(faces: Ints, heights: Floats, across: Floats, fragment: float, counted: Mask) -> float:
    shells = _find_shells(faces, heights)
    volumes, section = _measure(faces, heights, across, shells)
    moments, tops, stressed = table(len(heights), len(MOMENTS)), floats(len(heights), -1.0), floats(len(heights), 0.0)
    for v in range(len(heights)):
        if shells[v] >= 0 and volumes[shells[v]] > 0.0 and (len(counted) == 0 or counted[v]):
            tops[shells[v]] = max(tops[shells[v]], heights[v])
    _find_pieces(section, volumes)
    segments, pieces = section
    for k in range(len(pieces)):
        if pieces[k] >= 0:
            add_edge(segments[k], moments[pieces[k]])
    for k in range(len(pieces)):
        if pieces[k] >= 0:
            stress = stress_per_moment(moments[pieces[k]], segments[k, 0], segments[k, 1])
            stressed[pieces[k]] = max(stressed[pieces[k]], stress)
    most = 0.0
    for v in range(len(heights)):
        if tops[v] > 0.0 and tops[v] >= fragment:
            most = max(most, tops[v] * stressed[v] if stressed[v] > 0.0 else np.inf)
    return most


@helper
def _find_shells(faces: Ints, heights: Floats) -> Ints:
    """(n,) a representative of the connected vertices above 0 for each vertex above 0, -1 for the others."""
    shells = ints(len(heights), -1)
    for v in range(len(heights)):
        if heights[v] > 0.0:
            shells[v] = v
    for f in range(len(faces)):
        for k in range(3):
            v, w = faces[f, k], faces[f, k - 2]
            if shells[v] >= 0 and shells[w] >= 0:
                join(shells, v, w)
    for v in range(len(heights)):
        if shells[v] >= 0:
            shells[v] = root(shells, v)
    return shells


@helper
def _measure(faces: Ints, heights: Floats, across: Floats, shells: Ints) -> tuple[Floats, Section]:
    """(n,) volume between each shell and the plane, negative if the solid lies outside, and the section."""
    volumes, count = floats(len(heights), 0.0), 0
    for f in range(len(faces)):
        shell, crosses = -1, False
        for k in range(3):
            shell = max(shell, shells[faces[f, k]])
            crosses = crosses or heights[faces[f, k]] <= 0.0
        if shell >= 0:
            volumes[shell] += _volume(faces, f, heights, across)
            count += int(crosses)
    segments, owners, count = table(count, 4), ints(count, -1), 0
    for f in range(len(faces)):
        for k in range(3):
            v, w = faces[f, k], faces[f, k - 2]
            if (heights[v] > 0.0) != (heights[w] > 0.0):
                rising, share = heights[w] > 0.0, heights[v] / (heights[v] - heights[w])
                owners[count] = shells[w] if rising else shells[v]
                for axis in range(2):
                    end = across[v, axis] + share * (across[w, axis] - across[v, axis])
                    segments[count, 2 * int(rising) + axis] = end
        count += int(count < len(owners) and owners[count] >= 0)
    return volumes, (segments, owners)


@no_nrt
def _volume(faces: Ints, f: int, heights: Floats, across: Floats) -> float:
    """Contribution of a face to the volume above the plane: its area projected along the normal, times the height of the part of
    it above.
    """
    total, alone, above = 0.0, 0.0, 0
    for k in range(3):
        p, q, r = heights[faces[f, k]], heights[faces[f, k - 1]], heights[faces[f, k - 2]]
        total += p
        above += int(p > 0.0)
        if (p > 0.0) != (q > 0.0) and (p > 0.0) != (r > 0.0):
            alone = p * (p / (p - q)) * (p / (p - r))
    a, b, c = across[faces[f, 0]], across[faces[f, 1]], across[faces[f, 2]]
    twice = (b[0] - a[0]) * (c[1] - a[1]) - (c[0] - a[0]) * (b[1] - a[1])
    return float(twice * (alone if above == 1 else total - alone) / 6.0)


@helper
def _find_pieces(section: Section, volumes: Floats) -> None:
    """Assign the segments of every void to the piece around it, -1 if there is none: the shell of least area whose section
    contains the void's.
    """
    segments, shells = section
    holders, areas, around = ints(len(volumes), UNKNOWN), floats(len(volumes), 0.0), ints(len(volumes), 0)
    for k in range(len(shells)):
        areas[shells[k]] += 0.5 * (segments[k, 0] * segments[k, 3] - segments[k, 2] * segments[k, 1])
    for k in range(len(shells)):
        void = shells[k]
        if volumes[void] >= 0.0:
            holders[void] = void
        elif holders[void] == UNKNOWN:
            holders[void] = _find_holder(section, volumes, areas, around, k)
    for k in range(len(shells)):
        shells[k] = holders[shells[k]]


@no_nrt
def _find_holder(section: Section, volumes: Floats, areas: Floats, around: Ints, own: int) -> int:
    """The shell of positive volume and least area whose outline surrounds the middle of a segment. around: (n,) zeros,
    scratch.
    """
    segments, shells = section
    x, y = 0.5 * (segments[own, 0] + segments[own, 2]), 0.5 * (segments[own, 1] + segments[own, 3])
    for k in range(len(shells)):
        p, q, r, s = segments[k, 0], segments[k, 1], segments[k, 2], segments[k, 3]
        if (q > y) != (s > y) and p + (y - q) / (s - q) * (r - p) > x:
            around[shells[k]] += 1 if s > y else -1
    holder = -1
    for k in range(len(shells)):
        shell = shells[k]
        if around[shell] != 0 and volumes[shell] > 0.0 and (holder < 0 or areas[shell] < areas[holder]):
            holder = shell
    for k in range(len(shells)):
        around[shells[k]] = 0
    return int(holder)


@kernel
def section_moments(edges: Floats) -> Floats:
    """The MOMENTS of a section about the axes of its frame, mm2 to mm4. edges: as in greatest_stress_per_moment."""
    moments = floats(len(MOMENTS), 0.0)
    for k in range(len(edges)):
        add_edge(edges[k], moments)
    return moments


@kernel
def greatest_stress_per_moment(edges: Floats) -> float:
    """Greatest stress in a section per unit of bending moment in the worst direction, 1/mm3: the inverse of its least section
    modulus; infinite if it has no area.

    edges: (n, 4) edges of its outlines, x, y, x, y in mm, the section on the left of each.
    """
    moments, greatest = section_moments(edges), 0.0
    for k in range(len(edges)):
        greatest = max(greatest, stress_per_moment(moments, edges[k, 0], edges[k, 1]))
    return greatest if len(edges) > 0 else np.inf


@no_nrt
def add_edge(edge: Floats, moments: Floats) -> None:
    """Add the contribution of an edge, x, y, x, y, to a section's MOMENTS."""
    p, q, r, s = edge[0], edge[1], edge[2], edge[3]
    twice = p * s - r * q
    moments[AREA] += twice / 2.0
    moments[X] += (p + r) * twice / 6.0
    moments[Y] += (q + s) * twice / 6.0
    moments[XX] += (p * p + p * r + r * r) * twice / 12.0
    moments[YY] += (q * q + q * s + s * s) * twice / 12.0
    moments[XY] += (p * s + 2.0 * p * q + 2.0 * r * s + r * q) * twice / 24.0


@no_nrt
def stress_per_moment(moments: Floats, x: float, y: float) -> float:
    """|J^-1 p| for a point p of a section, 1/mm3; infinite if the section has no second moments."""
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
