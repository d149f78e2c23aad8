"""Skin covers the regions of a layer that are bare above or below, and no others."""

from collections.abc import Sequence

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from profiles.process import Process
from slicer.fill.region import Cover, Region, regions
from slicer.geometry.polygons import Polygons, offset, opening
from slicer.heights import shell_layers
from tests.slicer.hand import as_shapely, profile

WIDTH = 0.45


def square(side: float) -> Polygons:
    return Polygons.square((side, side), True)


def process(top: int = 2, bottom: int = 2, density: float = 0.2, **others: float) -> Process:
    keys = {"top_layers": top, "bottom_layers": bottom, "infill_density": density, "solid_below_mm2": 5}
    keys |= {"top_thickness_mm": 0, "bottom_thickness_mm": 0} | others
    return profile(*(f"process.{key}={value}" for key, value in keys.items())).process


def alone(sections: Sequence[Polygons], insides: Sequence[Polygons], beneath: Polygons | None, keys: Process) -> list[Region]:
    """Regions of a model in one part, or on plastic that continues downward."""
    top, bottom = shell_layers(keys)
    cover = Cover(sections, insides, [beneath or Polygons()] * bottom, [Polygons()] * top)
    return regions(insides, cover, beneath is not None, keys)


def areas(
    sections: Sequence[Polygons], beneath: Polygons | None = None, top: int = 2, bottom: int = 2, density: float = 0.2
) -> list[tuple[float, ...]]:
    by_layer = alone(sections, sections, beneath, process(top, bottom, density))
    return [tuple(round(r.area(), 3) for r in (region.top, region.solid, region.sparse)) for region in by_layer]


def test_a_tower_is_solid_at_both_ends_and_sparse_between() -> None:
    assert areas([square(10) for _ in range(7)]) == [
        (0, 100, 0), (0, 100, 0), (0, 0, 100), (0, 0, 100), (0, 0, 100), (0, 100, 0), (100, 0, 0)
    ]  # fmt: skip


def test_a_step_is_top_skin_where_it_is_bare_and_solid_below_it() -> None:
    by_layer = areas([square(20)] * 4 + [square(10)] * 6, bottom=0)
    assert by_layer[3][0] == pytest.approx(300, abs=25)
    assert by_layer[3][1] == 0
    assert by_layer[2][0] == 0
    assert by_layer[2][1] == pytest.approx(300, abs=25)
    assert by_layer[1] == (0, 0, 400)


def test_a_bare_top_continues_as_top_skin_under_the_walls_around_it() -> None:
    floor = [square(20)] * 6 + [square(20) - square(8)] * 4
    insides = [offset(section, -3 * WIDTH) for section in floor]
    region = alone(floor, insides, None, process(top=2, walls=3))[5]
    assert region.bare.area() == pytest.approx(64)
    assert region.top.area() == pytest.approx((8 + 2 * 5 * WIDTH) ** 2, rel=0.01), "three walls, and two lines of anchor"
    assert region.solid.area() == 0


@settings(max_examples=30, deadline=None)
@given(st.floats(3, 12), st.floats(0, 3), st.integers(1, 5), st.booleans())
def test_no_wall_begins_on_sparse_infill(side: float, aside: float, walls: int, pillar: bool) -> None:
    footprint = square(side).translate((aside, -aside))
    above = footprint if pillar else square(24) - footprint
    sections = [square(24)] * 6 + [above] * 4
    insides = [offset(section, -walls * WIDTH) for section in sections]
    below = alone(sections, insides, None, process(top=2, walls=walls))
    for i in range(len(sections) - 1):
        walled = as_shapely(sections[i + 1]) - as_shapely(insides[i + 1])
        assert as_shapely(below[i].sparse).intersection(walled).area < 0.05


@pytest.mark.parametrize(("aside", "solid"), [(0.3, False), (0.35, True)])
def test_a_wall_that_hardly_touches_the_one_below_is_on_solid_layers(aside: float, solid: bool) -> None:
    sections = [square(24)] * 6 + [square(24) - Polygons.square((aside, 24)).translate((12 - aside, -12))] * 4
    below = alone(sections, [offset(section, -3 * WIDTH) for section in sections], None, process(top=2, walls=3))[5]
    wall = Polygons.square((aside, 20)).translate((12 - 3 * WIDTH - aside, -10))
    assert (below.sparse ^ wall).is_empty() == solid


def test_an_overhang_gets_bottom_layers() -> None:
    by_layer = areas([square(10)] * 3 + [square(20)] * 5, top=0)
    assert by_layer[3][1] == pytest.approx(300 + 4 * 10 * WIDTH, abs=5)
    assert by_layer[5] == (0, 0, 400)


def test_a_part_on_plastic_has_the_number_of_solid_layers_that_is_set() -> None:
    tower = [square(10)] * 6
    assert areas(tower, beneath=square(10), top=1)[:2] == [(0, 100, 0), (0, 0, 100)]
    sparse = alone(tower, tower, square(10), process(top=1, interface_bottom_layers=0))
    assert [region.sparse.area() for region in sparse[:2]] == [100, 100]
    by_layer = alone(tower, tower, square(10), process(top=1, interface_bottom_layers=2))
    assert [region.sparse.area() for region in by_layer] == [0, 0, 100, 100, 100, 0]


