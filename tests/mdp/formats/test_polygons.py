"""Polygons of OBJ, OFF and PLY files become triangles; OBJ files: allowed lines, and negative indices."""

from pathlib import Path

import numpy as np
import pytest

from mdp.formats.polygons import triangulate
from mdp.formats.readers import READERS
from mdp.mesh import Floats
from mdp.read import read_mesh
from tests.mdp import files
from tests.mdp.files import refusal, save
from tests.shapes import tee


def test_polygons_become_triangles_also_where_they_are_not_convex(tmp_path: Path) -> None:
    ell = [(0, 0), (30, 0), (30, 10), (10, 10), (10, 30), (0, 30)]
    rows = [f"v {x} {y} {z}" for z in (0, 10) for x, y in ell]
    sides = [f"f {k + 1}//1 {(k + 1) % 6 + 1}//1 {(k + 1) % 6 + 7}//1 {k + 7}//1" for k in range(6)]
    caps = ["f -9 -10 -11 -12 -7 -8", "f 10 11 12 7 8 9"]
    mesh, notes = read_mesh(save(tmp_path / "ell.obj", "\n".join([*rows, *sides, *caps]).encode()))
    assert notes == ()
    assert mesh.volume_mm3 == pytest.approx(5000)
    assert mesh.areas_mm2.sum() == pytest.approx(2 * 500 + 1200)


def test_a_face_of_600_concave_corners_is_read(tmp_path: Path) -> None:
    turn = np.arange(600) * 2 * np.pi / 600
    radius = np.where(np.arange(600) % 2, 40.0, 20.0)
    rows = [f"v {x} {y} {z}" for z in (0, 10) for x, y in zip(radius * np.cos(turn), radius * np.sin(turn), strict=True)]
    sides = [f"f {k + 1} {(k + 1) % 600 + 1} {(k + 1) % 600 + 601} {k + 601}" for k in range(600)]
    caps = ["f " + " ".join(str(k) for k in range(600, 0, -1)), "f " + " ".join(str(k) for k in range(601, 1201))]
    mesh, notes = read_mesh(save(tmp_path / "star.obj", "\n".join([*rows, *sides, *caps]).encode()))
    assert notes == ()
    assert mesh.volume_mm3 == pytest.approx(10 * 300 * 40 * 20 * np.sin(2 * np.pi / 600))


def test_a_face_with_a_hole_that_a_bridge_joins_to_its_outline_leaves_the_hole_open() -> None:
    outer, inner = [(0, 0), (10, 0), (10, 10), (0, 10), (0, 0)], [(3, 3), (3, 6), (6, 6), (6, 3), (3, 3)]
    points = np.array([(x, y, 5.0) for x, y in outer + inner])
    a, b, c = (points[triangulate(points)[:, k]] for k in range(3))
    areas_mm2 = 0.5 * np.cross(b - a, c - a)[:, 2]
    assert (areas_mm2 >= 0).all()
    assert areas_mm2.sum() == pytest.approx(100 - 9)


@pytest.mark.parametrize("points", [np.zeros((5, 3)), np.arange(15.0).reshape(5, 3), np.eye(3)[[0, 1, 2, 0, 1, 2]]])
def test_a_polygon_without_a_normal_still_has_all_its_edges(points: Floats) -> None:
    triangles = triangulate(points)
    edges = {(a, b) for triangle in triangles.tolist() for a, b in zip(triangle, np.roll(triangle, -1).tolist(), strict=True)}
    assert len(triangles) == len(points) - 2
    assert {(k, (k + 1) % len(points)) for k in range(len(points))} <= edges


def test_triangles_and_polygons_of_one_file_stay_in_their_order(tmp_path: Path) -> None:
    box = "OFF\n8 7 0\n0 0 0\n9 0 0\n9 9 0\n0 9 0\n0 0 9\n9 0 9\n9 9 9\n0 9 9\n"
    faces = "3 0 2 1\n4 4 5 6 7\n4 0 1 5 4\n4 1 2 6 5\n4 2 3 7 6\n4 3 0 4 7\n3 0 3 2\n"
    surface = READERS[".off"](save(tmp_path / "a.off", (box + faces).encode()), None).objects[0].volumes[0][0]
    assert surface.faces[[0, 1, 2, -1]].tolist() == [[0, 2, 1], [4, 5, 6], [4, 6, 7], [0, 3, 2]]


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


def test_negative_indices_count_from_their_line(tmp_path: Path) -> None:
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
