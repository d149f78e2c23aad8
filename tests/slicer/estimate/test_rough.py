"""Rough durations of layers, and the layers that represent all others."""

from itertools import pairwise

import manifold3d as m3
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from slicer.bead import spacing_mm
from slicer.estimate.estimate import choose_layers, rough_lengths_mm, support_lengths_mm
from slicer.overhangs import find_overhangs
from slicer.sectioning import section_part
from slicer.support.support import own_supports
from tests.shapes import box, standing, tee
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


def test_a_step_halfway_up_has_skin_below_it() -> None:
    mesh = standing(m3.Manifold.cube((40, 40, 10)) + m3.Manifold.cube((20, 20, 20)))
    _, skin, _ = rough_lengths_mm(section_part(whole(mesh), PROFILE)).T
    assert np.flatnonzero(skin > 0.0).tolist() == [0, 1, 2, 3, 46, 47, 48, 49, 96, 97, 98, 99]


@settings(max_examples=50)
@given(st.integers(0, 10**6), st.integers(1, 300), st.integers(1, 40))
def test_every_run_of_layers_has_its_own_samples(seed: int, count: int, samples: int) -> None:
    weight = np.random.default_rng(seed).uniform(0.01, 5.0, count)
    layers, begins = choose_layers(weight, samples)
    of_runs = [layers[(begin <= layers) & (layers < end)] for begin, end in pairwise([*begins.tolist(), count])]
    assert np.concatenate(of_runs).tolist() == layers.tolist()
    assert of_runs[0].tolist() == [0]
    assert all(1 <= len(own) <= 2 for own in of_runs)
    assert len(of_runs) <= samples + 1


def test_layers_of_more_weight_are_sampled_more_densely() -> None:
    weight = np.where(np.arange(100) < 50, 9.0, 1.0)
    layers, _ = choose_layers(weight, 10)
    assert (layers[1:] < 50).mean() == pytest.approx(0.9, abs=0.05)


def test_a_layer_much_heavier_than_its_neighbours_represents_only_itself() -> None:
    layers, begins = choose_layers(np.where(np.arange(100) == 50, 40.0, 1.0), 10)
    assert 50 in layers
    assert {50, 51} <= set(begins.tolist())


def test_alternating_layers_are_sampled_equally_often() -> None:
    layers, _ = choose_layers(np.ones(200), 10)
    assert (layers[1:] % 2).mean() == 0.5


@pytest.mark.parametrize(("raft_layers", "lowest"), [(0, 0), (3, 1)], ids=["on the plate", "on a raft"])
def test_support_next_to_the_first_layer_is_counted_with_any_raft(raft_layers: int, lowest: int) -> None:
    sections = section_part(whole(tee()), profile(f"process.raft_layers={raft_layers}"))
    lengths_mm = support_lengths_mm(own_supports(sections, find_overhangs(sections))).sum(axis=1)
    assert np.flatnonzero(lengths_mm)[0] == lowest
