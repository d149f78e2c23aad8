import re
from pathlib import Path

import numpy as np
import pytest

from mdp.learning.lists import FOLDS, RatedList, Side, followed, of_side, of_some_models, read_lists, scale, side
from mdp.ranking.features import COLUMNS, PAPER_COLUMNS
from profiles.errors import UserError
from tests.mdp.learning.records import write_record

OUTCOME = np.array([0.5, np.nan, 0.3, 0.2])


def test_the_candidates_of_a_stage_that_were_cut_are_a_list(tmp_path: Path) -> None:
    write_record(tmp_path / "kitten.0.paper.npz", OUTCOME, np.array([1, 1, 1, 2], np.int32))
    first, second = read_lists(tmp_path)
    assert (first.model, second.model) == ("kitten", "kitten")
    assert first.outcome.tolist() == [0.5, 0.3]
    assert second.features.shape == (1, 6)


def test_a_stage_in_which_nothing_was_cut_is_no_list(tmp_path: Path) -> None:
    write_record(tmp_path / "a.0.x.npz", np.array([np.nan, 0.3]), np.array([1, 2], np.int32))
    assert [rated.outcome.tolist() for rated in read_lists(tmp_path)] == [[0.3]]


def test_records_of_other_terms_are_left_out_on_request(tmp_path: Path) -> None:
    for name in ("a.0.paper.npz", "a.0.ours.npz", "b.1.paper.npz"):
        write_record(tmp_path / name, OUTCOME)
    assert [entry.model for entry in read_lists(tmp_path, terms=("paper",))] == ["a", "b"]
    with pytest.raises(UserError, match=r"holds no record \(\*\.yours\.npz\)"):
        read_lists(tmp_path, terms=("paper", "yours"))
    with pytest.raises(UserError, match=r"holds no record \(\*\.\*\*\.npz\)"):
        read_lists(tmp_path, terms=("**",))


def test_features_are_found_by_name_in_any_column(tmp_path: Path) -> None:
    names = ("rim", *reversed(PAPER_COLUMNS))
    write_record(tmp_path / "a.0.x.npz", OUTCOME, features=np.tile(np.arange(7.0), (4, 1)), columns=np.array(names))
    write_record(tmp_path / "b.0.x.npz", OUTCOME, features=np.tile(np.arange(6.0), (4, 1)))
    turned, straight = read_lists(tmp_path)
    assert turned.table(("M1", "M6"))[0].tolist() == [6, 1]
    assert straight.table(("M1", "M6"))[0].tolist() == [0, 5]
    assert turned.columns == straight.columns == PAPER_COLUMNS


def test_a_candidate_whose_node_was_not_expanded_is_censored(tmp_path: Path) -> None:
    child, expanded = np.array([1, -1, 2, 3]), np.array([True, True, False, True])
    write_record(tmp_path / "a.0.x.npz", OUTCOME, child=child, node_expanded=expanded)
    write_record(tmp_path / "b.0.x.npz", OUTCOME)
    partly, whole = read_lists(tmp_path)
    assert partly.censored.tolist() == [False, True, False]
    assert not whole.censored.any()


def test_a_candidate_with_an_expanded_but_never_cut_node_is_censored(tmp_path: Path) -> None:
    arrays = {"child": np.array([1, 2, 3]), "parent": np.array([0, 0, 1]), "node_expanded": np.array([True, True, True, False])}
    write_record(tmp_path / "a.0.x.npz", np.array([0.5, 0.3, 0.2]), **arrays)
    assert read_lists(tmp_path)[0].censored.tolist() == [False, True, True]


def test_models_of_one_repository_and_folder_are_of_one_source(tmp_path: Path) -> None:
    for name in ("a.0.x.npz", "a.1.x.npz", "b.0.x.npz", "c.0.x.npz"):
        write_record(tmp_path / name, OUTCOME)
    manifest = tmp_path / "manifest.csv"
    manifest.write_text("id,source_repo,source_path\na,me/things,cat/a.stl\nb,me/things,cat/b.stl\nc,me/things,dog/c.stl\n")
    assert [entry.source for entry in read_lists(tmp_path, manifest)] == ["me/things/cat"] * 3 + ["me/things/dog"]
    assert [entry.source for entry in read_lists(tmp_path)] == ["a", "a", "b", "c"]


def test_sources_are_split_as_in_the_paper_deterministically() -> None:
    sides = [side(f"source {number}") for number in range(2000)]
    assert [sides.count(wanted) / 2000 for wanted in Side] == pytest.approx([0.60, 0.15, 0.25], abs=0.02)
    assert [side(name) for name in ("a", "b", "c")] == [Side.TEST, Side.TRAIN, Side.TRAIN]


def test_every_source_is_tested_in_exactly_one_fold_and_trains_in_at_least_two() -> None:
    sides = np.array([[side(f"source {number}", fold) for fold in range(FOLDS)] for number in range(500)])
    assert ((sides == Side.TEST).sum(axis=1) == 1).all()
    assert ((sides == Side.TRAIN).sum(axis=1) >= 2).all()


def test_the_test_set_of_one_split_is_training_data_in_the_next() -> None:
    judges = [f"source {number}" for number in range(500) if side(f"source {number}") is Side.TEST]
    assert {side(source, 1) for source in judges} == {Side.TRAIN}


