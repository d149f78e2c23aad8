"""Sweep: every offset of a direction evaluated in one pass over the faces, without cutting.

For a unit direction d let h = vertex . d. A face adds a piecewise quadratic in the offset c to "area above c", weighted with 1
(risky areas) or with n . d: by the divergence theorem the n . d-weighted area above c is the cross-section at c and its first
moment about c the volume above c.

    share of a face above c, whose corners lie at the heights low, mid and high:

      1 |*********                        c <= low          1
        |         **                      low < c < mid     1 - (c - low)^2 / ((mid - low) (high - low))
        |           ***                   mid <= c < high   (high - c)^2 / ((high - mid) (high - low))
        |              **                 high <= c         0
        |                ***
      0 |---+---+---+---+---***-+---> c
        0   1   2   3   4   5   6         columns: sampled offsets, a step apart
              low   mid       high
    whole           W                     the face's weight at the first column that it crosses, for all columns before
    share           s   s   s   s         its weighted shares in those that it crosses

    area above[column] = shares[column] + wholes[column + 1] + wholes[column + 2] + ...

So one pass down through the columns sums up all faces, and a direction costs vertices + faces + crossings. Heights are in steps
above the first offset, so column c lies at height c (sweep.crossing).

There are two passes: `gains` touches only faces that are risky in either direction and computes the savings of a cut; `sweep`
computes its feasibility, and runs only for the directions of promising candidates.
"""

from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np

from mdp.kernels.arrays import dot, floats, ints
from mdp.kernels.kernel import kernel
from mdp.kernels.threads import in_threads
from mdp.mesh import Floats, Ints, Mesh
from mdp.overhang import Mask, step_shares
from mdp.plane import Plane
from mdp.support_need.need import ModelPieces
from mdp.support_need.patches import Classes
from mdp.sweep.components import count_pieces, find_contact_areas, find_critical, plant_tree
from mdp.sweep.crossing import (
    RIM,
    STAIRS,
    STAIRS_UP,
    OffsetGrid,
    find_heights,
    find_lowest,
    integrate_blemishes,
    integrate_volume,
)
from mdp.sweep.cylinders import Cylinder, crossings
from mdp.sweep.facets import Blemishes, FaceTable, Facets, Layout
from mdp.sweep.slivers import SLIVER_COSINE, THIN_MM, find_slivers, least_distance_mm, thin_faces


class Gains(NamedTuple):
    """Values for each of k directions (rows) and its offsets c = (first + column) * step; those beyond `columns` are unused.

    up_mm2: risky area above the plane when printing straight up; residual_mm2: risky area above it when printing along the
    direction, weighted by what support each face needs; rim_mm: weighted length of the rim that a cut leaves, 0 if seams cost
    nothing; unavoidable_mm2: risky area above it that no cut can save, 0 if not requested; stairs_up_mm2, stairs_mm2: cost of the
    stair-stepping above it when printed straight up and along the direction; crossed: weighted number of cylinders that it cuts
    askew; these are 0 if they cost nothing.
    """

    first: Ints
    columns: Ints
    up_mm2: Floats
    residual_mm2: Floats
    rim_mm: Floats
    unavoidable_mm2: Floats
    stairs_up_mm2: Floats
    stairs_mm2: Floats
    crossed: Floats

    @property
    def used(self) -> Mask:
        """(k, n) whether each value belongs to an offset."""
        return np.arange(self.up_mm2.shape[1]) < self.columns[:, None]

    def offsets_mm(self, step_mm: float) -> Floats:
        """(k, n) offsets, mm."""
        return (self.first[:, None] + np.arange(self.up_mm2.shape[1])) * np.float64(step_mm)


class Sweep(NamedTuple):
    """Feasibility values; rows and columns as in Gains.

    section_mm2: cross-section; volume_mm3: volume above; lowest_mm: minimum z of the part above the plane, exact if below the
    direction's watched height, otherwise some greater number; fragile_mm: distance to the nearest surface that the plane would
    cut into a sliver; pieces: components of the solid below that do not reach the build plate; contact_area_mm2: least
    cross-section of a component of the solid above, without fragments; valid if there are no such pieces and the part above is
    nowhere below the watched height.
    """

    first: Ints
    columns: Ints
    section_mm2: Floats
    volume_mm3: Floats
    lowest_mm: Floats
    fragile_mm: Floats
    pieces: Ints
    contact_area_mm2: Floats


