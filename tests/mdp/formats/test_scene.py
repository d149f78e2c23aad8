"""Scenes that trimesh reads: glTF in several files, COLLADA."""

import sys
from pathlib import Path

import numpy as np
import pytest
import trimesh
from trimesh.exchange.gltf import export_gltf

from mdp.formats.scene import read
from mdp.read import read_mesh
from tests.mdp import files
from tests.mdp.files import refusal, save

DAE = """<COLLADA xmlns="http://www.collada.org/2005/11/COLLADASchema" version="1.4.1"><asset>{asset}</asset>
<library_geometries><geometry id="g"><mesh>
<source id="p"><float_array id="a" count="24">{positions}</float_array>
<technique_common><accessor source="#a" count="8" stride="3">
<param name="X" type="float"/><param name="Y" type="float"/><param name="Z" type="float"/>
</accessor></technique_common></source>
<vertices id="v"><input semantic="POSITION" source="#p"/></vertices>
<triangles count="12"><input semantic="VERTEX" source="#v" offset="0"/><p>{corners}</p></triangles>
</mesh></geometry></library_geometries>
<library_visual_scenes><visual_scene id="s"><node><instance_geometry url="#g"/></node></visual_scene></library_visual_scenes>
<scene><instance_visual_scene url="#s"/></scene></COLLADA>"""


def dae(asset: str) -> bytes:
    box = files.placed(20, 30, 40)
    positions, corners = (" ".join(map(str, rows.ravel().tolist())) for rows in (box.vertices, box.faces))
    return DAE.format(asset=asset, positions=positions, corners=corners).encode()


def test_a_gltf_with_buffer_files_is_read_like_a_glb(tmp_path: Path) -> None:
    box = trimesh.creation.box((20, 30, 40))
    for name, content in export_gltf(trimesh.Scene({"a": box})).items():
        (tmp_path / name).write_bytes(content)
    mesh, notes = read_mesh(tmp_path / "model.gltf")
    assert (notes, mesh.volume_mm3) == ((), pytest.approx(24_000))
    assert np.ptp(mesh.bounds_mm, axis=0) == pytest.approx([20, 30, 40])


def test_a_gltf_that_requires_an_extension_that_is_not_read_is_refused_by_its_name(tmp_path: Path) -> None:
    for name, content in export_gltf(trimesh.Scene({"a": trimesh.creation.box((20, 30, 40))})).items():
        required = content.replace(b'{"', b'{"extensionsRequired": ["EXT_meshopt_compression"], "', 1)
        (tmp_path / name).write_bytes(required if name.endswith(".gltf") else content)
    sentence = refusal(tmp_path / "model.gltf")
    assert sentence == "requires EXT_meshopt_compression, a glTF extension that is not read: export it without"


def test_transformations_of_nodes_are_applied(tmp_path: Path) -> None:
    mirrored = np.diag([-1.0, 1.0, 1.0, 1.0])
    mirrored[0, 3] = 60.0
    scene = trimesh.Scene({"a": trimesh.creation.box((20, 30, 40))})
    scene.add_geometry(trimesh.creation.cone(10, 20), transform=mirrored)
    for name, content in export_gltf(scene).items():
        (tmp_path / name).write_bytes(content)
    mesh, notes = read_mesh(tmp_path / "model.gltf")
    assert not any("wound" in note for note in notes)
    assert mesh.volume_mm3 == pytest.approx(sum(body.volume for body in scene.geometry.values()), rel=1e-6)
    assert np.ptp(mesh.bounds_mm, axis=0)[0] == pytest.approx(80.0, abs=0.01)


def test_a_gltf_without_its_buffers_or_of_nothing_ends_in_a_sentence(tmp_path: Path) -> None:
    assert "places no mesh" in refusal(save(tmp_path / "a.gltf", b'{"asset": {"version": "2.0"}}'))
    assert "cannot be read as .gltf" in refusal(save(tmp_path / "b.gltf", b"x"))
    lost = b'{"asset": {"version": "2.0"}, "buffers": [{"uri": "lost.bin", "byteLength": 8}]}'
    assert refusal(save(tmp_path / "c.gltf", lost)).startswith("cannot be read as .gltf (FileNotFoundError: ")


@pytest.mark.parametrize(
    ("asset", "sides_mm"),
    [
        ("", (20, 40, 30)),
        ("<up_axis>X_UP</up_axis>", (30, 40, 20)),
        ('<unit name="meter" meter="1"/><up_axis>Z_UP</up_axis>', (20, 30, 40)),
        ('<unit name="centimeter" meter="0.01"/><up_axis>Z_UP</up_axis>', (200, 300, 400)),
        ('<unit name="millimeter" meter="0.001"/><up_axis>Y_UP</up_axis>', (20, 40, 30)),
    ],
)
def test_unit_and_up_axis_of_collada_are_applied(tmp_path: Path, asset: str, sides_mm: tuple[float, ...]) -> None:
    pytest.importorskip("collada")
    mesh, notes = read_mesh(save(tmp_path / "a.dae", dae(asset)))
    assert notes == ()
    assert np.ptp(mesh.bounds_mm, axis=0) == pytest.approx(sides_mm)


def test_the_up_axis_of_collada_stays_up_without_mirroring(tmp_path: Path) -> None:
    pytest.importorskip("collada")
    (plain,) = read(save(tmp_path / "a.dae", dae("<up_axis>Z_UP</up_axis>")))
    for up, axis in enumerate(("X_UP", "Y_UP", "Z_UP")):
        (placed,) = read(save(tmp_path / "a.dae", dae(f"<up_axis>{axis}</up_axis>")))
        assert placed.vertices[:, 2] == pytest.approx(plain.vertices[:, up])
        turn, *_ = np.linalg.lstsq(plain.vertices, placed.vertices, rcond=None)
        assert np.linalg.det(turn) == pytest.approx(1.0)


@pytest.mark.parametrize(
    ("asset", "sentence"),
    [
        ('<unit meter="much"/>', "its <unit> is 'much' m, it must be a number above 0"),
        ("<unit meter='0'/>", "its <unit> is '0' m, it must be a number above 0"),
        ("<up_axis>UP</up_axis>", "its <up_axis> is 'UP', it must be one of X_UP, Y_UP, Z_UP"),
    ],
)
def test_an_invalid_unit_or_axis_is_refused(tmp_path: Path, asset: str, sentence: str) -> None:
    pytest.importorskip("collada")
    assert sentence in refusal(save(tmp_path / "a.dae", dae(asset)))


def test_a_missing_collada_library_is_reported_with_the_install_command(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "collada", None)
    assert refusal(save(tmp_path / "a.dae", dae(""))) == "reading .dae files needs collada: pip install 'tiltprint[dae]'"


def test_an_import_error_without_a_name_is_reported_with_the_install_command(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def missing(*given: object, **more: object) -> None:
        raise ImportError("no loader")  # without a name, as trimesh raises it

    monkeypatch.setattr("trimesh.load_scene", missing)
    sentence = refusal(save(tmp_path / "a.dae", b"<COLLADA/>"))
    assert sentence == "reading .dae files needs pycollada: pip install 'tiltprint[dae]'"
