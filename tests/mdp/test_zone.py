"""Zones: faces that reach into a box, and the offsets at which a plane passes through it or through faces of a colour."""

import numpy as np
import pytest
import trimesh
from hypothesis import given, settings
from hypothesis import strategies as st

from mdp.mesh import Mesh
from mdp.plane import Plane
from mdp.pose import about
from mdp.zone import Brushed, Grown, Painted, Zone, Zones, spans_mm, touched
from tests import shapes
from tests.mdp.files import both
from tests.mdp.solids import random_direction, random_solid


def test_faces_of_a_box_are_touched_where_the_zone_reaches_them() -> None:
    box = shapes.box()
    top = touched(box, [Zone((-5, -5, 15), (5, 5, 25))])
    assert set(box.normals[top][:, 2]) == {1.0}
    assert not touched(box, [Zone((-5, -5, 5), (5, 5, 15))]).any()
    assert not touched(box, []).any()


@settings(max_examples=25)
@given(st.integers(0, 50), st.tuples(*[st.floats(-15.0, 15.0)] * 3), st.floats(0.5, 10.0))
def test_a_face_with_a_point_in_the_zone_is_touched(seed: int, low: tuple[float, float, float], size: float) -> None:
    mesh, zone = random_solid(seed), Zone(low, (low[0] + size, low[1] + size, low[2] + size))
    weights = np.random.default_rng(0).dirichlet((1.0, 1.0, 1.0), 200)
    points = np.einsum("sc,fci->fsi", weights, mesh.vertices[mesh.faces])
    inside = ((points >= zone.min_mm) & (points <= zone.max_mm)).all(axis=2).any(axis=1)
    assert (zone.faces(mesh) >= inside).all()


def test_a_face_is_not_touched_if_only_its_bounding_box_reaches_into_the_zone() -> None:
    mesh = Mesh(
        np.array([[0.0, 0, 0], [10, 0, 0], [0, 10, 0], [0, 0, 10]]), np.array([[0, 2, 1], [1, 2, 3], [0, 1, 3], [0, 3, 2]])
    )
    assert touched(mesh, [Zone((4.0, 4.0, 4.0), (9.0, 9.0, 9.0))]).tolist() == [False, False, False, False]
    assert touched(mesh, [Zone((3.0, 3.0, 3.0), (9.0, 9.0, 9.0))]).tolist() == [False, True, False, False]


@given(st.integers(1, 999), st.integers(1, 999))
def test_a_plane_passes_through_a_zone_between_its_lowest_and_its_highest_corner(height: int, around: int) -> None:
    direction, zone = random_direction(height, around), Zone((-1.0, 2.0, 3.0), (4.0, 5.0, 9.0))
    corners = np.array([[x, y, z] for x in (-1.0, 4.0) for y in (2.0, 5.0) for z in (3.0, 9.0)]) @ direction
    np.testing.assert_allclose(spans_mm(direction[None], [zone])[0], [[corners.min(), corners.max()]], atol=1e-12)


@settings(max_examples=25, deadline=None)
@given(st.integers(0, 50), st.integers(1, 999), st.integers(1, 999))
def test_a_box_that_is_turned_with_a_model_reaches_the_same_faces_and_the_same_planes(
    seed: int, height: int, around: int
) -> None:
    mesh, plain, shift = random_solid(seed), Zone((-4.0, -6.0, 1.0), (3.0, 5.0, 6.0)), np.array((3.0, -2.0, 1.0))
    turn, direction = about(random_direction(height, around), 0.001 * height), random_direction(around, height)
    turned = plain.transform(turn, np.zeros(3)).transform(np.eye(3), shift)
    assert (turned.faces(mesh.transform(turn, shift)) == plain.faces(mesh)).all()
    np.testing.assert_allclose(turned.corners, plain.corners @ turn.T + shift, atol=1e-12)
    spans = spans_mm(direction[None], [plain])[0] + turn @ direction @ shift
    np.testing.assert_allclose(spans_mm((turn @ direction)[None], [turned])[0], spans, atol=1e-12)


RED = 0xFF0000


def painted(seed: int, share: float = 0.1) -> Mesh:
    """A solid, some of its faces red."""
    mesh = random_solid(seed)
    red = np.random.default_rng(seed).random(len(mesh.faces)) < share
    return Mesh(mesh.vertices, mesh.faces, np.where(red, RED, 0x123456).astype(np.int32))


@settings(max_examples=25, deadline=None)
@given(st.integers(0, 50), st.integers(1, 999), st.integers(1, 999))
def test_a_plane_passes_through_a_colour_where_it_has_corners_of_one_of_its_faces_on_both_sides(
    seed: int, height: int, around: int
) -> None:
    mesh, direction = painted(seed), random_direction(height, around)
    heights = (mesh.vertices @ direction)[mesh.faces[mesh.colours == RED]]
    (spans,) = spans_mm(direction[None], Zones(keep=(Painted(RED),)).on(mesh).keep)
    for offset_mm in np.linspace(mesh.vertices.min(), mesh.vertices.max(), 301):
        passes = ((heights.min(axis=1) < offset_mm) & (heights.max(axis=1) > offset_mm)).any()
        assert passes == ((spans[:, 0] < offset_mm) & (offset_mm < spans[:, 1])).any()


