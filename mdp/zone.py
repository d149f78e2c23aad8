"""Zone: a box of the workpiece frame in which a person wants no cut at all, or no seam."""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import product

import numpy as np

from mdp.mesh import Floats, Mesh
from mdp.overhang import Mask
from profiles.machine import Vector


@dataclass(frozen=True)
class Zone:
    """A box by its least and greatest x, y, z, mm."""

    min_mm: Vector
    max_mm: Vector

    def spans_mm(self, directions: Floats) -> Floats:
        """(k, 2) least and greatest direction . p over the box for (k, 3) directions."""
        middle, half = 0.5 * np.add(self.min_mm, self.max_mm), 0.5 * np.subtract(self.max_mm, self.min_mm)
        centre, reach = directions @ middle, np.abs(directions) @ half
        return np.stack([centre - reach, centre + reach], axis=1)

    def touches(self, mesh: Mesh) -> Mask:
        """(m,) which faces reach into the box: no axis of a box, a triangle or two edges parts them (Akenine-Moeller)."""
        middle, half = 0.5 * np.add(self.min_mm, self.max_mm), 0.5 * np.subtract(self.max_mm, self.min_mm)
        corners = mesh.vertices[mesh.faces] - middle
        edges = np.roll(corners, -1, axis=1) - corners
        axes = [np.broadcast_to(axis, mesh.normals.shape) for axis in np.eye(3)]
        axes += [mesh.normals, *(np.cross(axis, edges[:, k]) for axis, k in product(np.eye(3), range(3)))]
        inside = np.ones(len(mesh.faces), dtype=np.bool_)
        for axis in axes:
            heights, reach = np.einsum("fci,fi->fc", corners, axis), np.abs(axis) @ half
            inside &= (heights.min(axis=1) <= reach) & (heights.max(axis=1) >= -reach)
        return inside


@dataclass(frozen=True)
class Zones:
    """What a person keeps the search out of. keep: no plane passes through; no_seam: rims there weigh many times."""

    keep: tuple[Zone, ...] = ()
    no_seam: tuple[Zone, ...] = ()


NO_ZONES = Zones()


def touched(mesh: Mesh, zones: Sequence[Zone]) -> Mask:
    """(m,) which faces reach into any of the zones."""
    faces = np.zeros(len(mesh.faces), dtype=np.bool_)
    for zone in zones:
        faces |= zone.touches(mesh)
    return faces


def spans_mm(directions: Floats, zones: Sequence[Zone]) -> Floats:
    """(k, zones, 2) least and greatest direction . p over each zone for (k, 3) directions."""
    return np.stack([zone.spans_mm(directions) for zone in zones], axis=1) if zones else np.zeros((len(directions), 0, 2))
