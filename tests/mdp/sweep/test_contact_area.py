import manifold3d as m3
import numpy as np
import pytest

from mdp.mesh import Floats, Mesh
from mdp.ranking.candidates import Reason, bounds_of, check, platform_disc
from mdp.sweep.sweep import Remainder, sweep
from profiles.profile import load
from tests import shapes

UP = np.array([[0.0, 0.0, 1.0]])


def _remainder(mesh: Mesh) -> Remainder:
    return Remainder(mesh, np.zeros(len(mesh.faces), bool))


def _contact_areas(mesh: Mesh, fragment_mm: float = 2.0) -> Floats:
    """By offset, 1 mm apart, the first at 1 mm."""
    areas: Floats = sweep(_remainder(mesh), UP, 1.0, fragment_mm=fragment_mm).contact_area_mm2[0]
    return areas


def _two_towers(side: float, height: float) -> Mesh:
    """A block of 10 mm with a tower of 10 x 10 x 20 mm on it and a second one beside it."""
    block, tower = m3.Manifold.cube((40, 20, 10), True).translate((0, 0, 5)), m3.Manifold.cube((10, 10, 20), True)
    second = m3.Manifold.cube((side, side, height), True).translate((12, 0, 10 + height / 2))
    return shapes.standing(block + tower.translate((-10, 0, 20)) + second)


def test_the_thinnest_tower_counts_and_not_the_sum_of_the_sections() -> None:
    assert _contact_areas(_two_towers(1.5, 15))[[4, 14, 26]] == pytest.approx([800.0, 1.5 * 1.5, 100.0])


def test_a_fragment_may_stand_on_little() -> None:
    mesh = _two_towers(1.5, 5.5)
    assert _contact_areas(mesh)[[11, 13]] == pytest.approx([2.25, 100.0])
    assert _contact_areas(mesh, 0.0)[13] == pytest.approx(2.25)


def test_a_piece_on_two_legs_stands_on_both() -> None:
    legs = m3.Manifold.cube((3, 3, 20)) + m3.Manifold.cube((3, 3, 20)).translate((20, 0, 0))
    table = shapes.standing(legs + m3.Manifold.cube((23, 3, 3)).translate((0, 0, 18)))
    assert _contact_areas(table)[9] == pytest.approx(18.0)


def test_a_closed_void_above_the_plane_is_no_piece() -> None:
    solid = m3.Manifold.cube((20, 20, 20), True) - m3.Manifold.cube((6, 6, 6), True)
    assert _contact_areas(shapes.standing(solid))[[1, 9]] == pytest.approx([400.0, 400.0 - 36.0])


def test_a_part_with_a_piece_on_a_thread_is_refused() -> None:
    profile = load(settings=["search.clearance=false", "search.least_volume_share=0"])
    for side, reason in ((1.5, Reason.INTERFACE), (2.5, Reason.FEASIBLE)):
        mesh = _two_towers(side, 15)
        limits = bounds_of(UP, mesh, profile, platform_disc(mesh, profile.search))
        checked = check(_remainder(mesh), limits, profile.search.offset_step_mm, np.zeros(1, np.int32), np.array([14.0]))
        assert (checked.reason[0], checked.contact_area_mm2[0]) == (reason, pytest.approx(side**2))
