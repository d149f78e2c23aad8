"""Bars of a coupon: their outlines by closed formulas and the published dimensions, and the stress caused by a load."""

from itertools import combinations
from math import cos, pi, radians, sin

import numpy as np
import pytest

from machine.setup.coupon.bars import BEND, TENSILE, Shape, bar, dumbbell, lower, upper
from mdp.mesh import Floats


def area(loop: Floats) -> float:
    x, y = loop.T
    return 0.5 * float(np.sum(x * np.roll(y, -1) - np.roll(x, -1) * y))


def width_at(loop: Floats, s_mm: float) -> float:
    """Width of an outline that is symmetrical about u = 0, by interpolation along its right side."""
    right = loop[loop[:, 0] > 0.0]
    right = right[np.argsort(right[:, 1])]
    return 2.0 * float(np.interp(s_mm, right[:, 1], right[:, 0]))


def test_the_dumbbell_has_the_measures_of_iso_527_2_type_5a() -> None:
    loop = dumbbell()
    assert np.ptp(loop, axis=0).tolist() == pytest.approx([12.5, 75.0])
    assert [width_at(loop, s) for s in (-12.5, 0.0, 12.5)] == pytest.approx([4.0, 4.0, 4.0])
    assert [width_at(loop, s) for s in (-37.0, 25.1, 37.0)] == pytest.approx([12.5, 12.5, 12.5])  # 50 mm between the grips
    start = np.array([2.0 + 12.5, 12.5])  # middle of the larger arc, 12.5 mm, which joins the narrow part without a kink
    arc = loop[(loop[:, 0] > 0.0) & (loop[:, 1] > 12.4) & (loop[:, 1] < 20.0)]
    assert np.hypot(*(arc - start).T) == pytest.approx(np.full(len(arc), 12.5))


def test_the_dumbbell_s_area_is_that_of_strips_and_arcs() -> None:
    steep = np.arccos(1.0 - 4.25 / 20.5)
    long = 12.5 + 20.5 * sin(steep)
    inner = 2.0 * 12.5 * sin(steep) + 12.5**2 * (sin(steep) - 0.5 * (steep + sin(steep) * cos(steep)))
    outer = (6.25 - 8.0) * 8.0 * sin(steep) + 8.0**2 * 0.5 * (steep + sin(steep) * cos(steep))
    quarter = 2.0 * 12.5 + inner + outer + 6.25 * (37.5 - long)
    assert area(dumbbell()) == pytest.approx(4.0 * quarter, rel=1e-3)  # arcs are polygons


def test_the_upper_part_of_a_beam_is_a_rectangle_less_two_notches() -> None:
    assert upper(BEND).area() == pytest.approx(8.0 * 11.5 - 2.0 * 1.5**2)


@pytest.mark.parametrize("lean_deg", [0.0, 30.0, 45.0])
@pytest.mark.parametrize("shape", [BEND, TENSILE])
def test_both_sides_of_a_joint_have_its_section(shape: Shape, lean_deg: float) -> None:
    lean, height = radians(lean_deg), 35.0
    below = lower(shape, lean, height)
    axis, across = np.array([sin(lean), cos(lean)]), np.array([cos(lean), -sin(lean)])
    corners = np.vstack(below.to_polygons())
    top = corners[(corners - [0.0, height]) @ axis > -1e-6]
    assert sorted(((top - [0.0, height]) @ across).tolist()) == pytest.approx([-0.5 * shape.depth_mm, 0.5 * shape.depth_mm])
    assert corners[:, 1].min() == pytest.approx(0.0)


def test_a_screw_fits_through_the_foot_and_its_hole_stays_inside() -> None:
    foot = lower(BEND, 0.0, 10.0)
    solid = foot.hull().area() - foot.area()
    assert solid == pytest.approx(pi * 2.15**2, rel=0.02)
    assert foot.num_contour() == 2


def test_a_number_is_engraved_and_two_numbers_differ() -> None:
    plain, bars = bar(BEND, 0.0, 10.0), [bar(BEND, 0.0, 10.0, number) for number in range(1, 13)]
    assert all((plain - numbered).volume() > 1.0 for numbered in bars)
    assert all((one - other).volume() + (other - one).volume() > 0.3 for one, other in combinations(bars, 2))


def test_a_load_s_stress_is_moment_over_section_modulus_or_force_over_area() -> None:
    assert BEND.strength_mpa(100.0) == pytest.approx(100.0 * 9.0 / (6.0 * 8.0**2 / 6.0))
    assert TENSILE.strength_mpa(320.0) == pytest.approx(320.0 / 16.0)
