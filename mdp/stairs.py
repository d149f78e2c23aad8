"""Stairs: how much of a surface shows the steps of the layers that it is printed in.

A face between wall and level shows a step at every layer. The step is as high as the cusp between its edge and the face: the
layer height times the cosine of the angle between the face's normal and the printing direction. Walls have none, nor have faces
that are exactly level: they are the top or the bottom of a layer.

    cusp ^
         |          *|
         |       *   |       worst just beside level
         |    *      |
         | *         |
         +-----------*--> |normal . direction|
         0 (wall)    1 (level)
"""

import numpy as np

from mdp.kernels.kernel import no_nrt
from mdp.mesh import Floats

LEVEL_COSINE = 0.9998  # within 1.1 degrees: 10 mm of such a face are one layer of 0.2 mm, it is printed as one


@no_nrt
def step_share(cosine: float) -> float:
    """Height of the steps on a face with that cosine between normal and printing direction, as a share of the layer height."""
    facing = abs(cosine)
    return facing if facing < LEVEL_COSINE else 0.0


def step_shares(cosines: Floats) -> Floats:
    """(m,) the same for many.

    >>> step_shares(np.array([0.0, -0.5, 0.9, 1.0])).tolist()
    [0.0, 0.5, 0.9, 0.0]
    """
    facing = np.abs(cosines)
    return np.where(facing < LEVEL_COSINE, facing, 0.0)
