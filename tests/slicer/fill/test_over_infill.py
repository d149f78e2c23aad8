"""Skins over sparse infill end on infill or on solid plastic."""

from collections.abc import Sequence
from itertools import pairwise

import manifold3d as m3
import numpy as np
import pytest
import shapely
from shapely.ops import substring

from mdp.mesh import Floats
from slicer.fill.ends import anchored, infill_bridges
from slicer.fill.region import Region
from slicer.geometry.polygons import Polygons
from slicer.paths import SKINS, Kind
from slicer.paths import Path as Stroke
from slicer.slice import slice_part
from tests.shapes import standing
from tests.slicer.hand import BARE, profile, whole

WIDTH = 0.4
CELL = 6.0
INFILL = [np.array([[x, -15.0], [x, 15.0]]) for x in (-12.0, -6.0, 0.0, 6.0, 12.0)]
INSIDE = Polygons.square((30.0, 30.0), True)
LINE = 0.45  # line width of a profile


def block(x: float, y: float, side: float) -> Polygons:
    return Polygons.square((side, side), True).translate((x, y))


def region(solid: Polygons) -> Region:
    empty = Polygons()
    return Region(empty, empty, solid, INSIDE - solid, INSIDE - solid)


def test_a_skin_between_two_lines_of_infill_grows_to_both_and_no_farther() -> None:
    grown = anchored(region(block(3.0, 0.0, 2.0)), INSIDE, INFILL, 0.0, WIDTH, CELL)
    left, low, right, high = grown.solid.bounds()
    assert (left, right) == pytest.approx((0.0, 6.0), abs=0.2)
    assert (low, high) == pytest.approx((-1.0, 1.0), abs=WIDTH)
    assert grown.solid.area() + grown.sparse.area() == pytest.approx(900.0)
    assert grown.uncut.area() == pytest.approx(grown.sparse.area())  # the skins' growth is not plastic that a cut costs


def test_a_skin_grows_along_its_lines_in_any_direction() -> None:
    turned = [line @ np.array([[0.0, 1.0], [-1.0, 0.0]]) for line in INFILL]
    left, low, right, high = anchored(region(block(0.0, 3.0, 2.0)), INSIDE, turned, 90.0, WIDTH, CELL).solid.bounds()
    assert (left, right) == pytest.approx((-1.0, 1.0), abs=WIDTH)
    assert (low, high) == pytest.approx((0.0, 6.0), abs=0.2)


def test_a_skin_on_the_skin_of_the_layer_below_does_not_grow() -> None:
    solid = block(3.0, 0.0, 2.0)
    assert anchored(region(solid), INSIDE - solid, INFILL, 0.0, WIDTH, CELL).solid.area() == pytest.approx(4.0)


def test_a_bridge_over_infill_has_no_tongue_too_narrow_for_a_line() -> None:
    solid = block(0.0, 0.0, 10.0) + Polygons.square((8.0, 0.5 * WIDTH)).translate(
        (5.0, 0.0)
    )  # and a strip of half a line beside it
    bridge = infill_bridges(region(solid), block(0.0, 0.0, 9.0), WIDTH)
    assert bridge.bounds() == pytest.approx((-5.0, -5.0, 5.0, 5.0), abs=0.1 * WIDTH)


def test_a_bridge_over_infill_ends_under_the_walls_around_a_pit() -> None:
    bare, inside = block(0.0, 0.0, 3.0), block(0.0, 0.0, 10.0)  # the floor of a pit, on solid layers 0.4 mm wider all round
    region = Region(bare, inside, Polygons(), Polygons(), Polygons())
    bridge = infill_bridges(region, inside - block(0.0, 0.0, 3.8), WIDTH)
    half = 1.5 + 0.5 * WIDTH  # as far as the wedges between line ends reach, which stay open
    assert (bridge ^ block(0.0, 0.0, 2.0 * half)).is_empty()
    held = block(0.0, 0.0, 3.8) - block(0.0, 0.0, 3.0 + 1.5 * WIDTH)  # it still lies on the solid layers, by a quarter of a line
    assert (held - bridge).area() == pytest.approx(0.0, abs=0.01)


def test_without_infill_a_skin_grows_to_the_walls() -> None:
    left, _, right, _ = anchored(region(block(3.0, 0.0, 2.0)), INSIDE, [], 0.0, WIDTH, 0.0).solid.bounds()
    assert (left, right) == pytest.approx((-15.0, 15.0), abs=0.01)


def test_skins_that_face_each_other_over_a_void_without_infill_become_one() -> None:
    void = block(0.0, 0.0, 10.0)
    skins = block(-5.0, 0.0, 4.0) + block(5.0, 0.0, 4.0)  # each begins on plastic and ends 3 mm from the other's middle
    one = anchored(Region(Polygons(), Polygons(), skins, void - skins, void - skins), void, [], 0.0, WIDTH, 0.0).solid
    assert (Polygons.square((10.0, 3.9), True) - one).is_empty()


