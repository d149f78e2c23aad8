"""NDCG as in the 2020 paper's table, and regret: measures of a list's order.

NDCG@k = DCG@k / ideal DCG@k, DCG@k = sum over the first k of (2^rating - 1) / log2(place + 1), the ideal list cut at the same k,
averaged over lists, 0 for a list without a rating above 0. Candidates with equal scores keep their order.
"""

from collections.abc import Callable, Sequence

import numpy as np

from mdp.learning.lists import RatedList
from mdp.mesh import Floats, Ints
from mdp.ranking.ranker import DECIMALS

RESAMPLES = 2000  # samples of a bootstrap: 50 of them lie beyond either end of the 95 % interval

Scores = Callable[[RatedList], Floats]
Measure = Callable[[Floats, RatedList], float]


def order(scores: Floats) -> Ints:
    """(n,) candidates by descending score."""
    return np.argsort(-scores, kind="stable").astype(np.int32)


def as_searched(scores: Scores) -> Scores:
    """A network's scores rounded as in a search, so that equivalent candidates keep their order."""
    return lambda rated: np.asarray(np.round(scores(rated), DECIMALS), np.float64)


def ndcg(scores: Floats, ratings: Ints, cut: int) -> float:
    """NDCG of one list, cut at a place."""
    ideal = _dcg(np.sort(ratings)[::-1], cut)
    return _dcg(ratings[order(scores)], cut) / ideal if ideal > 0.0 else 0.0


def _dcg(ratings: Ints, cut: int) -> float:
    first = ratings[:cut]
    gains = np.exp2(first) - 1.0
    return float((gains / np.log2(np.arange(len(first)) + 2.0)).sum())


def at(cut: int) -> Measure:
    """NDCG cut at a place, as a measure."""
    return lambda scores, rated: ndcg(scores, rated.ratings, cut)


def regret(first: int) -> Measure:
    """Regret of the best of the first few candidates: how much more it ends with than the best of the list, as a share of
    that.
    """
    return lambda scores, rated: float(rated.regrets[order(scores)[:first]].min())


NDCGS = {f"NDCG@{cut}": at(cut) for cut in (1, 2, 3, 4, 5)}
REGRETS = {f"regret@{first}": regret(first) for first in (1, 2, 5)}


def interval(values: Floats, models: Sequence[str]) -> tuple[float, float]:
    """95 % interval of the mean over lists, by resampling the models: lists of one model are not independent."""
    names, inverse = np.unique(np.asarray(models), return_inverse=True)
    sums = np.bincount(inverse, weights=values, minlength=len(names))
    counts = np.bincount(inverse, minlength=len(names))
    drawn = np.random.default_rng(0).integers(0, len(names), (RESAMPLES, len(names)))
    means = sums[drawn].sum(axis=1) / counts[drawn].sum(axis=1)
    low, high = np.quantile(means, [0.025, 0.975])
    return float(low), float(high)
