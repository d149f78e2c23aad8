"""Layers meet the top, whatever the part's height."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from profiles.errors import SliceError
from profiles.process import Process
from slicer.heights import equal_heights

PROCESS = Process(name="test", first_layer_height_mm=0.3)


def test_part_one_begins_with_the_first_layer_height() -> None:
    assert equal_heights(1.1, PROCESS, True).tip_mm == pytest.approx([0.3, 0.5, 0.7, 0.9, 1.1])


def test_a_part_on_plastic_begins_pressed_in_by_the_overlap() -> None:
    at = equal_heights(1.0, PROCESS, False)
    assert at.tip_mm == pytest.approx([0.1, 0.3, 0.5, 0.7, 0.9, 1.0])
    assert at.height_mm == pytest.approx([0.2, 0.2, 0.2, 0.2, 0.2, 0.1])
    assert at.cut_mm == pytest.approx([0.05, 0.2, 0.4, 0.6, 0.8, 0.95])


def test_a_thin_remainder_stretches_the_last_layer() -> None:
    assert equal_heights(0.74, PROCESS, True).height_mm == pytest.approx([0.3, 0.2, 0.24])


def test_a_remainder_that_would_make_a_layer_too_high_is_shared() -> None:
    process = Process(name="test", layer_height_mm=0.4, first_layer_height_mm=0.4)
    assert equal_heights(0.88, process, True).height_mm == pytest.approx([0.4, 0.24, 0.24])


def test_a_part_lower_than_one_layer_is_one_layer() -> None:
    assert equal_heights(0.12, PROCESS, True).height_mm == pytest.approx([0.12])


def test_a_part_too_high_to_be_meant_is_refused() -> None:
    with pytest.raises(SliceError, match=r"needs 100000 layers of process.layer_height_mm 0\.2 mm: at most 50000"):
        equal_heights(20000.0, PROCESS, True)


@given(st.floats(0.1, 30.0), st.floats(0.05, 0.4), st.booleans())
def test_the_top_is_met_and_no_layer_is_too_high_or_too_thin(top: float, layer: float, on_platform: bool) -> None:
    process = Process(name="test", layer_height_mm=layer, first_layer_height_mm=0.3, interface_overlap=0.04 / layer)
    at = equal_heights(top, process, on_platform)
    assert at.tip_mm[-1] == pytest.approx(top)
    assert at.height_mm.max() <= 0.9 * 0.45 + 1e-9
    assert np.diff(at.tip_mm) == pytest.approx(at.height_mm[1:])
    assert (at.cut_mm > 0).all()
    assert (at.cut_mm < top).all()
