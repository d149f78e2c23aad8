"""Layers of an earlier part under a region of a later base plane, checked by heights and by shapely."""

import numpy as np
import pytest

from profiles.frozen import Vector
from slicer.geometry.polygons import Polygons
from slicer.interface.interface import BasePlane
from slicer.support.from_earlier_part import DEEP_MM, Patch, keep_off, upper_side
from tests.slicer.hand import as_shapely
from tests.slicer.interface.test_base_plane import HEIGHTS, LEVEL, UP, part, plane_of

AT_MM, GAP_MM, OFF_MM = 10.0, 0.25, 0.3
TILTED = (0.6, 0.0, 0.8)
SLAB = Polygons.square((40.0, 40.0), True)
WINDOW = Polygons.square((10.0, 10.0), True)


def plane(direction: Vector) -> BasePlane:
    return plane_of(part(1, UP, (0.0, 0.0, 0.0)), part(2, direction, (0.0, 0.0, AT_MM)))


def test_support_under_a_level_place_begins_from_its_gap_on_as_deep_as_it_has_to() -> None:
    hanging = Polygons.square((4.0, 2.0), True)
    begins = Patch(hanging, GAP_MM).begins(plane(LEVEL), 100)
    tips_mm = HEIGHTS.tip_mm[sorted(begins)]
    assert tips_mm.min() == pytest.approx(AT_MM - GAP_MM - DEEP_MM + 0.05)
    assert tips_mm.max() == pytest.approx(AT_MM - GAP_MM - 0.15)
    assert {round(area.area(), 6) for area in begins.values()} == {8.0}


def test_no_support_begins_in_layers_that_the_earlier_part_has_no_use_for() -> None:
    assert max(Patch(Polygons.square((4.0, 2.0), True), GAP_MM).begins(plane(LEVEL), 47)) == 46


def test_every_layer_under_a_tilted_overhang_has_the_strip_below_it() -> None:
    tilted, hanging = plane(TILTED), Polygons.square((5.0, 5.0), True)
    begins = Patch(hanging, 0.0).begins(tilted, 100)
    covered = as_shapely(Polygons())
    for layer, area in begins.items():
        points = np.array(area.to_polygons()[0])
        depth_mm = points @ tilted.turn[2, :2] + tilted.turn[2, 2] * tilted.z_mm(layer) + tilted.shift[2]
        assert (depth_mm.min() > -DEEP_MM - 1e-6, depth_mm.max() < 1e-6) == (True, True)
        covered = covered.union(as_shapely(tilted.project(area, layer)).buffer(0.3))
    assert covered.buffer(-0.3).covers(as_shapely(hanging).buffer(-0.4))


@pytest.mark.parametrize("direction", [LEVEL, TILTED])
def test_support_keeps_off_the_plane_but_under_patches(direction: Vector) -> None:
    seen, patch = plane(direction), Patch(Polygons.square((6.0, 6.0), True), 0.1)
    bodies = [SLAB] * 100
    clear = keep_off(bodies, [patch], seen, OFF_MM)
    for layer in range(100):
        gone = as_shapely(SLAB) - as_shapely(clear[layer])
        near = as_shapely(seen.band(layer, -OFF_MM, seen.far_mm)) & as_shapely(SLAB)
        under_patch = as_shapely(Patch(Polygons.square((6.6, 6.6), True), 0.1).under(seen, layer, OFF_MM))
        assert gone.symmetric_difference(near - under_patch).area < 1e-5


def test_support_that_reaches_no_plane_stays_as_it_is() -> None:
    bodies = [SLAB, Polygons(), SLAB]
    assert all(after is before for after, before in zip(keep_off(bodies, [], plane(LEVEL), OFF_MM), bodies, strict=True))


def test_the_upper_side_of_a_block_that_ends_at_the_plane_is_its_place() -> None:
    block = [Polygons.square((8.0, 6.0), True)] * 50
    assert upper_side(block, plane(LEVEL), WINDOW, 0.3).area() == pytest.approx(8.15 * 6.15, rel=0.01)
    assert upper_side(block[:45], plane(LEVEL), WINDOW, 0.3).is_empty(), "it ends a millimetre below"


def test_the_steps_of_a_block_under_a_tilted_plane_are_one_upper_side() -> None:
    tilted = plane(TILTED)
    under = [SLAB ^ tilted.band(layer, -tilted.far_mm, 0.0) for layer in range(100)]
    reached = as_shapely(upper_side(under, tilted, WINDOW, 0.5))
    assert reached.covers(as_shapely(WINDOW).buffer(-0.5))
