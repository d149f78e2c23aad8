"""Baselines: ranking without learning, a linear trade-off of two features, and the learners that the paper compares with uRank.

XGBoost's trees come in two versions: as in the paper, on features scaled by list, and tuned, on unscaled features as well.
"""

from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING
from zlib import crc32

import numpy as np

from mdp.learning.lists import RatedList, Singles, scale
from mdp.learning.ndcg import Scores, ndcg
from mdp.mesh import Floats

if TYPE_CHECKING:
    from xgboost import DMatrix

WEIGHTS = np.concatenate([[0.0], np.geomspace(0.05, 20.0, 53)])  # weights of M6 relative to M2; all are tried
FITTED_AT = 5  # cutoff of the NDCG for fitting the trade-off and for early stopping of tuned trees
# XGBoost's own ranking demo, which the paper cites, with the paper's depth and rounds, and pairs as in 2020.
PAPER = {"max_depth": 8, "eta": 0.1, "gamma": 1.0, "min_child_weight": 0.1, "tree_method": "hist", "nthread": 1, "seed": 0}
PAPER_PAIRS = {"lambdarank_pair_method": "mean", "lambdarank_num_pair_per_sample": 1}
PAPER_ROUNDS = 500
TUNED = {"max_depth": 4, "eta": 0.05, "min_child_weight": 5.0, "subsample": 0.8, "tree_method": "hist", "nthread": 1, "seed": 0}
TUNED_ROUNDS, TUNED_PATIENCE = 1000, 50  # rounds; early stopping after 50 without a gain on the validation lists

Lists = Sequence[RatedList]
Columns = Sequence[str]
Fit = Callable[[Lists, Lists, Columns], Scores]  # training lists, validation lists, names of features


def random_order(rated: RatedList) -> Floats:
    """Random scores, reproducible for each list."""
    return np.random.default_rng(crc32(rated.features.tobytes())).random(len(rated.ratings))


def trade_off(weight: float) -> Scores:
    """M2 - weight M6: what the cuts so far save, less what they lose for good."""

    def of_list(rated: RatedList) -> Floats:
        gain, loss = rated.table(("M2", "M6")).T.astype(np.float64)
        scores: Floats = gain - weight * loss
        return scores

    return of_list


def fit_trade_off(training: Lists, validation: Lists, columns: Columns) -> Scores:
    """The trade-off with the highest NDCG on the training lists."""
    del validation, columns
    means = [np.mean([ndcg(trade_off(weight)(rated), rated.ratings, FITTED_AT) for rated in training]) for weight in WEIGHTS]
    return trade_off(float(WEIGHTS[int(np.argmax(means))]))


def fit_trees(objective: str) -> Fit:
    """RankNet (rank:pairwise) or LambdaRank (rank:ndcg) as in the paper: 500 rounds without early stopping."""

    def fit(training: Lists, validation: Lists, columns: Columns) -> Scores:
        del validation
        import xgboost

        settings = {**PAPER, **PAPER_PAIRS, "objective": objective}
        booster = xgboost.train(settings, _rows(training, columns, _scaled), num_boost_round=PAPER_ROUNDS)
        return lambda rated: booster.inplace_predict(_scaled(rated, columns)).astype(np.float64)

    return fit


def fit_tuned_trees(objective: str) -> Fit:
    """Trees with the settings TUNED, XGBoost's own pairs, and unscaled features as well; the validation lists stop the
    training.
    """

    def fit(training: Lists, validation: Lists, columns: Columns) -> Scores:
        import xgboost

        settings = {**TUNED, "objective": objective, "eval_metric": f"ndcg@{FITTED_AT}"}
        train, stop = (_rows(lists, columns, _scaled_and_raw) for lists in (training, validation))
        stopping = xgboost.callback.EarlyStopping(rounds=TUNED_PATIENCE, save_best=True)
        booster = xgboost.train(
            settings, train, num_boost_round=TUNED_ROUNDS, evals=[(stop, "validation")], callbacks=[stopping], verbose_eval=False
        )
        return lambda rated: booster.inplace_predict(_scaled_and_raw(rated, columns)).astype(np.float64)

    return fit


def _rows(lists: Lists, columns: Columns, table: Callable[[RatedList, Columns], Singles]) -> "DMatrix":
    """The lists as XGBoost's training matrix."""
    import xgboost

    rows = xgboost.DMatrix(np.vstack([table(rated, columns) for rated in lists]), label=np.hstack([r.ratings for r in lists]))
    rows.set_group([len(rated.ratings) for rated in lists])
    return rows


def _scaled(rated: RatedList, columns: Columns) -> Singles:
    return scale(rated.table(columns))


def _scaled_and_raw(rated: RatedList, columns: Columns) -> Singles:
    return np.hstack([_scaled(rated, columns), rated.table(columns)])


BASELINES: dict[str, Fit] = {
    "random": lambda training, validation, columns: random_order,
    "M2": lambda training, validation, columns: trade_off(0.0),
    "M2 - lambda M6": fit_trade_off,
    "RankNet": fit_trees("rank:pairwise"),
    "RankNet (tuned)": fit_tuned_trees("rank:pairwise"),
    "LambdaRank": fit_trees("rank:ndcg"),
    "LambdaRank (tuned)": fit_tuned_trees("rank:ndcg"),
}
