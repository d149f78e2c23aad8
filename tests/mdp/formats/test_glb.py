"""GLB files: nodes, accessors and refusals."""

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
    """The document of a box of 10 mm."""
    content = files.glb(files.placed(10, 10, 10))
    return content[20 : 20 + int.from_bytes(content[12:16], "little")]


def _edited(**changes: object) -> bytes:
    """The GLB file of a box of 10 mm with part of its document changed."""
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


def test_without_a_scene_the_root_nodes_are_placed(tmp_path: Path) -> None:
    mesh, _ = read_mesh(save(tmp_path / "a.glb", _edited(scenes=[], nodes=[{"mesh": 0}, {"children": [0], "scale": [2, 2, 2]}])))
    assert mesh.volume_mm3 == pytest.approx(8000)


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"nodes": [{"children": [1]}, {"children": [0], "mesh": 0}]}, "its nodes contain each other"),
        ({"nodes": [*({"children": [k + 1, k + 1]} for k in range(30)), {}]}, "places more than 20000 objects by reference"),
        ({"buffers": [{"uri": "other.bin", "byteLength": 9}]}, "data in another file"),
        ({"scene": 5}, "is damaged: it names 5 of its scenes, there are 1 (counted from 0)"),
        ({"nodes": [{"mesh": -1}]}, "is damaged: it names -1 of its meshes, there are 1 (counted from 0)"),
        ({"nodes": [{"mesh": 0, "matrix": [1, 2]}]}, "is damaged: matrix of a node is [1, 2], it must be 16 finite numbers"),
        ({"meshes": 5}, "is damaged: meshes of its glTF document is not a list"),
        ({"meshes": [{"primitives": [{"attributes": {}}]}]}, "is damaged: a mesh has no vertices (POSITION)"),
        (
            {"accessors": [{"componentType": 7, "bufferView": 0}] * 2},
            "is damaged: componentType of accessor 1 is 7, it must be one of",
        ),
        ({"accessors": [{}] * 2}, "is damaged: accessor 1 names no bufferView"),
        ({"accessors": [{"bufferView": 0, "componentType": 5126, "type": "VEC2"}] * 2}, "is 'VEC2', it must be VEC3 here"),
        ({"meshes": [[]]}, "its glTF document holds something of a kind that does not belong there"),
        (
            {"extensionsRequired": ["EXT_meshopt_compression"]},
            "requires EXT_meshopt_compression, a glTF extension that is not read",
        ),
        ({"nodes": [{}]}, "its scene places no mesh"),
    ],
)
def test_a_scene_that_cannot_be_read_is_refused(tmp_path: Path, changes: dict[str, object], words: str) -> None:
    assert words in refusal(save(tmp_path / "a.glb", _edited(**changes)))


def test_a_document_that_is_no_json_is_refused_with_the_place(tmp_path: Path) -> None:
    sentence = refusal(save(tmp_path / "a.glb", _edited().replace(b'"asset"', b'{asset"', 1)))
    assert sentence == "is damaged: its glTF document is not valid JSON at character 2"


def test_a_file_may_require_extensions_of_looks_and_whole_numbers_for_positions(tmp_path: Path) -> None:
    accessors = json.loads(_document())["accessors"]
    corners = files.placed(10, 10, 10)
    points = np.where(corners.vertices > 5.0, 32767, 0).astype("<i2")
    changes = {
        "extensionsRequired": ["KHR_materials_unlit", "KHR_mesh_quantization"],
        "accessors": [accessors[0], {**accessors[1], "componentType": 5122, "normalized": True}],
        "nodes": [{"mesh": 0, "scale": [20, 30, 40]}],
    }
    content = _edited(**changes)
    place = content.index(corners.vertices.astype("<f4").tobytes())
    content = content[:place] + points.tobytes().ljust(len(content) - place, b"\0")
    mesh, notes = read_mesh(save(tmp_path / "a.glb", content))
    assert (notes, mesh.volume_mm3) == ((), pytest.approx(24_000))


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
def test_points_and_lines_next_to_a_solid_are_left_out_with_a_note(tmp_path: Path, mode: int) -> None:
    solid, line = ({"attributes": {"POSITION": 1}, "indices": 0}, {"attributes": {"POSITION": 1}, "mode": mode})
    mesh, notes = read_mesh(save(tmp_path / "a.glb", _edited(meshes=[{"primitives": [solid, line]}])))
    assert mesh.volume_mm3 == pytest.approx(1000.0)
    assert notes == ("left out points and lines in one of its parts: only solids and faces are printed",)
    assert (
        refusal(save(tmp_path / "b.glb", _edited(meshes=[{"primitives": [line]}])))
        == "its scene places no mesh but points and lines"
    )
