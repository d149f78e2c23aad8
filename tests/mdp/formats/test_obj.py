"""OBJ files: what may stand in a line, and indices counted backwards."""

from pathlib import Path

import pytest

from mdp.read import read_mesh
from tests.mdp import files
from tests.mdp.files import refusal, save
from tests.shapes import tee


@pytest.mark.parametrize(
    ("old", "new"),
    [
        ("v ", "v\t"),
        ("\nf ", "\n  f "),
        ("\nf ", " # a comment\nf "),
        ("\nf ", " \\\n \nf "),
        ("\n", "\r\n"),
        ("\nf ", "\n# \x85f 3D \x0cv mm\nf "),
        ("\nf ", "\ns 1\nusemtl a\nf "),
    ],
)
def test_blanks_comments_and_other_lines_change_nothing(tmp_path: Path, old: str, new: str) -> None:
    plain = read_mesh(save(tmp_path / "a.obj", files.obj(tee())))[0]
    changed = read_mesh(save(tmp_path / "b.obj", files.obj(tee()).decode().replace(old, new).encode("latin-1")))[0]
    assert (changed.vertices.tobytes(), changed.faces.tobytes()) == (plain.vertices.tobytes(), plain.faces.tobytes())


def test_negative_indices_count_from_the_line_they_stand_in(tmp_path: Path) -> None:
    boxes = [files.placed(10, 10, 10), files.placed(10, 10, 10, (20, 0, 0))]
    rows = ["".join(f"v {x} {y} {z}\n" for x, y, z in box.vertices) + _faces((box.faces - 8).tolist()) for box in boxes]
    mesh, notes = read_mesh(save(tmp_path / "a.obj", "".join(rows).encode()))
    assert (mesh.volume_mm3, notes) == (pytest.approx(2000), ())


@pytest.mark.parametrize(
    ("line", "sentence"),
    [
        ("f 1 2", "the face in line 47 has 2 corners, at least 3 are needed"),
        ("f 0 1 2", "the face in line 47 names a vertex that does not exist: `0 1 2`"),
        ("f -17 1 2", "the face in line 47 names a vertex that does not exist: `-17 1 2`"),
        ("f 1 2 x", "the face in line 47 is malformed: `1 2 x`"),
        ("v 1 2", "the vertex in line 47 has fewer than three coordinates"),
    ],
)
def test_a_bad_line_is_named(tmp_path: Path, line: str, sentence: str) -> None:
    assert refusal(save(tmp_path / "a.obj", files.obj(tee()) + line.encode())) == sentence


def _faces(rows: list[list[int]]) -> str:
    return "".join("f " + " ".join(map(str, row)) + "\n" for row in rows)
