"""Variable walls fill a region with as many beads as fit, within the nozzle's range, and stay inside it."""

from collections.abc import Sequence
from dataclasses import replace
from itertools import pairwise

import manifold3d as m3
import numpy as np
import pytest
import shapely
from hypothesis import given, settings
from hypothesis import strategies as st

from slicer.bead import ROUND_SIDES, Bead, mean_width_mm
from slicer.geometry.edge_index import depths, index_edges
from slicer.geometry.polygons import Polygons, close_loop
from slicer.geometry.polyline import length_mm
from slicer.geometry.triangulation import triangulate
from slicer.paths import Kind
from slicer.shells import wall_beads
from slicer.slice import slice_part
from slicer.strokes.strokes import in_pieces, strokes_of
from slicer.walls.skeleton import FEATURE, skeleton_of
from slicer.walls.variable import STEP, Wall, trace_loops, variable_walls
from slicer.walls.walls import bead_rule, layer_walls
from tests.shapes import from_manifold
from tests.slicer.hand import SOLID, as_shapely, content, of_kind, profile, rows_of, volume_mm3, whole

WIDTH, HEIGHT, NOZZLE = 0.45, 0.2, 0.4
PROCESS = profile().process
RULE = bead_rule(3, PROCESS, HEIGHT, NOZZLE)
Points = list[tuple[float, float]]


def plate(thickness: float, length: float = 12.0) -> Polygons:
    return Polygons.square((length, thickness))


def plastic(walls: Sequence[Wall]) -> shapely.Geometry:
    """Area that walls cover, printed in pieces of one width."""
    beads = [Bead(Kind.OUTER_WALL, wall.course[:, :2], mean_width_mm(wall.course), 0, course=wall.course) for wall in walls]
    pieces = in_pieces(strokes_of(beads, np.zeros(len(beads), np.bool_), {}, 0.0), HEIGHT)
    return shapely.union_all([shapely.LineString(row.points).buffer(0.5 * row.width_mm) for row in rows_of(pieces)])


def across(walls: Sequence[Wall], x: float) -> int:
    """Number of beads side by side at x."""
    line = shapely.LineString([(x, -50), (x, 50)])
    met = [line.intersection(shapely.LineString(wall.course[:, :2])) for wall in walls]
    return sum(int(shapely.get_num_geometries(met_wall)) for met_wall in met if not met_wall.is_empty)


def farthest_out_mm(walls: Sequence[Wall], section: Polygons) -> float:
    over = plastic(walls).difference(as_shapely(section))
    return (
        0.0
        if over.is_empty
        else float(shapely.distance(as_shapely(section), shapely.points(shapely.get_coordinates(over))).max())
    )


@pytest.mark.parametrize(
    ("thickness", "beads"),
    [(0.1, 0), (0.15, 1), (0.25, 1), (0.5, 1), (0.7, 2), (1.0, 2), (1.3, 3), (1.6, 4), (2.0, 5), (2.4, 6), (3.0, 7)],
)
def test_a_plate_gets_as_many_beads_as_fit(thickness: float, beads: int) -> None:
    assert across(variable_walls([plate(thickness)], RULE), 6.0) == beads


@pytest.mark.parametrize("thickness", np.arange(0.25, 3.1, 0.15).round(2).tolist())
def test_a_plate_is_filled_from_side_to_side(thickness: float) -> None:
    walls = variable_walls([plate(thickness)], RULE)
    middle = shapely.box(3, 0, 9, thickness)
    assert plastic(walls).intersection(middle).area > 0.995 * middle.area
    spacings = sum(mean_width_mm(wall.course) - HEIGHT * ROUND_SIDES for wall in walls for _ in range(across([wall], 6.0)))
    assert spacings + HEIGHT * ROUND_SIDES == pytest.approx(thickness, abs=0.02)


