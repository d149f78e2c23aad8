"""Labels of the 2020 paper: 5, 4, 3, 2, 1 for the five best candidates of a list, 0 for the rest, and features scaled by list.

The value of a candidate is the least final cost through it, stopping there included. The paper's lists are what the beam kept, so
candidates that were never cut are not among them.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from mdp.learning.lists import TrainingList
from mdp.mesh import Floats, Ints

BEST = 5  # so many candidates of a list are rated
SMALLEST_RANGE = 1e-8

Singles = NDArray[np.float32]


@dataclass(frozen=True, eq=False)
class RatedList:
    """The n candidates of a list that were cut: features (n, F) unscaled, named in `columns`, outcomes and ratings (n,)."""

    features: Singles
    columns: tuple[str, ...]
    outcome: Floats
    ratings: Ints
    model: str

    @property
    def teaches(self) -> bool:
        """False for a list that has but one rating, as a list of one candidate: nothing can be learnt from its order."""
        return len(np.unique(self.ratings)) > 1

    def table(self, columns: Sequence[str]) -> Singles:
        """(n, k) the named features."""
        return self.features[:, [self.columns.index(name) for name in columns]]


def ratings(outcome: Floats) -> Ints:
    """(n,) 5 for the least outcome down to 1 for the fifth, 0 for the rest; equal outcomes in the order they come."""
    rated = np.zeros(len(outcome), np.int32)
    best = np.argsort(outcome, kind="stable")[:BEST]
    rated[best] = BEST - np.arange(len(best))
    return rated


def rate(lists: Sequence[TrainingList], columns: Sequence[str]) -> list[RatedList]:
    """The lists with a candidate that was cut, rated; features: the named columns in single precision, as a ranker gets them."""
    rated = []
    for one in lists:
        cut = ~np.isnan(one.outcome)
        if cut.any():
            outcome = one.outcome[cut]
            features = one.table(columns)[cut].astype(np.float32)
            rated.append(RatedList(features, tuple(columns), outcome, ratings(outcome), one.model))
    return rated


def scale(features: Singles) -> Singles:
    """(n, F) every column from 0 to 1 over its list; a column that is the same everywhere becomes 0."""
    low, high = features.min(axis=0), features.max(axis=0)
    scaled: Singles = (features - low) / (high - low + np.float32(SMALLEST_RANGE))
    return scaled
