"""Saved files, read back by another library."""

import io

import numpy as np
import pytest
import trimesh

from mdp.decomposition import Decomposition
from mdp.joint import joints_of
from mdp.plane import PLATFORM
from mdp.save import COLOURS, glb, json_values, part_file, stl, threemf
from mdp.search.search import SearchRequest, decompose
from profiles.profile import load
from tests.shapes import branch, tee


@pytest.fixture(scope="module")
def cut() -> Decomposition:
    return decompose(branch(), "branch", load(settings=["search.directions=200"]))


def test_an_stl_holds_the_mesh_to_single_precision() -> None:
    read = trimesh.load(io.BytesIO(stl(tee())), file_type="stl")
    assert read.is_watertight
    assert (len(read.faces), read.volume) == (len(tee().faces), pytest.approx(tee().volume_mm3, rel=1e-6))
    assert read.bounds == pytest.approx(tee().bounds_mm, abs=1e-5)


def test_a_3mf_holds_every_part_in_its_place_and_is_the_same_bytes_every_time(cut: Decomposition) -> None:
    scene = trimesh.load(io.BytesIO(threemf(cut)), file_type="3mf")
    volumes = sorted(geometry.volume for geometry in scene.geometry.values())
    assert len(cut.parts) == 2
    assert volumes == pytest.approx(sorted(part.volume_mm3 for part in cut.parts), rel=1e-6)
    assert scene.bounds == pytest.approx(cut.mesh.bounds_mm, abs=1e-5)
    assert threemf(cut) == threemf(cut)


def test_the_values_describe_the_parts(cut: Decomposition) -> None:
    values = json_values(cut, joints_of(cut.parts, load()), 0.25, 1.5)
    assert [part["file"] for part in values["parts"]] == ["part-01.stl", "part-02.stl"] == [part_file(k) for k in (1, 2)]
    assert sum(part["volume_mm3"] for part in values["parts"]) == pytest.approx(cut.mesh.volume_mm3)
    assert values["reduction"] == pytest.approx(1.0 - values["residual_area_mm2"] / values["risky_area_mm2"])
    assert sum(row["chosen"] for row in values["front"]) == 1
    assert [(joint["part"], joint["load_n"] > 0.0, joint["weakest"]) for joint in values["joints"]] == [(2, True, True)]
    assert np.linalg.norm(values["parts"][1]["direction"]) == pytest.approx(1.0)


def test_a_model_in_one_piece_has_nothing_to_reduce() -> None:
    whole = decompose(tee(), "tee", load(), SearchRequest(parts=1))
    values = json_values(whole, (), 0.0, 0.0)
    assert (values["reduction"], len(values["parts"])) == (0.0, 1)
    assert whole.parts[0].base is PLATFORM


def test_the_scene_holds_all_parts_in_print_order_and_colour_as_gltf_wants_them(cut: Decomposition) -> None:
    scene = trimesh.load_scene(io.BytesIO(glb(cut)), file_type="glb")
    bodies = scene.geometry.values()
    assert list(scene.geometry) == [f"part-{part.index:02d}" for part in cut.parts]
    assert [body.volume for body in bodies] == pytest.approx([part.volume_mm3 for part in cut.parts], rel=1e-5)
    low, high = cut.mesh.bounds_mm * 0.001
    assert scene.bounds == pytest.approx(np.array([[low[0], low[2], -high[1]], [high[0], high[2], -low[1]]]), abs=1e-7)
    colours = ["#" + "".join(f"{value:02X}" for value in body.visual.material.baseColorFactor[:3]) for body in bodies]
    assert colours == list(COLOURS[: len(cut.parts)])
    assert glb(cut) == glb(cut)
