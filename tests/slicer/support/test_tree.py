"""Branches keep simple outlines however far they continue downward past holes and walls."""

import manifold3d as m3
import numpy as np
import pytest

from mdp.mesh import Mesh
from slicer.geometry.polygons import Polygons, offset
from slicer.support.tree import carrying_area
from tests.shapes import standing
from tests.slicer.hand import as_shapely, cut, ragged
from tests.slicer.support.laws import assert_sound, supported

LEAN_MM = 0.2


def bored_bracket(seed: int, holes: int = 12) -> Mesh:
    """A block with an arm, bored in all directions: edges of holes are close to its walls."""
    rng = np.random.default_rng(seed)
    solid = m3.Manifold.cube((30, 16, 24)) + m3.Manifold.cube((50, 16, 5)).translate((0, 0, 19))
    for _ in range(holes):
        drill = m3.Manifold.cylinder(60, 1.5 + 2 * rng.random(), -1, 24, True)
        drill = drill.rotate((90 + rng.uniform(-40, 40), 0, rng.uniform(-60, 60)))
        solid -= drill.translate(tuple(rng.uniform((2, 2, 4), (45, 14, 22))))
    return standing(max(solid.decompose(), key=lambda piece: piece.volume()))


@pytest.mark.parametrize("seed", [4, 8])
def test_branches_between_holes_and_walls_have_bases_and_support(seed: int) -> None:
    base, top = cut(bored_bracket(seed), ((0.5, 0.2, 1.0), 8.0))
    assert_sound(*supported(top, "process.layer_height_mm=0.3", earlier=[base]))


@pytest.mark.parametrize("seed", range(6))
def test_branches_deflected_by_a_slope_are_supported_and_stay_simple(seed: int) -> None:
    star = ragged(seed)
    places = offset(star, 1.0) - star
    for layer in range(1, 25):
        reachable = Polygons.square((160.0, 160.0), True) - offset(star, 0.9 * LEAN_MM * layer)
        below = carrying_area(places, reachable, Polygons(), LEAN_MM)
        assert (below - reachable).area() < 1e-5
        loose = as_shapely(places) - as_shapely(below).buffer(LEAN_MM + 1e-3)
        assert (loose & as_shapely(reachable).buffer(LEAN_MM - 0.05)).area < 0.01
        assert below.num_vert() <= 4 * star.num_vert()
        places = below