def test_the_count_changes_where_the_thickness_does() -> None:
    wedge = Polygons([np.array([[0, -0.1], [28, -1.4], [28, 1.4], [0, 0.1]])])
    walls = variable_walls([wedge], RULE)
    counts = np.array([across(walls, x) for x in np.arange(2.0, 26.0, 0.35)])
    highest = np.maximum.accumulate(counts)
    assert [(a, b) for a, b in pairwise(highest.tolist()) if a != b] == [(1, 2), (2, 3), (3, 4), (4, 5), (5, 6)]
    assert (highest - counts).max() <= 1  # where one bead ends before two begin


def test_outer_walls_of_a_thin_plate_are_walls_of_half_its_thickness() -> None:
    (loop,) = variable_walls([plate(0.8)], RULE)
    assert loop.closed
    assert loop.level == 0
    assert loop.course[:, 2] == pytest.approx(0.4 + 0.5 * HEIGHT * ROUND_SIDES, abs=0.01)
    assert np.abs(loop.points[:, 1] - 0.4).max() == pytest.approx(0.4 - 0.5 * loop.course[:, 2][0], abs=0.005)


def test_a_wall_of_one_bead_is_an_outer_wall_that_does_not_run_round() -> None:
    (bead,) = wall_beads(layer_walls(plate(0.5), 3, PROCESS, HEIGHT, NOZZLE), PROCESS, HEIGHT)
    assert bead.kind is Kind.OUTER_WALL
    assert bead.line
    assert not bead.one_way
    assert bead.width_mm == pytest.approx(0.5, abs=0.005)


def test_a_thick_island_has_walls_of_one_width() -> None:
    block = Polygons.square((20, 20))
    walled = layer_walls(block, 3, PROCESS, HEIGHT, NOZZLE)
    assert walled.varying == ()
    spacing = WIDTH - HEIGHT * ROUND_SIDES
    sides = [np.ptp(loop[:, 0]) for loops in walled.loops for loop in loops]
    assert sides == pytest.approx([20.0 - WIDTH - 2.0 * k * spacing for k in range(3)], abs=1e-6)


def test_without_walls_a_narrow_place_gets_one_bead_and_the_rest_stays_open() -> None:
    block = Polygons.square((10, 10)) + Polygons.square((8, 0.5)).translate((10, 5))
    walled = layer_walls(block, 0, PROCESS, HEIGHT, NOZZLE)
    (line,) = walled.varying
    assert mean_width_mm(line.course) == pytest.approx(0.5, abs=0.01)
    assert line.points[:, 1] == pytest.approx(5.25, abs=0.1)
    assert line.points[:, 0].min() > 9.4
    assert walled.inside.area() == pytest.approx(100.0, rel=0.005)


def test_a_wall_that_is_now_thicker_and_now_thinner_than_the_least_bead_is_laid_from_end_to_end() -> None:
    x = np.linspace(0, 30, 121)
    side = 0.12 + 0.02 * np.sin(2.0 * x)  # half of the thickness, which is 0.2 to 0.28 mm; the least bead is 0.24 mm
    walls = variable_walls([Polygons([np.concatenate([np.column_stack([x, -side]), np.column_stack([x, side])[::-1]])])], RULE)
    assert len(walls) == 1
    assert length_mm(walls[0].course) > 29.0


@pytest.mark.parametrize("tooth_mm", [0.2, 0.35, 0.5])
def test_the_outer_wall_of_a_hall_with_thin_teeth_stays_at_its_border(tooth_mm: float) -> None:
    teeth = [Polygons.square((tooth_mm, 1.2)).translate((x, 29.5)) for x in (8.0, 9.0, 9.8, 14.0)]
    hall = Polygons.square((30, 30)) + Polygons.compose(teeth)
    outer = [wall for wall in variable_walls([hall], RULE) if wall.level == 0]
    assert max(np.abs(depths(wall.points, index_edges(hall))).max() for wall in outer) < 0.5


def test_a_ring_of_one_bead_runs_round() -> None:
    (bead,) = variable_walls([Polygons.circle(6, 128) - Polygons.circle(5.4, 128)], RULE)
    assert bead.closed
    assert length_mm(bead.course) == pytest.approx(2 * np.pi * 5.7, rel=0.01)
    assert bead.course[:, 2] == pytest.approx(0.6, abs=0.02)


