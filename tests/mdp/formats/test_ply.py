"""PLY files, ASCII and binary."""

import struct
from pathlib import Path

import numpy as np
import pytest

from mdp.read import read_mesh
from tests.mdp import files
from tests.mdp.files import refusal, save
from tests.shapes import tee


@pytest.mark.parametrize("order", ["binary_little_endian", "binary_big_endian"])
def test_binary_ply_reads_like_ascii(tmp_path: Path, order: str) -> None:
    mesh, _ = read_mesh(save(tmp_path / "a.ply", files.ply(tee(), order)))
    plain, _ = read_mesh(save(tmp_path / "b.ply", files.ply(tee())))
    assert np.array_equal(mesh.vertices, plain.vertices)
    assert np.array_equal(mesh.faces, plain.faces)


def test_a_comment_of_a_ply_header_may_hold_any_bytes(tmp_path: Path) -> None:
    plain, _ = read_mesh(save(tmp_path / "a.ply", files.ply(tee())))
    content = files.ply(tee()).replace(b"comment x", b"comment \x85element face 0 \x0cproperty x")
    mesh, _ = read_mesh(save(tmp_path / "b.ply", content))
    assert np.array_equal(mesh.faces, plain.faces)


def test_a_ply_without_a_list_of_corners_is_refused(tmp_path: Path) -> None:
    content = files.ply(tee()).replace(b"property list uchar int vertex_indices", b"property int vertex_indices")
    assert "`face` with a list vertex_indices" in refusal(save(tmp_path / "a.ply", content))


def test_a_binary_ply_may_mix_triangles_and_quads_and_carry_other_tables(tmp_path: Path) -> None:
    points = [(x, y, z) for z in (0, 9) for x, y in ((0, 0), (9, 0), (9, 9), (0, 9))]
    faces = [(0, 2, 1), (0, 3, 2), (4, 5, 6, 7), (0, 1, 5, 4), (1, 2, 6, 5), (2, 3, 7, 6), (3, 0, 4, 7)]
    header = "ply\ncomment here\nformat binary_big_endian 1.0\nelement vertex 8\nproperty float x\nproperty float y\n"
    header += "property float z\nelement face 7\nproperty uchar flags\nproperty list uchar int vertex_index\nelement edge 1\n"
    header += "property int vertex1\nproperty int vertex2\nend_header\n"
    rows = [struct.pack(">fff", *point) for point in points]
    rows += [struct.pack(f">BB{len(face)}i", 1, len(face), *face) for face in faces]
    mesh, notes = read_mesh(save(tmp_path / "a.ply", header.encode() + b"".join(rows) + struct.pack(">ii", 0, 1) + b"\n"))
    assert (mesh.volume_mm3, len(mesh.faces), len(notes)) == (pytest.approx(729), 12, 1)  # the note reports its size


def test_the_numbers_of_an_ascii_ply_may_be_on_any_lines(tmp_path: Path) -> None:
    header, _, body = files.ply(tee()).partition(b"end_header\n")
    mesh, _ = read_mesh(save(tmp_path / "a.ply", header + b"end_header\n\n" + body.replace(b" ", b"\n")))
    assert mesh.volume_mm3 == pytest.approx(tee().volume_mm3)


def _tetrahedron(vertex: str, face: str, corners: list[str], sides: list[str]) -> bytes:
    """A tetrahedron with extra property lines and their values for every vertex and every face."""
    points = ["0 0 0", "9 0 0", "0 9 0", "0 0 9"]
    faces = ["3 0 2 1", "3 0 1 3", "3 1 2 3", "3 0 3 2"]
    header = f"ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\nproperty float z\n{vertex}"
    header += f"element face 4\nproperty list uchar int vertex_indices\n{face}end_header\n"
    rows = [f"{values} {more}\n" for values, more in [*zip(points, corners, strict=True), *zip(faces, sides, strict=True)]]
    return (header + "".join(rows)).encode()


BYTES = "property uchar red\nproperty uchar green\nproperty uchar blue\n"
SHARES = BYTES.replace("uchar", "float")


def test_faces_of_a_ply_have_their_own_colours(tmp_path: Path) -> None:
    sides = ["255 0 0", "0 255 0", "1 2 3", "0 0 300"]
    mesh, _ = read_mesh(save(tmp_path / "a.ply", _tetrahedron("", BYTES, [""] * 4, sides)))
    assert mesh.colours is not None
    assert mesh.colours.tolist() == [0xFF0000, 0x00FF00, 0x010203, -1]


@pytest.mark.parametrize(("kind", "red", "blue"), [(BYTES, "255 0 0", "0 0 255"), (SHARES, "1 0 0", "0 0 1")])
def test_a_face_of_a_ply_has_the_colour_of_its_corners_where_all_have_it(tmp_path: Path, kind: str, red: str, blue: str) -> None:
    mesh, _ = read_mesh(save(tmp_path / "a.ply", _tetrahedron(kind, "", [red, red, red, blue], [""] * 4)))
    assert mesh.colours is not None
    assert mesh.colours.tolist() == [0xFF0000, -1, -1, -1]
