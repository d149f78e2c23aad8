"""Which layers stand for all."""

import manifold3d as m3
import numpy as np

from slicer.estimate.choice import choose_layers
from slicer.heights import layer_heights
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
