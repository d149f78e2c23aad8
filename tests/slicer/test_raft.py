"""A raft: dense and wide where needed, under the whole print, and the model a gap above it unchanged."""

import manifold3d as m3
import numpy as np
import pytest

from mdp.mesh import Mesh
from slicer.bead import spacing_mm
from slicer.paths import Kind, Layer, SlicedPart
from slicer.raft import lift_mm
from slicer.slice import slice_part
from tests.shapes import box, standing
from tests.slicer.hand import BARE, cut, profile, whole

RAFT = "process.raft_layers=5"
PROPS = (Kind.SUPPORT, Kind.SUPPORT_INTERFACE)
SIDE = 40.0
BENCH = m3.Manifold.cube((8, 8, 12), True) + m3.Manifold.cube((30, 30, 3), True).translate((0, 0, 7))


def raft_of(mesh: Mesh, *settings: str) -> list[Layer]:
    """The layers below the model's base plane."""
    return [layer for layer in slice_part(whole(mesh), profile(RAFT, *settings)).layers if layer.z_mm < 0.0]


def model_of(sliced: SlicedPart) -> list[Layer]:
    """The layers with beads of the model."""
    return [layer for layer in sliced.layers if not layer.is_of(*PROPS, Kind.SKIRT).all()]


def square_mm2(beyond_mm: float) -> float:
    """Area of a square of SIDE, offset by beyond_mm with round corners."""
    return SIDE**2 + 4 * SIDE * beyond_mm + np.pi * beyond_mm**2


def filled_mm3(beyond_mm: float, density: float, height_mm: float) -> float:
    """Volume of a solid outline, lines of a density inside it, and one side's length of connections between the lines."""
    line_mm = spacing_mm(0.45, height_mm)
    outline_mm2 = (4 * SIDE + 2 * np.pi * beyond_mm) * line_mm
    inside_mm2 = density * (square_mm2(beyond_mm) - outline_mm2) + (SIDE + 2 * beyond_mm) * line_mm
    return (outline_mm2 + inside_mm2) * height_mm


def test_every_layer_holds_its_area_times_its_height_times_its_density() -> None:
    layers = raft_of(box(SIDE, SIDE, 4), *BARE, "process.raft_first_layer_density=0.8", "process.raft_expansion_mm=2")
    beyond_mm, densities, heights_mm = [5.0, 2.0, 2.0, 2.0, 2.0], [0.8, 0.15, 0.7, 0.7, 0.7], [0.2, 0.3, 0.3, 0.3, 0.3]
    expected = [filled_mm3(*row) for row in zip(beyond_mm, densities, heights_mm, strict=True)]
    assert [layer.height_mm for layer in layers] == pytest.approx(heights_mm)
    assert [float(layer.volumes_mm3.sum()) for layer in layers] == pytest.approx(expected, rel=0.04)
    kinds = [{path.kind for path in layer.paths} for layer in layers]
    assert kinds == [{Kind.SUPPORT}] * 2 + [set(PROPS)] * 3


def test_the_gap_and_the_raft_s_height_make_up_what_the_model_is_lifted_by() -> None:
    settings = (RAFT, "process.raft_contact_distance_mm=0.15")
    layers = raft_of(box(), *settings[1:])
    assert layers[-1].z_mm == pytest.approx(-0.15)
    assert lift_mm(profile(*settings)) == pytest.approx(0.2 + 4 * 0.3 + 0.15)
    assert layers[0].z_mm - layers[0].height_mm == pytest.approx(-lift_mm(profile(*settings)))
    assert lift_mm(profile()) == 0.0