def test_a_larger_share_of_the_models_contains_a_smaller_one(tmp_path: Path) -> None:
    for number in range(60):
        write_record(tmp_path / f"m{number}.0.x.npz", OUTCOME)
    quarter, half, whole = ({rated.model for rated in of_some_models(read_lists(tmp_path), share)} for share in (0.25, 0.5, 1.0))
    assert 8 <= len(quarter) <= 22 < len(half) < 40 < len(whole) == 60
    assert quarter < half


def test_a_list_is_on_the_side_of_its_source(tmp_path: Path) -> None:
    for number in range(30):
        write_record(tmp_path / f"m{number}.0.x.npz", OUTCOME)
    lists = read_lists(tmp_path)
    parts = [of_side(lists, wanted) for wanted in Side]
    assert sum(len(part) for part in parts) == 30
    assert all(side(rated.source) is wanted for wanted, part in zip(Side, parts, strict=True) for rated in part)


@pytest.mark.parametrize(
    ("others", "sentence"),
    [
        ({"version": np.array(1)}, "is of version 1, only 2 is understood"),
        ({"columns": np.array(["M1", "M2", "M3", "M4", "M5", "x"])}, "has no feature M6; it has M1, M2, M3, M4, M5, x"),
        ({"features": np.full((4, 6), np.inf)}, "feature M1 of a candidate of model kitten.0.x is inf"),
        ({"features": np.zeros((3, 6))}, "its features, stages and outcomes differ in length"),
    ],
)
def test_a_record_that_cannot_be_learnt_from_is_refused(tmp_path: Path, others: dict[str, object], sentence: str) -> None:
    write_record(tmp_path / "kitten.0.x.npz", **({"outcome": OUTCOME} | others))
    with pytest.raises(UserError, match=re.escape(sentence)):
        read_lists(tmp_path)


def test_an_invalid_record_is_refused(tmp_path: Path) -> None:
    with pytest.raises(UserError, match="holds no record"):
        read_lists(tmp_path)
    (tmp_path / "a.npz").write_bytes(b"PK torn")
    with pytest.raises(UserError, match=r"record .*a\.npz cannot be read"):
        read_lists(tmp_path)


def test_a_model_that_the_manifest_does_not_know_and_a_manifest_without_sources_are_refused(tmp_path: Path) -> None:
    write_record(tmp_path / "a.0.x.npz", OUTCOME)
    manifest = tmp_path / "manifest.csv"
    manifest.write_text("id,source_repo,source_path\nb,me/things,b.stl\n")
    with pytest.raises(UserError, match="its model a is not in"):
        read_lists(tmp_path, manifest)
    manifest.write_text("id,faces\na,12\n")
    with pytest.raises(UserError, match="has no column source_repo, source_path"):
        read_lists(tmp_path, manifest)


def test_the_small_set_holds_lists_of_twenty_models_in_less_than_300_kb() -> None:
    folder = Path(__file__).parent / "data"
    lists = read_lists(folder, columns=COLUMNS, terms=("paper",))
    assert len({entry.model for entry in lists}) == 20
    assert len(lists) >= 70
    assert {entry.model for entry in read_lists(folder, terms=("ours",))} == {"bracket", "figure", "lattice", "tree"}
    assert sum(file.stat().st_size for file in folder.iterdir()) < 300_000


def listed(*outcome: float, censored: tuple[int, ...] = ()) -> RatedList:
    features = np.arange(6.0 * len(outcome), dtype=np.float32).reshape(-1, 6)
    return RatedList(features, PAPER_COLUMNS, np.array(outcome), np.isin(np.arange(len(outcome)), censored), "a", "a", "a.0.x")


def test_the_five_least_outcomes_are_rated_and_the_rest_are_not() -> None:
    assert listed(0.9, 0.1, 0.5, 0.2, 0.4, 0.3, 0.6).ratings.tolist() == [0, 5, 1, 4, 2, 3, 0]


def test_a_short_list_has_no_zero_and_equal_outcomes_keep_their_order() -> None:
    assert listed(0.2, 0.1, 0.2).ratings.tolist() == [4, 5, 3]


def test_candidates_not_followed_leave_the_list_unless_they_are_its_best() -> None:
    (shortened,) = followed([listed(0.4, 0.2, 0.3, 0.2, censored=(1, 2))])
    assert shortened.outcome.tolist() == [0.4, 0.2, 0.2]
    assert shortened.features[:, 0].tolist() == [0, 6, 18]
    assert shortened.ratings.tolist() == [3, 5, 4]


def test_regrets_are_shares_of_the_least_outcome_or_of_a_twentieth_of_the_risky_area() -> None:
    assert listed(0.3, 0.2).regrets.tolist() == pytest.approx([0.5, 0])
    assert listed(0.0, 0.01).regrets.tolist() == pytest.approx([0, 0.2])


def test_a_list_of_one_candidate_teaches_nothing() -> None:
    assert listed(0.0, 0.0).teaches
    assert not listed(0.0).teaches


def test_features_are_scaled_to_the_range_of_their_list_and_a_constant_one_becomes_zero() -> None:
    scaled = scale(np.array([[1, 7], [3, 7], [2, 7]], np.float32))
    assert np.allclose(scaled, [[0, 0], [1, 0], [0.5, 0]])
