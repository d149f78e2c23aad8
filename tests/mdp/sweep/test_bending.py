"""Bending: stress at the base of the body above a plane, against textbook sections."""

import manifold3d as m3
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mdp.cut import Solid, above, mesh_of, solid_of
from mdp.mesh import Floats, Mesh
from mdp.plane import Plane
from mdp.sweep.bending import stress_per_newton
from tests import shapes
from tests.mdp.solids import random_direction, random_solid

LEVEL = Plane(np.array([0.0, 0.0, 1.0]), 5.0)


def _stress(solid: Solid, plane: Plane = LEVEL) -> float:
    return stress_per_newton(mesh_of(solid), plane, 2.0)


def _beam(width_mm: float, depth_mm: float, length_mm: float) -> Solid:
    """A beam on a block whose top is at 5 mm."""
    return m3.Manifold.cube((40.0, 40.0, 5.0), True).translate((0.0, 0.0, 2.5)) + m3.Manifold.cube(
        (width_mm, depth_mm, 2.0 * length_mm), True
    ).translate((0.0, 0.0, 5.0))


def test_a_beam_is_pushed_in_its_worst_direction() -> None:
    # Over the diagonal: the root sum of squares of the stresses of both axes, L / (b h^2 / 6) and L / (h b^2 / 6).
    base = Plane(LEVEL.normal, 6.0)
    assert _stress(_beam(4.0, 6.0, 31.0), base) == pytest.approx(30.0 * np.hypot(6.0 / (4.0 * 36.0), 6.0 / (6.0 * 16.0)))


def test_a_pipe_has_the_section_modulus_of_a_pipe() -> None:
    pipe = m3.Manifold.cylinder(50.0, 6.0, 6.0, 720) - m3.Manifold.cylinder(50.0, 4.0, 4.0, 720)
    assert _stress(pipe) == pytest.approx(45.0 / (np.pi / 4.0 * (6.0**4 - 4.0**4) / 6.0), rel=1e-3)


def test_the_weaker_of_two_pieces_counts_in_any_rotation() -> None:
    two = _beam(4.0, 6.0, 31.0) + m3.Manifold.cube((2.0, 2.0, 20.0), True).translate((10.0, 5.0, 6.0))
    thin = 10.0 * np.hypot(6.0 / 8.0, 6.0 / 8.0)
    assert _stress(two, Plane(LEVEL.normal, 6.0)) == pytest.approx(thin)
    turn = np.radians(40.0)
    leaning = Plane(np.array([0.0, -np.sin(turn), np.cos(turn)]), 6.0)
    assert _stress(two.rotate((40.0, 0.0, 0.0)), leaning) == pytest.approx(thin)


def test_an_arch_is_one_piece_on_two_feet() -> None:
    legs = [m3.Manifold.cube((4.0, 4.0, 24.0), True).translate((x, 0.0, 12.0)) for x in (-10.0, 10.0)]
    arch = legs[0] + legs[1] + m3.Manifold.cube((24.0, 4.0, 4.0), True).translate((0.0, 0.0, 22.0))
    assert _stress(arch) < _stress(legs[0]) * 24.0 / 19.0 / 1.5


def test_a_fragment_may_have_any_base() -> None:
    assert _stress(m3.Manifold.cube((1.0, 1.0, 6.9))) == 0.0


def _box(size_mm: float, x: float, y: float, z: float) -> Solid:
    """A cube about a point."""
    return m3.Manifold.cube((size_mm,) * 3, True).translate((x, y, z))


def _corner_stress(lever_mm: float, width_mm: float, xx: float, yy: float) -> float:
    """Stress at the corner of a square section of that width about its centroid, in its principal axes."""
    return lever_mm * float(np.hypot(0.5 * width_mm / xx, 0.5 * width_mm / yy))


def test_a_closed_void_is_missing_from_the_section_around_it() -> None:
    hollow = solid_of(shapes.hollow())  # 20 mm, the void from 5 to 15 mm
    inertia = (20.0**4 - 10.0**4) / 12.0
    assert _stress(hollow, Plane(LEVEL.normal, 9.0)) == pytest.approx(_corner_stress(11.0, 20.0, inertia, inertia))
    whole = 20.0**4 / 12.0
    assert _stress(hollow, Plane(LEVEL.normal, 3.0)) == pytest.approx(_corner_stress(17.0, 20.0, whole, whole))
    assert _stress(hollow, Plane(LEVEL.normal, 16.0)) == pytest.approx(_corner_stress(4.0, 20.0, whole, whole))


