import numpy as np
import pytest

from mdp.learning.baselines import trade_off
from mdp.learning.evaluate import NDCGS, REGRETS, correlation, importance, shuffled, table
from mdp.mesh import Floats
from tests.mdp.learning.records import drawn_list

LISTS = [drawn_list(seed, size) for seed, size in enumerate((2, 4, 8, 15, 30, 45, 50, 50) * 5)]


def cells(text: str, name: str) -> list[str]:
    return next([cell.strip() for cell in line.split("|")[2:-1]] for line in text.splitlines() if line.startswith(f"| {name} |"))


def test_the_right_order_has_full_marks() -> None:
    text = table("All lists", {"right": lambda rated: -rated.outcome, "M2": trade_off(0.0)}, LISTS, NDCGS)
    assert text.startswith("All lists: 40 lists of 7 models")
    assert cells(text, "right") == ["1.0000"] * 5 + ["1.0000 to 1.0000"]
    assert 0 < float(cells(text, "M2")[0]) < 1


def test_the_wrong_order_costs_the_largest_regret() -> None:
    text = table("", {"wrong": lambda rated: rated.outcome, "right": lambda rated: -rated.outcome}, LISTS, REGRETS)
    assert float(cells(text, "wrong")[0]) == pytest.approx(np.mean([rated.regrets.max() for rated in LISTS]), abs=1e-4)
    assert cells(text, "right")[:3] == ["0.0000"] * 3


def test_only_features_that_a_ranker_looks_at_are_important() -> None:
    m1, m2, m6 = importance(trade_off(0.5), ("M1", "M2", "M6"), LISTS)
    assert m1 == 0
    assert m2 > m6 > 0.02


def test_a_shuffled_feature_keeps_its_values_and_no_other_moves() -> None:
    before = np.vstack([rated.features for rated in LISTS])
    dealt = shuffled("M3", LISTS, np.random.default_rng(0))
    after = np.vstack([rated.features for rated in dealt])
    assert [len(rated.features) for rated in dealt] == [len(rated.features) for rated in LISTS]
    assert np.array_equal(np.sort(after[:, 2]), np.sort(before[:, 2]))
    assert (after != before).any(axis=0).tolist() == [False, False, True, False, False, False]


def test_correlation_is_pearson_s_and_nothing_with_a_constant() -> None:
    matrix: Floats = correlation(("M1", "M2", "M3"), LISTS)
    rows = np.vstack([rated.features[:, :3] for rated in LISTS]).astype(np.float64)
    assert matrix == pytest.approx(np.corrcoef(rows.T))
    for rated in LISTS:
        rated.features[:, 4] = 0.5
    assert correlation(("M1",), LISTS).tolist() == [[pytest.approx(1)]]
    assert correlation(("M1", "M5"), LISTS)[0].tolist() == pytest.approx([1, 0])
