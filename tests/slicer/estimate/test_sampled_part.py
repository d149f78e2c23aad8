"""Which layers stand for all."""

import manifold3d as m3
import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from slicer.estimate.sampled_part import choose_layers
from slicer.heights import layer_heights
from tests.mdp.solids import random_solid
from tests.shapes import box, standing
from tests.slicer.hand import profile

PROFILE = profile()


def test_the_chosen_layers_stand_for_every_layer_once() -> None:
    mesh = box(20, 20, 60)
    choice = choose_layers(mesh, layer_heights(mesh, PROFILE, True), PROFILE.process, 1)
    assert choice.counts.sum() == 300
    assert (choice.layers[0], choice.counts[0]) == (0, 1)
    assert (np.diff(choice.layers) > 0).all()
    assert len(choice.layers) <= 26


def test_a_low_part_is_looked_at_layer_by_layer() -> None:
    mesh = box(20, 20, 1)
    choice = choose_layers(mesh, layer_heights(mesh, PROFILE, True), PROFILE.process, 1)
    assert choice.layers.tolist() == [0, 1, 2, 3, 4]


def test_a_level_surface_half_way_up_is_looked_at_more_closely() -> None:
    mesh = standing(m3.Manifold.cube((30, 30, 30)) + m3.Manifold.cube((10, 10, 60)))
    choice = choose_layers(mesh, layer_heights(mesh, PROFILE, True), PROFILE.process, 1)
    ledge = choice.counts[(choice.layers > 144) & (choice.layers < 150)]
    assert ledge.max() < choice.counts.max()


@settings(max_examples=30)
@given(st.integers(0, 50), st.integers(1, 12), st.integers(2, 40))
def test_every_layer_is_stood_for_by_one_of_its_own_run_and_the_lowest_by_their_own(
    seed: int, special: int, samples: int
) -> None:
    mesh = random_solid(seed)
    heights = layer_heights(mesh, PROFILE, True)
    choice = choose_layers(mesh, heights, PROFILE.process, special, samples)
    ends = np.cumsum(choice.counts)
    begins = ends - choice.counts
    assert ends[-1] == len(heights.tip_mm)
    assert (choice.counts > 0).all()
    assert ((begins <= choice.layers) & (choice.layers < ends)).all()
    assert np.abs(choice.layers - 0.5 * (begins + ends - 1)).max() <= 0.5
    assert {1, min(special, len(heights.tip_mm))} <= set(ends.tolist())
    assert len(choice.layers) <= samples + 2
