import manifold3d as m3
import numpy as np
import pytest

from mdp.candidates import Reason, bounds, check
from mdp.mesh import Mesh
from mdp.sweep import Remainder, sweep
from profiles.profile import load
from tests import shapes

UP, SIDE = np.array([0.0, 0.0, 1.0]), np.array([1.0, 0.0, 0.0])


def _remainder(mesh: Mesh) -> Remainder:
    return Remainder(mesh, np.zeros(len(mesh.faces), bool))


def _thin(mesh: Mesh, direction: np.ndarray, thickness_mm: float = 1.0) -> dict[float, float]:
    """Distance to the nearest thin region by offset."""
    swept = sweep(_remainder(mesh), direction[None], 1.0, thin_mm=thickness_mm)
    return {float(swept.first[0] + k): float(swept.thin_mm[0, k]) for k in range(swept.count[0])}


def _on_block(*pieces: m3.Manifold) -> Mesh:
    """A block of 30 x 20 x 10 mm with things on it."""
    return shapes.standing(sum(pieces, m3.Manifold.cube((30, 20, 10), True).translate((0, 0, 5))))


def test_a_plane_through_a_fin_is_at_no_distance_and_one_in_the_block_as_far_as_the_fin() -> None:
    fin = m3.Manifold.cube((20, 0.8, 15), True).translate((0, 0, 17.4))
    thin = _thin(_on_block(fin), UP)
    assert (thin[12.0], thin[20.0], thin[4.0]) == pytest.approx((0.0, 0.0, 6.0), abs=0.11)


def test_a_plane_across_a_thin_bridge_is_at_no_distance_and_one_beside_it_as_far_as_its_end() -> None:
    posts = [m3.Manifold.cube((8, 8, 20), True).translate((x, 0, 18)) for x in (-11, 11)]
    bridge = m3.Manifold.cube((22, 0.9, 0.9), True).translate((0, 0, 25))
    thin = _thin(_on_block(*posts, bridge), SIDE)
    assert (thin[0.0], thin[5.0], thin[10.0]) == pytest.approx((0.0, 0.0, 3.0), abs=0.01)


def test_a_thin_plate_is_thin_from_both_sides_and_only_below_the_asked_thickness() -> None:
    plate = _on_block(m3.Manifold.cube((50, 40, 0.8), True).translate((0, 0, 10.4)))
    assert _thin(plate, UP)[7.0] == pytest.approx(3.0, abs=0.01)
    assert _thin(plate, UP, 0.7)[7.0] == np.inf


def test_an_acute_edge_is_no_thin_wall() -> None:
    wedge = m3.Manifold.extrude(m3.CrossSection([[(0, 0), (20, 0), (0, 20)]]), 20).rotate((90, 0, 0))
    assert min(_thin(shapes.standing(wedge), UP).values()) == np.inf


def test_only_a_sliver_forbids_a_plane_a_cut_across_a_fin_is_told() -> None:
    profile = load(
        settings=["search.clearance=false", "search.least_interface_mm2=0", "search.least_volume_share=0", "search.fragile_mm=1"]
    )
    mesh = _on_block(m3.Manifold.cube((20, 0.8, 15), True).translate((0, 0, 17.4)))
    limits = bounds(mesh, profile.machine, profile.search, UP[None])
    checked = check(_remainder(mesh), limits, profile.search, np.zeros(3, np.int32), np.array([9.0, 18.0, 24.0]), thin=True)
    assert checked.reason.tolist() == [Reason.FEASIBLE, Reason.FEASIBLE, Reason.FRAGILE]
    assert checked.thin_mm == pytest.approx([1.0, 0.0, 0.0], abs=0.11)
