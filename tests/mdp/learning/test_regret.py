from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

torch = pytest.importorskip("torch", reason="the extra `train` is not installed")
onnx = pytest.importorskip("onnx", reason="the extra `train` is not installed")
onnxruntime = pytest.importorskip("onnxruntime", reason="onnxruntime is not installed")

from mdp.learning.command import COLUMN_SETS
from mdp.learning.export import write
from mdp.learning.labels import RatedList, followed, rate, ratings
from mdp.learning.lists import read_lists
from mdp.learning.ndcg import best_within
from mdp.learning.regret import OBJECTIVE, Network, export, regret_loss, scores, thin
from mdp.learning.training import SCHEDULES, Epoch, train
from mdp.mesh import Floats
from mdp.ranking.features import COLUMNS
from mdp.ranking.network import Network as SearchNetwork
from mdp.ranking.ranker import ranker_named

pytestmark = pytest.mark.train

CHEAP = COLUMN_SETS["cheap"]
SMALL_SET = Path(__file__).parent / "data"


def planted(seed: int, size: int = 20) -> RatedList:
    """A list whose candidates end the better the more M2 they have and the less of it is wasted, all shifted by list."""
    rng = np.random.default_rng(seed)
    features = (rng.random(len(COLUMNS)) + rng.random((size, len(COLUMNS)))).astype(np.float32)
    wasted = features[:, COLUMNS.index("wasted")].astype(np.float64)
    outcome: Floats = 3.0 - features[:, 1] + 2.0 * wasted
    return RatedList(features, COLUMNS, outcome, ratings(outcome), f"m{seed % 7}", f"m{seed % 7}.0.ours")


def small(seed: int = 0) -> Network:
    network = Network(CHEAP, (8, 8), seed)
    network.standardise(OBJECTIVE.pad([planted(number) for number in range(10)], CHEAP))
    return network


def batch(*lists: list[float]) -> torch.Tensor:
    return torch.nn.utils.rnn.pad_sequence([torch.tensor(values) for values in lists], batch_first=True)


def test_the_loss_is_the_expected_regret_in_percent() -> None:
    given = batch([np.log(3.0), 0.0])
    loss = regret_loss(given, batch([0.0, 0.04]), torch.ones(1, 2, dtype=torch.bool))
    entropy = -(0.75 * np.log(0.75) + 0.25 * np.log(0.25))
    assert loss.tolist() == pytest.approx([100 * 0.25 * 0.04 - 0.005 * entropy], abs=1e-6)


def test_regret_is_measured_against_the_best_that_a_step_sees() -> None:
    present = torch.tensor([[False, True, True]])
    far = regret_loss(batch([0.0, 50.0, 0.0]), batch([0.0, 0.1, 0.3]), present)
    assert far.tolist() == pytest.approx([0.0], abs=1e-3)


def test_a_step_sees_a_part_of_each_list_and_of_short_ones_all() -> None:
    present = torch.arange(50).expand(400, 50) < torch.tensor([50, 2] * 200).unsqueeze(1)
    seen = thin(present, torch.Generator().manual_seed(1))
    assert not (seen & ~present).any()
    assert 0.6 < seen[::2].double().mean() < 0.7
    assert seen[1::2].sum(dim=1).tolist() == [2] * 200


def test_a_candidate_that_a_step_does_not_see_changes_no_score() -> None:
    network, lists = small(), OBJECTIVE.pad([planted(1, 6)], CHEAP)
    seen = lists.present.clone()
    seen[0, 2] = False
    changed = lists.features.clone()
    changed[0, 2] = 9.0
    with torch.no_grad():
        first, second = network(lists.features, seen)[seen], network(changed, seen)[seen]
    assert first.tolist() == second.tolist()


def test_inputs_have_mean_0_and_spread_1_over_the_training_lists() -> None:
    network = small()
    lists = OBJECTIVE.pad([planted(number) for number in range(10)], CHEAP)
    inputs = (network.inputs(lists.features, lists.present)[lists.present] - network.mean) / network.spread
    assert inputs.mean(dim=0).abs().max() < 1e-4
    assert torch.allclose(inputs.std(dim=0, correction=0), torch.ones(inputs.shape[1]), atol=1e-3)


def test_a_planted_rule_is_learnt() -> None:
    lists = [planted(seed) for seed in range(150)]
    network = Network(CHEAP, (8, 8))
    train(network, CHEAP, (lists[:120], lists[120:]), replace(SCHEDULES["regret"], epochs=40, rate=1e-2))
    fresh = [planted(seed) for seed in range(1000, 1100)]
    learnt, within = scores([network], CHEAP), best_within(1)
    assert np.mean([within(learnt(rated), rated) for rated in fresh]) > 0.8


def test_the_loss_falls_on_the_small_set() -> None:
    lists = rate(followed(read_lists(SMALL_SET, columns=CHEAP)), CHEAP)
    assert {rated.terms for rated in lists} == {"ours", "paper"}
    epochs: list[Epoch] = []
    train(Network(CHEAP), CHEAP, (lists, lists), replace(SCHEDULES["regret"], epochs=15, batch=8), on_epoch=epochs.append)
    assert epochs[-1].loss < 0.7 * epochs[0].loss
    assert epochs[0].measures == ("1 - regret@1", "1 - regret@2")


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
    assert isinstance(ranker, SearchNetwork)
    assert ranker.columns == CHEAP
    assert ranker.scores(rated.table(CHEAP)) == pytest.approx(scores(members, CHEAP)(rated), abs=6e-5)


def test_the_file_of_the_largest_ensemble_is_below_200_kb() -> None:
    content = export([Network(COLUMNS, seed=seed) for seed in range(12)], COLUMNS, {"kind": "regret"})
    assert len(content) < 200_000
    assert onnx.load_model_from_string(content).metadata_props[0].value == ",".join(COLUMNS)
