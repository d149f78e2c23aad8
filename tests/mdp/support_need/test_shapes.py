"""Self-supporting faces on shapes of any size and rotation: against closed formulas and point-by-point checks."""

import manifold3d as m3
import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from mdp.directions.unit_vectors import frame_across, framed, spread
from mdp.mesh import Floats, Mesh
from mdp.overhang import Mask, facing_down, risky_upright
from mdp.pose import about, unit
from mdp.support_need.need import SupportNeed, needs_support
from mdp.support_need.over_air import find_over_air
from mdp.support_need.patches import CARRIES_ITSELF, NARROW
from mdp.topology.edges import flat_places, link
from profiles.profile import load
from tests.mdp.solids import random_solid
from tests.shapes import from_manifold, standing

PROCESS = load().process
UP_DEG = PROCESS.self_supporting_angle_deg
TURN = st.floats(0.0, 360.0)


def needing_mm2(mesh: Mesh) -> float:
    """Area that needs support upright on the build plate."""
    return float(mesh.areas_mm2[risky_upright(mesh, UP_DEG) & needs_support(mesh, PROCESS, True)].sum())


def block(x: float, y: float, z: float, low: float = 0.0) -> m3.Manifold:
    return m3.Manifold.cube((x, y, z), True).translate((0, 0, low + z / 2))


@settings(max_examples=30)
@given(st.floats(2.0, 45.0), st.floats(6.0, 15.0), TURN)
def test_a_deck_shorter_than_the_bridge_length_is_self_supporting_in_any_rotation(
    length: float, width: float, turn: float
) -> None:
    assume(abs(length - PROCESS.bridge_mm) > 0.1)
    pillars = block(length + 10, width, 10) - block(length, 2 * width, 12)
    mesh = standing((pillars + block(length + 10, width, 3, 10)).rotate((0, 0, turn)))
    assert needing_mm2(mesh) == pytest.approx(0.0 if length < PROCESS.bridge_mm else length * width, abs=1e-6)


@settings(max_examples=30)
@given(st.floats(0.2, 4.0), st.floats(5.0, 20.0), TURN)
def test_a_collar_carries_itself_where_it_is_narrower_than_two_lines(width: float, radius: float, turn: float) -> None:
    assume(abs(width - NARROW * PROCESS.line_width_mm) > 0.1)
    collar = m3.Manifold.cylinder(3, radius + width, -1, 60).translate((0, 0, 10)) + m3.Manifold.cylinder(20, radius, -1, 60)
    round_off = 60 / (2 * np.pi) * np.sin(2 * np.pi / 60)  # of a circle of 60 sides
    area = np.pi * ((radius + width) ** 2 - radius**2) * round_off
    needing = needing_mm2(standing(collar.rotate((0, 0, turn))))
    assert needing == pytest.approx(0.0 if width < NARROW * PROCESS.line_width_mm else area, abs=1e-6)


@settings(max_examples=20)
@given(st.floats(0.06, 3.0), st.floats(1.0, 8.0), TURN)
def test_the_lowest_point_under_a_ceiling_begins_in_mid_air(depth: float, side: float, turn: float) -> None:
    frame = block(20, 20, 12) - block(14, 30, 10) - block(30, 14, 10)
    mesh = standing((frame + block(side, side, depth, 10 - depth)).rotate((0, 0, turn)))
    lowest = np.abs(mesh.vertices[mesh.faces, 2] - (10 - depth)).max(axis=1) < 1e-6
    needing = risky_upright(mesh, UP_DEG) & needs_support(mesh, PROCESS, True)
    assert mesh.areas_mm2[lowest].sum() == pytest.approx(side**2)
    assert needing[lowest].all()


def airy_share(mesh: Mesh, direction: Floats) -> Floats:
    """(m,) share of each face with nothing of the mesh beneath it, by 16 of its points against every face that points up."""
    shares = np.array([(i + 0.5, j + 0.5) for i in range(4) for j in range(4)]) / 4.0
    shares = np.where(shares.sum(axis=1, keepdims=True) > 1.0, 1.0 - shares, shares)
    weights = np.column_stack([1.0 - shares.sum(axis=1), shares])
    corners = mesh.vertices @ np.array([*frame_across(direction), direction]).T
    places = np.einsum("sc,fci->fsi", weights, corners[mesh.faces]).reshape(-1, 3)
    airy = np.ones(len(places), dtype=np.bool_)
    for face in mesh.faces[mesh.normals @ direction > 0.05]:
        origin, *edges = corners[face] - [(0, 0, 0), corners[face[0]], corners[face[0]]]
        u, v = np.linalg.solve(np.array(edges)[:, :2].T, (places - origin)[:, :2].T)
        lower = origin[2] + u * edges[0][2] + v * edges[1][2] < places[:, 2] - 1e-4
        airy &= ~((u >= 0.0) & (v >= 0.0) & (u + v <= 1.0) & lower)
    return airy.reshape(-1, len(shares)).mean(axis=1)


def by_place(values: Floats, places: Floats, areas: Floats) -> Floats:
    """(m,) area-weighted means over the flat regions of the faces."""
    total, area = np.bincount(places, values * areas), np.bincount(places, areas)
    means: Floats = total[places] / area[places]
    return means


@pytest.mark.parametrize("seed", range(4))
def test_faces_over_air_are_those_below_which_no_face_looks_up(seed: int) -> None:
    mesh, directions = random_solid(seed), spread(37, 0.0)[[2, 14, 30]]
    surface, over_air = link(mesh), np.zeros((3, len(mesh.faces)), np.uint8)
    places = flat_places(surface)
    find_over_air(0, 3, (surface, places), framed(directions), over_air)
    for direction, row in zip(directions, over_air, strict=True):
        down = mesh.normals @ direction < -0.05
        airy = by_place(airy_share(mesh, direction), places, mesh.areas_mm2)
        clear = down & (np.abs(airy - 0.5) > 0.2)
        wrong_mm2 = mesh.areas_mm2[clear & (row != (airy > 0.5))].sum()
        assert mesh.areas_mm2[clear].sum() > 100.0
        assert wrong_mm2 < 0.02 * mesh.areas_mm2[clear].sum()


def needing(mesh: Mesh, direction: Floats) -> Mask:
    """(m,) whether each face needs support among those that overhang along a direction."""
    classes = SupportNeed.of(mesh, PROCESS, 5.0).along(direction[None])[0]
    return facing_down(mesh, direction, UP_DEG) & (classes != CARRIES_ITSELF)


@settings(max_examples=10)
@given(st.integers(0, 50), st.floats(-1.0, 1.0), TURN, st.floats(0.1, 0.9))
def test_a_solid_turned_with_its_direction_needs_the_same(seed: int, z: float, turn: float, lean: float) -> None:
    mesh, direction = random_solid(seed), unit([lean, 0.3, 1.0])
    turned = about(unit([np.cos(turn), np.sin(turn), z]), 1.0 + z)
    assert np.array_equal(needing(mesh, direction), needing(mesh.transform(turned), turned @ direction))


def test_needed_support_does_not_depend_on_other_bodies_on_the_build_plate() -> None:
    ledge = block(10, 20, 20) + block(20, 20, 3, 12)
    far = ledge + block(8, 8, 8).translate((60, 0, 0))
    alone, beside = from_manifold(ledge), from_manifold(far)
    assert needing_mm2(alone) == needing_mm2(beside) == pytest.approx(2 * 5 * 20)
