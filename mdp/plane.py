"""Plane: a cutting or base plane of the workpiece frame."""

from collections.abc import Sequence
from dataclasses import dataclass
from math import hypot

import numpy as np

from mdp.mesh import Floats, dot
from profiles.errors import PlanError
from profiles.frozen import Vector

UP = np.array([0.0, 0.0, 1.0])
LEAST_LENGTH, MOST_LENGTH = 1e-6, 1e6  # limits for the length of a vector that is meant as a direction
UNIT = 1e-12  # a vector whose squared length is this close to 1 keeps its bits, so that a plan repeats exactly the same planes


def unit_direction(x: float, y: float, z: float) -> Vector | None:
    """The vector scaled to length 1, no component beyond 1; None if it is not finite, or too short or too long to be a direction.

    A component beyond 1, even by one rounding, has no arc sine.

    >>> unit_direction(0.0, 3.0, 4.0), unit_direction(0.0, 0.0, 0.0)
    ((0.0, 0.6, 0.8), None)
    """
    length = hypot(x, y, z)
    if not LEAST_LENGTH <= length <= MOST_LENGTH:
        return None
    if abs(x * x + y * y + z * z - 1.0) <= UNIT and max(abs(x), abs(y), abs(z)) <= 1.0:
        return x, y, z
    return x / length, y / length, z / length


@dataclass(frozen=True, eq=False)
class Plane:
    """The points p with normal . p = offset_mm; normal (3,) is the printing direction above the plane.

    limbs_mm: (k, 3) a point on each limb that a cut removes while other pieces above the plane stay; None: the cut removes
    everything above the plane.

    A normal is scaled to length 1; offset_mm refers to the scaled one. Raises PlanError for a normal that `unit_direction`
    refuses.
    """

    normal: Floats
    offset_mm: float
    limbs_mm: Floats | None = None

    def __post_init__(self) -> None:
        given = np.asarray(self.normal, dtype=np.float64).tolist()
        direction = unit_direction(*given)
        if direction is None:
            raise PlanError(f"the normal of a plane is {given}: a direction of a length of about 1 is expected")
        normal = np.array(direction)
        normal.setflags(write=False)
        object.__setattr__(self, "normal", normal)
        if self.limbs_mm is not None:
            limbs_mm = np.array(self.limbs_mm, dtype=np.float64).reshape(-1, 3)
            limbs_mm.setflags(write=False)
            object.__setattr__(self, "limbs_mm", limbs_mm)

    def heights_mm(self, points: Floats) -> Floats:
        """(n,) signed distances of (n, 3) points, positive on the printed side.

        >>> Plane(UP, 2.0).heights_mm(np.array([[5.0, 0.0, 3.0]]))
        array([1.])
        """
        return dot(points, self.normal) - self.offset_mm


def normals_and_offsets(planes: Sequence[Plane]) -> tuple[Floats, Floats]:
    """(k, 3) normals and (k,) offsets of planes, mm."""
    normals = np.array([plane.normal for plane in planes], dtype=np.float64).reshape(-1, 3)
    return normals, np.array([plane.offset_mm for plane in planes], dtype=np.float64)


PLATFORM = Plane(UP, 0.0)
