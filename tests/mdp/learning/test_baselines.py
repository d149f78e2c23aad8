from math import log2

import numpy as np
import pytest

from mdp.learning.baselines import BASELINES, fit_trade_off, random_order, trade_off
from mdp.learning.ndcg import at
from mdp.mesh import Floats
from mdp.ranking.features import PAPER_COLUMNS
from tests.mdp.learning.records import drawn_list

TRAINING = [drawn_list(seed, 20) for seed in range(60)]
VALIDATION = [drawn_list(seed, 20) for seed in range(60, 80)]
TEST = [drawn_list(seed, 20) for seed in range(80, 140)]


def mean_ndcg(name: str) -> float:
    scores = BASELINES[name](TRAINING, VALIDATION, PAPER_COLUMNS)
    return float(np.mean([at(5)(scores(rated), rated) for rated in TEST]))


def test_random_scores_come_again_for_the_same_list_and_order_nothing() -> None:
    assert np.array_equal(random_order(TEST[0]), random_order(drawn_list(80, 20)))
    discounts = [1 / log2(rank + 1) for rank in range(1, 6)]
    expected = sum(discounts) * (31 + 15 + 7 + 3 + 1) / 20 / np.dot(discounts, [31, 15, 7, 3, 1])
    assert mean_ndcg("random") == pytest.approx(expected, abs=0.05)


def test_a_trade_off_takes_m6_off_m2() -> None:
    rated = drawn_list(1, 4)
    expected: Floats = rated.features[:, 1] - 0.5 * rated.features[:, 5].astype(np.float64)
    assert trade_off(0.5)(rated) == pytest.approx(expected)


def test_the_fitted_trade_off_finds_the_weight_that_the_outcomes_were_drawn_with() -> None:
    rated = drawn_list(1, 4)
    m2, m6 = rated.table(("M2", "M6")).T.astype(np.float64)
    weight = np.median((m2 - fit_trade_off(TRAINING, VALIDATION, PAPER_COLUMNS)(rated)) / m6)
    assert weight == pytest.approx(0.5, abs=0.1)


def test_savings_alone_rank_worse_than_savings_minus_losses() -> None:
    assert mean_ndcg("random") < mean_ndcg("M2") < mean_ndcg("M2 - lambda M6")


@pytest.mark.train
@pytest.mark.parametrize("name", ["RankNet", "RankNet (tuned)", "LambdaRank", "LambdaRank (tuned)"])
def test_boosted_trees_learn_the_order_deterministically(name: str) -> None:
    pytest.importorskip("xgboost", reason="the extra `train` is not installed")
    assert mean_ndcg("random") + 0.2 < mean_ndcg(name) < 1
    again = [BASELINES[name](TRAINING, VALIDATION, PAPER_COLUMNS)(TEST[0]).tolist() for _ in range(2)]
    assert again[0] == again[1]
