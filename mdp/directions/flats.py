"""Flats: directions along the large flat faces of a model. A part printed along their normal, or along a line in two of them,
shows no stairs on them; a direction half a degree beside shows them as high as any."""

from itertools import combinations
from math import cos, radians

import numpy as np

from mdp.mesh import Floats, Mesh

LEAST_SHARE = 0.02  # of the surface that looks one way: on a ball of 5,000 faces no two have so much together
MOST_FLATS, MOST_DIRECTIONS = 12, 40  # 12 flats have 66 lines in two of them; few of those lie in more than two
SAME = cos(radians(0.5))
COARSE = 0.05  # of the parts of a unit vector, in which areas are added up beforehand: several times what SAME allows
DIGITS = 4  # of the parts of a unit vector: what differs less looks the same way


def flat_directions(mesh: Mesh, least_z: float) -> Floats:
    """(k, 3) unit directions with at least that z along which large flat faces are level or walls, those first along which the
    largest area is."""
    flats, areas = _flats(mesh)
    crossed = [np.cross(first, second) for first, second in combinations(flats, 2)]
    found = np.array([*flats, *crossed]).reshape(-1, 3)
    lengths = np.linalg.norm(found, axis=1)
    found = found[lengths > 1e-2] / lengths[lengths > 1e-2, None]
    found = np.concatenate([found, -found])
    found = found[found[:, 2] >= least_z]
    cosines = np.abs(found @ flats.T) if len(flats) else np.zeros((len(found), 0))
    along = (((cosines >= SAME) | (cosines <= np.sqrt(1.0 - SAME * SAME))) * areas).sum(axis=1)
    directions = np.zeros((0, 3))
    for direction in found[np.lexsort((*np.round(found.T, DIGITS), -np.round(along, DIGITS)))]:
        if len(directions) < MOST_DIRECTIONS and not np.any(directions @ direction >= SAME):
            directions = np.concatenate([directions, direction[None]])
    return directions


def _flats(mesh: Mesh) -> tuple[Floats, Floats]:
    """(k, 3) normals of the largest flats, both sides of a wall taken as one, and (k,) their shares of the surface."""
    normals = np.round(mesh.normals, DIGITS)
    order = np.lexsort(normals.T)
    changed = np.any(np.diff(normals[order], axis=0) != 0.0, axis=1)
    starts = np.concatenate([[0], np.flatnonzero(changed) + 1])
    areas = np.add.reduceat(mesh.areas_mm2[order], starts)
    alike, least_mm2 = mesh.normals[order[starts]], LEAST_SHARE * mesh.areas_mm2.sum()
    flats, shares = np.zeros((0, 3)), np.zeros(0)
    large = np.flatnonzero(_areas_near(alike, areas) >= least_mm2)
    for row in large[np.argsort(-np.round(areas[large], 6), kind="stable")]:
        near = np.abs(flats @ alike[row]) >= SAME
        if near.any():
            shares[np.argmax(near)] += areas[row]
        else:
            flats, shares = np.concatenate([flats, alike[row][None]]), np.append(shares, areas[row])
    shares /= mesh.areas_mm2.sum()
    largest = np.argsort(-shares, kind="stable")[:MOST_FLATS]
    largest = largest[shares[largest] >= LEAST_SHARE]
    return flats[largest], shares[largest]


def _areas_near(normals: Floats, areas: Floats) -> Floats:
    """(n,) area of all that looks about the same way as each of (n, 3) unit normals, or the opposite way; nothing that looks the
    same way is left out."""
    cells = np.rint((normals + 1.0) / COARSE).astype(np.int64) + 1
    around = np.zeros((round(2.0 / COARSE) + 3,) * 3)
    np.add.at(around, tuple(cells.T), areas)
    for axis in range(3):
        around += np.roll(around, 1, axis) + np.roll(around, -1, axis)
    around += around[::-1, ::-1, ::-1]
    near: Floats = around[tuple(cells.T)]
    return near
