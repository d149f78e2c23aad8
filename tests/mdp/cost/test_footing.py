"""Footing: what the plate holds, by the closed formulas of a glued beam."""

from dataclasses import replace

import manifold3d as m3
import numpy as np
import pytest

from mdp.cost.footing import Plate, Stance
from mdp.cut import mesh_of
from mdp.mesh import Floats
from profiles.profile import load

UPRIGHT = np.eye(3)


def rod(radius_mm: float, height_mm: float) -> m3.Manifold:
    return m3.Manifold.cylinder(height_mm, radius_mm, radius_mm, 512)


def tension_mpa(solid: m3.Manifold, rotation: Floats, brim_mm: float = 0.0, density_g_cm3: float = 1.24) -> float:
    plate = Plate.under(mesh_of(solid), load())
    return replace(plate, density_g_cm3=density_g_cm3).tension_mpa(rotation, brim_mm)


def test_the_tension_under_a_rod_is_that_of_a_push_at_its_top_less_its_weight() -> None:
    """1 N at 60 mm bends pi r^3 / 4; the weight of pi r^2 h of 1.24 g/cm3 presses on pi r^2."""
    alone, with_brim = (tension_mpa(rod(5.0, 60.0), UPRIGHT, brim_mm) for brim_mm in (0.0, 5.0))
    pressed_mpa = 60.0 * 1.24e-6 * 9.81
    assert alone == pytest.approx(60.0 / (np.pi * 125.0 / 4.0) - pressed_mpa, rel=1e-3)
    assert with_brim == pytest.approx(60.0 / (np.pi * 1000.0 / 4.0) - pressed_mpa / 4.0, rel=1e-2)


def test_a_weight_beside_the_contact_bends_it_too() -> None:
    plate = replace(Plate.under(mesh_of(rod(5.0, 60.0)), load()), density_g_cm3=1.24)
    beside = replace(plate, centre=np.array([40.0, 0.0, 30.0]))
    straight, leaning = plate.tension_mpa(UPRIGHT), beside.tension_mpa(UPRIGHT)
    weight_n = np.pi * 25.0 * 60.0 * 1.24e-6 * 9.81
    assert leaning - straight == pytest.approx(weight_n * 40.0 / (np.pi * 125.0 / 4.0), rel=1e-3)


def test_a_solid_is_measured_as_it_is_turned() -> None:
    plate = m3.Manifold.cube((40.0, 30.0, 4.0), True)
    on_edge = np.array([[0.0, 0.0, -1.0], [0.0, 1.0, 0.0], [1.0, 0.0, 0.0]])
    flat, edge = (tension_mpa(plate, turn, density_g_cm3=1e-9) for turn in (UPRIGHT, on_edge))
    # A push of 1 N at the top against the section modulus of 40 x 30 mm and of 4 x 30 mm, pushed over a corner.
    assert flat == pytest.approx(4.0 * np.hypot(6 / (40 * 30**2), 6 / (30 * 40**2)), rel=1e-6)
    assert edge == pytest.approx(40.0 * np.hypot(6 / (4 * 30**2), 6 / (30 * 4**2)), rel=1e-6)


def stance_of(solid: m3.Manifold, of_file: bool = False) -> Stance:
    mesh = mesh_of(solid.translate((0.0, 0.0, -solid.bounding_box()[2])))
    return Plate.under(mesh, load()).stance(UPRIGHT, of_file)


def table(legs_mm: float) -> m3.Manifold:
    """A plate of 60 x 60 mm on four square legs of 40 mm."""
    legs = [m3.Manifold.cube((legs_mm, legs_mm, 41.0), True).translate((x, y, 20.5)) for x in (-27, 27) for y in (-27, 27)]
    return m3.Manifold.batch_boolean(
        [m3.Manifold.cube((60.0, 60.0, 4.0), True).translate((0.0, 0.0, 42.0)), *legs], m3.OpType.Add
    )


def balanced(radius_mm: float, aside_mm: float) -> m3.Manifold:
    """A slab of 30 x 30 x 10 mm that stands on a rod of 40 mm, so far from the slab's middle."""
    return rod(radius_mm, 41.0) + m3.Manifold.cube((30.0, 30.0, 10.0), True).translate((aside_mm, 0.0, 45.0))


def test_a_model_on_a_fifth_of_its_shadow_stands_on_a_flat_base() -> None:
    assert stance_of(m3.Manifold.cube((20.0, 20.0, 20.0))) == Stance.FLAT
    assert stance_of(balanced(8.0, 0.0)) == Stance.FLAT  # 201 of 900 mm2


def test_a_table_on_its_legs_stands_firmly_unless_they_are_thin() -> None:
    assert stance_of(table(8.0)) == Stance.FIRM  # 256 of 3600 mm2
    assert stance_of(table(3.0)) == Stance.HELD  # 36 mm2: four such legs hold, and no more


def test_what_leans_out_over_its_base_is_held_as_far_as_glue_and_brim_reach() -> None:
    assert stance_of(balanced(5.0, 3.0)) == Stance.HELD  # 79 of 900 mm2, the weight over the edge of the rod
    assert stance_of(balanced(5.0, 14.0)) == Stance.LOOSE


def test_a_rounded_end_is_as_wide_as_a_hundredth_of_the_model_above_the_plate() -> None:
    """A rod of 18 mm on a half ball, 68 mm high: at 0.7 mm the ball's section is 12 pi mm2, of the rod's shadow a seventh."""
    assert stance_of(rod(9.0, 59.0) + m3.Manifold.sphere(9.0, 256)) == Stance.FIRM


def test_a_point_is_no_base_and_the_file_is_believed_no_further_than_it_stands() -> None:
    assert stance_of(m3.Manifold.cylinder(40.0, 0.01, 20.0, 64), of_file=True) == Stance.LOOSE
