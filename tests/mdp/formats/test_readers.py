"""Guarantees of every mesh reader, in any format."""

import struct
from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from mdp.mesh import Mesh
from mdp.read import read_mesh
from profiles.errors import MeshError
from tests.checks import assert_closed
from tests.mdp import files
from tests.mdp.files import refusal, save
from tests.shapes import ball, tee

FORMATS = (".stl", ".obj", ".off", ".ply", ".3mf", ".glb")  # those of our own readers
SIZES = st.floats(1.0, 500.0, width=32)


def outcome(path: Path) -> Mesh | None:
    """The mesh of a file, or None if it is refused; any other exception fails the test."""
    try:
        return read_mesh(path)[0]
    except MeshError:
        return None


@settings(max_examples=40, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture, HealthCheck.too_slow])
@given(suffix=st.sampled_from(FORMATS), x=SIZES, y=SIZES, z=SIZES)
def test_a_box_in_any_format_comes_back_with_its_volume(tmp_path: Path, suffix: str, x: float, y: float, z: float) -> None:
    mesh, notes = read_mesh(files.written(tmp_path / f"box{suffix}", files.placed(x, y, z, (3.0, -4.0, 5.0))))
    assert [note for note in notes if not note.startswith("its longest side is")] == []
    assert mesh.volume_mm3 == pytest.approx(x * y * z, rel=1e-4)
    assert mesh.bounds_mm == pytest.approx(np.array([[-x / 2, -y / 2, 0], [x / 2, y / 2, z]]), abs=1e-4)


@pytest.mark.parametrize("suffix", FORMATS)
def test_a_sound_mesh_keeps_its_faces_and_places(tmp_path: Path, suffix: str) -> None:
    mesh, notes = read_mesh(files.written(tmp_path / f"tee{suffix}", tee()))
    assert notes == ()
    assert_closed(mesh)
    assert np.allclose(mesh.vertices[mesh.faces], tee().vertices[tee().faces], atol=1e-6)


@pytest.mark.parametrize("suffix", FORMATS)
def test_files_of_an_independent_writer_are_read_the_same(tmp_path: Path, suffix: str) -> None:
    trimesh = pytest.importorskip("trimesh")
    path = tmp_path / f"ball{suffix}"
    trimesh.Trimesh(ball().vertices, ball().faces, process=False).export(path)
    mesh, notes = read_mesh(path)
    assert (notes, len(mesh.faces)) == ((), len(ball().faces))
    assert mesh.volume_mm3 == pytest.approx(ball().volume_mm3, rel=1e-4)


@pytest.mark.parametrize("suffix", FORMATS)
def test_a_file_cut_anywhere_ends_in_a_sentence_or_in_the_whole_solid(tmp_path: Path, suffix: str) -> None:
    content = files.written(tmp_path / f"a{suffix}", tee()).read_bytes()
    for end in range(1, len(content) - 2, 61):
        mesh = outcome(save(tmp_path / f"cut{suffix}", content[:end]))
        assert mesh is None or mesh.volume_mm3 == pytest.approx(tee().volume_mm3, rel=1e-4)


@settings(max_examples=150, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture, HealthCheck.too_slow])
@given(suffix=st.sampled_from(FORMATS), share=st.floats(0, 0.999), value=st.integers(0, 255))
def test_a_file_with_one_wrong_byte_never_ends_in_a_traceback(tmp_path: Path, suffix: str, share: float, value: int) -> None:
    content = bytearray(files.written(tmp_path / f"a{suffix}", tee()).read_bytes())
    content[int(share * len(content))] = value
    mesh = outcome(save(tmp_path / f"wrong{suffix}", bytes(content)))
    if mesh is not None:
        assert_closed(mesh)


def test_a_coordinate_that_is_no_number_is_refused(tmp_path: Path) -> None:
    vertices = tee().vertices.copy()
    vertices[2, 1] = np.nan
    assert "vertex 3 of 16 has a coordinate that is not a finite number" in refusal(
        files.written(tmp_path / "a.off", Mesh(vertices, tee().faces))
    )
    assert "not a number" in refusal(save(tmp_path / "b.off", b"OFF\n1 0 0\n1 2 three\n"))


def test_a_comment_of_an_off_file_may_hold_any_bytes(tmp_path: Path) -> None:
    content = files.off(tee()).replace(b"# made here", b"# fait \x85 \x1c ici")
    mesh, _ = read_mesh(save(tmp_path / "a.off", content))
    assert mesh.volume_mm3 == pytest.approx(tee().volume_mm3)


@pytest.mark.parametrize("suffix", [".off", ".obj", ".ply", ".3mf", ".glb"])
def test_an_index_out_of_range_is_refused(tmp_path: Path, suffix: str) -> None:
    wrong = Mesh(tee().vertices, np.where(tee().faces == 5, 99, tee().faces))
    assert "vert" in refusal(files.written(tmp_path / f"a{suffix}", wrong))


def test_absurd_counts_are_refused_before_anything_is_allocated(tmp_path: Path) -> None:
    assert "announces 900000000000 vertices" in refusal(save(tmp_path / "a.off", b"OFF\n900000000000 6 0\n0 0 0\n"))
    header = files.ply(tee(), "binary_little_endian").replace(b"vertex 16", b"vertex 99999999999999")
    assert "more than the file can hold" in refusal(save(tmp_path / "a.ply", header))
    content = files.glb(tee()).replace(b'"count": 16', b'"count": 99')
    assert "an accessor of 99 rows lies outside" in refusal(save(tmp_path / "a.glb", content))
    huge = bytearray(files.stl(tee()))
    huge[80:84] = struct.pack("<I", 2**32 - 2)
    assert "of the 4294967294 facets" in refusal(save(tmp_path / "a.stl", bytes(huge)))
