from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

torch = pytest.importorskip("torch", reason="the extra `train` is not installed")
onnx = pytest.importorskip("onnx", reason="the extra `train` is not installed")
onnxruntime = pytest.importorskip("onnxruntime", reason="onnxruntime is not installed")

from mdp.learning.command import COLUMN_SETS
from mdp.learning.lists import RatedList, followed, read_lists, scale
from mdp.learning.ndcg import regret
from mdp.learning.networks import PaperNetwork, RegretNetwork, contrasts, export, scaled, scores, write
from mdp.learning.training import OBJECTIVES, SCHEDULES, Padded, train
from mdp.mesh import Floats
from mdp.ranking.features import COLUMNS, PAPER_COLUMNS
from mdp.ranking.ranker import LearnedRanker, ranker_named
from profiles.errors import UserError
from tests.mdp.learning.records import drawn_list

pytestmark = pytest.mark.train

CHEAP = COLUMN_SETS["cheap"]
SMALL_SET = Path(__file__).parent / "data"
METADATA = {"kind": "urank", "data_set": "drawn, 3 lists", "commit": "abc", "figures": "NDCG@1 .4"}


def test_the_savings_of_a_cut_are_weighed_against_its_permanent_losses() -> None:
    assert contrasts(("M2", "M3", "M6")).tolist() == [[1.0, 1.0, 1.0], [0.0, 0.0, 0.0], [-1.0, -4.0, -16.0]]


def planted(seed: int, size: int = 20) -> RatedList:
    """A list whose candidates end better with more M2 and less waste; its features share an offset."""
    rng = np.random.default_rng(seed)
    features = (rng.random(len(COLUMNS)) + rng.random((size, len(COLUMNS)))).astype(np.float32)
    wasted = features[:, COLUMNS.index("wasted")].astype(np.float64)
    outcome: Floats = 3.0 - features[:, 1] + 2.0 * wasted
    return RatedList(features, COLUMNS, outcome, np.zeros(size, np.bool_), f"m{seed % 7}", "", "")


def side_by_side(*lists: RatedList) -> Padded:
    return OBJECTIVES["regret"].pad(lists, CHEAP)


def small(seed: int = 0) -> RegretNetwork:
    network, lists = RegretNetwork(CHEAP, (8, 8), seed), side_by_side(*(planted(number) for number in range(10)))
    network.prepare(lists.features, lists.present)
    return network


def test_the_network_is_the_paper_s() -> None:
    network = PaperNetwork(PAPER_COLUMNS)
    assert sum(parameter.numel() for parameter in network.parameters()) == 10_901
    assert all(not layer.bias.any() for layer in network.layers)
    assert float(network.layers[1].weight.detach().abs().max()) == pytest.approx((6 / 200) ** 0.5, rel=1e-2)


def test_features_are_scaled_over_the_candidates_that_are_there() -> None:
    lists = [drawn_list(1, 9), drawn_list(2, 4)]
    padded = OBJECTIVES["urank"].pad(lists, PAPER_COLUMNS)
    assert np.array_equal(scaled(padded.features, padded.present, 1e-8)[1, :4].numpy(), scale(lists[1].features))


def test_a_list_has_the_same_scores_alone_and_in_a_batch() -> None:
    network, lists = PaperNetwork(PAPER_COLUMNS), [drawn_list(1, 9), drawn_list(2, 4)]
    padded = OBJECTIVES["urank"].pad(lists, PAPER_COLUMNS)
    with torch.no_grad():
        batch = network(padded.features, padded.present).numpy()
    assert np.allclose(scores([network], PAPER_COLUMNS)(lists[1]), batch[1, :4], atol=1e-6)


def test_a_candidate_that_a_step_does_not_see_changes_no_score() -> None:
    network, lists = small(), side_by_side(planted(1, 6))
    seen = lists.present.clone()
    seen[0, 2] = False
    changed = lists.features.clone()
    changed[0, 2] = 9.0
    with torch.no_grad():
        first, second = network(lists.features, seen)[seen], network(changed, seen)[seen]
    assert first.tolist() == second.tolist()


def test_inputs_have_mean_0_and_spread_1_over_the_training_lists() -> None:
    network = small()
    lists = side_by_side(*(planted(number) for number in range(10)))
    inputs = network.inputs(lists.features, lists.present)[lists.present]
    assert inputs.mean(dim=0).abs().max() < 1e-4
    assert torch.allclose(inputs.std(dim=0, correction=0), torch.ones(inputs.shape[1]), atol=1e-3)


