"""Flats: directions along the large flat faces of a model.

A part printed along the normal of a flat, or along the line in which two flats meet, shows no stair-stepping on them; at half a
degree beside it the steps are as wide as anywhere.
"""

from dataclasses import dataclass
from itertools import combinations
from math import cos, radians

import numpy as np

from mdp.mesh import Floats, Mesh

LEAST_SHARE = 0.02  # share of the surface with one normal: on a ball of 5,000 faces no two faces reach it together
MOST_FLATS, MOST_DIRECTIONS = 12, 40  # 12 flats have 66 pairwise lines; few of those lie in more than two flats
SAME = cos(radians(0.5))
# cell size in the coordinates of a unit vector, in which areas are summed beforehand: several times what SAME allows
COARSE = 0.05
OFF_DEG = 15.0  # a direction closer to one along large flats is meant to be that one
DIGITS = 4  # rounding of a unit vector's coordinates, for normals to count as equal


@dataclass(frozen=True, eq=False)
class Flats:
    """The large flats of a model: (k, 3) normals, both sides of a wall counted as one, and (k,) their shares of the surface."""

    normals: Floats
    shares: Floats

    @classmethod
    def of(cls, mesh: Mesh) -> "Flats":
        """The flats of a mesh, largest first."""
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
        return cls(flats[largest], shares[largest])

    def directions(self, least_z: float) -> Floats:
        """(k, 3) unit directions with at least that z along which flats are level or vertical, those with the largest total area
        first.
        """
        crossed = [np.cross(first, second) for first, second in combinations(self.normals, 2)]
        found = np.array([*self.normals, *crossed]).reshape(-1, 3)
        lengths = np.linalg.norm(found, axis=1)
        found = found[lengths > 1e-2] / lengths[lengths > 1e-2, None]
        found = np.concatenate([found, -found])
        found = found[found[:, 2] >= least_z]
        directions = np.zeros((0, 3))
        for direction in found[np.lexsort((*np.round(found.T, DIGITS), -np.round(self.share_along(found), DIGITS)))]:
            if len(directions) < MOST_DIRECTIONS and not np.any(directions @ direction >= SAME):
                directions = np.concatenate([directions, direction[None]])
        return directions

    def share_along(self, directions: Floats) -> Floats:
        """(n,) share of the surface that is level or vertical along each of (n, 3) directions."""
        cosines = np.abs(directions @ self.normals.T)
        along: Floats = ((cosines >= SAME) | (cosines <= np.sqrt(1.0 - SAME * SAME))) @ self.shares
        return along

    def beside(self, direction: Floats, least_z: float) -> Floats:
        """(k, 3) directions within OFF_DEG of a given one along which more of the surface is level or vertical, the best
        first.
        """
        walls = direction - (self.normals @ direction)[:, None] * self.normals
        lengths = np.linalg.norm(walls, axis=1)
        found = np.concatenate([self.directions(least_z), walls[lengths > 1e-2] / lengths[lengths > 1e-2, None]])
        share = self.share_along(found)
        better = (found @ direction > cos(radians(OFF_DEG))) & (found[:, 2] >= least_z)
        better &= share > self.share_along(direction[None]) + 10.0**-DIGITS
        return found[better][np.argsort(-np.round(share[better], DIGITS), kind="stable")]


def _areas_near(normals: Floats, areas: Floats) -> Floats:
    """(n,) total area with a normal near each of (n, 3) unit normals or its opposite; an upper bound that misses no equal
    normal.
    """
    cells = np.rint((normals + 1.0) / COARSE).astype(np.int64) + 1
    around = np.zeros((round(2.0 / COARSE) + 3,) * 3)
    np.add.at(around, tuple(cells.T), areas)
    for axis in range(3):
        around += np.roll(around, 1, axis) + np.roll(around, -1, axis)
    around += around[::-1, ::-1, ::-1]
    near: Floats = around[tuple(cells.T)]
    return near
