"""GLB files: nodes, accessors and what is refused."""

import json
import struct
from pathlib import Path

import numpy as np
import pytest

from mdp.mesh import NO_COLOUR
from mdp.read import read_mesh
from tests.mdp import files
from tests.mdp.files import refusal, save


def test_glb_nodes_are_placed_and_coordinates_are_taken_as_mm_with_z_up(tmp_path: Path) -> None:
    node = {"translation": [1, 2, 3], "rotation": [0, 0, 0.5**0.5, 0.5**0.5], "scale": [1, 2, 3]}
    mesh, _ = read_mesh(save(tmp_path / "a.glb", files.glb(files.placed(10, 10, 10), node)))
    assert np.ptp(mesh.bounds_mm, axis=0) == pytest.approx([20, 10, 30])


def _document() -> bytes:
    """That of a box of 10 mm."""
    content = files.glb(files.placed(10, 10, 10))
    return content[20 : 20 + int.from_bytes(content[12:16], "little")]


def _edited(**changes: object) -> bytes:
    """The GLB file of a box of 10 mm with some of its document changed."""
    content = files.glb(files.placed(10, 10, 10))
    length = int.from_bytes(content[12:16], "little")
    text = json.dumps({**json.loads(content[20 : 20 + length]), **changes}).encode()
    text += b" " * (-len(text) % 4)
    body = struct.pack("<II", len(text), 0x4E4F534A) + text + content[20 + length :]
    return content[:8] + struct.pack("<I", 12 + len(body)) + body


@pytest.mark.parametrize(
    ("nodes", "boxes"),
    [
        ([{"children": [1, 2]}, {"mesh": 0}, {"mesh": 0, "translation": [50, 0, 0]}], 2),
        ([{"children": [1, 2]}, {"children": [3]}, {"children": [3], "translation": [50, 0, 0]}, {"mesh": 0}], 2),
        ([{"children": [1, 2], "camera": 0}, {"mesh": 0}, {"name": "world", "mesh": 0, "translation": [0, 0, 50]}], 2),
        ([{"mesh": 0, "scale": [-1, 1, 1], "camera": 0}], 1),
    ],
)
def test_every_mesh_that_a_node_of_the_scene_reaches_is_placed(tmp_path: Path, nodes: list[object], boxes: int) -> None:
    mesh, _ = read_mesh(save(tmp_path / "a.glb", _edited(nodes=nodes)))
    assert mesh.volume_mm3 == pytest.approx(1000 * boxes)


def test_the_colours_of_materials_are_kept_as_srgb(tmp_path: Path) -> None:
    materials = [{"pbrMetallicRoughness": {"baseColorFactor": [1.0, 0.2158605, 0.0, 1.0]}}, {"name": "plain"}]
    box = json.loads(_document())["meshes"][0]["primitives"][0]
    meshes = [{"primitives": [{**box, "material": number}]} for number in (0, 1)]
    nodes = [{"mesh": 0}, {"mesh": 1, "translation": [50, 0, 0]}]
    content = _edited(materials=materials, meshes=meshes, nodes=nodes, scenes=[{"nodes": [0, 1]}])
    mesh, _ = read_mesh(save(tmp_path / "a.glb", content))
    assert mesh.colours is not None
    assert set(mesh.colours.tolist()) == {0xFF8000, NO_COLOUR}


def test_without_a_scene_the_nodes_that_no_other_holds_are_placed(tmp_path: Path) -> None:
    mesh, _ = read_mesh(save(tmp_path / "a.glb", _edited(scenes=[], nodes=[{"mesh": 0}, {"children": [0], "scale": [2, 2, 2]}])))
    assert mesh.volume_mm3 == pytest.approx(8000)


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"nodes": [{"children": [1]}, {"children": [0], "mesh": 0}]}, "its nodes contain each other"),
        ({"nodes": [*({"children": [k + 1, k + 1]} for k in range(30)), {}]}, "places more than 20000 objects by reference"),
        ({"buffers": [{"uri": "other.bin", "byteLength": 9}]}, "data in another file"),
        ({"scene": 5}, "its glTF document is malformed (IndexError"),
        ({"nodes": [{}]}, "its scene places no mesh"),
    ],
)
def test_a_scene_that_cannot_be_read_is_refused(tmp_path: Path, changes: dict[str, object], words: str) -> None:
    assert words in refusal(save(tmp_path / "a.glb", _edited(**changes)))


@pytest.mark.parametrize(
    "primitive",
    [
        {"attributes": {"POSITION": 1}, "mode": 5},
        {"attributes": {"POSITION": 1}, "indices": 0, "extensions": {"KHR_draco_mesh_compression": {"bufferView": 1}}},
    ],
)
def test_strips_and_compressed_geometry_are_refused_and_not_guessed(tmp_path: Path, primitive: object) -> None:
    sentence = refusal(save(tmp_path / "a.glb", _edited(meshes=[{"primitives": [primitive]}])))
    assert sentence == "holds strips or fans of triangles or compressed geometry; only plain triangles are read"


@pytest.mark.parametrize("mode", [0, 1, 3])
def test_points_and_lines_beside_a_solid_are_left_out_with_a_note(tmp_path: Path, mode: int) -> None:
    solid, line = ({"attributes": {"POSITION": 1}, "indices": 0}, {"attributes": {"POSITION": 1}, "mode": mode})
    mesh, notes = read_mesh(save(tmp_path / "a.glb", _edited(meshes=[{"primitives": [solid, line]}])))
    assert mesh.volume_mm3 == pytest.approx(1000.0)
    assert notes == ("left out points and lines in one of its parts: only solids and faces are printed",)
    assert (
        refusal(save(tmp_path / "b.glb", _edited(meshes=[{"primitives": [line]}])))
        == "its scene places no mesh but points and lines"
    )
