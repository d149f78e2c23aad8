"""The file of choices and the weights fitted to it."""

import json
from collections import Counter
from pathlib import Path

import numpy as np
import pytest

from mdp.plane import Plane
from mdp.search.problem import Problem
from profiles.profile import load
from tests.shapes import box
from tools.campaigns import fit_choices
from tools.campaigns.harness import read_lines


def test_the_book_has_120_models_of_three_kinds_half_of_them_large_each_judged_twice() -> None:
    book = read_lines(fit_choices.BOOK)
    assert len({entry["id"] for entry in book}) == 120
    assert Counter(entry["class"] for entry in book) == {"organic": 50, "mechanical": 40, "other": 30}
    assert Counter(entry["size_mm"] for entry in book) == {60.0: 60, 120.0: 60}
    for entry in book:
        assert 4 <= len(entry["alternatives"]) <= 7
        assert [set(verdict["marks"]) for verdict in entry["verdicts"]] == [set(entry["alternatives"])] * 2


def test_the_standard_weights_order_four_of_five_pairs_as_the_judges_do() -> None:
    pairs = fit_choices.pairs_of(read_lines(fit_choices.BOOK))
    assert fit_choices.ordered(pairs, fit_choices.weights_of(load())).mean() >= 0.8


def test_weights_are_recovered_from_ordered_pairs() -> None:
    rng, true = np.random.default_rng(1), np.array([1.0, 4.0, 0.0, 0.2])
    differences = rng.normal(size=(2000, 4))
    differences *= np.sign(differences @ true)[:, None]
    found = fit_choices.fitted(differences)
    assert found / found[0] == pytest.approx(true, abs=0.15)


def test_no_weight_is_below_nothing() -> None:
    differences = np.array(
        [[1.0, -1.0], [2.0, -0.5], [0.5, -2.0]]
    )  # a fit without bounds gives the second figure a negative weight
    assert fit_choices.fitted(differences)[1] == 0.0


def test_a_pair_that_two_judges_order_differently_counts_for_both_and_as_disputed() -> None:
    costs = dict.fromkeys((*fit_choices.COSTS, *fit_choices.SHARES), 0.0)
    alternatives = {"A": {"figures": costs | {"support_mm2": 30.0}}, "B": {"figures": costs | {"support_mm2": 10.0}}}
    verdicts = [{"marks": {"A": "best", "B": "wrong"}}, {"marks": {"A": "acceptable", "B": "best"}}]
    entry = {"source": "s", "surface_mm2": 100.0, "diameter_mm": 60.0}
    pairs = fit_choices.pairs_of([entry | {"alternatives": alternatives, "verdicts": verdicts}])
    assert pairs.differences[:, 0].tolist() == pytest.approx([-0.2, 0.2])
    assert pairs.unanimous.tolist() == [False, False]


def test_every_cut_is_charged_before_the_least_cost_is_taken() -> None:
    costs = dict.fromkeys((*fit_choices.COSTS, *fit_choices.SHARES), 0.0)
    figures = {"A": (100.0, 0), "B": (92.0, 1), "C": (80.0, 3)}
    alternatives = {
        letter: {"figures": costs | {"support_mm2": support_mm2}, "planes": [{}] * cuts}
        for letter, (support_mm2, cuts) in figures.items()
    }
    entry, only_support = {"surface_mm2": 1.0, "diameter_mm": 60.0, "alternatives": alternatives}, np.eye(len(costs))[0]
    assert [fit_choices.taken(entry, only_support, share) for share in (0.0, 0.05, 0.07, 0.09)] == ["C", "C", "B", "A"]


def test_no_seam_is_hidden_on_a_convex_model() -> None:
    problem = Problem(box(20, 30, 40), load())
    node = problem.cut(problem.root, Plane(np.array([0.0, 0.0, 1.0]), 15.0))
    assert fit_choices.seams_by_sight(node, 0.25) == pytest.approx((100.0, 0.0))


def test_verdicts_are_read_with_their_reasons(tmp_path: Path) -> None:
    file = tmp_path / "judge.csv"
    file.write_text("sheet,best,acceptable,wrong,reason\npost_60.png,B,AC,,stands, without a seam\n")
    marks = {"B": "best", "A": "acceptable", "C": "acceptable"}
    assert fit_choices.read_verdicts(file) == {"post_60": {"judge": "judge", "marks": marks, "reason": "stands, without a seam"}}


def test_a_letter_with_two_marks_is_refused(tmp_path: Path) -> None:
    file = tmp_path / "judge.csv"
    file.write_text("post_60,A,BC,AD,which is it\n")
    with pytest.raises(SystemExit, match="post_60: a letter has two marks"):
        fit_choices.read_verdicts(file)


def test_two_agreeing_judges_count_twice_and_a_repeated_judgement_once(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(fit_choices, "BOOK", tmp_path / "book.jsonl")
    fit_choices.BOOK.write_text(json.dumps({"sheet": "post_60", "alternatives": {"A": {"planes": []}}, "verdicts": []}) + "\n")
    models, offers = tmp_path / "list.csv", tmp_path / "offers.jsonl"
    models.write_text("id,file,class,source,size_mm\npost,post.stl,other,us,60\n")
    offers.write_text(json.dumps({"sheet": "post_60", "alternatives": {"A": {"planes": []}}}) + "\n")
    for name in ("one", "other", "one"):
        (tmp_path / f"{name}.csv").write_text("post_60,A,,,good\n")
        fit_choices.add_to_book(models, offers, [tmp_path / f"{name}.csv"], load())
    (entry,) = read_lines(fit_choices.BOOK)
    assert sorted(verdict["judge"] for verdict in entry["verdicts"]) == ["one", "other"]
