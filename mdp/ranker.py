"""Ranker: which b of B candidate cuts the beam follows."""

from collections.abc import Callable

import numpy as np

from mdp.mesh import Floats, Ints

Ranker = Callable[[Floats], Ints]


def by_reduction(rows: Floats) -> Ints:
    """Order of the (n, 6) feature rows M1..M6, best first: they come in the classic order already."""
    return np.arange(len(rows), dtype=np.int32)


RANKERS: dict[str, Ranker] = {"classic": by_reduction}