def test_directions_with_fewer_spans_than_others_end_in_spans_that_no_plane_is_in() -> None:
    two = both(shapes.box(), shapes.box().transform(np.eye(3), (50.0, 0.0, 0.0)))
    red = Mesh(two.vertices, two.faces, np.full(len(two.faces), RED, dtype=np.int32))
    spans = spans_mm(np.eye(3), Zones(keep=(Painted(RED),)).on(red).keep)
    np.testing.assert_allclose(spans[:, 0], [[-10.0, 10.0], [-10.0, 10.0], [0.0, 20.0]], atol=2e-6)
    np.testing.assert_allclose(spans[:, 1], [[40.0, 60.0], [np.inf, np.inf], [np.inf, np.inf]], atol=2e-6)


def test_a_plane_may_be_in_a_flat_face_of_a_colour_and_touch_its_edges() -> None:
    box = shapes.box()
    top = Mesh(box.vertices, box.faces, np.where(box.normals[:, 2] > 0.9, RED, 0).astype(np.int32))
    zones = Zones(keep=(Painted(RED),)).on(top)
    assert zones.crossed(Plane(np.array([0.0, 0.0, 1.0]), 20.0)) is None
    assert zones.crossed(Plane(np.array([1.0, 0.0, 0.0]), 10.0)) is None
    assert zones.crossed(Plane(np.array([1.0, 0.0, 0.0]), 9.9)) == 1


def test_an_angle_of_nothing_takes_the_flat_place_and_ninety_degrees_its_neighbours() -> None:
    box = shapes.box()
    top = Grown((3.0, 4.0, 20.0), 0.0).faces(box)
    assert box.normals[top].tolist() == [[0.0, 0.0, 1.0]] * 2
    around = Grown((3.0, 4.0, 20.0), 90.0).faces(box)
    assert (int(around.sum()), float(box.normals[~around][:, 2].max())) == (10, -1.0)


@pytest.mark.parametrize("angle_deg", [20.0, 70.0, 130.0])
def test_on_a_ball_it_is_a_cap_of_that_angle(angle_deg: float) -> None:
    ball = shapes.ball(10.0, 96)
    area = float(ball.areas_mm2[Grown((0.0, 0.0, 20.0), angle_deg).faces(ball)].sum())
    assert area == pytest.approx(2 * np.pi * 100 * (1 - np.cos(np.radians(angle_deg))), rel=0.06)


def test_unconnected_faces_are_left_out() -> None:
    two = both(shapes.box(), shapes.box().transform(np.eye(3), (50.0, 0.0, 0.0)))
    marked = Grown((50.0, 0.0, 20.0), 1.0).faces(two)
    assert two.vertices[two.faces[marked]][:, :, 0].min() == 40.0


@settings(max_examples=20, deadline=None)
@given(st.integers(0, 50), st.tuples(*[st.floats(-20.0, 20.0)] * 3))
def test_the_nearest_face_is_the_one_that_trimesh_finds(seed: int, point: tuple[float, float, float]) -> None:
    mesh: Mesh = random_solid(seed)
    corners = mesh.vertices[mesh.faces]
    nearest = trimesh.triangles.closest_point(corners, np.tile(point, (len(corners), 1)))
    assert mesh.nearest_face(np.array(point))[1] == pytest.approx(np.linalg.norm(nearest - point, axis=1).min(), abs=1e-9)


def test_brushed_faces_are_kept_as_ranges_and_stay_on_the_turned_model() -> None:
    ball, chosen = random_solid(3), np.zeros(len(random_solid(3).faces), dtype=np.bool_)
    chosen[[0, 1, 2, 5, 7, 8]] = True
    zone = Brushed.of(chosen)
    assert zone.numbers == "0-2 5 7-8"
    turn = about(random_direction(400, 300), 1.0)
    assert (zone.transform(turn, np.ones(3)).faces(ball.transform(turn, np.ones(3))) == chosen).all()


def test_a_brushed_patch_keeps_planes_out_over_its_height() -> None:
    box = shapes.box()  # 20 mm high
    side = Brushed.of(box.normals[:, 0] > 0.9)
    zones = Zones(keep=(side,)).on(box)
    assert zones.crossed(Plane(np.array([0.0, 0, 1]), 10.0)) == 1
    assert zones.crossed(Plane(np.array([1.0, 0, 0]), 1.0)) is None


@pytest.mark.parametrize("numbers", ["", "5-2", "a", "3-", "1,2", "-4", "1  2"])
def test_text_that_is_no_list_of_faces_is_refused(numbers: str) -> None:
    with pytest.raises(ValueError, match="numbers and ranges of faces are expected"):
        Brushed(numbers)