def test_grooves_are_filled_by_a_solid_first_layer() -> None:
    tower = [square(10)] * 6
    by_layer = alone(tower, tower, square(10), process(top=1, interlock_mm=0.2))
    assert [region.sparse.area() for region in by_layer[:2]] == [0, 100]


def test_a_later_part_is_on_the_solid_layers_of_an_interface() -> None:
    tower, keys = [square(20)] * 6, process(top=3, interface_top_layers=2)
    later = [Polygons()] * 6 + [square(20)] * 3
    by_layer = regions(tower, Cover(tower, tower, [Polygons()] * 2, later[6:], later), False, keys)
    assert [region.sparse.area() for region in by_layer] == [0, 0, 400, 400, 0, 0]
    assert [region.top.area() for region in by_layer] == [0] * 6, "what will be covered is no top skin"


def test_the_skin_beside_a_later_part_is_as_thick_as_everywhere() -> None:
    tower, keys = [square(20)] * 8, process(top=4, bottom=0, interface_top_layers=1)
    later = [Polygons()] * 8 + [square(10)] * 4
    by_layer = regions(tower, Cover(tower, tower, [], later[8:], later), False, keys)
    for region in by_layer[4:]:
        assert (square(20) - square(10) - region.solid - region.top).area() == pytest.approx(0, abs=1e-6)
    assert [region.sparse.area() > 50 for region in by_layer] == [True] * 7 + [False]


def test_a_part_overhanging_the_plastic_beneath_gets_bottom_skin_there() -> None:
    by_layer = areas([square(20)] * 6, beneath=square(10), top=0)
    assert by_layer[1][1] == pytest.approx(300, abs=25)
    assert by_layer[2] == (0, 0, 400)


def test_full_density_has_no_infill() -> None:
    assert {row[2] for row in areas([square(10)] * 6, density=1.0)} == {0}


def test_an_island_of_infill_too_small_to_bother_with_becomes_solid() -> None:
    assert {row[2] for row in areas([square(2)] * 9)} == {0}


@pytest.mark.parametrize(("least", "sparse_mm2"), [(24.0, 25.0), (26.0, 0.0)])
def test_sparse_places_below_the_least_area_become_solid(least: float, sparse_mm2: float) -> None:
    by_layer = alone([square(5)] * 9, [square(5)] * 9, None, process(solid_below_mm2=least))
    assert by_layer[4].sparse.area() == pytest.approx(sparse_mm2)


def test_no_infill_leaves_small_places_hollow() -> None:
    assert areas([square(2)] * 9, density=0)[4] == (0, 0, 4)


@pytest.mark.parametrize(("height", "layers"), [(0.1, (7, 5)), (0.2, (4, 3)), (0.3, (3, 3))])
def test_thin_layers_get_more_of_them_for_the_least_thickness(height: float, layers: tuple[int, int]) -> None:
    keys = process(3, 3, layer_height_mm=height, top_thickness_mm=0.7, bottom_thickness_mm=0.5)
    assert shell_layers(keys) == layers


def test_zero_solid_layers_are_none_at_any_thickness() -> None:
    assert shell_layers(process(0, 0, top_thickness_mm=3, bottom_thickness_mm=3)) == (0, 0)


@pytest.mark.parametrize("step", [0.1, 0.3, 0.6, 1.5, 4.0])
def test_every_vertical_line_meets_enough_wall_or_skin_below_a_slope(step: float) -> None:
    sections = [square(60 - 2 * step * i) for i in range(12)]
    insides = [offset(section, -1.3) for section in sections]
    by_layer = alone(sections, insides, None, process(3, 0, solid_below_mm2=0))
    for i, region in enumerate(by_layer[:-1]):
        for above in sections[i + 1 : i + 4]:
            assert (region.sparse - above).area() < 1e-6


@pytest.mark.parametrize("count", [1, 2, 3, 5, 12, 1000])
def test_sparse_infill_is_where_all_solid_layers_below_cover(count: int) -> None:
    layers = [square(10).translate((k * 7 % 5, k * 3 % 4)) for k in range(11)]
    for i, region in enumerate(alone(layers, layers, None, process(0, count, solid_below_mm2=0))):
        expected = layers[i]
        for layer in layers[max(i - count, 0) : i]:
            expected = expected ^ layer
        expected = expected if i >= count else Polygons()
        assert (region.sparse - expected).area() < 1e-6
        assert (offset(expected, -2.0 * WIDTH) - region.sparse).area() < 1e-6  # solid beside walls that begin in it


def test_opening_drops_what_is_too_narrow_only() -> None:
    shape = Polygons.square((10, 10)) + Polygons.square((10, 0.3)).translate((5, 5))
    assert opening(shape, 0.2).area() == pytest.approx(100.0)
