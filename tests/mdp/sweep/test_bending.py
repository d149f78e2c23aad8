"""Bending: stress at the base of what lies above a plane against textbook sections."""

import manifold3d as m3
import numpy as np
import pytest

from mdp.cut import Solid, mesh_of
from mdp.plane import Plane
from mdp.sweep.bending import stress_per_newton

LEVEL = Plane(np.array([0.0, 0.0, 1.0]), 5.0)


def _stress(solid: Solid, plane: Plane = LEVEL) -> float:
    return stress_per_newton(mesh_of(solid), plane, 2.0)


def _beam(width_mm: float, depth_mm: float, length_mm: float) -> Solid:
    """On a block whose top is at 5 mm."""
    return m3.Manifold.cube((40.0, 40.0, 5.0), True).translate((0.0, 0.0, 2.5)) + m3.Manifold.cube(
        (width_mm, depth_mm, 2.0 * length_mm), True
    ).translate((0.0, 0.0, 5.0))


def test_a_beam_is_pushed_in_its_worst_direction() -> None:
    # Over the diagonal: the stresses of both axes, L / (b h^2 / 6) and L / (h b^2 / 6), as the sides of a right angle.
    base = Plane(LEVEL.normal, 6.0)
    assert _stress(_beam(4.0, 6.0, 31.0), base) == pytest.approx(30.0 * np.hypot(6.0 / (4.0 * 36.0), 6.0 / (6.0 * 16.0)))


def test_a_pipe_has_the_section_modulus_of_a_pipe() -> None:
    pipe = m3.Manifold.cylinder(50.0, 6.0, 6.0, 720) - m3.Manifold.cylinder(50.0, 4.0, 4.0, 720)
    assert _stress(pipe) == pytest.approx(45.0 / (np.pi / 4.0 * (6.0**4 - 4.0**4) / 6.0), rel=1e-3)


def test_of_two_pieces_the_weaker_counts_and_turning_changes_nothing() -> None:
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


def test_a_crumb_may_stand_on_anything() -> None:
    assert _stress(m3.Manifold.cube((1.0, 1.0, 6.9))) == 0.0
