"""Bores and pins found in twenty forms with known features, and the ones that planes cut."""

from typing import TypeAlias

import manifold3d as m3
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mdp.cut import mesh_of
from mdp.mesh import Mesh
from mdp.plane import Plane
from mdp.pose import about, unit
from mdp.search.plan_file import PlanFile, PlannedPart
from mdp.search.search import SearchRequest, decompose
from mdp.sweep.cylinders import Cylinder, crossings, find_cylinders, spoiled_by_cuts
from profiles.profile import load

Solid: TypeAlias = m3.Manifold


def block(x: float = 40.0, y: float = 40.0, z: float = 20.0) -> Solid:
    return Solid.cube((x, y, z), True)


def rod(diameter_mm: float, length_mm: float = 60.0, sides: int = 48) -> Solid:
    return Solid.cylinder(length_mm, diameter_mm / 2, diameter_mm / 2, sides, True)


def slot(diameter_mm: float, length_mm: float) -> Solid:
    """A slot with parallel sides and round ends."""
    ends = [rod(diameter_mm).translate((side * length_mm / 2, 0, 0)) for side in (-1, 1)]
    return Solid.batch_hull(ends)


def holes(count: int, diameter_mm: float) -> Solid:
    around = 2.0 * np.pi * np.arange(count) / count
    return Solid.compose([rod(diameter_mm).translate((15 * np.cos(a), 15 * np.sin(a), 0)) for a in around])


def rounded(x: float, y: float, z: float, radius: float) -> Solid:
    """A block with rounded upright edges."""
    corners = [(i * (x / 2 - radius), j * (y / 2 - radius), 0) for i in (-1, 1) for j in (-1, 1)]
    return Solid.batch_hull([rod(2 * radius, z).translate(corner) for corner in corners])


def torus() -> Solid:
    return m3.CrossSection.circle(4.0, 32).translate((14.0, 0.0)).revolve(64)


BORE, PIN = True, False
# The bores and pins of each form, by diameter.
FORMS: dict[str, tuple[Solid, list[tuple[bool, float]]]] = {
    "block": (block(), []),
    "bore": (block() - rod(8), [(BORE, 8)]),
    "bore of eight sides": (block() - rod(8, sides=8), [(BORE, 8)]),
    "bore of 256 sides": (block() - rod(12, sides=256), [(BORE, 12)]),
    "blind bore": (block() - rod(6, 20).translate((0, 0, 10)), [(BORE, 6)]),
    "counterbore": (block() - rod(4) - rod(9, 10).translate((0, 0, 8)), [(BORE, 4), (BORE, 9)]),
    "countersink": (block() - rod(4) - Solid.cylinder(5, 2, 7, 48).translate((0, 0, 5.01)), [(BORE, 4)]),
    "bores that cross": (block() - rod(8) - rod(5).rotate((90, 0, 0)), [(BORE, 5), (BORE, 5), (BORE, 8)]),
    "leaning bore": (block() - rod(7, 90).rotate((0, 35, 0)), [(BORE, 7)]),
    "nine holes": (block(50, 50, 5) - holes(9, 3.4), [(BORE, 3.4)] * 9),
    "bearing seat": (block(60, 60, 12) - rod(22, 14).translate((0, 0, 6)) - rod(12), [(BORE, 12), (BORE, 22)]),
    "pin": (block() + rod(6, 30).translate((0, 0, 15)), [(PIN, 6)]),
    "two pins and a bore": (
        block() + rod(4, 30).translate((12, 0, 15)) + rod(4, 30).translate((-12, 0, 15)) - rod(10),
        [(PIN, 4), (PIN, 4), (BORE, 10)],
    ),
    "tube": (rod(40, 30, 96) - rod(20, 40), [(BORE, 20)]),
    "slot": (block() - slot(6, 14), [(BORE, 6), (BORE, 6)]),
    "rounded block": (rounded(40, 30, 20, 5), []),
    "cone": (Solid.cylinder(30, 12, 4, 48), []),
    "ball": (Solid.sphere(12, 64), []),
    "ring": (torus(), []),
    "hexagonal pocket": (block() - rod(12, 20, 6).translate((0, 0, 10)), []),
}


def found(mesh: Mesh) -> list[tuple[bool, float]]:
    return sorted((cylinder.is_bore, round(2.0 * cylinder.radius_mm, 1)) for cylinder in find_cylinders(mesh))


@pytest.mark.parametrize("name", FORMS)
def test_exactly_the_bores_and_pins_of_a_shape_are_found(name: str) -> None:
    solid, features = FORMS[name]
    assert found(mesh_of(solid)) == sorted(features)


