"""The last layer ends at the top of the part, at any height."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from profiles.errors import SliceError
from profiles.process import Process
from profiles.profile import load
from slicer.heights import equal_heights, interface_height_mm, layer_heights
from tests.shapes import box

PROCESS = Process(name="test", first_layer_height_mm=0.3)


def test_part_one_begins_with_the_first_layer_height() -> None:
    assert equal_heights(1.1, PROCESS, 0.4, 0.3).tip_mm == pytest.approx([0.3, 0.5, 0.7, 0.9, 1.1])


def test_a_part_on_plastic_begins_with_a_bead_as_high_as_the_room_under_its_tip() -> None:
    at = equal_heights(1.0, PROCESS, 0.4, interface_height_mm(PROCESS))
    assert at.tip_mm == pytest.approx([0.1, 0.3, 0.5, 0.7, 0.9, 1.0])
    assert at.height_mm == pytest.approx([0.1, 0.2, 0.2, 0.2, 0.2, 0.1])
    assert at.cut_mm == pytest.approx([0.05, 0.2, 0.4, 0.6, 0.8, 0.95])


def test_a_thin_remainder_stretches_the_last_layer() -> None:
    assert equal_heights(0.74, PROCESS, 0.4, 0.3).height_mm == pytest.approx([0.3, 0.2, 0.24])


def test_a_remainder_that_would_make_a_layer_too_high_is_shared() -> None:
    process = Process(name="test", layer_height_mm=0.4, first_layer_height_mm=0.4)
    assert equal_heights(0.88, process, 0.4, 0.4).height_mm == pytest.approx([0.4, 0.24, 0.24])


def test_a_part_lower_than_one_layer_is_one_layer() -> None:
    assert equal_heights(0.12, PROCESS, 0.4, 0.3).height_mm == pytest.approx([0.12])


def test_a_part_too_high_to_be_meant_is_refused() -> None:
    with pytest.raises(SliceError, match=r"needs 100000 layers of process.layer_height_mm 0\.2 mm: at most 50000"):
        equal_heights(20000.0, PROCESS, 0.4, 0.3)


def test_a_remainder_thinner_than_the_least_layer_is_shared_by_the_last_ones() -> None:
    assert equal_heights(0.955, PROCESS, 0.4, 0.3).height_mm == pytest.approx([0.3, 0.2, 0.2, 0.1275, 0.1275])
    fine = Process(name="test", layer_height_mm=0.1, first_layer_height_mm=0.2)
    assert equal_heights(0.545, fine, 0.4, 0.2).height_mm == pytest.approx([0.2, 0.1, 0.1225, 0.1225])


def test_a_slab_thinner_than_the_least_layer_is_one_such_layer() -> None:
    assert equal_heights(0.03, PROCESS, 0.4, 0.3).height_mm == pytest.approx([0.08])


def test_no_layer_is_stretched_beyond_the_nozzle() -> None:
    process = Process(name="test", layer_height_mm=0.24, first_layer_height_mm=0.24)
    assert equal_heights(0.75, process, 0.25, 0.24).height_mm == pytest.approx([0.24, 0.24, 0.135, 0.135])


@given(st.floats(0.15, 30.0), st.floats(0.05, 0.3), st.floats(0.05, 0.3), st.floats(0.02, 0.15), st.floats(0, 0.9), st.booleans())
def test_the_top_is_met_and_no_layer_is_too_high_or_too_thin(
    top: float, layer: float, first: float, least: float, overlap: float, on_plate: bool
) -> None:
    process = Process(
        name="test",
        layer_height_mm=layer,
        first_layer_height_mm=first,
        least_layer_height_mm=least,
        interface_overlap=overlap,
    )
    at = equal_heights(top, process, 0.3, first if on_plate else interface_height_mm(process))
    assert at.tip_mm[-1] == pytest.approx(top)
    assert at.height_mm.min() >= min(least, layer, first) - 1e-9
    assert at.height_mm.max() <= 0.3 + 1e-9
    assert at.bottom_mm[0] == pytest.approx(0.0, abs=1e-9)
    assert np.diff(at.tip_mm) == pytest.approx(at.height_mm[1:])
    assert (at.cut_mm > 0).all()
    assert (at.cut_mm < top).all()


@given(st.floats(0.3, 9.0), st.floats(0.08, 9.0), st.floats(0, 1))
def test_neither_a_pedestal_nor_the_model_on_it_has_a_too_thin_layer(pedestal: float, model: float, gap: float) -> None:
    profile = load(settings=[f"process.pedestal_gap_mm={gap!r}"])
    at = layer_heights(box(9, 9, pedestal + model), profile, True, pedestal)
    assert at.height_mm.min() >= 0.08 - 1e-9
    assert at.height_mm.max() <= 0.4 + 1e-9
    assert at.tip_mm[-1] == pytest.approx(pedestal + model, abs=1e-6)


@given(
    st.lists(st.floats(0.5, 29.0), max_size=4, unique=True),
    st.sampled_from([0.1, 0.2, 0.3]),
    st.sampled_from([0.0, 0.05]),
    st.booleans(),
)
def test_a_layer_ends_in_every_plane_from_which_a_limb_is_printed(
    planes_mm: list[float], layer_mm: float, cusp_mm: float, on_plate: bool
) -> None:
    settings = [f"process.layer_height_mm={layer_mm}", "process.first_layer_height_mm=0.3", f"process.adaptive_cusp_mm={cusp_mm}"]
    profile = load(settings=settings)
    least, apart = profile.process.least_layer_height_mm, list[float]()
    for z in sorted(planes_mm):
        apart += [z] if not apart or z - apart[-1] >= least else []
    heights = layer_heights(box(9, 9, 30), profile, on_plate, limb_planes_mm=apart)
    for z in [*apart, 30.0]:
        assert np.abs(heights.tip_mm - z).min() < 1e-9
    assert heights.bottom_mm[1:] == pytest.approx(heights.tip_mm[:-1])
    assert heights.height_mm.min() >= 0.99 * min(least, heights.height_mm[0])
