"""Orientations in which models rest, and the azimuth: a bearing about z that turns with a model."""

import gc
import weakref

import manifold3d as m3
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mdp.cut import Solid, mesh_of
from mdp.directions.orientation import RISKY, azimuth_rad, best_orientation, face_areas, resting_facets, resting_orientations
from mdp.mesh import Mesh
from mdp.overhang import risky_upright
from mdp.pose import UP, about, unit
from tests.shapes import ball, box, branch, hollow, standing, tee

ANGLE_DEG = 45.0
ANY_DEG = st.floats(-180.0, 180.0)


def cone() -> Mesh:
    """A cone on its tip: 30 mm across, 30 mm high."""
    return standing(m3.Manifold.cylinder(30, 0.0, 15.0, 64))


def set_down(mesh: Mesh, rotation: object) -> Mesh:
    turned = mesh.transform(rotation)
    return turned.transform(np.eye(3), (0.0, 0.0, -turned.bounds_mm[0, 2]))


def test_a_box_keeps_its_orientation() -> None:
    best = best_orientation(box(20, 30, 40), ANGLE_DEG)
    assert np.allclose(best.rotation, np.eye(3))
    assert (best.risky_mm2, best.stable) == (0.0, True)


def test_a_tee_is_laid_on_its_side() -> None:
    best = best_orientation(tee(), ANGLE_DEG)
    assert best.turns_deg == pytest.approx((90.0, 0.0))
    assert best.risky_mm2 == 0.0


def test_a_cone_on_its_point_is_turned_over() -> None:
    best = best_orientation(cone(), ANGLE_DEG)
    assert best.rotation[2] == pytest.approx([0, 0, -1], abs=1e-9)
    assert best.risky_mm2 == 0.0


def test_a_box_rests_on_each_of_its_faces_and_nowhere_else() -> None:
    resting = resting_orientations(box(20, 30, 40), ANGLE_DEG)
    directions = sorted(tuple(np.round(o.rotation[2]).astype(int)) for o in resting)
    assert directions == [(-1, 0, 0), (0, -1, 0), (0, 0, -1), (0, 0, 1), (0, 1, 0), (1, 0, 0)]


def test_a_pole_does_not_rest_on_its_end() -> None:
    pole = set_down(box(4, 60, 4), about(np.array([1.0, 0.0, 0.0]), np.pi / 2))
    assert pole.bounds_mm[1, 2] == pytest.approx(60)
    assert len(resting_orientations(pole, ANGLE_DEG)) == 4


def test_the_least_risky_come_first() -> None:
    resting = resting_orientations(branch(), ANGLE_DEG)
    areas = [orientation.risky_mm2 for orientation in resting]
    assert len(resting) > 4
    assert areas == sorted(areas)
    again = [orientation.rotation.tobytes() for orientation in resting_orientations(branch(), ANGLE_DEG)]
    assert [orientation.rotation.tobytes() for orientation in resting] == again


def test_orientations_that_need_a_raft_are_tried_on_request() -> None:
    assert best_orientation(hollow(), ANGLE_DEG).risky_mm2 == pytest.approx(100.0)
    balanced = best_orientation(hollow(), ANGLE_DEG, resting=False)
    assert (balanced.risky_mm2, balanced.stable) == (0.0, False)


def test_the_best_is_never_worse_than_straight_up() -> None:
    mesh = ball()
    upright = mesh.areas_mm2[risky_upright(mesh, ANGLE_DEG)].sum()
    assert best_orientation(mesh, ANGLE_DEG, resting=False).risky_mm2 <= upright


@pytest.mark.parametrize("mesh", [tee(), branch(), hollow(), cone()], ids=["tee", "branch", "hollow", "cone"])
def test_the_area_is_what_the_turned_model_has(mesh: Mesh) -> None:
    for orientation in [best_orientation(mesh, ANGLE_DEG, resting=False), *resting_orientations(mesh, ANGLE_DEG)[:3]]:
        turned = set_down(mesh, orientation.rotation)
        assert orientation.risky_mm2 == pytest.approx(turned.areas_mm2[risky_upright(turned, ANGLE_DEG)].sum(), abs=1e-6)


def test_the_turns_are_the_rotation() -> None:
    for orientation in resting_orientations(branch(), ANGLE_DEG):
        x, y = np.radians(orientation.turns_deg)
        assert about(np.eye(3)[1], y) @ about(np.eye(3)[0], x) == pytest.approx(orientation.rotation, abs=1e-12)


vectors = st.tuples(*[st.floats(-1, 1)] * 3).filter(lambda v: np.linalg.norm(v) > 0.1)


@settings(max_examples=25, deadline=None)
@given(vectors, st.floats(0.0, 6.3))
def test_turning_a_model_does_not_change_its_best_area(axis: tuple[float, float, float], angle_rad: float) -> None:
    turned = set_down(hollow(), about(unit(axis), angle_rad))
    assert best_orientation(turned, ANGLE_DEG).risky_mm2 == pytest.approx(100.0)


