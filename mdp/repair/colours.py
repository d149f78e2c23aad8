"""Colours and paint: the painted source face of each face of a repaired solid."""

from collections.abc import Iterator

import numpy as np

from mdp.formats.surface import Surface, concatenate
from mdp.mesh import NO_COLOUR, Floats, Indices

NONE = -1  # no triangle; as an index it selects the last row of a table, which holds the default
NEAR_SHARE = 1e-4  # share of the model's size: the greatest shift of a vertex by a repair
SAME_DIRECTION = 1.0 - 1e-6  # cosine of two normals
INSIDE = -1e-6  # least barycentric coordinate
# Cell sizes of a plane's normal and its distance from the middle, in sizes of the model. Normals of about one direction differ by
# 1.5e-3, and so do the distances: the margin, in cells, by which a triangle extends beyond its own plane.
PLANE_CELLS, PLANE_MARGIN = np.array([0.05, 0.05, 0.05, 0.005]), np.array([0.04, 0.04, 0.04, 0.4])
FINEST = 8  # halvings of the model's size: limit for cells of position
PAIRS_AT_ONCE = 1_000_000  # pairs of a point and a triangle, which take some 100 MB of memory


def carry_colours(surfaces: list[Surface], solid: Surface) -> Indices | None:
    """(m,) colours of the solid's faces, NO_COLOUR for faces that the repair created or that are unpainted; None if nothing is
    painted.
    """
    given = concatenate(surfaces)
    if given.colours is None or _same_faces(given, solid):
        return given.colours
    painted = given.colours != NO_COLOUR
    row = triangle_of(given.vertices[given.faces[painted]], solid.vertices[solid.faces])
    return np.append(given.colours[painted], NO_COLOUR)[row]


def triangle_of(corners: Floats, wanted: Floats) -> Indices:
    """(m,) the triangle of (k, 3, 3) in the file to which each of (m, 3, 3) faces of the repaired solid is equal, or on which its
    centre lies; NONE if there is none.
    """
    row = _same_corners(corners, wanted)
    rest, cut = np.flatnonzero(row == NONE), np.setdiff1d(np.arange(len(corners)), row)
    if len(rest) and len(cut):  # a triangle that exists as a whole does not exist in pieces
        row[rest] = np.append(cut, NONE)[_pieces(corners[cut], wanted[rest])]
    return row


def _same_faces(given: Surface, solid: Surface) -> bool:
    return len(given.faces) == len(solid.faces) and np.array_equal(given.vertices[given.faces], solid.vertices[solid.faces])


def _same_corners(corners: Floats, wanted: Floats) -> Indices:
    """The first triangle with the same corners as each wanted one, in any order; NONE if there is none."""
    both = np.concatenate([corners, wanted]) + 0.0  # -0.0 and 0.0 are equal
    _, vertex_of = np.unique(both.reshape(-1, 3), axis=0, return_inverse=True)
    _, group = np.unique(np.sort(vertex_of.reshape(-1, 3), axis=1), axis=0, return_inverse=True)
    group = group.ravel()
    by_group = np.full(len(both), NONE, dtype=np.int64)
    by_group[group[: len(corners)][::-1]] = np.arange(len(corners))[::-1]
    matched: Indices = by_group[group[len(corners) :]]
    return matched


def _pieces(corners: Floats, wanted: Floats) -> Indices:
    """The triangle that contains the centre of each wanted one and is parallel to it, facing either way; NONE if there is
    none.
    """
    both = np.concatenate([corners, wanted]).reshape(-1, 3)
    middle, size = (both.min(axis=0) + both.max(axis=0)) / 2.0, float(np.ptp(both, axis=0).max())
    near_mm = NEAR_SHARE * size
    order = np.argsort(corners[:, :, 0].min(axis=1), kind="stable")
    corners = corners[order] - middle
    wanted = wanted - middle
    normals, wanted_normals, middles = _normals(corners), _normals(wanted), wanted.mean(axis=1)
    nearest = np.full(len(wanted), np.inf)
    triangle = np.full(len(wanted), NONE, dtype=np.int64)
    for rows, painted in _neighbours(corners, normals, middles, wanted_normals, size):
        away = np.abs(np.einsum("ij,ij->i", normals[painted], middles[rows] - corners[painted, 0]))
        parallel = np.abs(np.einsum("ij,ij->i", normals[painted], wanted_normals[rows])) > SAME_DIRECTION
        on = np.flatnonzero(parallel & (away <= near_mm))
        on = on[_holds(corners[painted[on]], normals[painted[on]], middles[rows[on]])]
        on = on[np.lexsort((painted[on], away[on], rows[on]))]
        row, first = np.unique(rows[on], return_index=True)
        better = away[on[first]] < nearest[row]
        row, best = row[better], on[first[better]]
        nearest[row], triangle[row] = away[best], order[painted[best]]
    return triangle


