"""Conversion between our meshes and trimesh's."""

import numpy as np
import pytest
import trimesh

from mdp.mesh import Mesh
from profiles.errors import MeshError
from tests.shapes import tee


def test_a_mesh_is_unchanged_by_conversion_to_trimesh_and_back() -> None:
    there = tee().to_trimesh()
    back = Mesh.from_trimesh(there)
    assert there.volume == pytest.approx(tee().volume_mm3)
    assert (back.vertices.tobytes(), back.faces.tobytes()) == (tee().vertices.tobytes(), tee().faces.tobytes())


@pytest.mark.parametrize("faces", [tee().faces[1:], tee().faces[:, ::-1]])
def test_an_open_or_inverted_mesh_is_not_converted_back(faces: np.ndarray) -> None:
    with pytest.raises(MeshError, match="is not a solid"):
        Mesh.from_trimesh(trimesh.Trimesh(tee().vertices, faces, process=False))
