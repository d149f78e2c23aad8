"""Walls of one width lie at their distances from the outline, and are printed only where a pair of them fits."""

import manifold3d as m3
import numpy as np
import pytest
import shapely
from hypothesis import given, settings
from hypothesis import strategies as st

from mdp.topology.cross_section import cross_sections
from slicer.bead import spacing_mm
from slicer.geometry.polygons import Polygons
from slicer.paths import Kind, bead_area_mm2
from slicer.shells import wall_beads
from slicer.walls.walls import CORE_MM, walls
from tests.slicer.hand import distances_mm, profile, section_at, shared

WIDTH, HEIGHT = 0.45, 0.2
PROCESS = profile().process
SPACING = 0.45 - 0.2 * (1 - np.pi / 4)
Points = list[tuple[float, float]]


def rectangle(x: float, y: float) -> Polygons:
    return Polygons.square((x, y))


def test_spacing_makes_the_bead_as_large_as_its_strip() -> None:
    assert spacing_mm(WIDTH, HEIGHT) * HEIGHT == pytest.approx(bead_area_mm2(WIDTH, HEIGHT))


def test_three_walls_of_a_square_are_half_a_width_in_and_a_spacing_apart() -> None:
    walled = walls(rectangle(20, 20), 3, PROCESS, HEIGHT)
    boxes = [loops[0].min(axis=0)[0] for loops in walled.loops]
    assert boxes == pytest.approx([0.225, 0.225 + SPACING, 0.225 + 2 * SPACING], abs=1e-6)
    assert walled.inside.area() == pytest.approx((20 - 2 * (0.225 + 2.5 * SPACING)) ** 2, rel=1e-6)


def test_a_hole_gets_its_own_walls_in_the_opposite_direction() -> None:
    walled = walls(rectangle(20, 20) - rectangle(6, 6).translate((7, 7)), 1, PROCESS, HEIGHT)
    across = sorted(np.ptp(loop[:, 0]) for loop in walled.loops[0])
    assert across == pytest.approx([6.45, 19.55], abs=1e-6)


def test_outer_walls_of_a_real_model_keep_half_a_width_from_its_exact_outline() -> None:
    mesh, off = shared("org_kitten", 60.0), []
    for z in np.arange(0.5, 60, 2.7):
        exact = shapely.MultiLineString([np.vstack([loop, loop[:1]]) for loop in cross_sections(mesh, np.array([z]))[0]])
        for loop in walls(section_at(mesh, z), 3, PROCESS, HEIGHT).loops[0]:
            line = shapely.LineString(np.vstack([loop, loop[:1]]))
            points = shapely.line_interpolate_point(line, np.arange(0, line.length, 0.1))
            off.append(shapely.distance(exact, points) - WIDTH / 2)
    low, middle, high = np.percentile(np.concatenate(off), [5, 50, 95])
    assert abs(middle) < 0.002
    assert -0.005 < low < high < 0.005


@settings(max_examples=30, deadline=None)
@given(st.lists(st.tuples(st.floats(-8, 8), st.floats(-8, 8)), min_size=5, max_size=12))
def test_walls_stay_inside_any_polygon(points: Points) -> None:
    polygon = m3.CrossSection.hull_points(np.array(points)) - Polygons.circle(2.0, 24)
    for level, loops in enumerate(walls(polygon, 3, PROCESS, HEIGHT).loops):
        for loop in loops:
            coarse = 0.01 + level * CORE_MM
            assert distances_mm(polygon, loop).min() > WIDTH / 2 + level * SPACING - coarse


@pytest.mark.parametrize(("order", "first"), [("inner-first", Kind.INNER_WALL), ("outer-first", Kind.OUTER_WALL)])
def test_walls_are_printed_in_the_order_that_is_set(order: str, first: Kind) -> None:
    beads = wall_beads(walls(rectangle(20, 20), 3, PROCESS, HEIGHT), profile(f"process.wall_order={order}").process, HEIGHT)
    ranked = sorted(beads, key=lambda bead: bead.rank)
    assert ranked[0].kind is first
    assert [b.rank <= 0 for b in ranked] == [True] * 3


def test_outer_beads_carry_what_their_round_side_leaves_out_up_to_the_bulge() -> None:
    walled = walls(rectangle(20, 20), 3, PROCESS, HEIGHT)
    flows = [wall_beads(walled, profile(f"process.outer_bulge={b}").process, HEIGHT)[0].flow for b in (0.0, 0.04, 0.2)]
    strip = 0.2 * (WIDTH + SPACING) / 2  # from the outline to half a spacing inside the centreline
    assert flows == pytest.approx(
        [1.0, 1.0 + 0.018 * HEIGHT / bead_area_mm2(WIDTH, HEIGHT), strip / bead_area_mm2(WIDTH, HEIGHT)]
    )


def test_five_thousand_holes_are_walled() -> None:
    holes = [Polygons.circle(0.8, 12).translate((3 * i, 3 * j)) for i in range(71) for j in range(71)]
    plate = Polygons.square((220, 220)).translate((-4, -4)) - Polygons.compose(holes)
    walled = walls(plate, 3, PROCESS, HEIGHT)
    assert len(walled.loops[0]) == 71**2 + 1


def test_without_room_for_a_pair_of_walls_none_reverses() -> None:
    bar = rectangle(20, 1.5 * WIDTH).translate((9.0, 4.0))  # beside a block that is wide enough
    for loop in walls(rectangle(10, 10) + bar, 3, PROCESS, HEIGHT).loops[0]:
        assert loop[:, 0].max() < 10.0


def test_between_all_walls_a_place_narrower_than_two_lines_is_narrow_and_a_wider_one_inside() -> None:
    around = WIDTH + 5 * SPACING  # width that three walls on both sides take of a plate
    slim, roomy = (walls(rectangle(20, around + lines * SPACING), 3, PROCESS, HEIGHT) for lines in (1.7, 2.3))
    assert slim.inside.is_empty()
    assert slim.narrow.area() == pytest.approx((20 - around) * 1.7 * SPACING, rel=0.01)
    assert roomy.narrow.is_empty()
    assert roomy.inside.area() == pytest.approx((20 - around) * 2.3 * SPACING, rel=0.01)
