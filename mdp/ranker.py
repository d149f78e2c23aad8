"""Ranker: which b of B candidate cuts the beam follows."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from mdp.mesh import Floats, Ints


@dataclass(frozen=True)
class Ranker:
    """pool(b) is how many candidates B it wants to choose from; order(rows) ranks their (B, 6) features M1..M6, best first."""

    pool: Callable[[int], int]
    order: Callable[[Floats], Ints]


def _as_they_come(rows: Floats) -> Ints:
    return np.arange(len(rows), dtype=np.int32)


def _just_enough(beam_width: int) -> int:
    return 2 * beam_width + 4  # some turn out to be twins


BY_REDUCTION = Ranker(_just_enough, _as_they_come)

RANKERS: dict[str, Ranker] = {"classic": BY_REDUCTION}
