"""Skins are solid, infill meets its density, and both stay in their area."""

from itertools import pairwise

import manifold3d as m3
import numpy as np
import pytest
import shapely
from hypothesis import given, settings
from hypothesis import strategies as st

from slicer.bead import length_mm
from slicer.hatch import hatched
from slicer.infill import PATTERNS, infill
from slicer.paths import Kind, bead_area_mm2
from slicer.polygons import Polygons, grown
from slicer.skin import skin
from tests.slicer.hand import as_shapely, distances_mm

WIDTH, HEIGHT, OVERLAP = 0.45, 0.2, 0.15


def square():
    return Polygons.square((40, 40))


def ring():
    return Polygons.circle(15, 64) - Polygons.circle(6, 48)


def strip():
    return Polygons.square((3, 30)).rotate(20)


def plastic_mm2(beads):
    return sum(length_mm(b.points) * bead_area_mm2(b.width_mm, HEIGHT) * b.flow for b in beads) / HEIGHT


@pytest.mark.parametrize("area", [square, ring, strip])
@pytest.mark.parametrize("angle", [45.0, 135.0, 20.0])
def test_a_skin_extrudes_its_area(area, angle):
    beads = skin(area(), Kind.SKIN, angle, WIDTH, HEIGHT, OVERLAP)
    assert plastic_mm2(beads) == pytest.approx(area().area(), rel=0.003)
    assert all(0.9 < bead.flow < 1.1 for bead in beads)


def test_a_skin_covers_its_area_everywhere():
    lines = [shapely.LineString(b.points).buffer(b.width_mm / 2) for b in skin(ring(), Kind.SKIN, 45.0, WIDTH, HEIGHT, OVERLAP)]
    assert as_shapely(ring()).difference(shapely.union_all(lines)).area < 0.01 * ring().area()


def test_a_skin_of_a_square_is_one_zigzag():
    assert len(skin(square(), Kind.SKIN, 45.0, WIDTH, HEIGHT, OVERLAP)) == 1


@pytest.mark.parametrize("pattern", sorted(PATTERNS))
@pytest.mark.parametrize("density", [0.1, 0.2, 0.5])
def test_sparse_infill_meets_its_density(pattern, density):
    large = Polygons.circle(60, 128)
    beads = infill(large, pattern, density, 30.0, 0, WIDTH, HEIGHT, OVERLAP)
    assert plastic_mm2(beads) / large.area() == pytest.approx(density, rel=0.04)


def test_no_density_is_no_infill():
    assert infill(square(), "grid", 0.0, 45.0, 0, WIDTH, HEIGHT, OVERLAP) == []


@pytest.mark.parametrize("pattern", sorted(PATTERNS))
def test_infill_stays_inside_and_reaches_into_the_wall_by_the_overlap(pattern):
    points = np.concatenate([b.points for b in infill(ring(), pattern, 0.3, 45.0, 1, WIDTH, HEIGHT, OVERLAP)])
    nearest = distances_mm(ring(), points).min()
    assert nearest > 0.5 * (WIDTH - HEIGHT * (1 - np.pi / 4)) - OVERLAP * WIDTH - 1e-3


def test_rectilinear_lines_turn_by_a_right_angle_from_layer_to_layer():
    first, second = (infill(square(), "rectilinear", 0.2, 30.0, k, WIDTH, HEIGHT, OVERLAP)[0].points for k in (0, 1))
    a, b = (p[1] - p[0] for p in (first, second))
    assert abs(a @ b) < 1e-6 * np.hypot(*a) * np.hypot(*b)


def test_grid_lines_lie_on_each_other_in_all_layers():
    layers = [infill(square(), "grid", 0.2, 45.0, k, WIDTH, HEIGHT, OVERLAP) for k in (0, 1)]
    assert [b.points.tobytes() for b in layers[0]] == [b.points.tobytes() for b in layers[1]]


@settings(max_examples=30, deadline=None)
@given(
    st.lists(st.tuples(st.floats(-20, 20), st.floats(-20, 20)), min_size=4, max_size=9),
    st.floats(0, 180),
    st.floats(0.4, 5.0),
)
def test_hatching_agrees_with_shapely(points, angle, spacing):
    hull = m3.CrossSection.hull_points(np.array(points))
    area = hull - Polygons.circle(4.0, 20).translate((3, 1)) if hull.area() > 1 else hull
    lines = hatched(area, area, angle, spacing, 0.0)
    solid = as_shapely(area)
    along = np.array([np.cos(np.radians(angle)), np.sin(np.radians(angle))])
    across = np.array([-along[1], along[0]])
    bundle = shapely.MultiLineString(
        [[(k + 0.5) * spacing * across - 90 * along, (k + 0.5) * spacing * across + 90 * along] for k in range(-80, 80)]
    )
    assert sum(length_mm(line) for line in lines) == pytest.approx(solid.intersection(bundle).length, rel=1e-6, abs=1e-4)


@settings(max_examples=30, deadline=None)
@given(st.lists(st.tuples(st.floats(-20, 20), st.floats(-20, 20)), min_size=4, max_size=9), st.floats(0, 180))
def test_joints_of_a_skin_never_leave_its_area(points, angle):
    hull = m3.CrossSection.hull_points(np.array(points))
    star = hull - Polygons.circle(5.0, 20).translate((4, 4)) - Polygons.square((30, 1.5)).rotate(33)
    for bead in skin(star, Kind.SKIN, angle, WIDTH, HEIGHT, OVERLAP):
        middles = np.array([(a + b) / 2 for a, b in pairwise(bead.points)])
        assert distances_mm(star, middles).min() > 0.0


def test_shrinking_an_empty_area_gives_nothing():
    assert skin(grown(Polygons.square((0.2, 0.2)), -0.2), Kind.SKIN, 0.0, WIDTH, HEIGHT, OVERLAP) == []