@dataclass(frozen=True, eq=False)
class Remainder:
    """The solid in the form that the sweep takes, made once for all directions: its mesh, the faces that are risky upright, and
    the weight of a mm of rim on each face (m,), None if seams cost nothing; feather: extra weight of feather edges. pieces:
    source faces in the model; None if every risky face needs support. stair_weights: (m,) weight of area on each face whose steps
    are as high as a layer; None if stair-stepping or seams cost nothing. cylinders: bores that should not be cut askew.
    """

    mesh: Mesh
    risky: Mask
    seam_weights: Floats | None = None
    feather: float = 0.0
    pieces: ModelPieces | None = None
    stair_weights: Floats | None = None
    cylinders: tuple[Cylinder, ...] = ()

    @property
    def weight(self) -> float:
        """Weight of area over air."""
        return 1.0 if self.pieces is None else self.pieces.need.weight

    def classes(self, directions: Floats) -> Classes:
        """(k, n) support class of the model's faces along (k, 3) directions."""
        return np.zeros((len(directions), 0), np.uint8) if self.pieces is None else self.pieces.need.along(directions)

    @cached_property
    def faces(self) -> FaceTable:
        """The face table, in the order of the mesh."""
        pieces, count = self.pieces, len(self.risky)
        return FaceTable(
            points=np.ascontiguousarray(self.mesh.vertices.T),
            corners=np.ascontiguousarray(self.mesh.faces.T.astype(np.uint32)),
            normals=np.ascontiguousarray(self.mesh.normals.T),
            areas_mm2=self.mesh.areas_mm2,
            sources=np.full(count, -1, np.int32) if pieces is None else pieces.sources,
            risky=self.risky,
            counts=np.ones(count) if pieces is None or pieces.counts is None else pieces.counts,
            seam_weights=np.zeros(0) if self.seam_weights is None else self.seam_weights,
            stair_weights=np.zeros(0) if self.stair_weights is None else self.stair_weights,
        )

    @cached_property
    def facets(self) -> Facets:
        """The surface in spatial order."""
        return Facets.of(self.mesh, self.faces)

    @cached_property
    def risky_mm2(self) -> float:
        """Weighted area that is risky upright, mm2."""
        return float(self.faces.counted_mm2[self.risky].sum())

    @cached_property
    def stairs_mm2(self) -> float:
        """Cost of the stair-stepping when printed straight up, mm2."""
        if self.stair_weights is None:
            return 0.0
        return float((self.mesh.areas_mm2 * self.stair_weights) @ step_shares(self.mesh.normals[:, 2]))

    @cached_property
    def layout(self) -> Layout:
        """The surface arranged for sweeping."""
        return self.facets.layout(SLIVER_COSINE)

    @cached_property
    def thin(self) -> Floats:
        """(k, 3, 3) corners of the faces under whose centre the solid is a thin wall or rod, by a ray for every face."""
        mesh = self.facets.mesh
        return mesh.vertices[mesh.faces[thin_faces(self.layout.triangles, THIN_MM)]]

    def thin_mm(self, plane: Plane) -> float:
        """Distance of a plane to the nearest thin wall or rod on either side, mm; 0 if it crosses one, infinite if there are
        none.
        """
        return least_distance_mm(self.thin, plane)

    def most_columns(self, step_mm: float) -> int:
        """Upper bound of the number of offsets of any direction."""
        return int(float(np.linalg.norm(self.mesh.bounds_mm[1] - self.mesh.bounds_mm[0])) / step_mm) + 3


