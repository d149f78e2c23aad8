"""Walls lie at their distances from the outline; what is too narrow for two is filled by one line."""

from collections.abc import Sequence

import manifold3d as m3
import numpy as np
import pytest
import shapely
from hypothesis import given, settings
from hypothesis import strategies as st

from slicer.bead import PATH_RESOLUTION_MM, Bead, length_mm, spacing_mm
from slicer.geometry.cross_section import cross_sections
from slicer.geometry.polygons import Polygons, close_loop, contours
from slicer.paths import Kind, bead_area_mm2
from slicer.walls.centreline import centrelines
from slicer.walls.gap import gaps
from slicer.walls.thin import thin_walls
from slicer.walls.walls import Walls, wall_beads, walls
from tests.slicer.hand import as_shapely, distances_mm, profile, section_at, shared

WIDTH, HEIGHT = 0.45, 0.2
SPACING = 0.45 - 0.2 * (1 - np.pi / 4)
Points = list[tuple[float, float]]


def rectangle(x: float, y: float) -> Polygons:
    return Polygons.square((x, y))


def plastic_mm2(beads: Sequence[Bead]) -> float:
    return sum(length_mm(b.points) * bead_area_mm2(b.width_mm, HEIGHT) * b.flow for b in beads) / HEIGHT


def test_spacing_makes_the_bead_as_large_as_its_strip() -> None:
    assert spacing_mm(WIDTH, HEIGHT) * HEIGHT == pytest.approx(bead_area_mm2(WIDTH, HEIGHT))


def test_three_walls_of_a_square_lie_at_half_a_width_and_then_a_spacing_apart() -> None:
    walled = walls(rectangle(20, 20), 3, WIDTH, HEIGHT)
    boxes = [loops[0].min(axis=0)[0] for loops in walled.loops]
    assert boxes == pytest.approx([0.225, 0.225 + SPACING, 0.225 + 2 * SPACING], abs=1e-6)
    assert walled.inside.area() == pytest.approx((20 - 2 * (0.225 + 2.5 * SPACING)) ** 2, rel=1e-6)


def test_a_hole_gets_walls_of_its_own_running_the_other_way() -> None:
    walled = walls(rectangle(20, 20) - rectangle(6, 6).translate((7, 7)), 1, WIDTH, HEIGHT)
    across = sorted(np.ptp(loop[:, 0]) for loop in walled.loops[0])
    assert across == pytest.approx([6.45, 19.55], abs=1e-6)


def test_outer_walls_of_a_real_model_keep_half_a_width_from_its_exact_outline() -> None:
    mesh, off = shared("org_kitten", 60.0), []
    for z in np.arange(0.5, 60, 2.7):
        exact = shapely.MultiLineString([np.vstack([loop, loop[:1]]) for loop in cross_sections(mesh, np.array([z]))[0]])
        for loop in walls(section_at(mesh, z), 3, WIDTH, HEIGHT).loops[0]:
            line = shapely.LineString(np.vstack([loop, loop[:1]]))
            points = shapely.line_interpolate_point(line, np.arange(0, line.length, 0.1))
            off.append(shapely.distance(exact, points) - WIDTH / 2)
    low, middle, high = np.percentile(np.concatenate(off), [5, 50, 95])
    assert abs(middle) < 0.002
    assert -0.005 < low < high < 0.005


@pytest.mark.parametrize("thickness", [0.25, 0.4, 0.6, 0.8])
def test_a_thin_plate_gets_one_line_in_its_middle(thickness: float) -> None:
    plate = rectangle(20, thickness)
    walled = walls(plate, 3, WIDTH, HEIGHT)
    bead = max(thin_walls(walled.free, plate, WIDTH, HEIGHT, 0.0), key=lambda bead: bead.length_mm)
    assert walled.loops[0] == ()
    assert bead.points[4:-4, 1] == pytest.approx(thickness / 2, abs=1e-3)
    assert bead.width_mm == pytest.approx(thickness, abs=0.02)
    assert length_mm(bead.points) > 20 - 3 * thickness


def test_a_plate_of_three_lines_gets_two_walls_round_and_one_line_between() -> None:
    walled = walls(rectangle(20, WIDTH + 2 * SPACING), 3, WIDTH, HEIGHT)
    (line,) = [b for b in gaps(walled.narrow, WIDTH, HEIGHT) if length_mm(b.points) > 5]
    assert len(walled.loops[0]) == 1
    assert line.points[:, 1] == pytest.approx(WIDTH / 2 + SPACING, abs=0.01)


def test_what_is_narrower_than_a_third_of_a_line_stays_empty() -> None:
    assert walls(rectangle(20, 0.15), 3, WIDTH, HEIGHT).free.is_empty()


