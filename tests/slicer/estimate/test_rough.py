"""What layers take roughly, and which of them stand for all."""

import manifold3d as m3
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from slicer.bead import spacing_mm
from slicer.estimate.rough import choose_layers, rough_lengths_mm
from slicer.sectioning import section_part
from tests.shapes import box, standing
from tests.slicer.hand import profile, whole

PROFILE = profile()
SPACING = spacing_mm(0.45, 0.2)


def test_a_box_is_walls_around_skin_at_its_ends_and_infill_between() -> None:
    mesh = box(30, 30, 20)
    walls, skin, sparse = rough_lengths_mm(section_part(whole(mesh), PROFILE)).T
    inside = 900.0 - 3.0 * SPACING * 120.0
    assert walls == pytest.approx(np.full(100, 360.0))
    solid = np.isin(np.arange(100), [0, 1, 2, 3, 96, 97, 98, 99])
    assert skin == pytest.approx(np.where(solid, inside / SPACING, 0.0))
    assert sparse == pytest.approx(np.where(solid, 0.0, 0.2 * inside / SPACING))


def test_a_ledge_half_way_up_has_skin_below_it() -> None:
    mesh = standing(m3.Manifold.cube((40, 40, 10)) + m3.Manifold.cube((20, 20, 20)))
    _, skin, _ = rough_lengths_mm(section_part(whole(mesh), PROFILE)).T
    assert np.flatnonzero(skin > 0.0).tolist() == [0, 1, 2, 3, 46, 47, 48, 49, 96, 97, 98, 99]


@settings(max_examples=50)
@given(st.integers(0, 10**6), st.integers(1, 300), st.integers(1, 40))
def test_every_layer_is_stood_for_by_one_of_its_own_run(seed: int, count: int, samples: int) -> None:
    weight = np.random.default_rng(seed).uniform(0.01, 5.0, count)
    layers, begins = choose_layers(weight, samples)
    ends = np.append(begins[1:], count)
    assert begins[0] == 0
    assert ((begins <= layers) & (layers < ends)).all()
    assert layers[0] == 0
    assert len(layers) <= samples + 1


def test_layers_of_more_weight_are_sampled_more_densely() -> None:
    weight = np.where(np.arange(100) < 50, 9.0, 1.0)
    layers, _ = choose_layers(weight, 10)
    assert (layers[1:] < 50).sum() == 9
