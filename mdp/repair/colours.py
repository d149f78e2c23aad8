"""Colours: which face of a repaired solid is a face, or a piece of one, that the file has painted."""

import numpy as np

from mdp.formats.surface import Surface, concatenate
from mdp.mesh import NO_COLOUR, Floats, Indices

NEAR_SHARE = 1e-4  # of the model's size: as far as repairs move a vertex
SAME_DIRECTION = 1.0 - 1e-6  # cosine of two normals
INSIDE = -1e-6  # least barycentric coordinate


def carry_colours(surfaces: list[Surface], solid: Surface) -> Indices | None:
    """(m,) colours of the solid's faces, NO_COLOUR where the repair made them or the file has not painted them; None: it paints
    nothing at all."""
    given = concatenate(surfaces)
    if given.colours is None or _same_faces(given, solid):
        return given.colours
    painted = given.colours != NO_COLOUR
    corners, colours = given.vertices[given.faces[painted]], given.colours[painted]
    wanted = solid.vertices[solid.faces]
    carried_colours = _same_corners(corners, colours, wanted)
    rest = np.flatnonzero(carried_colours == NO_COLOUR)
    if len(rest) and len(corners):
        carried_colours[rest] = _pieces(corners, colours, wanted[rest])
    return carried_colours


def _same_faces(given: Surface, solid: Surface) -> bool:
    return len(given.faces) == len(solid.faces) and np.array_equal(given.vertices[given.faces], solid.vertices[solid.faces])


def _same_corners(corners: Floats, colours: Indices, wanted: Floats) -> Indices:
    """Colours of the triangles that have the corners of a painted one, in any order."""
    both = np.concatenate([corners, wanted]) + 0.0  # -0.0 and 0.0 are one place
    _, vertex_of = np.unique(both.reshape(-1, 3), axis=0, return_inverse=True)
    _, group = np.unique(np.sort(vertex_of.reshape(-1, 3), axis=1), axis=0, return_inverse=True)
    group = group.ravel()
    by_group = np.full(len(both), NO_COLOUR, dtype=np.int64)
    by_group[group[: len(corners)][::-1]] = colours[::-1]
    matched: Indices = by_group[group[len(corners) :]]
    return matched


def _pieces(corners: Floats, colours: Indices, wanted: Floats) -> Indices:
    """Colours of the triangles whose middle lies on a painted one, and that face the same way or the opposite."""
    near_mm = NEAR_SHARE * float(np.ptp(np.concatenate([corners, wanted]).reshape(-1, 3), axis=0).max())
    order = np.argsort(corners[:, :, 0].min(axis=1), kind="stable")
    corners, colours = corners[order], colours[order]
    low, high = corners[:, :, 0].min(axis=1), corners[:, :, 0].max(axis=1)
    widest, normals, mine = float((high - low).max()), _normals(corners), _normals(wanted)
    middles = wanted.mean(axis=1)
    first = np.searchsorted(low, middles[:, 0] - widest - near_mm)
    end = np.searchsorted(low, middles[:, 0] + near_mm, side="right")
    colour_of = np.full(len(wanted), NO_COLOUR, dtype=np.int64)
    for row, (begin, stop) in enumerate(zip(first.tolist(), end.tolist(), strict=True)):
        away = np.einsum("ij,ij->i", normals[begin:stop], middles[row] - corners[begin:stop, 0])
        parallel = np.abs(normals[begin:stop] @ mine[row]) > SAME_DIRECTION
        near = begin + np.flatnonzero(parallel & (np.abs(away) <= near_mm))
        on = near[_holds(corners[near], normals[near], middles[row])]
        if len(on):
            colour_of[row] = colours[on[np.argmin(np.abs(away[on - begin]))]]
    return colour_of


def _holds(corners: Floats, normals: Floats, point: Floats) -> np.ndarray[tuple[int], np.dtype[np.bool_]]:
    """Whether a point lies over (n, 3, 3) triangles of (n, 3) unit normals."""
    next_corners = np.roll(corners, -1, axis=1)
    turns = np.einsum("ncx,nx->nc", np.cross(next_corners - corners, point - corners), normals)
    whole = turns.sum(axis=1)
    inside: np.ndarray[tuple[int], np.dtype[np.bool_]] = (turns >= INSIDE * whole[:, None]).all(axis=1)
    return inside


def _normals(corners: Floats) -> Floats:
    """(n, 3) unit normals of (n, 3, 3) triangles; zero for one without area."""
    crosses = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    lengths = np.linalg.norm(crosses, axis=1)
    normals: Floats = crosses / np.where(lengths > 0, lengths, 1.0)[:, None]
    return normals