def gains(remainder: Remainder, directions: Floats, step_mm: float, risky_below: float, unavoidable: Mask | None = None) -> Gains:
    """Savings of all offsets of (k, 3) unit directions. risky_below: overhang.threshold of the angle; unavoidable: (m,) faces
    that no cut can save, in the order of remainder.facets.

    >>> from mdp.cut import convex_hull
    >>> from mdp.overhang import risky_upright, threshold
    >>> pyramid = convex_hull(np.array([[0.0, 0, 0], [10, 10, 4], [-10, 10, 4], [-10, -10, 4], [10, -10, 4]]))  # on its tip
    >>> swept = gains(Remainder(pyramid, risky_upright(pyramid, 45.0)), np.array([[0.0, 0, 1], [0, 1, 0]]), 1.0, threshold(45.0))
    >>> swept.offsets_mm(1.0)[0, :3].tolist(), swept.up_mm2[0, :3].round().tolist()
    ([1.0, 2.0, 3.0], [404.0, 323.0, 188.0])
    """
    shape = (len(directions), remainder.most_columns(step_mm))
    columns = np.zeros((2, shape[0]), np.int32)
    swept = Gains(columns[0], columns[1], *(np.zeros(shape) for _ in range(7)))
    blemishes = blemishes_of(remainder, directions, risky_below, unavoidable)
    in_threads(_gains, shape[0], blemishes, step_mm, swept)
    if remainder.cylinders:
        swept.crossed[:] = crossings(remainder.cylinders, directions, swept.offsets_mm(step_mm))
    return swept


def blemishes_of(remainder: Remainder, directions: Floats, risky_below: float, unavoidable: Mask | None = None) -> Blemishes:
    """The blemishes of a solid along some directions. risky_below, unavoidable: see gains."""
    lost, faces = np.zeros(0, np.bool_) if unavoidable is None else unavoidable, remainder.facets.faces
    directions, classes = np.ascontiguousarray(directions), remainder.classes(directions)
    return Blemishes(directions, faces, risky_below, classes, remainder.weight, remainder.feather, lost)


def sweep(
    remainder: Remainder,
    directions: Floats,
    step_mm: float,
    watched_mm: Floats | None = None,
    fragment_mm: float = 2.0,
) -> Sweep:
    """Feasibility of cuts at all offsets of (k, 3) unit directions.

    watched_mm (k,): height below which the least z of a part matters, and which it must reach for the contact area to be valid;
    None: all heights matter. fragment_mm: a lower piece above the plane may stand on any area.
    """
    watched = np.full(len(directions), np.inf) if watched_mm is None else np.ascontiguousarray(watched_mm)
    needed = np.full(len(directions), -np.inf) if watched_mm is None else watched
    sampling = np.ascontiguousarray(directions), step_mm, watched, needed, fragment_mm / step_mm
    shape = (len(directions), remainder.most_columns(step_mm))
    first, columns = np.zeros((2, shape[0]), np.int32)
    (section, volume, contact_area), (lowest, fragile) = np.zeros((3, *shape)), np.full((2, *shape), np.inf)
    swept = Sweep(first, columns, section, volume, lowest, fragile, np.zeros(shape, np.int32), contact_area)
    in_threads(_sweep, shape[0], remainder.layout, sampling, swept)
    return swept


@kernel
def _gains(begin_row: int, end_row: int, blemishes: Blemishes, step_mm: float, out: Gains) -> None:
    heights = floats(blemishes.faces.points.shape[1], 0.0)
    for row in range(begin_row, end_row):
        first, n = find_heights(blemishes.faces.points, blemishes.directions[row], step_mm, heights)
        out.first[row], out.columns[row] = first, n
        if n > 0:
            above = integrate_blemishes(blemishes, row, OffsetGrid(blemishes.directions[row], heights, n, step_mm))
            for k in range(n):
                sums = above[k]  # by kind of face, see crossing
                airy_both = sums[5] + sums[7]
                both = sums[3] + sums[6]
                out.up_mm2[row, k] = sums[1] + both + airy_both
                out.residual_mm2[row, k] = sums[2] + both + blemishes.weight * (sums[4] + airy_both)
                out.unavoidable_mm2[row, k] = sums[6] + sums[7]
                out.stairs_up_mm2[row, k], out.stairs_mm2[row, k] = sums[STAIRS_UP], sums[STAIRS]
                out.rim_mm[row, k] = sums[RIM] / step_mm


