"""Modifiers: other settings apply inside a box, a mesh or a height range, without loss or overlap at its border."""

from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import Any

import manifold3d as m3
import numpy as np
import pytest
import shapely
from hypothesis import given, settings
from hypothesis import strategies as st

from mdp.decomposition import Part
from mdp.mesh import Mesh
from mdp.zone import MeshVolume, Modifier, Zone
from profiles.errors import SliceError
from slicer.estimate.estimate import estimate
from slicer.geometry.polygons import Polygons
from slicer.modifiers import Place, combined
from slicer.paths import Kind, Layer, SlicedPart, bead_area_mm2
from slicer.slice import slice_part, slice_parts
from tests.shapes import box, from_manifold, standing
from tests.slicer.hand import BARE, SOLID, content, cut, profile, whole

RIGHT = Zone((0.0, -99.0, -1.0), (99.0, 99.0, 99.0))  # half of a model
SLAB = Zone((-99.0, -99.0, 4.0), (99.0, 99.0, 6.0))  # some layers of a model
BLOCK = whole(box(40.0, 40.0, 10.0))
INSIDE_MM = 20.0 - 0.225 - 2.5 * (0.45 - 0.2 * (1 - np.pi / 4))  # from the block's middle to its three walls
WALLS = (Kind.OUTER_WALL, Kind.INNER_WALL)


def modified(part: Part, *modifiers: tuple[Zone | MeshVolume, dict[str, Any]]) -> Part:
    return replace(part, modifiers=tuple(Modifier(*modifier) for modifier in modifiers))


@cache
def sliced(part: Part, *settings: str) -> SlicedPart:
    return slice_part(part, profile(*BARE, *settings))


def mm3(layer: Layer, within: Zone, *kinds: Kind) -> float:
    """Plastic of some kinds in a box."""
    total = 0.0
    for path in layer.paths:
        if path.kind in kinds:
            inside = shapely.LineString(path.points).intersection(shapely.box(*within.min_mm[:2], *within.max_mm[:2]))
            total += inside.length * bead_area_mm2(path.width_mm, layer.height_mm) * path.flow
    return total


def density(layer: Layer, within: Zone) -> float:
    """The density of the sparse infill in a box."""
    x, y = np.subtract(within.max_mm, within.min_mm)[:2]
    return mm3(layer, within, Kind.INFILL) / (layer.height_mm * x * y)


def walls_across(layer: Layer, x: float) -> int:
    """Number of walls that a line along y crosses on its way from the middle of the block."""
    count = 0
    for path in layer.paths:
        if path.kind in WALLS:
            a, b = path.points[:-1], path.points[1:]
            count += int((((a[:, 0] < x) != (b[:, 0] < x)) & (a[:, 1] + b[:, 1] > 0.0)).sum())
    return count


def speeds(layer: Layer, kind: Kind, right: bool) -> set[float]:
    """The speeds of the strokes of a kind on one side of x = 0."""
    return {path.speed_mm_s for path in layer.paths if path.kind is kind and (path.points[:, 0].mean() > 0.0) == right}


LEFT_INSIDE, RIGHT_INSIDE = (
    Zone((x, -INSIDE_MM, 0.0), (x + INSIDE_MM - 1.0, INSIDE_MM, 1.0)) for x in (-INSIDE_MM, 1.0)
)  # half a millimetre and more from the border of the two halves


def test_infill_inside_a_box_is_as_dense_as_its_settings_say_and_outside_as_the_process_says() -> None:
    layer = sliced(modified(BLOCK, (RIGHT, {"infill_density": 0.6}))).layers[25]
    assert density(layer, LEFT_INSIDE) == pytest.approx(0.2, rel=0.1)
    assert density(layer, RIGHT_INSIDE) == pytest.approx(0.6, rel=0.05)


def test_a_box_of_another_pattern_has_its_lines_and_leaves_walls_alone() -> None:
    plain, other = (sliced(part).layers[25] for part in (BLOCK, modified(BLOCK, (RIGHT, {"infill_pattern": "honeycomb"}))))
    assert density(other, RIGHT_INSIDE) == pytest.approx(0.2, rel=0.1)
    longest = {right: max(_steps(other, right)) for right in (False, True)}
    assert longest[False] > 15.0  # lines of a grid
    assert longest[True] < 10.0  # sides of hexagons, and lines along walls
    walls = [[path.points.tobytes() for path in layer.paths if path.kind in WALLS] for layer in (plain, other)]
    assert sorted(walls[0]) == sorted(walls[1])


