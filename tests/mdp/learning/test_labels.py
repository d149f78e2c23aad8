import numpy as np
import pytest

from mdp.learning.labels import RatedList, followed, rate, ratings, scale
from mdp.learning.lists import TrainingList
from mdp.ranking.features import PAPER_COLUMNS


def test_the_five_least_outcomes_are_rated_and_the_rest_are_not() -> None:
    assert ratings(np.array([0.9, 0.1, 0.5, 0.2, 0.4, 0.3, 0.6])).tolist() == [0, 5, 1, 4, 2, 3, 0]


def test_a_short_list_has_no_zero_and_equal_outcomes_keep_their_order() -> None:
    assert ratings(np.array([0.2, 0.1, 0.2])).tolist() == [4, 5, 3]


def test_only_candidates_that_were_cut_are_rated() -> None:
    outcome = np.array([np.nan, 0.3, 0.1, np.nan])
    features = np.arange(24.0).reshape(4, 6)
    never = TrainingList(features, PAPER_COLUMNS, np.full(4, np.nan), np.zeros(4, np.bool_), "a", "a", 2, "a.0.x")
    (rated,) = rate([TrainingList(features, PAPER_COLUMNS, outcome, np.zeros(4, np.bool_), "a", "a", 1, "a.0.x"), never], ("M2",))
    assert (rated.features.tolist(), rated.ratings.tolist()) == ([[7], [13]], [4, 5])


def test_candidates_that_nobody_followed_leave_the_list_unless_they_are_its_best() -> None:
    outcome = np.array([0.4, 0.2, np.nan, 0.3, 0.2])
    censored = np.array([False, True, False, True, False])
    training = TrainingList(np.arange(30.0).reshape(5, 6), PAPER_COLUMNS, outcome, censored, "a", "a", 1, "a.0.ours")
    (shortened,) = followed([training])
    assert shortened.outcome.tolist() == [0.4, 0.2, 0.2]
    assert shortened.features[:, 0].tolist() == [0, 6, 24]
    assert rate([shortened], ("M2",))[0].terms == "ours"


def test_regrets_are_shares_of_the_least_outcome_or_of_a_twentieth_of_the_risky_area() -> None:
    def regrets(*outcome: float) -> list[float]:
        return RatedList(np.zeros((2, 0), np.float32), (), np.array(outcome), np.array([5, 4], np.int32), "a").regrets.tolist()

    assert regrets(0.3, 0.2) == pytest.approx([0.5, 0])
    assert regrets(0.0, 0.01) == pytest.approx([0, 0.2])


def test_a_list_with_a_single_label_teaches_nothing() -> None:
    features = np.zeros((2, 6), np.float32)
    assert RatedList(features, PAPER_COLUMNS, np.zeros(2), ratings(np.zeros(2)), "a").teaches
    assert not RatedList(features[:1], PAPER_COLUMNS, np.zeros(1), ratings(np.zeros(1)), "a").teaches


def test_features_are_scaled_to_the_range_of_their_list_and_a_constant_one_becomes_zero() -> None:
    scaled = scale(np.array([[1, 7], [3, 7], [2, 7]], np.float32))
    assert np.allclose(scaled, [[0, 0], [1, 0], [0.5, 0]])
