"""Colours stay with the faces of a file through scaling, turning and repair."""

from pathlib import Path

import numpy as np
import pytest

from mdp.formats.surface import Surface
from mdp.mesh import NO_COLOUR, Floats, Mesh, colour_text, parse_colour
from mdp.read import read_mesh
from mdp.repair.colours import NONE, SAME_DIRECTION, _pieces, carry_colours
from mdp.repair.repair import repair
from tests.mdp import files

RED, GREEN = 0xFF0000, 0x00FF00


def _painted(mesh: Mesh, colours: object) -> Surface:
    return Surface(mesh.vertices, mesh.faces.astype(np.int64), np.asarray(colours, dtype=np.int64))


def _areas_mm2(solid: Surface, colours: object) -> dict[int, float]:
    """Total area of each colour."""
    mesh, of = Mesh(solid.vertices, solid.faces.astype(np.int32)), np.asarray(colours)
    return {int(colour): round(float(mesh.areas_mm2[of == colour].sum()), 6) for colour in np.unique(of)}


def test_united_bodies_keep_the_colours_of_what_is_left_of_their_faces() -> None:
    cube = files.placed(10, 10, 10)
    bar = files.placed(10, 4, 4, (5.0, 3.0, 3.0))
    painted = [_painted(cube, [RED] * 12), _painted(bar, [GREEN] * 12)]
    solid, notes = repair(painted)
    assert notes == ["united 2 bodies that overlap or touch"]
    assert _areas_mm2(solid, carry_colours(painted, solid)) == {RED: 600.0 - 16.0, GREEN: 4 * 5 * 4 + 16.0}


def test_a_face_that_fills_a_hole_has_no_colour() -> None:
    box = files.placed(10, 10, 10)
    open_one = files.without(box, 3)
    painted = [_painted(open_one, [RED] * 11)]
    solid, notes = repair(painted)
    assert "filled 1 small hole" in notes[0]
    assert _areas_mm2(solid, carry_colours(painted, solid)) == {NO_COLOUR: 50.0, RED: 550.0}


def test_faces_turned_over_and_merged_keep_their_colours() -> None:
    box = files.inside_out(files.placed(10, 10, 10))
    soup = Surface(box.vertices[box.faces].reshape(-1, 3), np.arange(36).reshape(-1, 3), np.arange(12))
    solid, _ = repair([soup])
    colours = carry_colours([soup], solid)
    assert colours is not None
    middles = {tuple(row): colour for row, colour in zip(box.vertices[box.faces].mean(axis=1).round(6), range(12), strict=True)}
    assert [middles[tuple(row)] for row in solid.vertices[solid.faces].mean(axis=1).round(6)] == colours.tolist()


def test_unpainted_faces_have_no_colours() -> None:
    box = files.placed(10, 10, 10)
    plain = Surface(box.vertices, box.faces.astype(np.int64))
    assert carry_colours([plain], repair([plain])[0]) is None


@pytest.mark.parametrize(("text", "colour"), [("#FF0000", RED), ("#00ff0080", GREEN), ("red", None), ("#f00", None), ("", None)])
def test_colours_are_read_as_they_are_written(text: str, colour: int | None) -> None:
    assert parse_colour(text) == colour
    assert colour is None or parse_colour(colour_text(colour)) == colour


def test_a_mesh_that_is_scaled_and_turned_keeps_its_colours(tmp_path: Path) -> None:
    box = files.placed(10, 20, 30)
    colours = np.array([0x090909] * 4 + [RED] + [0x090909] * 7, dtype=np.int32)
    path = files.save(tmp_path / "a.ply", files.painted_ply(Mesh(box.vertices, box.faces, colours)))
    mesh, _ = read_mesh(path, 2.0, (90.0, 0.0, 0.0))
    assert mesh.colours is not None
    assert mesh.colours.tolist() == colours.tolist()
    turned = mesh.transform(np.eye(3))
    assert turned.colours is not None
    assert turned.colours.tolist() == mesh.colours.tolist()


def test_pieces_of_painted_faces_equal_those_of_brute_force() -> None:
    rng = np.random.default_rng(7)
    painted = rng.uniform(-50.0, 50.0, (120, 3, 3)) * rng.choice([0.02, 0.2, 1.0], (120, 1, 1))
    painted += rng.uniform(-50.0, 50.0, (120, 1, 3))
    painted[:60, :, 2] = np.round(painted[:60, :1, 2])  # many in parallel planes
    shares = rng.dirichlet([1.0, 1.0, 1.0], (120, 3))
    pieces = np.concatenate([np.einsum("nij,njx->nix", shares, painted), rng.uniform(-50.0, 50.0, (40, 3, 3))])
    carried = _pieces(painted, pieces)
    on = [{k for k in range(120) if lies_on(piece, painted[k])} for piece in pieces]
    assert all(row in found or (row == NONE and not found) for row, found in zip(carried, on, strict=True))
    assert (carried[:120] == np.arange(120)).mean() > 0.9


def lies_on(piece: Floats, triangle: Floats) -> bool:
    """Whether a piece's centre lies on a triangle of nearly the same direction: barycentric coordinates by least squares."""
    sides, place = (triangle[1:] - triangle[0]).T, piece.mean(axis=0) - triangle[0]
    shares, *_ = np.linalg.lstsq(sides, place, rcond=None)
    normals = [np.cross(each[1] - each[0], each[2] - each[0]) for each in (piece, triangle)]
    cosine = abs(normals[0] @ normals[1]) / np.linalg.norm(normals[0]) / np.linalg.norm(normals[1])
    away = np.linalg.norm(sides @ shares - place)
    return bool(away < 0.02 and shares.min() > -1e-6 and shares.sum() < 1.0 + 1e-6 and cosine > SAME_DIRECTION)