def test_a_small_round_pin_gets_a_ring_of_its_area() -> None:
    pin = Polygons.circle(0.4, 32)
    beads = thin_walls(walls(pin, 3, WIDTH, HEIGHT).free, pin, WIDTH, HEIGHT, 0.0)
    assert plastic_mm2(beads) == pytest.approx(pin.area(), rel=0.15)


@settings(max_examples=25, deadline=None)
@given(st.floats(3.0, 15.0), st.floats(0.3, 0.8), st.floats(0.3, 0.8), st.floats(0.0, 180.0))
def test_the_centreline_of_a_wedge_runs_in_its_middle_with_its_width(
    length: float, start: float, end: float, turn: float
) -> None:
    wedge = Polygons([np.array([[0, -start / 2], [length, -end / 2], [length, end / 2], [0, start / 2]])])
    lines = centrelines(contours(wedge.rotate(turn)), 0.2, 1.2, 0.5)
    c, s = np.cos(np.radians(turn)), np.sin(np.radians(turn))
    for line in lines:
        along, across = line.points @ [c, s], line.points @ [-s, c]
        assert across == pytest.approx(0.0, abs=0.1 * max(start, end))
        assert line.width_mm == pytest.approx(start + (end - start) * along.mean() / length, rel=0.12)
    assert sum(length_mm(line.points) for line in lines) > length - start - end - 0.2


def test_the_centreline_of_a_ring_is_closed() -> None:
    ring = Polygons.circle(5, 64) - Polygons.circle(4.5, 64)
    (line,) = centrelines(contours(ring), 0.2, 1.2, 0.5)
    assert line.points[0] == pytest.approx(line.points[-1])
    assert np.hypot(*line.points.T) == pytest.approx(4.75, abs=0.02)


@settings(max_examples=30, deadline=None)
@given(st.lists(st.tuples(st.floats(-8, 8), st.floats(-8, 8)), min_size=5, max_size=12))
def test_walls_stay_inside_any_polygon(points: Points) -> None:
    polygon = m3.CrossSection.hull_points(np.array(points)) - Polygons.circle(2.0, 24)
    for level, loops in enumerate(walls(polygon, 3, WIDTH, HEIGHT).loops):
        for loop in loops:
            coarse = 0.01 + level * PATH_RESOLUTION_MM
            assert distances_mm(polygon, loop).min() > WIDTH / 2 + level * SPACING - coarse


def uncovered(section: Polygons, walled: Walls) -> shapely.Geometry:
    """What of a section the walls, the gaps and what they enclose leave, but for slits of 0.03 mm, by shapely."""
    narrow = thin_walls(walled.free, section, WIDTH, HEIGHT, 0.0) + gaps(walled.narrow, WIDTH, HEIGHT)
    lines = [shapely.LineString(b.points).buffer(b.width_mm / 2) for b in narrow]
    lines += [shapely.LineString(close_loop(loop)).buffer(WIDTH / 2) for loops in walled.loops for loop in loops]
    rest = as_shapely(section).difference(shapely.union_all([*lines, as_shapely(walled.inside)]))
    return rest.buffer(-0.03 * WIDTH).buffer(0.03 * WIDTH)


@settings(max_examples=30, deadline=None)
@given(st.floats(0.3, 4.0), st.floats(0.3, 4.0), st.floats(4.0, 20.0))
def test_no_place_of_a_tapering_plate_wider_than_half_a_line_stays_empty(start: float, end: float, length: float) -> None:
    plate = Polygons([np.array([[0, -start / 2], [length, -end / 2], [length, end / 2], [0, start / 2]])])
    rest = uncovered(plate, walls(plate, 3, WIDTH, HEIGHT))
    assert max((part.area for part in shapely.get_parts(rest)), default=0.0) < WIDTH**2


@pytest.mark.parametrize("radius", [0.13, 0.16, 0.2, 0.3])
def test_the_bead_of_a_thin_pin_stays_inside_it(radius: float) -> None:
    pin = Polygons.circle(radius, 48)
    beads = thin_walls(walls(pin, 3, WIDTH, HEIGHT).free, pin, WIDTH, HEIGHT, 0.0)
    plastic = shapely.union_all([shapely.LineString(b.points).buffer(b.width_mm / 2) for b in beads])
    assert plastic.difference(as_shapely(pin).buffer(0.01)).area == pytest.approx(0.0, abs=1e-6)
    assert plastic.area > 0.5 * pin.area()


