"""Overhang: which faces cannot be printed along a direction without support, and which show stair-stepping.

A face is risky when n . d < -(sin alpha + 1e-4), with the sign of RoboFDM's Eq. 1; the printed formula of the 2020 paper has it
reversed. The 1e-4 keeps exact 45 degree faces, common in printed models, on the safe side of float rounding.

A face that is neither vertical nor level shows a step at every layer. The step is as high as the cusp between its edge and the
face: the layer height times the cosine of the angle between the face's normal and the printing direction. Vertical faces have
none, nor have faces that are exactly level: they are the top or the bottom of a layer.

    cusp ^
         |          *|
         |       *   |       worst close to level
         |    *      |
         | *         |
         +-----------*--> |normal . direction|
         0 (wall)    1 (level)
"""

from math import radians, sin

import numpy as np
from numpy.typing import NDArray

from mdp.kernels.kernel import no_nrt
from mdp.mesh import Floats, Mesh, dot
from mdp.plane import UP as UP
from mdp.plane import Plane

ROUNDING = 1e-4  # rounding in float32 files throws faces at exactly the angle, common in printed models, to either side
PLATE_TOLERANCE_MM = 0.3  # a first layer's chamfer still stands on the build plate
LEVEL_COSINE = 0.9998  # within 1.1 degrees: 10 mm of such a face are one layer of 0.2 mm, and print as one
BASE_TOLERANCE_MM = 1e-6  # faces of a part created by a cut lie in its base plane up to rounding

Mask = NDArray[np.bool_]


def threshold(self_supporting_angle_deg: float) -> float:
    """The value of n . d below which a face is risky."""
    return -(sin(radians(self_supporting_angle_deg)) + ROUNDING)


def facing_down(mesh: Mesh, direction: Floats, self_supporting_angle_deg: float) -> Mask:
    """(m,) whether each face overhangs too far along a unit direction, whatever it rests on."""
    return np.asarray(np.less(dot(mesh.normals, direction), threshold(self_supporting_angle_deg)))


def standing(mesh: Mesh) -> Mask:
    """(m,) whether each face stands on the build plate: all of it within 0.3 mm of the plate."""
    on_plate: Mask = np.all(mesh.vertices[mesh.faces, 2] <= PLATE_TOLERANCE_MM, axis=1)
    return on_plate


def risky_upright(mesh: Mesh, self_supporting_angle_deg: float, count_platform_faces: bool = False) -> Mask:
    """(m,) risky faces of a solid printed straight up on the build plate."""
    down = facing_down(mesh, UP, self_supporting_angle_deg)
    return down if count_platform_faces else np.logical_and(down, ~standing(mesh))


def risky_above(mesh: Mesh, base: Plane, self_supporting_angle_deg: float) -> Mask:
    """(m,) risky faces of a part printed upward from its base plane; faces in that plane rest on it."""
    down = facing_down(mesh, base.normal, self_supporting_angle_deg)
    resting: Mask = np.all(base.heights_mm(mesh.vertices)[mesh.faces] <= BASE_TOLERANCE_MM, axis=1)
    return np.logical_and(down, ~resting)


@no_nrt
def step_share(cosine: float) -> float:
    """Height of the steps on a face as a share of the layer height, by the cosine between its normal and the printing
    direction.
    """
    facing = abs(cosine)
    return facing if facing < LEVEL_COSINE else 0.0


def step_shares(cosines: Floats) -> Floats:
    """(m,) height of the steps on faces as shares of the layer height, by the cosines between normals and printing direction.

    >>> step_shares(np.array([0.0, -0.5, 0.9, 1.0])).tolist()
    [0.0, 0.5, 0.9, 0.0]
    """
    facing = np.abs(cosines)
    return np.where(facing < LEVEL_COSINE, facing, 0.0)