def test_a_planted_rule_is_learnt() -> None:
    lists = [planted(seed) for seed in range(150)]
    network = RegretNetwork(CHEAP, (8, 8))
    train(network, CHEAP, (lists[:120], lists[120:]), replace(SCHEDULES["regret"], epochs=40, rate=1e-2))
    fresh = [planted(seed) for seed in range(1000, 1100)]
    learnt, missed = scores([network], CHEAP), regret(1)
    assert np.mean([missed(learnt(rated), rated) == 0.0 for rated in fresh]) > 0.8


def test_the_loss_falls_on_the_small_set() -> None:
    lists = followed(read_lists(SMALL_SET, columns=CHEAP))
    epochs: list[tuple[Any, ...]] = []
    train(
        RegretNetwork(CHEAP),
        CHEAP,
        (lists, lists),
        replace(SCHEDULES["regret"], epochs=15, batch=8),
        on_epoch=lambda *told: epochs.append(told),
    )
    assert epochs[-1][1] < 0.7 * epochs[0][1]
    assert OBJECTIVES["regret"].measures == ("1 - regret@1", "1 - regret@2")


@pytest.mark.parametrize("size", [1, 2, 50])
def test_the_graph_of_an_ensemble_scores_as_the_mean_of_its_members_in_torch(size: int) -> None:
    members = [small(seed) for seed in range(3)]
    session = onnxruntime.InferenceSession(export(members, CHEAP, {}))
    for seed in range(10):
        rated = planted(seed, size)
        (given,) = session.run(["scores"], {"features": rated.table(CHEAP)})
        by_member = [scores([member], CHEAP)(rated) for member in members]
        assert given.shape == (size,)
        assert np.abs(given - np.mean(by_member, axis=0)).max() < 1e-5
        assert np.abs(by_member[0] - by_member[1]).max() > 1e-2


def test_a_search_takes_the_file_and_scores_by_it(tmp_path: Path) -> None:
    members, rated = [small(seed) for seed in range(2)], planted(3)
    write(tmp_path / "a.onnx", export(members, CHEAP, {"kind": "regret"}))
    ranker = ranker_named(str(tmp_path / "a.onnx"))
    assert isinstance(ranker, LearnedRanker)
    assert ranker.columns == CHEAP
    assert ranker.scores(rated.table(CHEAP)) == pytest.approx(scores(members, CHEAP)(rated), abs=6e-5)


def test_the_file_of_the_largest_ensemble_is_below_200_kb() -> None:
    content = export([RegretNetwork(COLUMNS, seed=seed) for seed in range(12)], COLUMNS, {"kind": "regret"})
    assert len(content) < 200_000
    assert onnx.load_model_from_string(content).metadata_props[0].value == ",".join(COLUMNS)


@pytest.mark.parametrize("size", [1, 2, 3, 50])
def test_the_graph_scores_as_the_network_does(size: int) -> None:
    network = PaperNetwork(PAPER_COLUMNS, seed=3)
    session = onnxruntime.InferenceSession(export([network], PAPER_COLUMNS, METADATA))
    for seed in range(20):
        rated = drawn_list(seed, size)
        (given,) = session.run(["scores"], {"features": rated.features})
        assert given.shape == (size,)
        assert np.abs(given - scores([network], PAPER_COLUMNS)(rated)).max() < 1e-5


def test_a_feature_that_is_the_same_for_all_candidates_changes_nothing() -> None:
    session = onnxruntime.InferenceSession(export([PaperNetwork(PAPER_COLUMNS)], PAPER_COLUMNS, METADATA))
    quarter = drawn_list(1, 10).features
    quarter[:, 2] = 0.25
    three_quarters = quarter.copy()
    three_quarters[:, 2] = 0.75
    assert session.run(None, {"features": quarter})[0].tolist() == session.run(None, {"features": three_quarters})[0].tolist()


def test_the_file_says_what_it_is(tmp_path: Path) -> None:
    file = tmp_path / "ranker.onnx"
    write(file, export([PaperNetwork(PAPER_COLUMNS)], PAPER_COLUMNS, METADATA))
    model = onnx.load(file)
    assert {entry.key: entry.value for entry in model.metadata_props} == {"features": "M1,M2,M3,M4,M5,M6", **METADATA}
    assert 43_000 < file.stat().st_size < 46_000
    assert [path.name for path in tmp_path.iterdir()] == ["ranker.onnx"]


def test_an_unwritable_file_is_reported_in_one_sentence(tmp_path: Path) -> None:
    with pytest.raises(UserError, match="cannot be written"):
        write(tmp_path / "nowhere" / "ranker.onnx", b"")