@pytest.mark.parametrize(("thin", "over", "wide"), [(0.16, 0.7, 0.6), (0.16, 1.5, 1.0), (0.2, 1.0, 0.6), (0.25, 0.7, 0.6)])
def test_a_thin_plate_that_widens_into_a_block_is_filled_up_to_its_walls(thin: float, over: float, wide: float) -> None:
    half = [(0, thin / 2), (4, thin / 2), (4 + over, wide / 2), (4.5 + over, 3), (12, 3)]
    shape = Polygons([np.array([(x, -y) for x, y in half] + half[::-1])])
    rest = uncovered(shape, walls(shape, 3, WIDTH, HEIGHT))
    assert max(2 * shapely.maximum_inscribed_circle(part).length for part in shapely.get_parts(rest)) < WIDTH / 2


@pytest.mark.parametrize("arms", [3, 4, 5, 7])
@pytest.mark.parametrize("thickness", [0.4, 0.7, 1.0, 1.6, 2.1])
def test_no_place_where_thin_arms_meet_stays_empty(arms: int, thickness: float) -> None:
    star = Polygons()
    for k in range(arms):
        star += Polygons.square((8, thickness)).translate((0, -thickness / 2)).rotate(360 * k / arms + 7)
    rest = uncovered(star, walls(star, 3, WIDTH, HEIGHT))
    assert max((part.area for part in shapely.get_parts(rest)), default=0.0) < WIDTH**2


@pytest.mark.parametrize(("order", "first"), [("inner-first", Kind.INNER_WALL), ("outer-first", Kind.OUTER_WALL)])
def test_walls_are_ranked_in_the_order_asked_for(order: str, first: Kind) -> None:
    beads = wall_beads(walls(rectangle(20, 20), 3, WIDTH, HEIGHT), profile(f"process.wall_order={order}").process, HEIGHT)
    ranked = sorted(beads, key=lambda bead: bead.rank)
    assert ranked[0].kind is first
    assert [b.rank <= 0 for b in ranked] == [True] * 3


def test_outer_beads_carry_what_their_round_side_leaves_out_up_to_the_bulge() -> None:
    walled = walls(rectangle(20, 20), 3, WIDTH, HEIGHT)
    flows = [wall_beads(walled, profile(f"process.outer_bulge={b}").process, HEIGHT)[0].flow for b in (0.0, 0.04, 0.2)]
    strip = 0.2 * (WIDTH + SPACING) / 2  # from the outline to half a spacing inside the centreline
    assert flows == pytest.approx(
        [1.0, 1.0 + 0.018 * HEIGHT / bead_area_mm2(WIDTH, HEIGHT), strip / bead_area_mm2(WIDTH, HEIGHT)]
    )


def test_five_thousand_holes_are_walled() -> None:
    holes = [Polygons.circle(0.8, 12).translate((3 * i, 3 * j)) for i in range(71) for j in range(71)]
    plate = Polygons.square((220, 220)).translate((-4, -4)) - Polygons.compose(holes)
    walled = walls(plate, 3, WIDTH, HEIGHT)
    assert len(walled.loops[0]) == 71**2 + 1


@settings(max_examples=30, deadline=None)
@given(st.lists(st.tuples(st.floats(-2, 2), st.floats(-2, 2)), min_size=4, max_size=8), st.floats(0.2, 1.5))
def test_thin_walls_reach_over_no_section_by_more_than_a_twentieth_of_a_line(points: Points, radius: float) -> None:
    section = m3.CrossSection.hull_points(np.array(points)) - Polygons.circle(radius, 12)
    beads = thin_walls(walls(section, 3, WIDTH, HEIGHT).free, section, WIDTH, HEIGHT, 0.0)
    plastic = shapely.union_all([shapely.LineString(b.points).buffer(b.width_mm / 2) for b in beads])
    assert plastic.difference(as_shapely(section).buffer(0.05 * WIDTH)).area < 1e-6


@pytest.mark.parametrize("tip_deg", [15, 25, 32, 38])
def test_the_tip_of_a_sharp_corner_is_filled(tip_deg: float) -> None:
    half = 5.0 * np.tan(np.radians(0.5 * tip_deg))
    corner = Polygons([np.array([[0.0, 0.0], [5.0, -half], [5.0, half]])])
    rest = uncovered(corner, walls(corner, 3, WIDTH, HEIGHT))
    assert max((part.area for part in shapely.get_parts(rest)), default=0.0) < WIDTH**2


def test_a_waist_between_two_bodies_gets_one_bead_along_it() -> None:
    half = [(-3, 2), (-0.4, 0.27), (0.0, 0.21), (0.4, 0.27), (3, 2)]
    shape = Polygons([np.array([(x, -y) for x, y in half] + half[::-1])])
    (bead,) = thin_walls(walls(shape, 3, WIDTH, HEIGHT).free, shape, WIDTH, HEIGHT, 0.0)
    assert abs(bead.points[-1, 1] - bead.points[0, 1]) < 0.1 * abs(bead.points[-1, 0] - bead.points[0, 0])