def test_a_place_smaller_than_a_cell_of_infill_between_skins_becomes_solid() -> None:
    one = anchored(region(block(-3.0, 0.0, 8.0) - block(-3.0, 0.0, 5.0)), INSIDE, INFILL, 0.0, WIDTH, CELL).solid
    assert (block(-3.0, 0.0, 8.0) - one).is_empty()


def test_small_infill_far_from_a_skin_that_grows_stays_infill() -> None:
    far = block(-10.0, -10.0, 4.0)  # less than a cell
    ring = block(-10.0, -10.0, 5.0) - far
    sparse = INSIDE - ring - block(3.0, 6.0, 2.0)
    before = Region(Polygons(), Polygons(), block(3.0, 6.0, 2.0), sparse, sparse)
    grown = anchored(before, INSIDE - ring, INFILL, 0.0, WIDTH, CELL)
    assert grown.solid.area() > 10.0
    assert (far - grown.sparse).area() < 0.1


def pit() -> m3.Manifold:
    return m3.Manifold.cube((30, 30, 4)) - m3.Manifold.cube((3, 3, 1)).translate((13.5, 13.5, 3.2))


def skin_below_the_pit(*settings: str) -> Floats:
    """(2,) how far the skin of the layers just below the pit reaches from its centre, along the lines and across."""
    keys = [f"process.{key}" for key in ("infill_pattern=rectilinear", "top_layers=3", "top_thickness_mm=0", "solid_below_mm2=0")]
    layers = slice_part(whole(standing(pit())), profile(*BARE, *keys, *settings)).layers
    paths = [path for layer in layers if 1.5 < layer.z_mm < 3.25 for path in layer.paths if path.kind in SKINS]
    points = np.concatenate([path.points[:, :2] for path in paths])
    return np.abs(points @ np.array([[1.0, 1.0], [1.0, -1.0]])).max(axis=0) / 2.0**0.5


def test_the_skin_below_a_pit_grows_to_the_next_lines_and_not_to_the_walls() -> None:
    half_mm, cell_mm = 3.0 / 2.0**0.5, 0.41 / 0.15  # half of the pit's diagonal, and the distance between lines
    assert (skin_below_the_pit("process.infill_density=0.15") < half_mm + cell_mm + 2.0).all()


@pytest.mark.parametrize("pattern", ["rectilinear", "grid", "gyroid", "cubic"])
@pytest.mark.parametrize("seed", range(3))
def test_no_stroke_of_skin_under_pockets_ends_with_nothing_under_its_last_width(pattern: str, seed: int) -> None:
    part = whole(standing(pocketed(np.random.default_rng(seed))))
    layers = slice_part(part, profile(*BARE, f"process.infill_pattern={pattern}", "process.infill_density=0.15")).layers
    assert max(farthest_end_mm(below.paths, layer.paths) for below, layer in pairwise(layers)) == 0.0


def test_the_bridge_over_a_hollow_extends_to_the_walls_around_it() -> None:
    hollow = m3.Manifold.cube((26, 20, 10)) - m3.Manifold.cube((20, 14, 6)).translate((3, 3, 2))
    ceiling = slice_part(whole(standing(hollow)), profile(*BARE)).layers[40]
    lines = np.concatenate([path.points for path in ceiling.paths if path.kind == Kind.BRIDGE])
    assert np.abs(lines[:, 0]).max() > 13.0 - 4.0 * WIDTH  # three walls and half a line
    assert np.abs(lines[:, 1]).max() > 10.0 - 4.0 * WIDTH


def pocketed(random: np.random.Generator) -> m3.Manifold:
    """A plate 4 mm thick with pockets 0.4 to 1.4 mm deep in its top, square and round."""
    plate = m3.Manifold.cube((24, 24, 4))
    for x, y, side, deep, round_ in zip(
        *random.uniform([[4], [4], [1], [0.4], [0]], [[20], [20], [3], [1.4], [1]], (5, 6)), strict=True
    ):
        tool = m3.Manifold.cylinder(2, side / 2, side / 2, 32) if round_ > 0.5 else m3.Manifold.cube((side, side, 2))
        plate -= tool.translate((x, y, 4.0 - deep))
    return plate


def farthest_end_mm(below: Sequence[Stroke], above: Sequence[Stroke]) -> float:
    """The greatest distance of the last line width of a skin stroke from the plastic of the layer below."""
    plastic = shapely.union_all([shapely.LineString(path.points[:, :2]).buffer(0.5 * path.width_mm) for path in below])
    strokes = [shapely.LineString(path.points[:, :2]) for path in above if path.kind in SKINS]
    tails = [substring(line, *part) for line in strokes for part in ((0.0, LINE), (line.length - LINE, line.length))]
    return max((tail.distance(plastic) for tail in tails), default=0.0)
