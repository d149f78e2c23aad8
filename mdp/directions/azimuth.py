"""Azimuth: a bearing about z that turns with a model, so that a search finds the same of a model however it is turned."""

from math import factorial

import numpy as np

from mdp.directions.orientation import centre_of_mass
from mdp.mesh import Floats, Mesh
from mdp.pose import UP, about

HIGHEST = 6  # the order of the highest moment that is measured
PLAIN = 1e-3  # of the largest that a moment can be: less is rounding, or a symmetry


def azimuth_rad(mesh: Mesh) -> float:
    """Where the first moment of a mesh points that is not 0: the integral over the surface of (x + i y)^m about the centre of
    mass points in m directions at once, of which the higher moments choose; 0 where there is none, as of a body of revolution.

    Over a triangle with the corners a, b, c as complex numbers it is 2 A m! / (m + 2)! times the sum of all a^i b^j c^k with
    i + j + k = m, A its area.
    """
    moments = _moments(mesh)
    order = next((m for m in range(1, HIGHEST + 1) if abs(moments[m - 1]) > PLAIN), 0)
    if order == 0:
        return 0.0
    bearings = (np.angle(moments[order - 1]) + 2.0 * np.pi * np.arange(order)) / order
    powers = np.arange(1, HIGHEST + 1)
    along = np.real(np.exp(-1j * np.outer(bearings, powers)) @ moments)
    return float(bearings[int(np.argmax(np.round(along, 6)))])


def axes_along(azimuth_rad: float) -> Floats:
    """(3, 3) rows: the axes of a frame that is turned about z by an angle."""
    return about(UP, azimuth_rad).T


def _moments(mesh: Mesh) -> np.ndarray:
    """(6,) the moments, each as a share of the largest that it can be."""
    centre = centre_of_mass(mesh)
    z = (mesh.vertices[:, 0] - centre[0]) + 1j * (mesh.vertices[:, 1] - centre[1])
    z /= np.abs(z).max()
    sums = [np.ones(len(mesh.faces), complex), *np.zeros((HIGHEST, len(mesh.faces)), complex)]
    for corner in z[mesh.faces].T:  # complete homogeneous polynomials of ever more variables
        for m in range(1, HIGHEST + 1):
            sums[m] = sums[m] + corner * sums[m - 1]
    total = mesh.areas_mm2.sum()
    scale = [2.0 * factorial(m) / factorial(m + 2) for m in range(1, HIGHEST + 1)]
    return np.array([scale[m - 1] * (mesh.areas_mm2 @ sums[m]) / total for m in range(1, HIGHEST + 1)])
