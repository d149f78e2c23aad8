"""Shared assertions."""

import numpy as np

from mdp.mesh import Floats, Mesh
from mdp.pose import UP, Pose, rotation
from profiles.machine import Machine


def assert_closed(mesh: Mesh) -> None:
    """Every edge has exactly two faces, once in each direction, and the volume is positive."""
    edges = mesh.faces[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2).astype(np.int64)
    n = len(mesh.vertices)
    forward, backward = np.sort(edges[:, 0] * n + edges[:, 1]), np.sort(edges[:, 1] * n + edges[:, 0])
    assert np.array_equal(forward, backward)
    assert mesh.volume_mm3 > 0


def assert_same_direction(machine: Machine, pose: Pose, direction: Floats) -> None:
    """The pose brings the workpiece direction to the machine's +z, to a billionth of a degree."""
    assert np.degrees(np.linalg.norm(rotation(machine, pose) @ direction - UP)) < 1e-9