@settings(max_examples=20, deadline=None)
@given(st.sampled_from(["bore", "counterbore", "pin", "slot", "cone"]), st.tuples(*[st.floats(-1.0, 1.0)] * 3), st.floats(0, 3))
def test_turned_and_rounded_as_in_a_file_a_form_has_the_same(
    name: str, axis: tuple[float, float, float], angle_rad: float
) -> None:
    solid, features = FORMS[name]
    turned = mesh_of(solid).transform(about(unit(np.add(axis, (0.0, 0.0, 2.0))), angle_rad), (31.0, -17.0, 12.0))
    rounded_mesh = Mesh(turned.vertices.astype(np.float32).astype(np.float64), turned.faces)
    assert found(rounded_mesh) == sorted(features)


def test_a_bore_is_found_where_it_was_drilled() -> None:
    (bore,) = find_cylinders(mesh_of(block() - rod(8).translate((5, -3, 0))))
    assert abs(bore.axis[2]) == pytest.approx(1.0)
    assert bore.middle == pytest.approx([5.0, -3.0, 0.0], abs=1e-6)
    assert [bore.radius_mm, bore.half_mm] == pytest.approx([4.0, 10.0], rel=0.01)


UPRIGHT = Cylinder(np.array([0.0, 0.0, 1.0]), np.array([1.0, 2.0, 3.0]), 4.0, 5.0, True, np.zeros(0, np.int32))


@settings(max_examples=60, deadline=None)
@given(st.tuples(*[st.floats(-1.0, 1.0)] * 3), st.floats(-12.0, 12.0))
def test_a_plane_cuts_a_cylinder_with_points_on_both_sides(place: tuple[float, float, float], offset_mm: float) -> None:
    direction = unit(np.add(place, (0.0, 0.0, 1.5)))
    turns = np.linspace(0.0, 2.0 * np.pi, 721)
    rim = np.stack([4.0 * np.cos(turns), 4.0 * np.sin(turns), np.zeros(721)], axis=1)
    heights = np.concatenate([(rim + UPRIGHT.middle + (0.0, 0.0, end)) @ direction for end in (-5.0, 5.0)]) - offset_mm
    if min(abs(heights.min()), abs(heights.max())) > 0.06:
        crossed = float(crossings([UPRIGHT], direction[None], np.array([[offset_mm]]))[0, 0])
        sine = np.sqrt(max(1.0 - direction[2] ** 2, 0.0))
        assert crossed == pytest.approx(sine if heights.min() < 0.0 < heights.max() else 0.0)


def test_an_oblique_cut_through_a_bore_has_the_set_cost_and_is_reported() -> None:
    post = mesh_of(Solid.cube((24, 24, 60), True).translate((0, 0, 30)) - rod(9).rotate((90, 0, 0)).translate((0, 0, 40)))
    askew, level = PlannedPart((0.0, 0.6, 0.8), 32.0), PlannedPart((0.6, 0.0, 0.8), 32.0)
    across = unit((0.6, 0.0, 0.8)) @ np.array([0.0, 1.0, 0.0])
    for planned, sine in ((askew, 0.8), (level, float(np.sqrt(1.0 - across**2)))):
        free, dear = (
            decompose(
                post,
                "post",
                load(settings=[f"search.feature_mm2={cost_mm2}"]),
                SearchRequest(plan=PlanFile("", parts=(planned,)), parts=2),
            )
            for cost_mm2 in (0.0, 300.0)
        )
        assert dear.cost_mm2 - free.cost_mm2 == pytest.approx(300.0 * sine)
        assert dear.residual_area_mm2 == pytest.approx(free.residual_area_mm2)
        assert "part 2: it is cut askew through a bore of 9 mm" in free.notes


def test_a_cut_square_to_the_axis_of_a_bore_or_outside_it_does_not_cross_it() -> None:
    post = mesh_of(Solid.cube((24, 24, 60), True).translate((0, 0, 30)) - rod(9, 200))
    (bore,) = find_cylinders(post)
    assert not bore.is_crossed(Plane(np.array([0.0, 0.0, 1.0]), 30.0))
    assert not bore.is_crossed(Plane(np.array([1.0, 0.0, 0.0]), 5.0))
    assert bore.is_crossed(Plane(np.array([1.0, 0.0, 0.0]), 4.0))


def test_a_turned_body_counts_by_its_surface_where_a_cut_is_not_square_to_its_axis() -> None:
    wheel = mesh_of(rod(60.0, 20.0, 96))
    (body,) = spoiled_by_cuts(wheel)
    assert (body.is_bore, body.in_words) == (False, "a turned body of 60 mm")
    around_mm2 = np.pi * 60.0 * 20.0
    square, askew, beside = (
        float(crossings([body], unit(normal)[None], np.array([[offset]]))[0, 0])
        for normal, offset in (((0, 0, 1), 3.0), ((1, 0, 0), 10.0), ((1, 0, 0), 30.5))
    )
    assert (square, beside) == (0.0, 0.0)
    assert askew == pytest.approx(around_mm2 / 500.0, rel=1e-2)


def test_a_body_with_large_arms_is_no_turned_body_that_cuts_spoil() -> None:
    assert spoiled_by_cuts(mesh_of(rod(16.0) + block(80.0, 10.0, 10.0))) == ()
