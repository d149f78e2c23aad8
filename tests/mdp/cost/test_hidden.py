"""Hidden seam positions: creases, necks and pits are hidden, flat and convex surfaces are not, in any triangulation."""

import manifold3d as m3
import numpy as np
import pytest

from mdp.cost.hidden import hidden_shares
from mdp.cut import Solid, mesh_of
from mdp.mesh import Floats, Mesh
from tests import shapes


def _hourglass(segments: int) -> Solid:
    """A solid of revolution, 10 mm wide at both ends and 5 mm at the neck at z = 0."""
    heights = np.linspace(-15.0, 15.0, segments)
    outline = [(0.0, -15.0), *((7.5 - 2.5 * np.cos(z * np.pi / 15.0), z) for z in heights), (0.0, 15.0)]
    return m3.CrossSection([np.array(outline)]).revolve(2 * segments)


def _between(mesh: Mesh, low_mm: float, high_mm: float) -> Floats:
    """The shares of the faces that lie wholly between two heights."""
    z = mesh.vertices[mesh.faces, 2]
    return hidden_shares(mesh)[(z.min(axis=1) > low_mm) & (z.max(axis=1) < high_mm)]


def test_no_face_of_a_box_or_ball_is_hidden() -> None:
    for mesh in (shapes.box(), mesh_of(m3.Manifold.sphere(10.0, 64))):
        assert hidden_shares(mesh).max() == pytest.approx(0.0, abs=1e-9)


@pytest.mark.parametrize("segments", [40, 100])
def test_a_neck_is_hidden_however_fine_its_mesh_is(segments: int) -> None:
    hourglass = mesh_of(_hourglass(segments))
    assert _between(hourglass, -1.5, 1.5).mean() > _between(hourglass, 8.0, 14.9).mean() + 0.2


def test_the_inside_of_a_deep_cup_is_out_of_sight() -> None:
    cup = m3.Manifold.cylinder(40.0, 10.0, 10.0, 48) - m3.Manifold.cylinder(40.0, 8.0, 8.0, 48).translate((0.0, 0.0, 4.0))
    mesh = mesh_of(cup)
    inside = np.linalg.norm(mesh.vertices[mesh.faces].mean(axis=1)[:, :2], axis=1) < 8.1
    shares = hidden_shares(mesh)
    walls = np.abs(mesh.normals[:, 2]) < 0.1
    assert shares[inside & walls].min() > 0.4
    assert shares[~inside & walls].max() == pytest.approx(0.0, abs=1e-9)


def test_noise_on_a_flat_surface_hides_nothing() -> None:
    plate = m3.Manifold.cube((40.0, 40.0, 4.0), True).refine(40)
    rough = plate.warp_batch(lambda points: points + np.random.default_rng(0).normal(0.0, 0.02, points.shape))
    assert hidden_shares(mesh_of(rough)).mean() < 0.05
