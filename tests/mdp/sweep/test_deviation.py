"""Deviation: distances from a surface are those of another library."""

import numpy as np
import pytest
import trimesh

from mdp.mesh import Mesh
from mdp.sweep.rays import distances_mm
from tests import shapes
from tests.mdp.solids import random_solid


@pytest.mark.parametrize("mesh", [shapes.tee(), shapes.bowl(), random_solid(3)], ids=["tee", "bowl", "random"])
def test_distances_are_those_of_trimesh(mesh: Mesh) -> None:
    places = np.random.default_rng(1).uniform(mesh.bounds_mm[0] - 5.0, mesh.bounds_mm[1] + 5.0, (200, 3))
    triangles = mesh.vertices[mesh.faces]
    nearest = [trimesh.triangles.closest_point(triangles, np.tile(place, (len(triangles), 1))) - place for place in places]
    expected = [np.linalg.norm(off, axis=1).min() for off in nearest]
    assert distances_mm(mesh, places, 1e3) == pytest.approx(expected, abs=1e-9)
    assert distances_mm(mesh, places, 2.0) == pytest.approx(np.minimum(expected, 2.0), abs=1e-9)