def _neighbours(
    corners: Floats, normals: Floats, points: Floats, point_normals: Floats, size: float
) -> Iterator[tuple[Indices, Indices]]:
    """Candidate pairs of points and triangles in about one plane, where the triangle's box contains the point: rows of both.

    Both are put into cells of direction, distance of the plane from the origin, and position; a triangle into all cells that it
    may touch. Triangles of similar size share a grid whose cells have that size.
    """
    near = NEAR_SHARE * size
    low, high = corners.min(axis=1) - near, corners.max(axis=1) + near
    sizes = np.maximum(np.ceil(np.log2((high - low).max(axis=1))), np.ceil(np.log2(size)) - FINEST).astype(np.int64)
    planes = np.column_stack([normals, np.einsum("ij,ij->i", normals, corners[:, 0]) / size]) / PLANE_CELLS
    point_planes = np.column_stack([point_normals, np.einsum("ij,ij->i", point_normals, points) / size]) / PLANE_CELLS
    for level in np.unique(sizes).tolist():
        members = np.flatnonzero(sizes == level)
        cell = 2.0**level
        least, most = (
            np.concatenate([np.column_stack([sign * planes[members] + margin, ends[members] / cell]) for sign in (1.0, -1.0)])
            for margin, ends in ((-PLANE_MARGIN, low), (PLANE_MARGIN, high))
        )
        cells, rows = _cells(np.floor(least).astype(np.int64), np.floor(most).astype(np.int64))
        inside = np.floor(np.column_stack([point_planes, points / cell])).astype(np.int64)
        first = np.minimum(cells.min(axis=0), inside.min(axis=0))
        shape = np.maximum(cells.max(axis=0), inside.max(axis=0)) - first + 1
        keys, at = (np.ravel_multi_index(tuple((places - first).T), tuple(shape)) for places in (cells, inside))
        order = np.argsort(keys, kind="stable")
        keys, triangles = keys[order], np.concatenate([members, members])[rows[order]]
        begin, end = np.searchsorted(keys, at), np.searchsorted(keys, at, side="right")
        block = np.cumsum(end - begin) // PAIRS_AT_ONCE
        for some in np.split(np.arange(len(points)), np.flatnonzero(np.diff(block)) + 1):
            counts = end[some] - begin[some]
            row = np.repeat(some, counts)
            triangle = triangles[np.arange(len(row)) + np.repeat(begin[some] - np.cumsum(counts) + counts, counts)]
            held = ((points[row] >= low[triangle]) & (points[row] <= high[triangle])).all(axis=1)
            yield row[held], triangle[held]


def _cells(least: Indices, most: Indices) -> tuple[Indices, Indices]:
    """The cells that boxes between (n, d) corners cover, at most two along each axis, and the box of each cell."""
    cells, rows = least, np.arange(len(least))
    for axis in range(least.shape[1]):
        wider = np.flatnonzero(most[rows, axis] > cells[:, axis])
        beyond = cells[wider].copy()
        beyond[:, axis] += 1
        cells, rows = np.concatenate([cells, beyond]), np.concatenate([rows, rows[wider]])
    return cells, rows


def _holds(corners: Floats, normals: Floats, points: Floats) -> np.ndarray[tuple[int], np.dtype[np.bool_]]:
    """(n,) whether each of (n, 3) points lies over its triangle, given by (n, 3, 3) corners and (n, 3) unit normals."""
    next_corners = np.roll(corners, -1, axis=1)
    turns = np.einsum("ncx,nx->nc", np.cross(next_corners - corners, points[:, None] - corners), normals)
    whole = turns.sum(axis=1)
    inside: np.ndarray[tuple[int], np.dtype[np.bool_]] = (turns >= INSIDE * whole[:, None]).all(axis=1)
    return inside


def _normals(corners: Floats) -> Floats:
    """(n, 3) unit normals of (n, 3, 3) triangles; zero for triangles without area."""
    crosses = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    lengths = np.linalg.norm(crosses, axis=1)
    normals: Floats = crosses / np.where(lengths > 0, lengths, 1.0)[:, None]
    return normals