def _steps(layer: Layer, right: bool) -> list[float]:
    steps = []
    for path in layer.paths:
        if path.kind is Kind.INFILL:
            middles = 0.5 * (path.points[:-1] + path.points[1:])
            steps += np.hypot(*np.diff(path.points, axis=0)[(middles[:, 0] > 0.0) == right].T).tolist()
    return steps


@pytest.mark.parametrize(("process", "inside", "outside"), [(3, 6, 3), (3, 1, 3), (1, 4, 1)])
@pytest.mark.parametrize("order", ["inner-first", "outer-first"])
def test_a_box_has_as_many_walls_as_its_settings_say(order: str, process: int, inside: int, outside: int) -> None:
    part = modified(BLOCK, (RIGHT, {"walls": inside}))
    layer = sliced(part, f"process.walls={process}", f"process.wall_order={order}").layers[25]
    assert (walls_across(layer, -10.0), walls_across(layer, 10.0)) == (outside, inside)
    outer = [path for path in layer.paths if path.kind is Kind.OUTER_WALL]
    assert len(outer) == 1  # one loop, which the border of the box does not split
    levels = [float(np.abs(path.points).max()) for path in layer.paths if path.kind in WALLS]
    assert levels == sorted(levels, reverse=order == "outer-first")


def bored_plate() -> Mesh:
    return standing(m3.Manifold.cube((30.0, 30.0, 2.0)) - m3.Manifold.cylinder(9.0, 4.0, 4.0, 48).translate((12.0, 14.0, -1.0)))


@cache
def plain_mm3() -> float:
    """The plastic of the solid bored plate without modifiers."""
    return slice_part(whole(bored_plate()), profile(*SOLID)).volume_mm3


@pytest.mark.parametrize("own", [{"walls": 6}, {"walls": 1}, {"infill_pattern": "gyroid"}, {"skin_speed_mm_s": 20.0}])
@settings(max_examples=4, deadline=None)
@given(st.floats(-14.0, 14.0), st.floats(-14.0, 14.0), st.floats(0.0, 90.0))
def test_a_solid_part_extrudes_its_volume_with_any_modifier(own: dict[str, Any], x: float, y: float, turn: float) -> None:
    c, s = np.cos(np.radians(turn)), np.sin(np.radians(turn))
    leaning = Zone((x - 9.0, y - 6.0, -1.0), (x + 9.0, y + 6.0, 99.0), ((c, s, 0.0), (-s, c, 0.0), (0.0, 0.0, 1.0)))
    other = slice_part(modified(whole(bored_plate()), (leaning, own)), profile(*SOLID))
    assert other.volume_mm3 == pytest.approx(plain_mm3(), rel=0.002)


@pytest.mark.parametrize("own", [{"walls": 6}, {"walls": 1}])
def test_parts_of_a_cut_extrude_their_volumes_with_any_modifier(own: dict[str, Any]) -> None:
    parts = cut(standing(m3.Manifold.cube((24.0, 20.0, 20.0))), ((0.6, 0.0, 0.8), 13.0))
    within = Zone((-6.0, -5.0, -1.0), (7.0, 99.0, 99.0))
    plain, other = (slice_parts(each, profile(*SOLID)) for each in (parts, [modified(part, (within, own)) for part in parts]))
    assert [one.volume_mm3 for one in other] == pytest.approx([one.volume_mm3 for one in plain], rel=0.003)


def test_a_dense_box_in_sparse_infill_is_filled() -> None:
    part = modified(BLOCK, (Zone((-8.0, -8.0, 3.0), (8.0, 8.0, 7.0)), {"infill_density": 1.0}))
    layer, within = sliced(part).layers[25], Zone((-8.0, -8.0, 0.0), (8.0, 8.0, 1.0))
    assert mm3(layer, within, Kind.SKIN, Kind.GAP) == pytest.approx(16.0 * 16.0 * 0.2, rel=0.02)
    assert mm3(layer, within, Kind.INFILL) < 1.0


def test_a_mesh_gives_the_same_bytes_as_a_box_of_its_form() -> None:
    low, high = (-8.3, -7.1, 2.05), (11.2, 9.9, 7.3)
    cube = m3.Manifold.cube(tuple(np.subtract(high, low))).translate(low)
    own = {"infill_density": 0.6, "walls": 5, "top_layers": 8, "infill_speed_mm_s": 30.0}
    as_box = content(sliced(modified(BLOCK, (Zone(low, high), own))))
    for mesh in (from_manifold(cube), from_manifold(cube.refine(3))):
        assert content(sliced(modified(BLOCK, (MeshVolume(Path("cube.stl"), mesh), own)))) == as_box
    assert as_box != content(sliced(BLOCK))


