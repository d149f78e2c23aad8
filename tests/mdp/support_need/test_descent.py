"""Floating starts: checked by a graph of the vertices below a layer's resolution, at any heights."""

from itertools import combinations

import networkx as nx
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numba import njit

from mdp.kernels.arrays import ints
from mdp.mesh import Floats, Ints
from mdp.support_need import descent
from mdp.support_need.descent import DIP_MM, UNSEEN
from mdp.topology.edges import LinkedFaces, link
from tests.mdp.solids import random_solid
from tests.shapes import box

NO_BASE = -np.inf


@njit
def begins_in_air(surface: LinkedFaces, heights: Floats, patch: Ints, base_mm: float) -> bool:
    pool = ints(len(heights), UNSEEN), ints(len(heights), 0)
    return descent.begins_in_air(surface, heights, patch, pool, base_mm)


def has_dip(surface: LinkedFaces, heights: Floats, patch: Ints, base_mm: float) -> bool:
    """Whether some vertex of a patch is the lowest of all vertices connected to it within DIP_MM, none of which rests."""
    whole = nx.Graph(edge for face in surface.faces.tolist() for edge in combinations(face, 2))
    for v in np.unique(surface.faces[patch]):
        low = [w for w in whole if heights[w] <= heights[v] + DIP_MM]
        around = nx.node_connected_component(whole.subgraph(low), v)
        rim = around | {w for u in around for w in whole[u]}
        if min(heights[w] for w in rim) >= heights[v] - 1e-6 and min(heights[w] for w in rim) > base_mm:
            return True
    return False


@settings(max_examples=30)
@given(st.integers(0, 20), st.integers(0, 10_000), st.integers(2, 40), st.sampled_from((NO_BASE, 0.025, 0.1)))
def test_a_place_begins_in_air_where_nothing_lower_is_reached_without_a_climb(
    shape: int, seed: int, steps: int, base_mm: float
) -> None:
    surface, rng = link(random_solid(shape)), np.random.default_rng(seed)
    heights = 0.02 * rng.integers(0, steps, surface.vertices.shape[1])
    patch = rng.choice(len(surface.faces), 12, replace=False).astype(np.int32)
    assert begins_in_air(surface, heights, patch, base_mm) == has_dip(surface, heights, patch, base_mm)


@pytest.mark.parametrize(("base_mm", "in_air"), [(NO_BASE, True), (0.0, False)])
def test_a_level_underside_begins_in_air_unless_it_rests_on_the_base(base_mm: float, in_air: bool) -> None:
    surface = link(box(4.0, 4.0, 4.0))
    under = np.flatnonzero(surface.normals[2] < -0.5).astype(np.int32)
    assert begins_in_air(surface, surface.vertices[2].copy(), under, base_mm) == in_air


def test_no_place_at_all_begins_nowhere() -> None:
    surface = link(box())
    assert not begins_in_air(surface, surface.vertices[2].copy(), np.zeros(0, np.int32), NO_BASE)
