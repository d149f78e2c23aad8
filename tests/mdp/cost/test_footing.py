"""Footing: adhesion to the build plate, by the closed formulas of a glued beam."""

from dataclasses import replace

import manifold3d as m3
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mdp.cost.footing import BLUNT, BuildPlate, Footing
from mdp.cut import mesh_of
from mdp.mesh import Floats
from mdp.overhang import PLATE_TOLERANCE_MM
from profiles.profile import load

UPRIGHT = np.eye(3)


def rod(radius_mm: float, height_mm: float) -> m3.Manifold:
    return m3.Manifold.cylinder(height_mm, radius_mm, radius_mm, 512)


def footing_of(solid: m3.Manifold, rotation: Floats = UPRIGHT, **changes: object) -> Footing:
    return replace(BuildPlate.under(mesh_of(solid), load()), **changes).footing(rotation)


def test_the_tension_under_a_rod_is_that_of_a_push_at_its_top_less_its_weight() -> None:
    """1 N at 60 mm acts on the section modulus pi r^3 / 4; the weight of pi r^2 h of 1.24 g/cm3 presses on pi r^2."""
    footing = footing_of(rod(5.0, 60.0), density_g_cm3=1.24, brim_mm=5.0)
    pressed_mpa = 60.0 * 1.24e-6 * 9.81
    assert footing.tension_mpa == pytest.approx(60.0 / (np.pi * 125.0 / 4.0) - pressed_mpa, rel=1e-3)
    assert footing.brimmed_mpa == pytest.approx(60.0 / (np.pi * 1000.0 / 4.0) - pressed_mpa / 4.0, rel=1e-2)


def test_an_eccentric_weight_also_bends_the_contact() -> None:
    beside_mm = np.array([40.0, 0.0, 30.0])
    straight, leaning = (
        footing_of(rod(5.0, 60.0), density_g_cm3=1.24, **centre).tension_mpa for centre in ({}, {"centre": beside_mm})
    )
    weight_n = np.pi * 25.0 * 60.0 * 1.24e-6 * 9.81
    assert leaning - straight == pytest.approx(weight_n * 40.0 / (np.pi * 125.0 / 4.0), rel=1e-3)


def test_a_solid_is_measured_as_it_is_turned() -> None:
    plate = m3.Manifold.cube((40.0, 30.0, 4.0), True)
    on_edge = np.array([[0.0, 0.0, -1.0], [0.0, 1.0, 0.0], [1.0, 0.0, 0.0]])
    flat, edge = (footing_of(plate, turn, density_g_cm3=1e-9).tension_mpa for turn in (UPRIGHT, on_edge))
    # A push of 1 N at the top towards a corner, against the section moduli of 40 x 30 mm and of 4 x 30 mm.
    assert flat == pytest.approx(4.0 * np.hypot(6 / (40 * 30**2), 6 / (30 * 40**2)), rel=1e-6)
    assert edge == pytest.approx(40.0 * np.hypot(6 / (4 * 30**2), 6 / (30 * 4**2)), rel=1e-6)


def standing(solid: m3.Manifold) -> Footing:
    return footing_of(solid.translate((0.0, 0.0, -solid.bounding_box()[2])))


def table(legs_mm: float) -> m3.Manifold:
    """A plate of 60 x 60 mm on four square legs of 40 mm."""
    legs = [m3.Manifold.cube((legs_mm, legs_mm, 41.0), True).translate((x, y, 20.5)) for x in (-27, 27) for y in (-27, 27)]
    return m3.Manifold.batch_boolean(
        [m3.Manifold.cube((60.0, 60.0, 4.0), True).translate((0.0, 0.0, 42.0)), *legs], m3.OpType.Add
    )


def balanced(radius_mm: float, aside_mm: float) -> m3.Manifold:
    """A slab of 30 x 30 x 10 mm on a rod of 40 mm, aside_mm from the rod's axis."""
    return rod(radius_mm, 41.0) + m3.Manifold.cube((30.0, 30.0, 10.0), True).translate((aside_mm, 0.0, 45.0))


def test_a_base_of_a_fifth_of_the_shadow_lacks_nothing_and_half_of_it_half() -> None:
    assert standing(m3.Manifold.cube((20.0, 20.0, 20.0))).narrow == 0.0
    assert standing(table(9.5)).narrow == pytest.approx(1.0 - 361.0 / 3600.0 / 0.2, abs=0.02)  # legs by the shadow


def test_a_pillar_may_be_tilted_until_its_middle_is_over_its_edge() -> None:
    pillar = standing(m3.Manifold.cube((20.0, 20.0, 80.0)))
    assert pillar.lean_deg == pytest.approx(np.degrees(np.arctan(10.0 / 40.0)), abs=0.1)


@pytest.mark.parametrize(("radius_mm", "unsteady"), [(20.0, 0.489), (10.0, 1.0)])
def test_a_stance_is_as_unsteady_as_its_tension_is_near_a_quarter_of_the_adhesion(radius_mm: float, unsteady: float) -> None:
    """1 N at 300 mm on the section modulus of a base with 5 mm of brim: 0.0244 and 0.113 MPa; anything from 0.05 MPa counts 1."""
    footing = footing_of(rod(radius_mm, 300.0), density_g_cm3=1e-9, brim_mm=5.0)
    assert footing.unsteady == pytest.approx(unsteady, rel=0.01)


