"""Models that are hard to search: lattices, points to stand on, floating pieces, nothing to improve and nothing possible."""

import manifold3d as m3
import numpy as np
import pytest

from mdp.cut import mesh_of, solid_of
from mdp.decomposition import Decomposition
from mdp.mesh import Mesh
from mdp.read import floating_pieces
from mdp.search.search import decompose
from profiles.profile import load
from tests import shapes


def _decomposed(mesh: Mesh, *settings: str) -> Decomposition:
    words = ("directions=60", "most_parts=3", "seam_mm=0.8", *settings)
    return decompose(mesh, "hard", load(settings=[f"search.{word}" for word in words]))


def _lattice(cells: int) -> m3.Manifold:
    """Rods along the edges of cells**3 cubes of 5 mm."""
    places = [(5.0 * i, 5.0 * j) for i in range(cells + 1) for j in range(cells + 1)]
    layer = m3.Manifold.batch_boolean([_rod(cells).translate((x, y, 0)) for x, y in places], m3.OpType.Add)
    across = layer.rotate((0, 90, 0)).translate((0, 0, 5.0 * cells))
    along = layer.rotate((-90, 0, 0)).translate((0, 0, 5.0 * cells))
    return layer + across + along


def _rod(cells: int) -> m3.Manifold:
    return m3.Manifold.cube((2.0, 2.0, 5.0 * cells)).translate((-1.0, -1.0, 0.0))


def test_a_lattice_of_thousands_of_handles_is_cut_into_parts_that_hang_together() -> None:
    solid = _lattice(11)
    decomposition = _decomposed(
        shapes.standing(solid), "clearance=false", "objective=risky"
    )  # its struts are bridges that need no support
    assert solid.genus() > 3000
    assert len(decomposition.parts) == 3
    assert len(solid_of(decomposition.parts[0].mesh).decompose()) == 1
    assert sum(solid_of(part.mesh).volume() for part in decomposition.parts) == pytest.approx(solid.volume(), rel=1e-9)


@pytest.mark.parametrize("mesh", [shapes.standing(m3.Manifold.cylinder(20, 0, 10, 48)), shapes.octahedron(15.0)])
def test_a_steep_model_on_its_tip_needs_no_support_and_says_so(mesh: Mesh) -> None:
    decomposition = _decomposed(mesh, "clearance=false")
    assert len(decomposition.parts) == 1
    assert decomposition.notes == ("no face needs support: the model is printed as one part",)


def test_a_ball_on_a_point_is_cut_and_every_part_is_on_earlier_ones() -> None:
    decomposition = _decomposed(shapes.ball(), "clearance=false")
    assert len(decomposition.parts) == 3
    assert decomposition.reduction > 0.3
    assert decomposition.parts[0].mesh.bounds_mm[0, 2] == 0.0


@pytest.mark.parametrize("least_mm2", [0, 4])
def test_no_part_floats_if_a_piece_of_the_model_does(least_mm2: int) -> None:
    bits = m3.Manifold.cube((10, 10, 10), True).translate((25, 0, 30))
    mesh = mesh_of(m3.Manifold.cube((10, 10, 10), True).translate((0, 0, 5)) + bits)
    decomposition = _decomposed(mesh, "clearance=false", f"least_interface_mm2={least_mm2}")
    assert len(decomposition.parts) == 1
    assert decomposition.residual_area_mm2 == pytest.approx(100.0)
    assert decomposition.notes[0] == "no cut is possible: every plane was rejected"
    assert any("hang on too small an area" in why for why in decomposition.rejected)


def test_pieces_that_float_are_reported_and_voids_are_not() -> None:
    block = m3.Manifold.cube((10, 10, 10), True).translate((0, 0, 5))
    high, higher = (block.translate((20, 0, z)) for z in (12.5, 40))
    assert floating_pieces(mesh_of(block + high)) == (
        "1 piece floats 12.5 mm above the build plate in its file: only support can hold it, whatever is cut",
    )
    assert floating_pieces(mesh_of(block + high + higher))[0].startswith("2 pieces float at least 12.5 mm")
    assert floating_pieces(shapes.hollow()) == floating_pieces(mesh_of(block + block.translate((20, 0, 0)))) == ()


def test_a_model_without_a_feasible_cut_is_one_part_and_says_how_many_candidates_were_rejected_for_each_reason() -> None:
    decomposition = _decomposed(shapes.tee(height=12.0, arm=14.0), "least_volume_share=0.5")
    assert len(decomposition.parts) == 1
    reasons = [line.partition(" candidates: ") for line in decomposition.rejected]
    assert reasons
    assert all(int(count) > 0 and text for count, _, text in reasons)


def test_a_time_limit_that_ends_a_search_leaves_whole_parts() -> None:
    whole = _decomposed(shapes.branch(), "time_limit_s=0")
    assert (len(whole.parts), whole.reduction) == (1, 0.0)
    assert np.array_equal(np.sort(whole.parts[0].mesh.areas_mm2), np.sort(mesh_of(solid_of(shapes.branch())).areas_mm2))