def test_an_eccentric_void_moves_the_centroid() -> None:
    pierced = _box(20.0, 0.0, 0.0, 10.0) - _box(8.0, 4.0, 0.0, 10.0)
    shift = -64.0 * 4.0 / (400.0 - 64.0)  # of the centroid along x
    xx = 20.0**4 / 12.0 + 400.0 * shift**2 - 8.0**4 / 12.0 - 64.0 * (4.0 - shift) ** 2
    yy = (20.0**4 - 8.0**4) / 12.0
    expected = 10.0 * np.hypot((10.0 - shift) / xx, 10.0 / yy)
    assert _stress(pierced, Plane(LEVEL.normal, 10.0)) == pytest.approx(expected)


def test_a_hole_from_below_is_missing_from_the_section() -> None:
    drilled = _box(20.0, 0.0, 0.0, 10.0) - _box(10.0, 0.0, 0.0, 5.0)
    inertia = (20.0**4 - 10.0**4) / 12.0
    assert _stress(drilled) == pytest.approx(_corner_stress(15.0, 20.0, inertia, inertia))


def test_a_void_belongs_to_the_piece_around_it_and_what_is_loose_inside_hangs_on_nothing() -> None:
    """Nested boxes about one centre: solid, void, a second solid, its void."""
    outer, inner = _box(40.0, 0, 0, 20) - _box(30.0, 0, 0, 20), _box(20.0, 0, 0, 20) - _box(10.0, 0, 0, 20)
    both = m3.Manifold.compose([outer, inner])
    tube = (20.0**4 - 10.0**4) / 12.0
    assert _stress(both, Plane(LEVEL.normal, 20.0)) == pytest.approx(_corner_stress(10.0, 20.0, tube, tube))
    assert _stress(both, Plane(LEVEL.normal, 7.0)) == np.inf


@settings(max_examples=30, deadline=None)
@given(st.integers(0, 10_000), st.integers(1, 999), st.integers(1, 999), st.floats(0.1, 0.9))
def test_random_solids_are_stressed_as_their_exact_pieces(seed: int, height: int, around: int, share: float) -> None:
    mesh, normal = random_solid(seed), random_direction(height, around)
    low, high = (mesh.vertices @ normal).min(), (mesh.vertices @ normal).max()
    plane = Plane(normal, float(low + share * (high - low)))
    assert stress_per_newton(mesh, plane, 2.0) == pytest.approx(_greatest_stress(mesh, plane, 2.0), rel=1e-4)


def _greatest_stress(mesh: Mesh, plane: Plane, fragment_mm: float) -> float:
    """The greatest stress of all pieces: each cut off exactly, its base's moments summed by faces, pushed in 720 directions."""
    pieces = [mesh_of(piece) for piece in above(solid_of(mesh), plane).decompose() if piece.volume() > 0.0]
    tops = [float(plane.heights_mm(piece.vertices).max()) for piece in pieces]
    return max(
        (top * _base_stress(piece, plane) for piece, top in zip(pieces, tops, strict=True) if top >= fragment_mm), default=0.0
    )


def _base_stress(piece: Mesh, plane: Plane) -> float:
    side = np.linalg.svd(plane.normal[None])[2][1:]
    base = np.abs(plane.heights_mm(piece.vertices)[piece.faces]).max(axis=1) < 1e-7
    corners, areas = piece.vertices[piece.faces[base]] @ side.T, piece.areas_mm2[base]
    corners = corners - (areas[:, None] * corners.mean(axis=1)).sum(axis=0) / areas.sum()
    middles = 0.5 * (corners + np.roll(corners, 1, axis=1))  # their mean is exact for quadratic functions
    moments: Floats = np.einsum("f,fki,fkj->ij", areas / 3.0, middles, middles)
    turns = np.pi * np.arange(720) / 720
    pushes = np.linalg.solve(moments, np.stack([np.cos(turns), np.sin(turns)]))
    return float(np.abs(corners.reshape(-1, 2) @ pushes).max())
