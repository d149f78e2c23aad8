"""Shells around a point."""

import numpy as np
import pytest

from mdp.formats.surface import Surface
from mdp.mesh import Mesh
from mdp.repair.repair import repair
from mdp.repair.shells import MOST_BODIES, check_count, shells_of, winding_number
from profiles.errors import MeshError
from tests.mdp.files import both, inside_out, placed


def test_winding_about_a_point_counts_the_shells_around_it() -> None:
    nest = both(placed(20, 20, 20), placed(10, 10, 10, (5, 5, 5)))
    for point, turns in (((10, 10, 10), 2), ((2, 2, 2), 1), ((30, 0, 0), 0)):
        assert winding_number(np.array(point, float), nest.vertices, nest.faces) == pytest.approx(turns, abs=1e-9)


def in_rows(mesh: Mesh, count: int) -> Surface:
    """A number of copies of one body, in rows of fifty."""
    size = mesh.bounds_mm[1] - mesh.bounds_mm[0]
    places = np.stack([np.arange(count) % 50, np.arange(count) // 50, np.zeros(count)], axis=1) * 2.0 * size
    vertices = (mesh.vertices[None] + places[:, None]).reshape(-1, 3)
    faces = (mesh.faces[None].astype(np.int64) + len(mesh.vertices) * np.arange(count)[:, None, None]).reshape(-1, 3)
    return Surface(vertices, faces)


@pytest.mark.parametrize("body", [placed(1, 1, 1), inside_out(placed(1, 1, 1))])
def test_more_bodies_than_are_taken_are_refused_with_what_to_do(body: Mesh) -> None:
    with pytest.raises(MeshError, match=rf"has 2001 separate bodies, {MOST_BODIES} are allowed: unite those .* or save them"):
        repair([in_rows(body, MOST_BODIES + 1)])


def test_voids_are_no_bodies() -> None:
    bubbles = in_rows(inside_out(placed(1, 1, 1)), MOST_BODIES + 1)
    block = placed(102, 90, 4, (-1, -1, -1))
    foam = Surface(
        np.concatenate([block.vertices, bubbles.vertices]), np.concatenate([block.faces, bubbles.faces + len(block.vertices)])
    )
    shells = shells_of(foam)
    check_count(shells)
    assert len(shells) == MOST_BODIES + 2