@pytest.mark.parametrize("layers", [1, 2, 3, 4, 7])
def test_half_of_a_raft_above_its_first_layer_is_dense(layers: int) -> None:
    raft = raft_of(box(), f"process.raft_layers={layers}")
    dense = [bool(layer.is_of(Kind.SUPPORT_INTERFACE).any()) for layer in raft]
    assert len(raft) == layers
    assert dense == [k > 0 and k >= layers - (layers + 1) // 2 for k in range(layers)]


def test_above_its_first_layer_the_model_is_printed_as_on_the_plate() -> None:
    ours, plain = (
        slice_part(whole(box()), profile("process.skirt_loops=0", *more)) for more in ((RAFT,), ("process.elephant_foot_mm=0",))
    )
    lifted = model_of(ours)
    assert [layer.z_mm for layer in lifted] == [layer.z_mm for layer in plain.layers]
    for one, other in zip(lifted[1:], plain.layers[1:], strict=True):
        assert one.volumes_mm3.sum() == pytest.approx(other.volumes_mm3.sum(), rel=1e-3)
        assert {path.kind for path in one.paths} == {path.kind for path in other.paths}
    assert lifted[0].volumes_mm3.sum() == pytest.approx(plain.layers[0].volumes_mm3.sum(), rel=1e-2)


def test_the_first_layer_on_a_raft_is_neither_squeezed_nor_widened_nor_hotter() -> None:
    squeezed = (*BARE, "process.elephant_foot_mm=0.2", "process.first_layer_flow=1.2", "process.first_layer_line_width_mm=0.6")
    first = model_of(slice_part(whole(box(20, 20, 2)), profile(RAFT, *squeezed, "material.first_layer_nozzle_c=230")))[0]
    assert max(np.abs(path.points).max() for path in first.paths) == pytest.approx(10 - 0.225)
    assert first.nozzle_add_c == 0.0
    assert set(first.speed_mm_s.tolist()) == {30.0}
    plain = slice_part(whole(box(20, 20, 2)), profile(*BARE)).layers[0]
    assert first.volumes_mm3.sum() == pytest.approx(plain.volumes_mm3.sum(), rel=1e-3)


def test_the_first_layer_of_the_raft_is_on_the_plate() -> None:
    asked = ("process.first_layer_flow=1.1", "process.first_layer_speed_mm_s=13", "material.first_layer_nozzle_c=230")
    first, second = raft_of(box(), *asked)[:2]
    assert first.nozzle_add_c == 230.0 - profile().material.nozzle_c
    assert second.nozzle_add_c == 0.0
    assert set(first.speed_mm_s.tolist()) == {13.0}
    assert set(first.flow.tolist()) == {1.1}


def test_skirts_go_around_the_raft_and_brims_are_left_out() -> None:
    sliced = slice_part(whole(box(SIDE, SIDE, 2)), profile(RAFT, "process.brim_mm=8"))
    rings = [(k, path) for k, layer in enumerate(sliced.layers) for path in layer.paths if path.kind is Kind.SKIRT]
    assert [k for k, _ in rings] == [0]
    assert np.abs(rings[0][1].points).max() == pytest.approx(0.5 * SIDE + 1.5 + 3.0 + 4.0 + 0.225, abs=0.01)


def test_support_has_a_raft_too_and_fills_the_gap_to_it() -> None:
    sliced = slice_part(whole(standing(BENCH)), profile(RAFT, "process.skirt_loops=0"))
    raft = [layer for layer in sliced.layers if layer.z_mm < 0.0]
    reached = [float(np.abs(layer.points).max()) for layer in raft]
    under = next(layer for layer in sliced.layers if layer.z_mm > 0.0)
    assert under.is_of(*PROPS).all()
    assert under.z_mm - under.height_mm == pytest.approx(raft[-1].z_mm)
    foot = float(np.abs(under.points).max())
    assert min(reached) > foot + 1.0
    assert foot > 12.0
    lowest_of_model = next(layer for layer in model_of(sliced))
    assert not lowest_of_model.is_of(*PROPS).any()


def test_thick_first_layers_give_support_on_a_raft_several_layers_to_fill_the_gap() -> None:
    high = ("process.first_layer_height_mm=0.32", "process.layer_height_mm=0.3", "process.raft_contact_distance_mm=0.2")
    layers = slice_part(whole(standing(BENCH)), profile(RAFT, *high)).layers
    filling = [layer for layer in layers if -0.2 < layer.z_mm < 0.33 and layer.is_of(*PROPS).all()]
    assert [layer.height_mm for layer in filling] == pytest.approx([0.26, 0.26])
    assert [layer.z_mm for layer in filling] == pytest.approx([0.06, 0.32])


def test_overhangs_near_the_plate_have_raft_under_them() -> None:
    ledge = m3.Manifold.cube((10, 10, 4), True) + m3.Manifold.cube((10, 30, 3.8), True).translate((0, 0, 0.1))
    reached = max(float(np.abs(layer.points[:, 1]).max()) for layer in raft_of(standing(ledge), *BARE))
    assert reached == pytest.approx(15.0 + 1.5 + 3.0 - 0.225, abs=0.02)


def test_a_raft_ends_at_the_plate_s_edge() -> None:
    small = ("machine.table.size_mm=[26,26]", "process.skirt_loops=0")
    for layer in raft_of(box(24, 24, 2), *small):
        assert np.abs(layer.points).max() <= 13.0 - 0.225


def test_a_part_on_another_part_has_no_raft() -> None:
    base, top = cut(box(20, 20, 20), ((0, 0, 1), 10.0))
    above, plain = (slice_part(top, profile(*more), [base]) for more in ((RAFT,), ()))
    assert min(layer.z_mm for layer in above.layers) > 0.0
    assert above.volume_mm3 == pytest.approx(plain.volume_mm3, rel=1e-9)


def test_a_vase_may_be_printed_on_a_raft() -> None:
    sliced = slice_part(whole(box(20, 20, 6)), profile(RAFT, "process.spiral_vase=true"))
    assert sliced.layers[4].z_mm == pytest.approx(-0.1)
    assert sliced.layers[-1].z_mm == pytest.approx(6.0)
