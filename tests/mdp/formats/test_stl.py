"""STL files, binary and ASCII."""

from pathlib import Path

import pytest

from mdp.read import read_mesh
from tests.mdp import files
from tests.mdp.files import refusal, save
from tests.shapes import tee


def test_ascii_stl_ignores_normals_and_the_words_in_a_name(tmp_path: Path) -> None:
    mesh, notes = read_mesh(save(tmp_path / "a.stl", files.ascii_stl(tee())))
    assert notes == ()
    assert mesh.volume_mm3 == pytest.approx(tee().volume_mm3)


def test_binary_stl_may_begin_with_solid(tmp_path: Path) -> None:
    mesh, _ = read_mesh(save(tmp_path / "a.stl", files.stl(tee(), b"solid facet normal")))
    assert len(mesh.faces) == len(tee().faces)


def test_a_truncated_stl_says_how_many_facets_it_holds(tmp_path: Path) -> None:
    content = files.stl(tee())
    assert "holds 3 of the 28 facets" in refusal(save(tmp_path / "a.stl", content[: 84 + 3 * 50 + 20]))


@pytest.mark.parametrize("count", [b"\0\0\0\0", b"\xff\xff\xff\xff"])
def test_the_file_size_of_a_binary_stl_replaces_a_wrong_facet_count(tmp_path: Path, count: bytes) -> None:
    content = files.stl(tee())
    mesh, _ = read_mesh(save(tmp_path / "a.stl", content[:80] + count + content[84:]))
    assert mesh.volume_mm3 == pytest.approx(tee().volume_mm3)
    assert "holds 3 of the 4 facets" in refusal(save(tmp_path / "b.stl", content[:80] + count + content[84 : 84 + 3 * 50 + 20]))


@pytest.mark.parametrize("line_end", [b"\n", b"\r", b"\r\n"])
def test_words_behind_the_end_of_a_loop_are_left_alone(tmp_path: Path, line_end: bytes) -> None:
    content = files.ascii_stl(tee()).replace(b"endloop\n", b"endloop foo bar \n", 5).replace(b"\n", line_end)
    mesh, notes = read_mesh(save(tmp_path / "a.stl", content))
    assert (mesh.volume_mm3, notes) == (pytest.approx(tee().volume_mm3), ())


def test_a_text_file_called_stl_is_refused(tmp_path: Path) -> None:
    assert "is not an STL file" in refusal(save(tmp_path / "a.stl", b"This is a letter about something solid.\n" * 5))


def test_an_ascii_facet_without_three_vertices_is_named_with_its_line(tmp_path: Path) -> None:
    lines = files.ascii_stl(tee()).splitlines()
    four = [*lines[:12], lines[11], *lines[12:]]
    assert refusal(save(tmp_path / "a.stl", b"\n".join(four))) == "facet 2 of 28 (line 9) has 4 vertices instead of 3"


def test_the_solids_of_one_ascii_file_are_read_together(tmp_path: Path) -> None:
    mesh, _ = read_mesh(save(tmp_path / "a.stl", files.ascii_stl(tee()) + files.ascii_stl(files.placed(5, 5, 5, (50, 0, 0)))))
    assert mesh.volume_mm3 == pytest.approx(tee().volume_mm3 + 125)


@pytest.mark.parametrize("line_end", [b"\r", b"\r\n", b" "])
def test_ascii_stl_may_end_its_lines_as_it_likes(tmp_path: Path, line_end: bytes) -> None:
    mesh, _ = read_mesh(save(tmp_path / "a.stl", files.ascii_stl(tee()).replace(b"\n", line_end)))
    assert mesh.volume_mm3 == pytest.approx(tee().volume_mm3)


def test_bytes_behind_the_last_facet_are_left_alone(tmp_path: Path) -> None:
    mesh, _ = read_mesh(save(tmp_path / "a.stl", files.stl(tee()) + b"colours"))
    assert len(mesh.faces) == len(tee().faces)


def test_four_vertices_in_a_facet_and_two_in_the_next_are_not_shifted_into_place(tmp_path: Path) -> None:
    lines = files.ascii_stl(tee()).splitlines()
    moved = [*lines[:12], lines[11], *lines[12:17], *lines[18:]]
    assert "facet 2 of 28 (line 9) has 4 vertices" in refusal(save(tmp_path / "a.stl", b"\n".join(moved)))
