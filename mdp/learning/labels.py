"""Labels: ratings and features scaled by list as in the 2020 paper, and regrets, what a candidate costs more than the best.

The value of a candidate is the least final cost through it, stopping there included. The paper rates the five best candidates of
a list 5, 4, 3, 2, 1 and the rest 0; its lists are what the beam kept, so candidates that were never cut are not among them.
Nor are, where regrets are asked for, those that nobody followed: all that is known of them is that stopping there is worse.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from mdp.learning.lists import TrainingList
from mdp.learning.sources import terms_of
from mdp.mesh import Floats, Ints

BEST = 5  # candidates of a list that are rated
TIE = 1e-9  # outcomes (shares) that differ less are the same
SMALLEST_RANGE = 1e-8  # added to the range, which is 0 where all of a list have the same
LEAST_OUTCOME = 0.05  # lists that can end with less count as if they ended with it, else the best of models would weigh most

Singles = NDArray[np.float32]


@dataclass(frozen=True, eq=False)
class RatedList:
    """The n candidates of a list that were cut: features (n, F) unscaled, named in `columns`, outcomes and ratings (n,).

    record: name of the file that they are from, without its ending; a model has one for each orientation and terms.
    """

    features: Singles
    columns: tuple[str, ...]
    outcome: Floats
    ratings: Ints
    model: str
    record: str = ""

    @property
    def regrets(self) -> Floats:
        """(n,) by how much each candidate ends with more than the best of the list, as share of the best."""
        least = float(self.outcome.min())
        shares: Floats = (self.outcome - least) / max(least, LEAST_OUTCOME)
        return shares

    @property
    def terms(self) -> str:
        """The terms of the search."""
        return terms_of(self.record)

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
    for recorded in lists:
        cut = ~np.isnan(recorded.outcome)
        if cut.any():
            outcome = recorded.outcome[cut]
            features = recorded.table(columns)[cut].astype(np.float32)
            rated.append(RatedList(features, tuple(columns), outcome, ratings(outcome), recorded.model, recorded.record))
    return rated


def followed(lists: Sequence[TrainingList]) -> list[TrainingList]:
    """The lists without the candidates that nobody followed, unless they are the best there."""
    lists_left = []
    for recorded in lists:
        known = ~np.isnan(recorded.outcome)
        if known.any():
            rows = known & (~recorded.censored | (recorded.outcome <= np.min(recorded.outcome[known]) + TIE))
            table, outcome, censored = recorded.features[rows], recorded.outcome[rows], recorded.censored[rows]
            lists_left.append(replace(recorded, features=table, outcome=outcome, censored=censored))
    return lists_left


def scale(features: Singles) -> Singles:
    """(n, F) every column from 0 to 1 over its list; a column that is the same everywhere becomes 0."""
    low, high = features.min(axis=0), features.max(axis=0)
    scaled: Singles = (features - low) / (high - low + np.float32(SMALLEST_RANGE))
    return scaled