@kernel
def _sweep(
    begin_row: int, end_row: int, layout: Layout, sampling: tuple[Floats, float, Floats, Floats, float], out: Sweep
) -> None:
    """Kernel of sweep. sampling: directions (k, 3), the step of their offsets, for each (k,) the height below which the least z
    of a part matters and the height that it must reach for the contact area to be valid, and the least height of a piece with a
    contact area, in steps.
    """
    points, normals, (directions, step_mm, watched_mm, needed_mm, fragment) = layout.faces.points, layout.vertex_normals, sampling
    section, contact_area, lowest, pieces = out.section_mm2, out.contact_area_mm2, out.lowest_mm, out.pieces
    size = points.shape[1]
    heights, cosines, scratch = floats(size, 0.0), floats(size, 0.0), ints(size, 0)
    for row in range(begin_row, end_row):
        first, n = find_heights(points, directions[row], step_mm, heights)
        out.first[row], out.columns[row] = first, n
        if n > 0:
            grid = OffsetGrid(directions[row], heights, n, step_mm)
            integrate_volume(layout, grid, section[row], out.volume_mm3[row])
            find_lowest(points[2], layout.rising_edges, grid, watched_mm[row], lowest[row])
            dot(normals[0], normals[1], normals[2], directions[row], cosines)
            find_slivers(layout, grid, cosines, out.fragile_mm[row])
            critical = scratch[: find_critical(layout, heights, cosines, scratch)]
            # The direction of growth is not a literal, otherwise these functions would be compiled once for each value.
            count_pieces(plant_tree(layout, grid, cosines, critical, n < 0), pieces[row])
            wanted = ints(n, 0)
            for column in range(n):
                contact_area[row, column] = section[row, column]
                wanted[column] = int(pieces[row, column] == 0 and lowest[row, column] >= needed_mm[row])
            find_contact_areas(plant_tree(layout, grid, cosines, critical, n > 0), fragment, wanted, contact_area[row])


def unavoidable_faces(remainder: Remainder, directions: Floats, least_offset_mm: Floats, risky_below: float) -> Mask:
    """(m,) unavoidable overhangs: risky faces, in the order of remainder.facets, that no cut can save, because each of (k, 3)
    directions along which they would support themselves needs a plane that lies too low, by (k,) least offsets, infinite if the
    direction is out of reach.

    A direction saves a face if the face does not overhang along it and a plane across it may lie below the face's centre. The
    final loss of a search is at least the area of these faces: a lower bound that is known before any cut.
    """
    faces, bounds = remainder.facets.faces, (np.ascontiguousarray(directions), least_offset_mm, risky_below)
    lost: Mask = faces.risky.copy()
    in_threads(_find_unavoidable, len(lost), faces, bounds, lost)
    return lost


@kernel
def _find_unavoidable(begin: int, end: int, faces: FaceTable, bounds: tuple[Floats, Floats, float], lost: Mask) -> None:
    points, corners, normals, (directions, least_offset_mm, risky_below) = faces.points, faces.corners, faces.normals, bounds
    last, count = 0, len(directions)  # neighbours are mostly saved by the same direction
    for f in range(begin, end):
        if not lost[f]:
            continue
        a, b, c = corners[0, f], corners[1, f], corners[2, f]
        x = (points[0, a] + points[0, b] + points[0, c]) / 3.0
        y = (points[1, a] + points[1, b] + points[1, c]) / 3.0
        z = (points[2, a] + points[2, b] + points[2, c]) / 3.0
        for number in range(count):
            row = (last + number) % count
            p, q, r = directions[row, 0], directions[row, 1], directions[row, 2]
            carried = normals[0, f] * p + normals[1, f] * q + normals[2, f] * r >= risky_below
            if carried and x * p + y * q + z * r > least_offset_mm[row]:
                lost[f] = False
                last = row
                break
