import numpy as np
import pytest

from mdp.learning.lists import RatedList, followed, scale


def listed(*outcome: float, censored: tuple[int, ...] = ()) -> RatedList:
    features = np.arange(6.0 * len(outcome), dtype=np.float32).reshape(-1, 6)
    return RatedList(features, ("M1",), np.array(outcome), np.isin(np.arange(len(outcome)), censored), "a")


def test_the_five_least_outcomes_are_rated_and_the_rest_are_not() -> None:
    assert listed(0.9, 0.1, 0.5, 0.2, 0.4, 0.3, 0.6).ratings.tolist() == [0, 5, 1, 4, 2, 3, 0]


def test_a_short_list_has_no_zero_and_equal_outcomes_keep_their_order() -> None:
    assert listed(0.2, 0.1, 0.2).ratings.tolist() == [4, 5, 3]


def test_candidates_that_nobody_followed_leave_the_list_unless_they_are_its_best() -> None:
    (shortened,) = followed([listed(0.4, 0.2, 0.3, 0.2, censored=(1, 2))])
    assert shortened.outcome.tolist() == [0.4, 0.2, 0.2]
    assert shortened.features[:, 0].tolist() == [0, 6, 18]
    assert shortened.ratings.tolist() == [3, 5, 4]


def test_regrets_are_shares_of_the_least_outcome_or_of_a_twentieth_of_the_risky_area() -> None:
    assert listed(0.3, 0.2).regrets.tolist() == pytest.approx([0.5, 0])
    assert listed(0.0, 0.01).regrets.tolist() == pytest.approx([0, 0.2])


def test_a_list_with_a_single_label_teaches_nothing() -> None:
    assert listed(0.0, 0.0).teaches
    assert not listed(0.0).teaches


def test_features_are_scaled_to_the_range_of_their_list_and_a_constant_one_becomes_zero() -> None:
    scaled = scale(np.array([[1, 7], [3, 7], [2, 7]], np.float32))
    assert np.allclose(scaled, [[0, 0], [1, 0], [0.5, 0]])