@pytest.mark.parametrize("diameter", np.arange(0.3, 2.4, 0.1).round(1).tolist())
def test_a_pin_is_filled_by_rings_or_a_dash_inside_it(diameter: float) -> None:
    pin = Polygons.circle(0.5 * diameter, 64)
    walls = variable_walls([pin], RULE)
    assert plastic(walls).area > (0.6 if diameter < 0.5 else 0.74) * pin.area()
    assert farthest_out_mm(walls, pin) < 0.05 * WIDTH


@settings(max_examples=60, deadline=None)
@given(st.lists(st.tuples(st.floats(-4, 4), st.floats(-4, 4)), min_size=4, max_size=9), st.floats(0.3, 2.0), st.floats(0.0, 1.5))
def test_all_beads_of_any_polygon_are_inside_it_with_printable_widths(points: Points, hole: float, aside: float) -> None:
    section = m3.CrossSection.hull_points(np.array(points)) - Polygons.circle(hole, 16).translate((aside, 0))
    walls = variable_walls([section], RULE)
    wider = [wall for wall in walls if wall.level > 0 or wall.closed or wall.course[:, 2].min() > RULE.least + 1e-9]
    assert farthest_out_mm(wider, section) < 0.05 * WIDTH
    assert farthest_out_mm(walls, section) < 0.05 * WIDTH + 0.5 * (1.0 - FEATURE) * RULE.least  # where a wall is that thin
    widths = np.concatenate([wall.course[:, 2] for wall in walls]) if walls else np.array([WIDTH])
    assert widths.min() > 0.6 * NOZZLE - 1e-9
    assert widths.max() < 2.0 * NOZZLE + 1e-9


def rest(section: Polygons) -> shapely.Geometry:
    """The part of a section that neither walls nor their inside cover, except for slits of 0.02 mm, by shapely."""
    walled = layer_walls(section, 3, PROCESS, HEIGHT, NOZZLE)
    loops = [shapely.LineString(close_loop(loop)).buffer(0.5 * WIDTH) for level in walled.loops for loop in level]
    filled = shapely.union_all([*loops, plastic(walled.varying), as_shapely(walled.inside)])
    return as_shapely(section).difference(filled).buffer(-0.01).buffer(0.01)


def largest_rest_mm2(section: Polygons) -> float:
    return max((part.area for part in shapely.get_parts(rest(section))), default=0.0)


@settings(max_examples=30, deadline=None)
@given(st.floats(0.3, 4.0), st.floats(0.3, 4.0), st.floats(4.0, 20.0))
def test_a_tapering_plate_is_filled(start: float, end: float, length: float) -> None:
    assert (
        largest_rest_mm2(Polygons([np.array([[0, -start / 2], [length, -end / 2], [length, end / 2], [0, start / 2]])]))
        < WIDTH**2
    )


@pytest.mark.parametrize(("thin", "over", "wide"), [(0.16, 0.7, 0.6), (0.16, 1.5, 1.0), (0.2, 1.0, 0.6), (0.25, 0.7, 0.6)])
def test_a_thin_plate_that_widens_into_a_block_is_filled_up_to_its_walls(thin: float, over: float, wide: float) -> None:
    half = [(0, thin / 2), (4, thin / 2), (4 + over, wide / 2), (4.5 + over, 3), (12, 3)]
    shape = Polygons([np.array([(x, -y) for x, y in half] + half[::-1])])
    parts = shapely.get_parts(rest(shape))
    assert max((2 * shapely.maximum_inscribed_circle(part).length for part in parts), default=0.0) < WIDTH / 2


@pytest.mark.parametrize("tip_deg", [15, 25, 32, 38])
def test_the_tip_of_a_sharp_corner_is_filled(tip_deg: float) -> None:
    half = 5.0 * np.tan(np.radians(0.5 * tip_deg))
    assert largest_rest_mm2(Polygons([np.array([[0.0, 0.0], [5.0, -half], [5.0, half]])])) < WIDTH**2


