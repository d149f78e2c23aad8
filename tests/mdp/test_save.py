"""The scene of all parts, as another program reads it."""

from io import BytesIO

import numpy as np
import pytest
import trimesh

from mdp.read import locate, read_mesh
from mdp.save import COLOURS, glb
from mdp.search.search import decompose
from profiles.profile import load


def test_the_scene_holds_all_parts_in_print_order_and_colour_as_gltf_wants_them() -> None:
    mesh, _ = read_mesh(locate("demo:bracket"))
    decomposition = decompose(mesh, "demo:bracket", load(settings=["search.directions=60"]), parts=2)
    parts = decomposition.parts
    scene = trimesh.load_scene(BytesIO(glb(decomposition)), file_type="glb")
    bodies = scene.geometry.values()
    assert list(scene.geometry) == [f"part-{part.index:02d}" for part in parts]
    assert [body.volume for body in bodies] == pytest.approx([part.volume_mm3 for part in parts], rel=1e-5)
    low, high = mesh.bounds_mm * 0.001
    assert scene.bounds == pytest.approx(np.array([[low[0], low[2], -high[1]], [high[0], high[2], -low[1]]]), abs=1e-7)
    colours = ["#" + "".join(f"{value:02X}" for value in body.visual.material.baseColorFactor[:3]) for body in bodies]
    assert colours == list(COLOURS[: len(parts)])
    assert glb(decomposition) == glb(decomposition)
