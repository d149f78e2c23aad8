"""One wall around tops and in the first layer: skin replaces the inner walls there, and only there."""

import manifold3d as m3
import pytest

from mdp.mesh import Mesh
from slicer.geometry.polyline import lengths_mm
from slicer.paths import Kind, SlicedPart
from slicer.slice import slice_part
from tests.shapes import box, from_manifold
from tests.slicer.hand import SOLID, profile, volume_mm3, whole

WIDTH = 0.45
SPACING = WIDTH - 0.2 * (1 - 0.785398)


def inner_wall_mm(sliced: SlicedPart, layer: int) -> float:
    strokes = sliced.layers[layer]
    return float(lengths_mm(strokes.points, strokes.starts)[strokes.is_of(Kind.INNER_WALL)].sum())


def two_inner_walls_mm(side: float) -> float:
    return 4 * sum(side - WIDTH - 2 * k * SPACING for k in (1, 2))


def stepped(upper: float) -> Mesh:
    """A plate of 20 mm with a smaller block on it, each 1 mm high."""
    return from_manifold(
        m3.Manifold.cube((20, 20, 1)) + m3.Manifold.cube((upper, upper, 2)).translate(((20 - upper) / 2, (20 - upper) / 2, 0))
    )


def test_only_the_last_layer_of_a_block_has_one_wall_round_its_top() -> None:
    sliced = slice_part(whole(box(20, 20, 2)), profile(*SOLID, "process.only_one_wall_top=true"))
    assert inner_wall_mm(sliced, 8) == pytest.approx(two_inner_walls_mm(20), abs=0.5)
    assert inner_wall_mm(sliced, 9) == 0.0
    assert volume_mm3(sliced, *Kind) == pytest.approx(20 * 20 * 2, rel=0.01)


def test_a_step_has_one_wall_and_the_body_on_it_has_all_walls_below() -> None:
    """The inner walls under a block of 10 mm follow that block instead of the plate of 20 mm."""
    sliced = slice_part(whole(stepped(10)), profile(*SOLID, "process.only_one_wall_top=true"))
    assert inner_wall_mm(sliced, 3) == pytest.approx(two_inner_walls_mm(20), abs=0.5)
    assert inner_wall_mm(sliced, 4) == pytest.approx(4 * sum(10 - (2 * k - 1) * SPACING for k in (1, 2)), abs=0.5)
    assert volume_mm3(sliced, *Kind) == pytest.approx(20 * 20 + 10 * 10, rel=0.01)


def test_a_step_narrower_than_three_lines_keeps_its_walls() -> None:
    sliced = slice_part(whole(stepped(17.5)), profile(*SOLID, "process.only_one_wall_top=true"))
    assert inner_wall_mm(sliced, 4) == pytest.approx(two_inner_walls_mm(20), abs=0.5)


def test_the_first_layer_has_one_wall_where_that_is_wanted() -> None:
    sliced = slice_part(whole(box(20, 20, 2)), profile(*SOLID, "process.only_one_wall_first_layer=true"))
    assert inner_wall_mm(sliced, 0) == 0.0
    assert inner_wall_mm(sliced, 1) == pytest.approx(two_inner_walls_mm(20), abs=0.5)
    assert volume_mm3(sliced, *Kind) == pytest.approx(20 * 20 * 2, rel=0.01)
