"""Analysis of the features: permutation importance (Altmann 2010) and Pearson correlation, as in the paper's Fig. 8."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from mdp.learning.labels import RatedList
from mdp.learning.ndcg import Scores, ndcg
from mdp.mesh import Floats

CUT = 5  # importance is what NDCG@5 loses


def importance(scores: Scores, columns: Sequence[str], lists: Sequence[RatedList], repeats: int) -> Floats:
    """(k,) for each named feature, NDCG@5 less its mean over repeats in which that feature is shuffled among all candidates."""
    whole, rng = mean_ndcg(scores, lists), np.random.default_rng(0)
    lost: Floats = np.array([[whole - mean_ndcg(scores, shuffled(name, lists, rng)) for _ in range(repeats)] for name in columns])
    means: Floats = lost.mean(axis=1)
    return means


def mean_ndcg(scores: Scores, lists: Sequence[RatedList]) -> float:
    """Mean NDCG@5."""
    return float(np.mean([ndcg(scores(rated), rated.ratings, CUT) for rated in lists]))


def shuffled(name: str, lists: Sequence[RatedList], rng: np.random.Generator) -> list[RatedList]:
    """The lists with one feature dealt out anew among the candidates of all of them."""
    features = np.vstack([rated.features for rated in lists])
    column = lists[0].columns.index(name)
    features[:, column] = rng.permutation(features[:, column])
    parts = np.split(features, np.cumsum([len(rated.features) for rated in lists])[:-1])
    return [replace(rated, features=part) for rated, part in zip(lists, parts, strict=True)]


def correlation(columns: Sequence[str], lists: Sequence[RatedList]) -> Floats:
    """(k, k) Pearson correlation of the named features over all candidates; 0 with one that never changes."""
    rows = np.vstack([rated.table(columns) for rated in lists]).astype(np.float64)
    spread = rows - rows.mean(axis=0)
    length = np.sqrt((spread**2).sum(axis=0))
    products = np.outer(length, length)
    matrix: Floats = np.divide(spread.T @ spread, products, out=np.zeros_like(products), where=products > 0.0)
    return matrix