@pytest.mark.parametrize("corners", [16, 48, 96])
@pytest.mark.parametrize("diameter", [0.7, 1.5, 2.5])
def test_the_rings_of_a_circle_never_turn_back(corners: int, diameter: float) -> None:
    """At each point the two sides of a circle are equally near to its centre, except for rounding."""
    for wall in variable_walls([Polygons.circle(0.5 * diameter, corners)], RULE):
        around = np.diff(np.unwrap(np.arctan2(*wall.course[:, 1::-1].T)))
        assert (around > -1e-6).all()
        assert around.sum() == pytest.approx(2.0 * np.pi)


@settings(max_examples=20, deadline=None)
@given(st.integers(3, 7), st.floats(0.3, 2.0), st.floats(0, 90))
def test_a_star_of_thin_arms_is_filled(arms: int, thickness: float, turn: float) -> None:
    star = Polygons()
    for k in range(arms):
        star += Polygons.square((6, thickness)).translate((0, -thickness / 2)).rotate(360 * k / arms + turn)
    assert largest_rest_mm2(star) < WIDTH**2


def test_a_comb_gets_its_volume_within_its_walls_the_same_every_time() -> None:
    comb = m3.Manifold.cube((25, 3, 2))
    for k in range(10):
        comb += m3.Manifold.cube((0.3 + 0.1 * k, 8, 2)).translate((1 + 2.3 * k, 2.5, 0))
    part, chosen = whole(from_manifold(comb)), profile(*SOLID)
    sliced = slice_part(part, chosen)
    assert volume_mm3(sliced, *Kind) == pytest.approx(comb.volume(), rel=0.02)
    assert volume_mm3(sliced, Kind.GAP) < 0.01 * comb.volume()
    widths = [path.width_mm for path in of_kind(sliced, Kind.OUTER_WALL)]
    assert min(widths) == pytest.approx(0.3, abs=0.01)
    assert content(sliced) == content(slice_part(part, chosen))


@settings(deadline=None, max_examples=60)
@given(st.floats(1e-6, 1e-3), st.floats(-1e-3, 1e-3), st.floats(0.1, 0.5), st.floats(1.0, 6.0))
def test_walls_stay_inside_a_plate_that_a_notch_all_but_cuts_through(neck: float, lean: float, wide: float, deep: float) -> None:
    tip = [(5.5, neck), (5.5 + wide, max(neck + lean, 1e-6))]
    notch = Polygons([np.array([(5.3, deep + 1.0), *tip, (6.5, deep + 1.0)])])
    plate_with_notch = plate(deep) - notch
    assert farthest_out_mm(variable_walls([plate_with_notch], RULE), plate_with_notch) < 0.1


@settings(deadline=None, max_examples=60)
@given(st.floats(1.0, 9.0), st.floats(-1e-8, 1e-8), st.floats(-1e-10, 1e-10))
def test_two_corners_that_all_but_meet_throw_no_wall_out_of_a_plate(x: float, aside: float, away: float) -> None:
    corners = np.array([(0, 0), (x, -1e-3), (x + aside, -1e-3 + away), (10, 0), (10, 5), (0, 5)])
    triangulation = triangulate([[corners]], STEP * RULE.inner)
    assert triangulation is not None
    ribs, _, _ = trace_loops(triangulation, skeleton_of(triangulation, RULE), RULE, 0)
    points = ribs[:, :2] + ribs[:, 2:4] * ribs[:, 5:6]
    assert (points.min(axis=0) >= 0.0).all()
    assert (points.max(axis=0) <= (10.0, 5.0)).all()


def test_a_wall_with_coincident_points_is_left_out(monkeypatch: pytest.MonkeyPatch) -> None:
    def fallen(line: Wall, *_: object) -> Wall:
        return replace(line, course=line.course[[0, 0]])

    fin, rule = Polygons.square((8.0, 0.5)), bead_rule(2, profile().process, 0.2, 0.4)
    assert [wall.closed for wall in variable_walls([fin], rule)] == [False]
    monkeypatch.setattr("slicer.walls.variable._clipped", fallen)
    assert variable_walls([fin], rule) == []
