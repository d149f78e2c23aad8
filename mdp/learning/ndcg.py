"""NDCG as the 2020 paper's table has it, and regret: what the order of a list is worth.

NDCG@k = DCG@k / ideal DCG@k, DCG@k = sum over the first k of (2^rating - 1) / log2(place + 1), the ideal list cut at the same
k, the mean over lists, 0 for a list without a rating above 0. Candidates with equal scores stay in the order they come.
"""

from collections.abc import Callable, Sequence

import numpy as np

from mdp.learning.lists import RatedList
from mdp.mesh import Floats, Ints
from mdp.ranking.ranker import DECIMALS

RESAMPLES = 2000  # of a bootstrap: 50 of them lie beyond either end of 95 %

Scores = Callable[[RatedList], Floats]
Measure = Callable[[Floats, RatedList], float]


def order(scores: Floats) -> Ints:
    """(n,) candidates by falling score."""
    return np.argsort(-scores, kind="stable").astype(np.int32)


def as_searched(scores: Scores) -> Scores:
    """Scores of a network rounded as a search compares them, so that candidates alike stay in the order they come."""
    return lambda rated: np.asarray(np.round(scores(rated), DECIMALS), np.float64)


def ndcg(scores: Floats, ratings: Ints, cut: int) -> float:
    """NDCG at a place of one list."""
    ideal = _dcg(np.sort(ratings)[::-1], cut)
    return _dcg(ratings[order(scores)], cut) / ideal if ideal > 0.0 else 0.0


def _dcg(ratings: Ints, cut: int) -> float:
    first = ratings[:cut]
    gains = np.exp2(first) - 1.0
    return float((gains / np.log2(np.arange(len(first)) + 2.0)).sum())


def at(cut: int) -> Measure:
    """NDCG at a place as a measure."""
    return lambda scores, rated: ndcg(scores, rated.ratings, cut)


def regret(first: int) -> Measure:
    """By how much the best of the first few ends with more than the best of the list, as share of that."""
    return lambda scores, rated: float(rated.regrets[order(scores)[:first]].min())


NDCGS = {f"NDCG@{cut}": at(cut) for cut in (1, 2, 3, 4, 5)}
REGRETS = {f"regret@{first}": regret(first) for first in (1, 2, 5)}


def interval(values: Floats, models: Sequence[str]) -> tuple[float, float]:
    """95 % interval of the mean of the lists' values, the models resampled: the lists of one model stand or fall together."""
    names, inverse = np.unique(np.asarray(models), return_inverse=True)
    sums = np.bincount(inverse, weights=values, minlength=len(names))
    counts = np.bincount(inverse, minlength=len(names))
    drawn = np.random.default_rng(0).integers(0, len(names), (RESAMPLES, len(names)))
    means = sums[drawn].sum(axis=1) / counts[drawn].sum(axis=1)
    low, high = np.quantile(means, [0.025, 0.975])
    return float(low), float(high)