def test_layers_between_two_heights_are_those_of_a_print_with_their_settings() -> None:
    own = {"walls": 5, "inner_wall_speed_mm_s": 33.0}
    part, everywhere = modified(BLOCK, (SLAB, own)), ("process.walls=5", "process.inner_wall_speed_mm_s=33")
    some, plain, full = sliced(part), sliced(BLOCK), sliced(BLOCK, *everywhere)

    def same(a: Layer, b: Layer) -> bool:
        walls = [[(path.points.tobytes(), path.speed_mm_s) for path in layer.paths if path.kind in WALLS] for layer in (a, b)]
        return sorted(walls[0]) == sorted(walls[1])

    assert [same(a, b) for a, b in zip(some.layers, full.layers, strict=True)] == [20 <= k < 30 for k in range(50)]
    assert [same(a, b) for a, b in zip(some.layers, plain.layers, strict=True)] == [not 20 <= k < 30 for k in range(50)]


def test_the_later_of_two_modifiers_wins_where_both_set_a_key() -> None:
    sparse, dense = {"infill_density": 0.1, "walls": 5}, {"infill_density": 0.5}
    first = sliced(modified(BLOCK, (RIGHT, sparse), (SLAB, dense))).layers[25]
    then = sliced(modified(BLOCK, (SLAB, dense), (RIGHT, sparse))).layers[25]
    assert [density(layer, LEFT_INSIDE) for layer in (first, then)] == pytest.approx([0.5, 0.5], rel=0.15)
    within = Zone((1.0, -16.0, 0.0), (16.0, 16.0, 1.0))
    assert [density(layer, within) for layer in (first, then)] == pytest.approx([0.5, 0.1], rel=0.15)
    assert [walls_across(layer, 10.0) for layer in (first, then)] == [5, 5]


def test_speeds_hold_inside_and_the_strokes_stay_whole() -> None:
    own = {"infill_speed_mm_s": 33.0, "outer_wall_speed_mm_s": 11.0}
    fast = ("material.volumetric_limit_mm3_s=50", "process.least_layer_time_s=0")
    plain, other = (sliced(part, *fast) for part in (BLOCK, modified(BLOCK, (RIGHT, own))))
    layer = other.layers[25]
    assert (speeds(layer, Kind.INFILL, True), speeds(layer, Kind.INFILL, False)) == ({33.0}, {80.0})
    assert (speeds(layer, Kind.OUTER_WALL, True), speeds(layer, Kind.OUTER_WALL, False)) == ({11.0}, {40.0})
    assert speeds(layer, Kind.INNER_WALL, True) == {60.0}
    assert other.volume_mm3 == pytest.approx(plain.volume_mm3, rel=1e-9)


def test_speeds_inside_leave_the_strokes_of_the_first_layer_whole() -> None:
    plain, other = (sliced(part).layers[0] for part in (BLOCK, modified(BLOCK, (RIGHT, {"outer_wall_speed_mm_s": 11.0}))))
    assert [path.points.tobytes() for path in other.paths] == [path.points.tobytes() for path in plain.paths]


def test_tops_and_bottoms_are_as_thick_as_the_settings_inside_say() -> None:
    part = modified(BLOCK, (RIGHT, {"top_layers": 10, "bottom_layers": 1, "top_thickness_mm": 0, "bottom_thickness_mm": 0}))
    solid = [
        [mm3(layer, half, Kind.SKIN, Kind.TOP_SKIN, Kind.BRIDGE) > 100.0 for layer in sliced(part).layers]
        for half in (LEFT_INSIDE, RIGHT_INSIDE)
    ]
    assert [k for k, filled in enumerate(solid[0]) if filled] == [0, 1, 2, 3, 46, 47, 48, 49]
    assert [k for k, filled in enumerate(solid[1]) if filled] == [0, *range(40, 50)]


def test_only_tops_in_the_box_are_ironed() -> None:
    top = sliced(modified(BLOCK, (RIGHT, {"ironing": True}))).layers[-1]
    assert min(path.points[:, 0].min() for path in top.paths if path.kind is Kind.IRONING) > -0.1
    assert mm3(top, RIGHT_INSIDE, Kind.IRONING) > 5.0


