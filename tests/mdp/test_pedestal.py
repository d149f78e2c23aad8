from math import pi

import manifold3d as m3
import numpy as np
import pytest

from mdp.cut import solid_of
from mdp.mesh import NO_COLOUR, Mesh
from mdp.overhang import risky_upright
from mdp.pedestal import on_pedestal
from tests import shapes
from tests.checks import assert_closed


def test_a_box_on_a_pedestal_gains_the_volume_of_a_rounded_prism() -> None:
    lifted = on_pedestal(shapes.box(20, 20, 20), 9.0)
    outline_mm2 = 20 * 20 + 4 * 20 * 2 + pi * 2**2
    assert lifted.volume_mm3 == pytest.approx(20**3 + 9.0 * outline_mm2 + 0.3 * (outline_mm2 - 400), rel=1e-3)
    assert lifted.bounds_mm[:, 2] == pytest.approx([0.0, 29.0])


@pytest.mark.parametrize("name", ["box", "tee", "branch", "hollow", "bowl", "ball"])
def test_every_shape_on_a_pedestal_is_one_closed_piece_without_new_overhangs(name: str) -> None:
    mesh = getattr(shapes, name)()
    lifted = on_pedestal(mesh, 7.5)
    assert_closed(lifted)
    assert sum(piece.volume() > 0 for piece in solid_of(lifted).decompose()) == 1
    above, before = lifted.areas_mm2[risky_upright(lifted, 45.0)].sum(), mesh.areas_mm2[risky_upright(mesh, 45.0)].sum()
    assert above <= before + 1e-6


def test_a_ball_on_a_point_gets_a_decent_base() -> None:
    lifted = on_pedestal(shapes.ball(10.0), 5.0)
    base = lifted.vertices[lifted.vertices[:, 2] == 0.0]
    assert np.hypot(base[:, 0], base[:, 1]).max() == pytest.approx(5.0, abs=0.05)


def test_two_feet_share_one_pedestal() -> None:
    legs = m3.Manifold.cube((5, 10, 20)) + m3.Manifold.cube((5, 10, 20)).translate((30, 0, 0))
    lifted = on_pedestal(shapes.standing(legs + m3.Manifold.cube((35, 10, 5)).translate((0, 0, 15))), 4.0)
    between = solid_of(lifted).slice(2.0)
    assert len(between.to_polygons()) == 1
    assert between.area() == pytest.approx(35 * 10 + 2 * 2 * (35 + 10) + pi * 4, rel=2e-3)


def test_no_height_leaves_the_model_alone() -> None:
    mesh = shapes.tee()
    assert on_pedestal(mesh, 0.0) is mesh


def test_faces_keep_their_colours_and_the_pedestal_has_none() -> None:
    box = shapes.box(20, 20, 20)
    red = Mesh(box.vertices, box.faces, np.where(box.normals[:, 2] > 0.9, 0xFF0000, 7).astype(np.int32))
    lifted = on_pedestal(red, 9.0)
    assert lifted.areas_mm2[lifted.colours == 0xFF0000].sum() == pytest.approx(400.0)
    assert lifted.areas_mm2[lifted.colours == 7].sum() == pytest.approx(4 * 20 * 19.7)
    assert lifted.vertices[lifted.faces[lifted.colours == NO_COLOUR]][:, :, 2].max() <= 9.3 + 1e-9
