"""Spread: unit directions that stand for all others, on a Fibonacci lattice: each a golden angle on from the one before."""

from functools import cache
from math import pi, sqrt

import numpy as np

from mdp.mesh import Floats


@cache
def spread(count: int, least_z: float = -1.0) -> Floats:
    """(count, 3) unit directions spread evenly over the sphere where z is at least that; read only."""
    place: Floats = np.arange(count, dtype=np.float64) + 0.5
    return _lattice(1.0 - (1.0 - least_z) * place / count, place)


@cache
def spread_like_light(count: int) -> Floats:
    """(count, 3) unit directions about +z, each for the same share of the light that a matt face receives (Malley); read only."""
    place: Floats = np.arange(count, dtype=np.float64)
    return _lattice(np.sqrt(1.0 - (place + 0.5) / count), place)


def _lattice(z: Floats, place: Floats) -> Floats:
    angle, across = place * pi * (3.0 - sqrt(5.0)), np.sqrt(1.0 - z * z)
    directions = np.stack([across * np.cos(angle), across * np.sin(angle), z], axis=1)
    directions.setflags(write=False)
    return directions
