"""Head: the convex bodies that move with the tip, and the directions of the separating-axis test between them and obstacles.

The distance of two convex bodies is the greatest gap over all unit directions d, where the gap is the least d . x of one body
minus the greatest d . x of the other. A sample of directions gives a lower bound of the distance, so the verdict "clear" is
always right.
"""

from dataclasses import dataclass
from itertools import product
from typing import NamedTuple

import numpy as np

from mdp.directions.unit_vectors import spread
from mdp.kernels.kernel import no_nrt
from mdp.mesh import Floats
from mdp.pose import UP
from profiles.frozen import Vector
from profiles.machine import Machine

FIELD = 120  # number of directions over the sphere, some 18 degrees apart


@dataclass(frozen=True)
class Ring:
    """A piece of the hot end: the hull of discs [radius, height above the tip] and everything above them. need_mm: the distance
    it must keep.
    """

    name: str
    discs_mm: tuple[tuple[float, float], ...]
    need_mm: float

    def least(self, directions: Floats) -> Floats:
        """(k,) least d . x over the body, tip at the origin, for (k, 3) directions; minus infinity for downward ones."""
        across = np.hypot(directions[:, 0], directions[:, 1])
        lowest = np.min([directions[:, 2] * h - across * r for r, h in self.discs_mm], axis=0)
        return np.where(directions[:, 2] >= 0.0, lowest, -np.inf)


@dataclass(frozen=True)
class Block:
    """A box that moves with the head, relative to the tip. need_mm: the distance it must keep."""

    name: str
    min_mm: Vector
    max_mm: Vector
    need_mm: float

    def least(self, directions: Floats) -> Floats:
        """(k,) least d . x over the body, tip at the origin, for (k, 3) directions."""
        least: Floats = np.where(directions > 0, directions * self.min_mm, directions * self.max_mm).sum(axis=1)
        return least


Body = Ring | Block


class Head(NamedTuple):
    """The head as kernels take it: (k, 2) radii and heights of the hot end's lowest points, (j, 6) least and greatest x y z of
    the boxes, relative to the tip, and the distance to keep.
    """

    silhouette: Floats
    boxes: Floats
    clearance_mm: float


def head_of(machine: Machine) -> Head:
    """The machine's head in the form that kernels take."""
    boxes = np.array([[*box.min_mm, *box.max_mm] for box in machine.head.boxes], dtype=np.float64).reshape(-1, 6)
    return Head(np.array(machine.head.silhouette_mm, dtype=np.float64), boxes, float(machine.clearance_mm))


@no_nrt
def lowest_of_hot_end(radius: float, silhouette: Floats) -> float:
    """Height above the tip of the hot end's lowest point at a radius; a huge number beyond its greatest radius."""
    if radius <= silhouette[0, 0]:
        return float(silhouette[0, 1])
    for k in range(len(silhouette) - 1):
        if radius <= silhouette[k + 1, 0]:
            share = (radius - silhouette[k, 0]) / (silhouette[k + 1, 0] - silhouette[k, 0])
            return float(silhouette[k, 1] + share * (silhouette[k + 1, 1] - silhouette[k, 1]))
    return 1e9


def bodies(machine: Machine) -> tuple[Body, ...]:
    """The head's bodies with the distance each must keep: clearance_mm, or its own height above the tip when that is less.

    (The tip itself prints one layer above the table, so a body that hangs lower than clearance_mm cannot keep that distance.)
    """
    profile = machine.head.silhouette_mm
    rings = [
        Ring("hot end" if height > 0 else "nozzle tip", tuple(profile[i : i + 2]), min(machine.clearance_mm, height))
        for i, (_, height) in enumerate(profile)
    ]
    boxes = [Block(box.name, box.min_mm, box.max_mm, min(machine.clearance_mm, box.min_mm[2])) for box in machine.head.boxes]
    return (*rings, *boxes)


def directions(normal: Floats) -> Floats:
    """(k, 3) unit directions for the separating-axis test against a table with this normal: between the normal and up, beside the
    normal, and over the whole sphere.
    """
    share = np.linspace(0.0, 1.0, 9)[:, None]
    across = np.array([normal[0], normal[1], 0.0])
    fan = [(1.0 - share) * normal + share * UP, (1.0 - share) * UP - share * across, (1.0 - share) * normal + share * across]
    faces = np.vstack([np.eye(3), -np.eye(3)])
    tried = np.vstack([*fan, faces, spread(FIELD)])
    size = np.linalg.norm(tried, axis=1)
    units: Floats = tried[size > 1e-9] / size[size > 1e-9][:, None]
    return units


def corners(least_mm: Vector, most_mm: Vector) -> Floats:
    """(8, 3) corners of a box."""
    return np.array(list(product(*zip(least_mm, most_mm, strict=True))))
