"""Sweep: every offset of a direction evaluated in one pass over the faces, nothing is cut.

For a unit direction d let h = vertex . d. A face adds a piecewise quadratic in the offset c to "area above c", weighted
with 1 (risky areas) or with n . d: by the divergence theorem the n . d-weighted area above c is the cross-section at c and
its first moment about c the volume above c. Faces wholly above an offset go into suffix sums, faces that cross sampled
offsets are added where they cross. Cost: vertices + faces + crossings.

There are two passes: `gains` touches only the faces that are risky one way or the other and tells what a cut is worth;
`sweep` tells whether it can be made, and is asked only for the directions that are worth it.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from mdp.facets import Facets, facets
from mdp.footing import find_footing
from mdp.fragile import SLIVER_COSINE, THIN_MM, find_slivers, least_distance_mm, thin_faces
from mdp.kernel import floats, int_table, ints, kernel
from mdp.mesh import Floats, Ints, Mesh
from mdp.overhang import Mask
from mdp.pieces import UNKNOWN, count_pieces, find_critical
from mdp.plane import Plane
from mdp.rays import Tree
from mdp.sums import dot, find_heights, find_lowest, sum_risks, sum_volumes
from mdp.threads import in_threads


@dataclass(frozen=True, eq=False)
class Gains:
    """Values for each of k directions (rows) and its offsets c = (first + column) * step; columns beyond count are unused.

    up_mm2: risky area above the plane when printing straight up; residual_mm2: risky area above it when printing along the
    direction.
    """

    first: Ints
    count: Ints
    up_mm2: Floats
    residual_mm2: Floats


@dataclass(frozen=True, eq=False)
class Sweep:
    """Rows and columns as in Gains.

    section_mm2: cross-section; volume_mm3: volume above; lowest_mm: least z of what lies above, exact where it is below the
    direction's watched height, some greater number elsewhere; fragile_mm: distance to the nearest surface that the plane
    would cut into a sliver; pieces: components of the solid below that do not reach the platform; footing_mm2: least
    cross-section of a component of the solid above, crumbs left out, where there are no such pieces and what lies above is
    nowhere below the watched height.
    """

    first: Ints
    count: Ints
    section_mm2: Floats
    volume_mm3: Floats
    lowest_mm: Floats
    fragile_mm: Floats
    pieces: Ints
    footing_mm2: Floats


@dataclass(frozen=True, eq=False)
class Remainder:
    """What the sweep needs to know of a solid, made once for all directions: its mesh and which faces are risky upright."""

    mesh: Mesh
    risky: Mask

    @cached_property
    def facets(self) -> Facets:
        """The surface laid out for sweeping."""
        return facets(self.mesh, self.risky)

    @cached_property
    def tree(self) -> Tree:
        """Boxes over the faces, for rays."""
        return Tree(self.facets.mesh)

    @cached_property
    def anchors(self) -> Ints:
        """(n,) the face met from each vertex into the solid, -1 where none is; the sweep looks them up when needed."""
        return np.full(len(self.mesh.vertices), UNKNOWN, np.int32)

    @cached_property
    def sharp(self) -> Ints:
        """Face corners at edges, where the normal of a vertex does not tell where the surface looks."""
        return self.facets.sharp_corners(SLIVER_COSINE)

    @cached_property
    def thin(self) -> Floats:
        """(k, 3, 3) corners of the faces under whose middle the solid is a thin wall or rod: a ray for every face."""
        mesh, tree = self.facets.mesh, self.tree
        thin = thin_faces(mesh.vertices, mesh.faces, mesh.normals, tree.low, tree.high, THIN_MM)
        corners: Floats = mesh.vertices[mesh.faces[thin]]
        return corners

    def thin_mm(self, plane: Plane) -> float:
        """Distance of a plane to the nearest thin wall or rod on either side, 0 where it goes through one; infinite: no such."""
        return least_distance_mm(self.thin, plane)

    def columns(self, step_mm: float) -> int:
        """Room for the offsets of any direction."""
        return int(float(np.linalg.norm(self.mesh.bounds_mm[1] - self.mesh.bounds_mm[0])) / step_mm) + 3


def gains(remainder: Remainder, directions: Floats, step_mm: float, risky_below: float) -> Gains:
    """What all offsets of (k, 3) unit directions would make safe; risky_below is overhang.threshold of the angle."""
    laid = remainder.facets
    surface = (laid.points, laid.corners, laid.normals, laid.mesh.areas_mm2, laid.risky)
    k, columns = len(directions), remainder.columns(step_mm)
    found = Gains(np.zeros(k, np.int32), np.zeros(k, np.int32), np.zeros((k, columns)), np.zeros((k, columns)))
    out = (found.first, found.count, found.up_mm2, found.residual_mm2)
    in_threads(_gains, k, surface, np.ascontiguousarray(directions), step_mm, risky_below, out)
    return found


def sweep(
    remainder: Remainder,
    directions: Floats,
    step_mm: float,
    watched_mm: Floats | None = None,
    crumb_mm: float = 2.0,
) -> Sweep:
    """Whether a cut can be made at all offsets of (k, 3) unit directions.

    watched_mm (k,): the height below which the least z of a part matters; absent: all heights. crumb_mm: a
    piece above the plane that is lower than this may stand on any area.
    """
    laid = remainder.facets
    rows = (laid.points, laid.corners, laid.normals, laid.vectors_mm2, laid.rising_edges, laid.vertex_normal_rows, laid.flatness)
    surface = (laid.mesh.vertices, laid.mesh.faces, laid.mesh.normals, laid.vertex_normals)
    tree = (remainder.tree.low, remainder.tree.high)
    solid = (surface, laid.standing, remainder.sharp, laid.links, tree, remainder.anchors)
    watched = np.full(len(directions), np.inf) if watched_mm is None else np.ascontiguousarray(watched_mm)
    needed = np.full(len(directions), -np.inf) if watched_mm is None else watched
    shape = (len(directions), remainder.columns(step_mm))
    found = Sweep(
        first=np.zeros(shape[0], np.int32),
        count=np.zeros(shape[0], np.int32),
        section_mm2=np.zeros(shape),
        volume_mm3=np.zeros(shape),
        lowest_mm=np.full(shape, np.inf),
        fragile_mm=np.full(shape, np.inf),
        pieces=np.zeros(shape, np.int32),
        footing_mm2=np.zeros(shape),
    )
    sums = (found.section_mm2, found.volume_mm3, found.footing_mm2)
    out = (found.first, found.count, found.pieces, *sums, found.lowest_mm, found.fragile_mm)
    in_threads(
        sweep_kernel, shape[0], rows, solid, np.ascontiguousarray(directions), watched, needed, crumb_mm / step_mm, step_mm, out
    )
    return found


@kernel
def _gains(begin_row, end_row, surface, directions, step, risky_below, out):  # type: ignore[no-untyped-def]
    points, corners, normals, areas, risky = surface
    first, count, up, residual = out
    heights, room = floats(points.shape[1], 0.0), int_table(2, len(areas) + 1)
    for row in range(begin_row, end_row):
        d = directions[row]
        begin, n = find_heights(points[0], points[1], points[2], d, step, heights)
        first[row], count[row] = begin, n
        if n > 0:
            sum_risks(corners, normals, areas, risky, d, heights, n, risky_below, room, up[row], residual[row])


@kernel
def sweep_kernel(begin_row, end_row, rows, solid, directions, watched, needed, crumb, step, out):  # type: ignore[no-untyped-def]
    points, corners, normals, vectors, edges, vertex_normals, flatness = rows
    surface, standing, sharp, links, tree, anchor = solid
    first, count, pieces, section, volume, footing, lowest, fragile = out
    heights, cosines, room = floats(points.shape[1], 0.0), floats(points.shape[1], 0.0), ints(points.shape[1], 0)
    for row in range(begin_row, end_row):
        d = directions[row]
        begin, n = find_heights(points[0], points[1], points[2], d, step, heights)
        first[row], count[row] = begin, n
        if n > 0:
            sum_volumes(corners, vectors, d, heights, n, step, section[row], volume[row])
            find_lowest(points[2], edges, heights, n, watched[row], lowest[row])
            dot(vertex_normals[0], vertex_normals[1], vertex_normals[2], d[0], d[1], d[2], cosines)
            find_slivers(cosines, flatness, sharp, corners, normals, d, heights, n, step, fragile[row])
            found = room[: find_critical(cosines, flatness, heights, links, room)]
            count_pieces(surface, standing, links, found, tree, anchor, cosines, heights, n, pieces[row])
            wanted = ints(n, 0)
            for column in range(n):
                footing[row, column] = section[row, column]
                wanted[column] = int(pieces[row, column] == 0 and lowest[row, column] >= needed[row])
            solid_above = (points, corners, surface, links, found, tree, anchor, cosines)
            find_footing(solid_above, d, heights, crumb, wanted, footing[row])
