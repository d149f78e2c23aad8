"""Plane: a cutting or base plane of the workpiece frame."""

from dataclasses import dataclass

import numpy as np

from mdp.mesh import Floats, dot

UP = np.array([0.0, 0.0, 1.0])


@dataclass(frozen=True, eq=False)
class Plane:
    """The points p with normal . p = offset_mm; normal is a unit vector and the printing direction above the plane."""

    normal: Floats
    offset_mm: float

    def __post_init__(self) -> None:
        normal = np.array(self.normal, dtype=np.float64)
        normal.setflags(write=False)
        object.__setattr__(self, "normal", normal)

    def heights_mm(self, points: Floats) -> Floats:
        """(n,) signed distances of (n, 3) points, positive on the printed side.

        >>> Plane(UP, 2.0).heights_mm(np.array([[5.0, 0.0, 3.0]]))
        array([1.])
        """
        return dot(points, self.normal) - self.offset_mm


PLATFORM = Plane(UP, 0.0)
