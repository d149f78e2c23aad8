"""A model on a pedestal: the pedestal is printed like a raft, with a gap, and the model as if on the build plate."""

from collections.abc import Sequence

import manifold3d as m3
import numpy as np
import pytest

from mdp.mesh import Mesh
from mdp.pedestal import on_pedestal
from slicer.paths import Kind, Layer
from slicer.slice import slice_part
from tests.shapes import ball, box, standing
from tests.slicer.hand import profile, volume_mm3, whole

UP = "search.pedestal_mm=5"
PROPS = {Kind.SUPPORT, Kind.SUPPORT_INTERFACE, Kind.SKIRT}


def lifted(mesh: Mesh, *settings: str) -> tuple[list[Layer], list[Layer]]:
    """Layers of the pedestal and of the model on it."""
    layers = slice_part(whole(on_pedestal(mesh, 5.0)), profile(UP, *settings)).layers
    return [lay for lay in layers if lay.z_mm < 5], [lay for lay in layers if lay.z_mm > 5]


def kinds(layers: Sequence[Layer]) -> set[Kind]:
    return {p.kind for lay in layers for p in lay.paths}


def test_the_pedestal_consists_of_support_and_the_model_has_none() -> None:
    pedestal, model = lifted(box())
    assert kinds(pedestal) == PROPS
    assert not kinds(model) & PROPS


def test_the_gap_is_between_roof_and_model() -> None:
    pedestal, model = lifted(box(), "process.pedestal_gap_mm=0.15")
    assert pedestal[-1].z_mm == pytest.approx(4.85)
    assert model[0].z_mm - model[0].height_mm == pytest.approx(5.0)
    assert model[-1].z_mm == pytest.approx(25.0)


def test_the_model_is_printed_as_on_the_build_plate() -> None:
    _, model = lifted(box())
    alone = slice_part(whole(box()), profile("process.skirt_loops=0", "process.elephant_foot_mm=0")).layers
    assert [lay.height_mm for lay in model] == pytest.approx([lay.height_mm for lay in alone])
    for ours, theirs in zip(model, alone, strict=True):
        plastic = [lay.volumes_mm3.sum() for lay in (ours, theirs)]
        assert plastic[0] == pytest.approx(plastic[1], rel=0.01)
        assert kinds([ours]) == kinds([theirs])


def test_the_pedestal_s_margin_is_no_part_of_the_model() -> None:
    _, model = lifted(box(10, 10, 10))
    assert max(np.abs(p.points).max() for lay in model for p in lay.paths) < 5


def test_the_roof_is_closed_and_the_inside_sparse() -> None:
    pedestal, _ = lifted(box())
    area = 24 * 24 - (4 - np.pi) * 4
    shares = [lay.volumes_mm3[~lay.is_of(Kind.SKIRT)].sum() / lay.height_mm / area for lay in pedestal]
    assert min(shares[0], *shares[-3:]) > 0.95
    assert max(shares[1:-3]) < 0.4
    assert {p.kind for p in pedestal[-1].paths} == {Kind.SUPPORT, Kind.SUPPORT_INTERFACE}


def test_a_ball_is_held_by_what_is_sunk_of_it() -> None:
    pedestal, model = lifted(ball())
    assert model[0].z_mm == pytest.approx(5.2)
    assert any(p.kind is Kind.OUTER_WALL for p in model[0].paths)
    assert pedestal[-1].z_mm == pytest.approx(4.9)


def test_support_beside_the_pedestal_is_on_the_build_plate() -> None:
    mushroom = m3.Manifold.cube((8, 8, 12), True) + m3.Manifold.cube((30, 30, 3), True).translate((0, 0, 7))
    pedestal, model = lifted(standing(mushroom))
    far = [np.abs(p.points).max() for lay in pedestal for p in lay.paths if p.kind is Kind.SUPPORT]
    assert max(far) > 12
    assert Kind.SUPPORT in kinds(model)


def test_a_box_without_a_pedestal_has_no_support() -> None:
    sliced = slice_part(whole(box(10, 10, 3)), profile())
    assert volume_mm3(sliced, Kind.SUPPORT, Kind.SUPPORT_INTERFACE) == 0
