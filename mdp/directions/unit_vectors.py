"""Unit vectors: evenly spread directions on a Fibonacci lattice, consecutive ones a golden angle apart, and right-handed frames
across a direction.
"""

from functools import cache
from math import pi, sqrt

import numpy as np

from mdp.mesh import Floats

AXES = np.eye(3)


@cache
def spread(count: int, least_z: float = -1.0) -> Floats:
    """(count, 3) unit directions spread evenly over the part of the sphere with at least that z; read-only."""
    place: Floats = np.arange(count, dtype=np.float64) + 0.5
    return _lattice(1.0 - (1.0 - least_z) * place / count, place)


@cache
def spread_like_light(count: int) -> Floats:
    """(count, 3) unit directions about +z, each for the same share of the light that a matt face receives (Malley); read-only."""
    place: Floats = np.arange(count, dtype=np.float64)
    return _lattice(np.sqrt(1.0 - (place + 0.5) / count), place)


def _lattice(z: Floats, place: Floats) -> Floats:
    angle, across = place * pi * (3.0 - sqrt(5.0)), np.sqrt(1.0 - z * z)
    directions = np.stack([across * np.cos(angle), across * np.sin(angle), z], axis=1)
    directions.setflags(write=False)
    return directions


def framed(directions: Floats, axes: Floats = AXES) -> tuple[Floats, Floats]:
    """(k, 3) unit directions as an array for kernels, and (k, 2, 3) pairs of unit vectors perpendicular to each.

    The first of a pair is the cross product of an axis and the direction, with the one of (3, 3) axes that is most nearly
    perpendicular to it; the second is the cross product of the direction and the first.
    """
    aside = _cross(axes[np.abs(np.round(directions @ axes.T, 9)).argmin(axis=1)], directions)
    aside /= np.sqrt(np.vecdot(aside, aside))[:, None]
    return np.array(directions), np.stack([aside, _cross(directions, aside)], axis=1)


def _cross(first: Floats, second: Floats) -> Floats:
    """(k, 3) cross products. numpy's own function takes five times as long for a single one."""
    (a, b, c), (p, q, r) = first.T, second.T
    return np.stack([b * r - c * q, c * p - a * r, a * q - b * p], axis=1)


def frame_across(direction: Floats) -> Floats:
    """(2, 3) the two vectors of the frame across a unit direction.

    >>> frame_across(np.array([0.0, 0.0, 1.0])) @ [2.0, 3.0, 4.0]
    array([-3.,  2.])
    """
    frame: Floats = framed(direction[None])[1][0]
    return frame
