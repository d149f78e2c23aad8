"""Symmetry: mirror planes of models, and the images of planes in them."""

import manifold3d as m3
import numpy as np
import pytest

from mdp.cost.symmetry import Mirror, find_mirrors
from mdp.cut import mesh_of
from mdp.mesh import Mesh
from mdp.plane import Plane
from tests import shapes


def _arms(other_mm: float) -> Mesh:
    """A post with two round arms towards -x (30 mm long) and +x (other_mm)."""
    arms = [m3.Manifold.cylinder(length, 4, 4, 24).rotate((0, 60 * side, 0)) for side, length in ((-1, 30.0), (1, other_mm))]
    return mesh_of(m3.Manifold.cylinder(40, 7, 7, 48) + sum((arm.translate((0, 0, 20)) for arm in arms), m3.Manifold()))


@pytest.mark.parametrize(("other_mm", "across_x"), [(30.0, True), (30.5, True), (22.0, False)])
def test_a_model_is_symmetric_if_it_equals_its_mirror_image(other_mm: float, across_x: bool) -> None:
    normals = np.abs([mirror.normal for mirror in find_mirrors(_arms(other_mm))])
    assert normals[:, 1].max() == pytest.approx(1.0)  # front and back always mirror each other
    assert (normals[:, 0].max() > 0.999) == across_x


def test_mirroring_a_plane_twice_gives_it_back() -> None:
    mirror = Mirror(np.array([1.0, 0.0, 0.0]), 3.0)
    plane, middle = Plane(np.array([0.1, 0.0, 0.99**0.5]), 7.0), np.array([5.0, 2.0, 1.0])
    twice = mirror.image(mirror.image(plane))
    assert [*twice.normal, twice.offset_mm] == pytest.approx([*plane.normal, 7.0])
    upright = mirror.upright(plane, middle)
    assert upright is not None
    own = mirror.image(upright)
    assert [*own.normal, own.offset_mm] == pytest.approx([*upright.normal, upright.offset_mm])
    assert mirror.upright(upright, middle) is None  # already equal to its own image


def test_a_model_without_symmetry_has_no_mirror_planes() -> None:
    bent = m3.Manifold.cube((30, 8, 5)) + m3.Manifold.cube((8, 20, 5)) + m3.Manifold.cube((5, 5, 25)).translate((20, 0, 0))
    assert find_mirrors(shapes.standing(bent)) == []
