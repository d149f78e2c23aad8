"""Reading model files: units, scale, rotation, and the notes about them."""

from pathlib import Path

import manifold3d as m3
import numpy as np
import pytest

from mdp.mesh import Mesh
from mdp.model_file import locate
from mdp.read import MANY_FACES, SizeError, read_mesh, too_fine
from profiles.errors import MeshError
from profiles.messages import terminal_words
from tests.mdp import files
from tests.mdp.files import refusal, save
from tests.shapes import box, tee


def test_the_same_file_gives_the_same_bytes_twice(tmp_path: Path) -> None:
    path = files.written(tmp_path / "two.stl", files.both(files.placed(10, 10, 10), files.placed(10, 10, 10, (5, 5, 5))))
    first, second = read_mesh(path)[0], read_mesh(path)[0]
    assert first.vertices.tobytes() + first.faces.tobytes() == second.vertices.tobytes() + second.faces.tobytes()


def test_scale_comes_before_rotation_and_rotation_about_x_before_z(tmp_path: Path) -> None:
    path = files.written(tmp_path / "box.off", files.placed(1, 2, 3))
    assert read_mesh(path, 10.0)[0].bounds_mm[1] == pytest.approx([5, 10, 30])
    assert read_mesh(path, 10.0, (90, 0, 0))[0].bounds_mm[1] == pytest.approx([5, 15, 20])
    assert read_mesh(path, 10.0, (90, 0, 90))[0].bounds_mm[1] == pytest.approx([15, 5, 20])
    assert read_mesh(path, 10.0, (0, 0, 45))[0].volume_mm3 == pytest.approx(6000)


def test_a_quarter_turn_is_exact(tmp_path: Path) -> None:
    mesh, _ = read_mesh(files.written(tmp_path / "box.off", files.placed(10, 20, 30)), 1.0, (0, 90, 0))
    assert sorted(set(mesh.vertices[:, 2].tolist())) == [0.0, 10.0]


@pytest.mark.parametrize(
    ("size_mm", "hint"),
    [(0.3, "metres, give --set process.scale=1000"), (0.9, "inches, give --set process.scale=25.4"), (5e4, "0.001")],
)
def test_an_absurd_size_is_refused_with_the_scale_that_fits(tmp_path: Path, size_mm: float, hint: str) -> None:
    sentence = refusal(files.written(tmp_path / "box.off", files.placed(size_mm, size_mm / 2, size_mm / 2)))
    assert f"largest extent is {size_mm:.4g} mm" in sentence
    assert hint in sentence


def test_the_possible_units_are_listed_with_their_scales_likeliest_first(tmp_path: Path) -> None:
    with pytest.raises(SizeError) as refused:
        read_mesh(files.written(tmp_path / "box.off", files.placed(0.16, 0.1, 0.1)))
    assert refused.value.units == {"metres": 1000.0, "inches": 25.4, "centimetres": 10.0}
    assert refused.value.question.endswith("its largest extent is 0.16 mm, less than 1 mm: which unit are its coordinates in?")


def test_a_scale_brings_a_model_in_metres_to_size(tmp_path: Path) -> None:
    mesh, _ = read_mesh(files.written(tmp_path / "box.off", files.placed(0.3, 0.1, 0.1)), scale=1000.0)
    assert mesh.volume_mm3 == pytest.approx(3e6)


@pytest.mark.parametrize("scale", [0.0, -1.0, float("nan")])
def test_a_scale_that_is_not_positive_is_refused(tmp_path: Path, scale: float) -> None:
    assert "process.scale must be above 0" in refusal(files.written(tmp_path / "box.off", tee()), scale=scale)


def test_files_that_cannot_be_opened_are_named(tmp_path: Path) -> None:
    assert "no such file" in refusal(tmp_path / "none.stl")
    (tmp_path / "folder.stl").mkdir()
    assert "is a folder" in refusal(tmp_path / "folder.stl")
    assert "is empty" in refusal(save(tmp_path / "empty.stl", b""))
    allowed = ".stl, .obj, .off, .ply, .3mf, .glb, .gltf, .dae, .step, .stp, .iges, .igs"
    assert f"allowed are {allowed}" in refusal(save(tmp_path / "a.blend", b"x"))


def test_a_file_without_permission_is_named(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def denied(path: Path) -> bytes:
        raise PermissionError(13, "Permission denied", str(path))

    path = files.written(tmp_path / "a.ply", tee())
    monkeypatch.setattr(Path, "read_bytes", denied)
    assert "cannot be read: Permission denied" in refusal(path)


def test_locate_knows_paths_and_names_the_demos_there_are(tmp_path: Path) -> None:
    assert locate("a/b.stl") == Path("a/b.stl")
    with pytest.raises(MeshError, match="no demo model 'none-such'; allowed are"):
        locate("demo:none-such")


def test_every_demo_reads_without_repair() -> None:
    folder = Path(__file__).parents[2] / "mdp" / "demos"
    for name in sorted(path.stem for path in folder.glob("*.ply")):
        mesh, notes = read_mesh(locate(f"demo:{name}"))
        assert notes == (), name
        assert mesh.bounds_mm[0, 2] == 0


def test_shared_models_read_as_they_are() -> None:
    if not files.SHARED.exists():
        pytest.skip("no shared models here")
    kitten, notes = read_mesh(files.SHARED / "models" / "kitten.off")
    assert (len(kitten.faces), notes) == (10_000, ())
    camel, notes = read_mesh(files.SHARED / "models" / "camelhead.glb")
    assert np.ptp(camel.bounds_mm, axis=0) == pytest.approx([41.89, 80.0, 41.90], abs=0.01)
    solid = m3.Manifold(m3.Mesh64(kitten.vertices.copy(), kitten.faces.astype(np.uint64)))
    assert solid.volume() == pytest.approx(198_875, rel=1e-4)


def test_a_mesh_with_far_too_many_faces_gets_advice_to_reduce_them() -> None:
    plane = np.zeros((4, 3)), np.zeros((MANY_FACES + 1, 3), np.int32)
    assert too_fine(box()) == ()
    (sentence,) = too_fine(Mesh(*plane))
    assert sentence.startswith(f"{MANY_FACES + 1} faces")
    assert "reduce its faces" in sentence


@pytest.mark.parametrize(
    ("name", "size_mm", "sentence"),
    [
        ("a.stl", 3.0, "its longest side is 3 mm: if its coordinates are inches, give --set process.scale=25.4"),
        ("a.obj", 9.9, "its longest side is 9.9 mm: if its coordinates are inches, give --set process.scale=25.4"),
        ("a.ply", 10.0, None),
        ("a.3mf", 3.0, None),
        (
            "a.glb",
            1.5,
            "its longest side is 1.5 mm: if its coordinates are metres with y up, as glTF specifies, "
            "give --set process.scale=1000 and --set process.rotate_deg=[90,0,0]",
        ),
        (
            "a.glb",
            6.0,
            "its longest side is 6 mm: metres with y up, as glTF specifies, would be more than 2000 mm; "
            "for a tenth of that give --set process.scale=100 and --set process.rotate_deg=[90,0,0]",
        ),
    ],
)
def test_a_small_model_is_reported_with_the_likely_scale(tmp_path: Path, name: str, size_mm: float, sentence: str | None) -> None:
    file = files.written(tmp_path / name, files.placed(size_mm, 1.0, 1.0))
    assert [*map(terminal_words, read_mesh(file)[1])] == ([] if sentence is None else [sentence])
    assert read_mesh(file, 25.4)[1] == ()