@settings(max_examples=25, deadline=None)
@given(vectors)
def test_one_direction_is_what_brute_force_gives(vector: tuple[float, float, float]) -> None:
    mesh, up = branch(), unit(vector)
    heights = mesh.vertices @ up - (mesh.vertices @ up).min()
    risky = sum(
        area
        for area, normal, face in zip(mesh.areas_mm2, mesh.normals, mesh.faces, strict=True)
        if normal @ up < -(np.sin(np.radians(ANGLE_DEG)) + 1e-4) and max(heights[k] for k in face) > 0.3
    )
    assert face_areas(mesh, up[None], ANGLE_DEG)[0, RISKY] == pytest.approx(risky, abs=1e-9)


def test_cached_values_of_a_mesh_are_computed_once_and_do_not_keep_it_alive() -> None:
    mesh = tee()
    assert best_orientation(mesh, ANGLE_DEG) is best_orientation(mesh, ANGLE_DEG)
    assert best_orientation(mesh, ANGLE_DEG) is not best_orientation(tee(), ANGLE_DEG)
    left = weakref.ref(mesh)
    del mesh
    gc.collect()
    assert left() is None


def test_a_tee_rests_on_six_facets_of_its_hull_and_not_on_the_undersides_of_its_arms() -> None:
    lean = np.array([0.8944, 0.0, -0.4472])  # from the foot to the end of an arm
    expected = [(0, -1, 0), (0, 1, 0), (0, 0, 1), lean * (-1, 1, 1), lean, (0, 0, -1)]
    facets = resting_facets(tee())
    assert np.array([normal for normal, _ in facets]) == pytest.approx(np.array(expected), abs=1e-4)
    front = facets[0][1]
    assert (front.shape, set(front[..., 1].ravel().tolist())) == ((4, 3, 3), {-5.0})


def azimuth_deg(solid: Solid, turn_deg: float = 0.0) -> float:
    mesh = mesh_of(solid)
    return float(np.degrees(azimuth_rad(Mesh(mesh.vertices @ about(UP, np.radians(turn_deg)).T, mesh.faces))))


def apart_deg(one: float, other: float, period_deg: float = 360.0) -> float:
    return abs((one - other + 0.5 * period_deg) % period_deg - 0.5 * period_deg)


def star(corners: int) -> Solid:
    """An upright prism over a wavy circle, a crest along x."""
    turns = np.linspace(0.0, 2.0 * np.pi, 240, endpoint=False)
    radius = 10.0 + 3.0 * np.cos(corners * turns)
    return m3.CrossSection([np.stack([radius * np.cos(turns), radius * np.sin(turns)], axis=1)]).extrude(5.0)


def test_the_azimuth_of_a_box_is_along_its_longer_side() -> None:
    assert apart_deg(azimuth_deg(m3.Manifold.cube((30.0, 10.0, 5.0), True)), 0.0, 180.0) < 1e-6
    assert apart_deg(azimuth_deg(m3.Manifold.cube((10.0, 30.0, 5.0), True)), 90.0, 180.0) < 1e-6


def test_the_azimuth_of_a_post_with_an_arm_is_along_the_arm() -> None:
    post = m3.Manifold.cylinder(30.0, 5.0, 5.0, 64) + m3.Manifold.cube((20.0, 4.0, 4.0)).translate((0.0, -2.0, 10.0))
    assert apart_deg(azimuth_deg(post), 0.0) < 1e-6


@given(ANY_DEG)
def test_the_azimuth_turns_with_a_model_of_no_symmetry(turn_deg: float) -> None:
    solid = m3.Manifold.cube((30.0, 10.0, 5.0)) + m3.Manifold.cube((4.0, 12.0, 20.0)) + m3.Manifold.sphere(3.0, 24)
    assert apart_deg(azimuth_deg(solid, turn_deg), azimuth_deg(solid) + turn_deg) < 1e-4


@pytest.mark.parametrize("corners", [2, 3, 4, 5, 6])
@given(turn_deg=ANY_DEG)
def test_one_of_several_symmetric_orientations_is_chosen(corners: int, turn_deg: float) -> None:
    assert apart_deg(azimuth_deg(star(corners), turn_deg), turn_deg, 360.0 / corners) < 1e-4


def test_a_body_of_revolution_has_azimuth_0_however_it_is_turned() -> None:
    assert azimuth_deg(m3.Manifold.cylinder(30.0, 5.0, 8.0, 64), 7.0) == 0.0


def test_the_azimuth_does_not_depend_on_how_a_surface_is_cut_into_triangles() -> None:
    solid = m3.Manifold.cube((30.0, 10.0, 5.0)) + m3.Manifold.cube((4.0, 12.0, 20.0))
    assert apart_deg(azimuth_deg(solid.refine(3)), azimuth_deg(solid)) < 1e-6
