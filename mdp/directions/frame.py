"""Frame: two unit vectors across a direction and each other, right-handed with it."""

from typing import NamedTuple

import numpy as np

from mdp.mesh import Floats

AXES = np.eye(3)


class FramedDirections(NamedTuple):
    """(k, 3) unit directions and (k, 2, 3) vectors across each of them, for kernels."""

    directions: Floats
    frames: Floats


def framed(directions: Floats, axes: Floats = AXES) -> FramedDirections:
    """Directions, and with each of them the vector across it and the one of (3, 3) axes that it leans on least, and the one
    across both."""
    aside = np.cross(axes[np.abs(np.round(directions @ axes.T, 9)).argmin(axis=1)], directions)
    aside /= np.sqrt(np.vecdot(aside, aside))[:, None]
    return FramedDirections(np.array(directions), np.stack([aside, np.cross(directions, aside)], axis=1))


def frame_across(direction: Floats) -> Floats:
    """(2, 3) the vectors across one unit direction.

    >>> frame_across(np.array([0.0, 0.0, 1.0])) @ [2.0, 3.0, 4.0]
    array([-3.,  2.])
    """
    frame: Floats = framed(direction[None]).frames[0]
    return frame
