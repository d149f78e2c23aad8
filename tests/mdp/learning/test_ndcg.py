from math import log2

import numpy as np
import pytest

from mdp.learning.lists import RatedList
from mdp.learning.ndcg import as_searched, at, interval, ndcg, order, regret
from mdp.mesh import Floats
from mdp.ranking.features import PAPER_COLUMNS
from tests.mdp.learning.records import drawn_list
from tests.mdp.learning.reference import reference_lists

RATINGS = np.array([0, 5, 1, 4, 2, 3], np.int32)


def listed(outcome: Floats) -> RatedList:
    return RatedList(
        np.zeros((len(outcome), 6), np.float32), PAPER_COLUMNS, outcome, np.zeros(len(outcome), np.bool_), "m", "", ""
    )


def test_the_right_order_has_an_ndcg_of_one_and_the_reverse_what_its_last_places_give() -> None:
    scores = RATINGS.astype(np.float64)
    assert [ndcg(scores, RATINGS, cut) for cut in (1, 3, 5, 10)] == pytest.approx([1, 1, 1, 1])
    assert ndcg(-scores, RATINGS, 1) == 0
    assert ndcg(-scores, RATINGS, 2) == pytest.approx((1 / log2(3)) / (31 + 15 / log2(3)))


def test_equal_scores_keep_the_order_and_a_list_without_a_rating_counts_nothing() -> None:
    assert ndcg(np.zeros(6), RATINGS, 2) == pytest.approx((31 / log2(3)) / (31 + 15 / log2(3)))
    assert ndcg(np.zeros(3), np.zeros(3, np.int32), 5) == 0


def test_the_published_scores_have_the_published_ndcg() -> None:
    lists = reference_lists()
    means = [np.mean([ndcg(scores, labels, cut) for scores, labels in lists]) for cut in range(1, 6)]
    assert means == pytest.approx([0.42256, 0.45508, 0.48323, 0.50974, 0.53157], abs=5e-6)


def test_regret_is_that_of_the_best_of_the_first_few() -> None:
    rated = listed(np.array([0.4, 0.1, 0.3, 0.1]))
    scores = np.array([4.0, 1.0, 3.0, 2.0])
    assert [regret(first)(scores, rated) for first in (1, 2, 3)] == pytest.approx([3, 2, 0])


def test_scores_that_a_search_takes_for_equal_leave_candidates_in_the_order_they_come() -> None:
    rated = listed(np.array([0.1, 0.2, 0.3]))
    scores = as_searched(lambda rated: np.array([1.0, 1.00001, 1.0002]))
    assert order(scores(rated)).tolist() == [2, 0, 1]


def test_an_interval_resamples_models_not_lists() -> None:
    values = np.array([0.0, 1.0] * 50)
    low, high = interval(values, [f"m{number}" for number in range(100)])
    assert low == pytest.approx(0.4, abs=0.03)
    assert high == pytest.approx(0.6, abs=0.03)
    assert interval(values, ["even", "odd"] * 50) == (0, 1)
    assert interval(values, ["one"] * 100) == (0.5, 0.5)


def test_ndcg_is_a_measure_of_a_list() -> None:
    rated = drawn_list(3, 12)
    assert at(3)(-rated.outcome, rated) == pytest.approx(1)
