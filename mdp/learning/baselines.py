"""Baselines: orders without learning, a line in two features, and the learners that the paper compares uRank with.

Boosted trees get the features scaled by list as uRank does; LambdaMART the unscaled ones beside them.
"""

from collections.abc import Callable, Sequence
from zlib import crc32

import numpy as np

from mdp.learning.labels import RatedList, Singles, scale
from mdp.learning.ndcg import Scores, ndcg
from mdp.mesh import Floats, Ints

WEIGHTS = np.concatenate([[0.0], np.geomspace(0.05, 20.0, 53)])  # of M6 against M2, tried in turn
FITTED_AT = 5  # the NDCG that the line is fitted by and that LambdaMART stops by
# The settings of XGBoost's own ranking demo, which the paper names, with the paper's depth and rounds.
XGBOOST = {"max_depth": 8, "eta": 0.1, "gamma": 1.0, "min_child_weight": 0.1, "tree_method": "hist", "nthread": 1, "seed": 0}
XGBOOST_PAIRS = {"lambdarank_pair_method": "mean", "lambdarank_num_pair_per_sample": 1}  # as that demo drew them in 2020
XGBOOST_ROUNDS = 500  # the paper's
LIGHTGBM = {
    "objective": "lambdarank",
    "metric": "ndcg",
    "eval_at": [FITTED_AT],
    "learning_rate": 0.05,
    "num_leaves": 15,
    "min_data_in_leaf": 20,
    "deterministic": True,
    "force_row_wise": True,
    "num_threads": 1,
    "seed": 0,
    "verbosity": -1,
}
LIGHTGBM_ROUNDS, LIGHTGBM_PATIENCE = 1000, 50  # validation ends it: after 50 rounds, a twentieth, that better nothing

Lists = Sequence[RatedList]
Columns = Sequence[str]
Fit = Callable[[Lists, Lists, Columns], Scores]  # lists to train with and to validate with, and what is learnt from


def random_order(rated: RatedList) -> Floats:
    """Scores drawn anew for every list, the same whenever it comes again."""
    return np.random.default_rng(crc32(rated.features.tobytes())).random(len(rated.ratings))


def trade_off(weight: float) -> Scores:
    """M2 - weight M6: what the cuts so far save less what they lose for ever."""

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


def fit_xgboost(objective: str) -> Fit:
    """RankNet (rank:pairwise) or LambdaRank (rank:ndcg) as the paper ran them: 500 rounds, come what may."""

    def fit(training: Lists, validation: Lists, columns: Columns) -> Scores:
        del validation
        import xgboost

        rows = xgboost.DMatrix(np.vstack([_scaled(rated, columns) for rated in training]), label=_ratings(training))
        rows.set_group([len(rated.ratings) for rated in training])
        booster = xgboost.train({**XGBOOST, **XGBOOST_PAIRS, "objective": objective}, rows, XGBOOST_ROUNDS)
        return lambda rated: booster.inplace_predict(_scaled(rated, columns)).astype(np.float64)

    return fit


def fit_lambdamart(training: Lists, validation: Lists, columns: Columns) -> Scores:
    """LightGBM's LambdaMART, stopped when the validation lists are ordered no better."""
    import lightgbm

    def rows(lists: Lists, reference: object = None) -> object:
        table = np.vstack([_scaled_and_raw(rated, columns) for rated in lists])
        groups = [len(rated.ratings) for rated in lists]
        return lightgbm.Dataset(table, label=_ratings(lists), group=groups, reference=reference)

    train = rows(training)
    stopping = lightgbm.early_stopping(LIGHTGBM_PATIENCE, verbose=False)
    booster = lightgbm.train(LIGHTGBM, train, LIGHTGBM_ROUNDS, valid_sets=[rows(validation, train)], callbacks=[stopping])
    return lambda rated: np.asarray(booster.predict(_scaled_and_raw(rated, columns), num_threads=1), dtype=np.float64)


def _ratings(lists: Lists) -> Ints:
    return np.concatenate([rated.ratings for rated in lists])


def _scaled(rated: RatedList, columns: Columns) -> Singles:
    return scale(rated.table(columns))


def _scaled_and_raw(rated: RatedList, columns: Columns) -> Singles:
    return np.hstack([_scaled(rated, columns), rated.table(columns)])


def fit_ranknet(training: Lists, validation: Lists, columns: Columns) -> Scores:
    """uRank's network and training with RankNet's loss."""
    from mdp.learning.training import Schedule, train
    from mdp.learning.urank import Network, scores

    network = Network(len(columns))
    train(network, columns, (training, validation), Schedule(loss="ranknet"))
    return scores(network, columns)


BASELINES: dict[str, Fit] = {
    "random": lambda training, validation, columns: random_order,
    "M2": lambda training, validation, columns: trade_off(0.0),
    "M2 - lambda M6": fit_trade_off,
    "RankNet": fit_ranknet,
    "RankNet (XGBoost)": fit_xgboost("rank:pairwise"),
    "LambdaRank (XGBoost)": fit_xgboost("rank:ndcg"),
    "LambdaMART (LightGBM)": fit_lambdamart,
}
