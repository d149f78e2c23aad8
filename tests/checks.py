"""Assertions that several tests share."""

import numpy as np

from mdp.mesh import Mesh


def assert_closed(mesh: Mesh) -> None:
    """Every edge has exactly two faces, once in each direction, and the volume is positive."""
    edges = mesh.faces[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2).astype(np.int64)
    n = len(mesh.vertices)
    forward, backward = np.sort(edges[:, 0] * n + edges[:, 1]), np.sort(edges[:, 1] * n + edges[:, 0])
    assert np.array_equal(forward, backward)
    assert mesh.volume_mm3 > 0
