"""Branches stay simple shapes however far they go down past holes and walls."""

from typing import Any

import manifold3d as m3
import numpy as np
import pytest

from mdp.mesh import Mesh
from slicer.geometry.polygons import Polygons
from slicer.support.branch import Growth
from slicer.support.reachable import reachable_areas
from slicer.support.tree import Tree
from tests.shapes import standing
from tests.slicer.hand import cut
from tests.slicer.support.laws import assert_sound, supported

PLATE = Polygons.square((400.0, 400.0), True)
GAP_LAYERS = 2  # support ends so many layers below what hangs


def bored_bracket(seed: int, holes: int = 12) -> Mesh:
    """A block with an arm, bored in all directions: edges of holes run close to its walls."""
    rng = np.random.default_rng(seed)
    solid = m3.Manifold.cube((30, 16, 24)) + m3.Manifold.cube((50, 16, 5)).translate((0, 0, 19))
    for _ in range(holes):
        drill = m3.Manifold.cylinder(60, 1.5 + 2 * rng.random(), -1, 24, True)
        drill = drill.rotate((90 + rng.uniform(-40, 40), 0, rng.uniform(-60, 60)))
        solid -= drill.translate(tuple(rng.uniform((2, 2, 4), (45, 14, 22))))
    return standing(max(solid.decompose(), key=lambda piece: piece.volume()))


def corners_of_branches(values: dict[str, Any]) -> list[int]:
    """Per layer, from the top down, the corners of all branches that are no trunks."""
    process, heights, blocked = values["process"], values["heights"], values["blocked"]
    hanging, count = values["hanging"], len(blocked) - GAP_LAYERS
    areas = reachable_areas(values["outlines"], heights, process, values["below"], blocked[:count], PLATE)
    tree, corners = Tree(Growth.of(process, areas.radius_mm)), []
    for m in range(count - 1, 0, -1):
        tree = tree.add_contact(hanging[m + GAP_LAYERS] ^ areas.reachable[m], areas.reachable[m], float(areas.top_mm[m])).lower(
            areas, m
        )
        corners.append(sum(branch.area.num_vert() for branch in tree.branches if not branch.full))
    return corners


@pytest.mark.parametrize("seed", [4, 8])
def test_branches_between_holes_and_walls_have_few_corners_however_far_they_go(seed: int) -> None:
    base, top = cut(bored_bracket(seed), ((0.5, 0.2, 1.0), 8.0))
    values, found = supported(top, earlier=[base])
    corners, of_sections = corners_of_branches(values), [section.num_vert() for section in values["outlines"]]
    assert 0 < max(corners) <= 3 * max(of_sections)
    assert sum(corners) <= 3 * sum(of_sections)
    assert_sound(values, found)