@pytest.mark.parametrize("own", [{"infill_density": 0.7, "walls": 5}, {"top_layers": 9}, {"infill_density": 1.0}])
def test_a_modifier_that_reaches_no_plastic_changes_no_byte(own: dict[str, Any]) -> None:
    beside = modified(BLOCK, (Zone((21.0, -99.0, -1.0), (99.0, 99.0, 99.0)), own))
    assert content(sliced(beside)) == content(sliced(BLOCK))


def test_a_tilted_part_has_the_settings_where_the_box_is_in_the_workpiece() -> None:
    leaning = cut(standing(m3.Manifold.cube((40.0, 40.0, 40.0))), ((0.6, 0.0, 0.8), 28.0))[1]
    box_ = Zone((-99.0, 1.0, -99.0), (99.0, 99.0, 99.0))
    layer = slice_part(modified(leaning, (box_, {"infill_density": 1.0})), profile(*BARE)).layers[20]
    back = leaning.rotation.T  # from the part's frame to the workpiece's
    y_of = {kind: [] for kind in (Kind.SKIN, Kind.INFILL)}
    for path in layer.paths:
        if path.kind in y_of:
            places = np.column_stack([path.points, np.full(len(path.points), layer.z_mm + leaning.base.offset_mm)])
            y_of[path.kind].append((places @ back.T)[:, 1])
    assert np.concatenate(y_of[Kind.INFILL]).max() < 1.0
    assert np.concatenate(y_of[Kind.SKIN]).min() > 1.0
    assert np.concatenate(y_of[Kind.INFILL]).min() < -15.0
    assert np.concatenate(y_of[Kind.SKIN]).max() > 15.0


@pytest.mark.parametrize("given_", ["process.spiral_vase=true", "process.walls=0"])
def test_settings_that_do_not_go_with_those_of_the_print_are_refused_in_a_sentence(given_: str) -> None:
    with pytest.raises(SliceError, match=r"process\.(spiral_vase|walls) (is|prints) .*: a \[\[modifier\]\] of the plan .*"):
        sliced(modified(BLOCK, (RIGHT, {"walls": 4})), given_)


def test_the_estimate_knows_what_holds_in_a_few_layers() -> None:
    high = whole(box(30.0, 30.0, 30.0))
    part = modified(high, (Zone((-99.0, -99.0, 8.0), (99.0, 99.0, 14.0)), {"infill_density": 1.0}))
    known = profile(*BARE)
    filament_mm2 = 0.25 * np.pi * known.material.diameter_mm**2
    purged = [estimate(one, known).filament_mm * filament_mm2 - slice_part(one, known).volume_mm3 for one in (high, part)]
    assert purged[1] - purged[0] == pytest.approx(0.0, abs=0.03 * high.volume_mm3)


def ball_volume() -> Mesh:
    return from_manifold(m3.Manifold.sphere(8.0, 48).translate((0.0, 0.0, 5.0)))


def test_a_ball_of_dense_infill_grows_and_shrinks_with_the_layers() -> None:
    layers = sliced(modified(BLOCK, (MeshVolume(Path("ball.stl"), ball_volume()), {"infill_density": 1.0}))).layers
    whole_block = Zone((-19.0, -19.0, 0.0), (19.0, 19.0, 1.0))
    for k in (12, 25, 37):
        radius = np.sqrt(64.0 - (0.2 * k + 0.1 - 5.0) ** 2)
        assert mm3(layers[k], whole_block, Kind.SKIN, Kind.GAP, Kind.BRIDGE) == pytest.approx(0.2 * np.pi * radius**2, rel=0.1)


def test_many_modifiers_one_over_the_other_take_no_more_places_than_there_are_values() -> None:
    square = [Polygons.square((10.0, 10.0))]
    places = [Place({key: k % 2}, square) for k in range(30) for key in ("walls", "infill_density")]
    over = combined(places, ["walls", "infill_density"])
    assert [dict(place.settings) for place in over] == [{"walls": 1, "infill_density": 1}]


def test_combined_places_do_not_overlap_and_have_the_last_value_of_every_key() -> None:
    left, right = (Polygons.square((20.0, 10.0)).translate((x, 0.0)) for x in (0.0, 10.0))
    found = combined([Place({"walls": 4}, [left]), Place({"walls": 5, "ironing": True}, [right])], ["walls", "ironing"])
    assert [(dict(place.settings), place.areas[0].area()) for place in found] == [
        ({"walls": 4}, pytest.approx(100.0)),
        ({"walls": 5, "ironing": True}, pytest.approx(200.0)),
    ]
