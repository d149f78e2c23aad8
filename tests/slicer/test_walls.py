"""Walls lie at their distances from the outline; what is too narrow for two is filled by one line."""

import manifold3d as m3
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from slicer.bead import length_mm, spacing_mm
from slicer.centreline import centrelines
from slicer.gap import gaps
from slicer.paths import bead_area_mm2
from slicer.polygons import Polygons, contours
from slicer.walls import walls
from tests.slicer.hand import distances_mm, section_at, shared

WIDTH, HEIGHT = 0.45, 0.2
SPACING = 0.45 - 0.2 * (1 - np.pi / 4)


def rectangle(x, y):
    return Polygons.square((x, y))


def plastic_mm2(beads):
    return sum(length_mm(b.points) * bead_area_mm2(b.width_mm, HEIGHT) * b.flow for b in beads) / HEIGHT


def test_spacing_makes_the_bead_as_large_as_its_strip():
    assert spacing_mm(WIDTH, HEIGHT) * HEIGHT == pytest.approx(bead_area_mm2(WIDTH, HEIGHT))


def test_three_walls_of_a_square_lie_at_half_a_width_and_then_a_spacing_apart():
    found = walls(rectangle(20, 20), 3, WIDTH, HEIGHT)
    boxes = [loops[0].min(axis=0)[0] for loops in found.loops]
    assert boxes == pytest.approx([0.225, 0.225 + SPACING, 0.225 + 2 * SPACING], abs=1e-6)
    assert found.inside.area() == pytest.approx((20 - 2 * (0.225 + 2.5 * SPACING)) ** 2, rel=1e-6)


def test_a_hole_gets_walls_of_its_own_running_the_other_way():
    found = walls(rectangle(20, 20) - rectangle(6, 6).translate((7, 7)), 1, WIDTH, HEIGHT)
    across = sorted(np.ptp(loop[:, 0]) for loop in found.loops[0])
    assert across == pytest.approx([6.45, 19.55], abs=1e-6)


def test_outer_walls_of_a_real_model_keep_half_a_width_from_its_outline():
    mesh = shared("org_kitten", 40.0)
    off = []
    for z in np.arange(0.5, 40, 2.7):
        section = section_at(mesh, z)
        points = np.concatenate(walls(section, 3, WIDTH, HEIGHT).loops[0])
        off.append(np.abs(distances_mm(section, points) - 0.225))
    assert np.median(np.concatenate(off)) < 0.002
    assert np.mean(np.concatenate(off) > 0.05) < 0.003


@pytest.mark.parametrize("thickness", [0.25, 0.4, 0.6, 0.8])
def test_a_thin_plate_gets_one_line_in_its_middle(thickness):
    plate = rectangle(20, thickness)
    found = walls(plate, 3, WIDTH, HEIGHT)
    bead = max(gaps(found.free, WIDTH, HEIGHT, plate), key=lambda bead: bead.length_mm)
    assert found.loops[0] == ()
    assert bead.points[4:-4, 1] == pytest.approx(thickness / 2, abs=1e-3)
    assert bead.width_mm == pytest.approx(thickness, abs=0.02)
    assert length_mm(bead.points) > 20 - 3 * thickness


def test_a_plate_of_three_lines_gets_two_walls_round_and_one_line_between():
    found = walls(rectangle(20, WIDTH + 2 * SPACING), 3, WIDTH, HEIGHT)
    (line,) = [b for b in gaps(found.narrow, WIDTH, HEIGHT) if length_mm(b.points) > 5]
    assert len(found.loops[0]) == 1
    assert line.points[:, 1] == pytest.approx(WIDTH / 2 + SPACING, abs=0.01)


def test_what_is_narrower_than_a_third_of_a_line_stays_empty():
    assert walls(rectangle(20, 0.15), 3, WIDTH, HEIGHT).free.is_empty()


def test_a_small_round_pin_gets_a_ring_of_its_area():
    pin = Polygons.circle(0.4, 32)
    assert plastic_mm2(gaps(walls(pin, 3, WIDTH, HEIGHT).free, WIDTH, HEIGHT, pin)) == pytest.approx(pin.area(), rel=0.15)


@settings(max_examples=25, deadline=None)
@given(st.floats(3.0, 15.0), st.floats(0.3, 0.8), st.floats(0.3, 0.8), st.floats(0.0, 180.0))
def test_the_centreline_of_a_wedge_runs_in_its_middle_and_tells_its_width(length, start, end, turn):
    wedge = Polygons([np.array([[0, -start / 2], [length, -end / 2], [length, end / 2], [0, start / 2]])])
    lines = centrelines(contours(wedge.rotate(turn)), 0.2, 1.2, 0.5)
    c, s = np.cos(np.radians(turn)), np.sin(np.radians(turn))
    for line in lines:
        along, across = line.points @ [c, s], line.points @ [-s, c]
        assert across == pytest.approx(0.0, abs=0.1 * max(start, end))
        assert line.width_mm == pytest.approx(start + (end - start) * along.mean() / length, rel=0.12)
    assert sum(length_mm(line.points) for line in lines) > length - start - end - 0.2


def test_the_centreline_of_a_ring_is_closed():
    ring = Polygons.circle(5, 64) - Polygons.circle(4.5, 64)
    (line,) = centrelines(contours(ring), 0.2, 1.2, 0.5)
    assert line.points[0] == pytest.approx(line.points[-1])
    assert np.hypot(*line.points.T) == pytest.approx(4.75, abs=0.02)


@settings(max_examples=30, deadline=None)
@given(st.lists(st.tuples(st.floats(-8, 8), st.floats(-8, 8)), min_size=5, max_size=12))
def test_walls_stay_inside_any_polygon(points):
    polygon = m3.CrossSection.hull_points(np.array(points)) - Polygons.circle(2.0, 24)
    for level, loops in enumerate(walls(polygon, 3, WIDTH, HEIGHT).loops):
        for loop in loops:
            assert distances_mm(polygon, loop).min() > WIDTH / 2 + level * SPACING - 0.01
