"""Components connected over edges."""

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from mdp.topology.components import connected_components


@given(st.lists(st.tuples(st.integers(0, 19), st.integers(0, 19)), max_size=30))
def test_components_agree_with_a_walk_along_the_edges(pairs: list[tuple[int, int]]) -> None:
    reach = np.eye(20, dtype=bool)
    for a, b in pairs:
        reach[a, b] = reach[b, a] = True
    reach = np.linalg.matrix_power(reach.astype(float), 20) > 0
    a, b = (np.array([pair[k] for pair in pairs], dtype=np.int64) for k in (0, 1))
    assert connected_components(20, a, b).tolist() == reach.argmax(axis=1).tolist()
