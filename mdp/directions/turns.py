"""Turns: a rotation as turns about x, then y, then z, as process.rotate_deg has it."""

from math import asin, atan2, degrees

import numpy as np

from mdp.mesh import Floats
from mdp.pose import about

DECIMALS = 9  # of an angle as a file or a person says it: off by less than a tenth of a micrometre over a metre
LEVEL = 1.0 - 1e-12  # sine of the turn about y from which the turns about x and z are one


def turned_by(angles_deg: tuple[float, float, float]) -> Floats:
    """(3, 3) the rotation of turns about x, then y, then z."""
    whole = np.eye(3)
    for axis, angle in zip(np.eye(3), np.radians(angles_deg), strict=True):
        whole = about(axis, float(angle)) @ whole
    return whole


def turns_of(rotation: Floats) -> tuple[float, float, float]:
    """The turns about x, then y, then z that a (3, 3) rotation is made of, degrees.

    >>> turns_of(turned_by((0.0, 0.0, 90.0)))
    (0.0, 0.0, 90.0)
    """
    sine = min(max(-float(rotation[2, 0]), -1.0), 1.0)
    if abs(sine) > LEVEL:
        return 0.0, degrees(asin(sine)), degrees(atan2(-rotation[0, 1], rotation[1, 1])) + 0.0
    x, z = atan2(rotation[2, 1], rotation[2, 2]), atan2(rotation[1, 0], rotation[0, 0])
    return degrees(x) + 0.0, degrees(asin(sine)) + 0.0, degrees(z) + 0.0


def turned_further(rotate_deg: tuple[float, float, float], rotation: Floats) -> tuple[float, float, float]:
    """The process.rotate_deg by which a model is read as it lies when it was read by another one and then turned by a (3, 3)
    rotation, degrees.

    >>> turned_further((30.0, 0.0, 0.0), turned_by((60.0, 0.0, 0.0)))
    (90.0, 0.0, 0.0)
    """
    x, y, z = (round(angle, DECIMALS) + 0.0 for angle in turns_of(rotation @ turned_by(rotate_deg)))
    return x, y, z