def test_a_thin_rod_is_held_by_its_brim_alone() -> None:
    """1 N at 50 mm on pi r^3 / 4: 8 MPa at 2 mm, 0.19 MPa with 5 mm of brim around it; the plate holds 0.2 MPa."""
    assert footing_of(rod(2.0, 50.0), brim_mm=5.0).held()
    assert not footing_of(rod(2.0, 50.0), brim_mm=4.0).held()


def test_a_table_on_thin_legs_is_held() -> None:
    assert standing(table(3.0)).held()
    assert not standing(table(1.0)).held()  # 4 of 3600 mm2 are too little for a brim


@pytest.mark.parametrize("thick_mm", [0.05, 0.1, 0.2])
def test_a_thin_sheet_has_its_whole_face_as_base(thick_mm: float) -> None:
    footing = standing(m3.Manifold.cube((100.0, 80.0, thick_mm)))
    assert footing.base_share > 0.99
    assert footing.held()


def test_a_body_leaning_over_its_base_is_held_by_adhesion_and_brim() -> None:
    assert standing(balanced(5.0, 3.0)).held()
    assert not standing(balanced(5.0, 14.0)).held()


def test_only_as_its_file_has_it_a_model_may_lean_out_over_its_base() -> None:
    footing = standing(balanced(5.0, 8.0))
    assert -2.0 < footing.lean_deg < -1.0
    assert (footing.held(of_file=True), footing.held()) == (True, False)


def test_a_rounded_end_is_as_wide_as_a_hundredth_of_the_model_above_the_plate() -> None:
    """A rod of 18 mm on a half ball, 68 mm high."""
    footing = standing(rod(9.0, 59.0) + m3.Manifold.sphere(9.0, 256))
    height_mm = 0.01 * np.hypot(68.0, 18.0)
    section_mm2 = np.pi * height_mm * (18.0 - height_mm)
    assert footing.base_share == pytest.approx(section_mm2 / (np.pi * 81.0), rel=0.05)


def test_a_point_is_not_a_base() -> None:
    assert not standing(m3.Manifold.cylinder(40.0, 0.01, 20.0, 64)).held(of_file=True)


@settings(deadline=None, max_examples=30)
@given(st.integers(0, 10**6))
def test_bases_are_the_sections_that_manifold3d_cuts(seed: int) -> None:
    ring = rod(20.0, 6.0) - rod(12.0, 6.0) + m3.Manifold.cube((8.0, 8.0, 30.0)).translate((15.0, 0.0, 3.0))
    turn = np.linalg.qr(np.random.default_rng(seed).normal(size=(3, 3)))[0]
    turn *= np.sign(np.linalg.det(turn))
    mesh, turned = mesh_of(ring), ring.transform(np.column_stack([turn, np.zeros(3)]))
    low, shadow_mm2 = turned.bounding_box()[2], 0.5 * np.abs(mesh.normals @ turn[2]) @ mesh.areas_mm2
    heights_mm = (0.5 * PLATE_TOLERANCE_MM, BLUNT * BuildPlate.under(mesh, load()).diameter_mm)
    touching_mm2, base_mm2 = (turned.slice(low + above_mm).area() for above_mm in heights_mm)
    footing = footing_of(ring, turn)
    assert footing.touching_share * shadow_mm2 == pytest.approx(touching_mm2, abs=1e-6)
    assert footing.base_share * shadow_mm2 == pytest.approx(max(touching_mm2, base_mm2), abs=1e-6)


@settings(deadline=None, max_examples=30)
@given(st.integers(0, 10**6))
def test_the_hull_bounds_what_touches_and_how_far_a_model_may_lean(seed: int) -> None:
    rng = np.random.default_rng(seed)
    plate = BuildPlate.under(mesh_of(rod(20.0, 6.0) + rod(4.0, 40.0).translate((12.0, 0.0, 0.0))), load())
    turn = np.linalg.qr(rng.normal(size=(3, 3)))[0] if rng.random() < 0.8 else UPRIGHT
    turn = turn * np.sign(np.linalg.det(turn))
    footing, shadow_mm2 = plate.footing(turn), 0.5 * np.abs(plate.mesh.normals @ turn[2]) @ plate.mesh.areas_mm2
    touching_mm2, lean_deg = plate.stance_bounds(turn[None])
    assert footing.touching_share * shadow_mm2 <= touching_mm2[0] + 1e-4
    assert footing.lean_deg <= lean_deg[0] + 1e-4
    assert touching_mm2[0] < 1.1 * shadow_mm2


@pytest.mark.parametrize("setting", ["process.raft_layers=3", "search.pedestal_mm=5"])
def test_no_brim_is_assumed_on_a_raft_or_a_pedestal(setting: str) -> None:
    mesh = mesh_of(rod(5.0, 60.0))
    footing = BuildPlate.under(mesh, load(settings=[setting, "process.brim_mm=10"])).footing(UPRIGHT)
    assert footing.brimmed_mpa == pytest.approx(footing.tension_mpa)
