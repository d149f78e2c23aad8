from dataclasses import replace
from pathlib import Path

import pytest

torch = pytest.importorskip("torch", reason="the extra `train` is not installed")

from mdp.learning.rankers.training import Epoch, Schedule, train
from mdp.learning.rankers.urank import Network
from mdp.ranking.features import PAPER_COLUMNS
from profiles.errors import LearningError
from tests.mdp.learning.records import drawn_list

pytestmark = pytest.mark.train

LISTS = ([drawn_list(seed, 12) for seed in range(40)], [drawn_list(seed, 12) for seed in range(40, 60)])
SHORT = Schedule(epochs=6, batch=8, rate=3e-3)


def weights(network: Network) -> list[list[float]]:
    return [array.ravel().tolist() for layer in network.weights() for array in layer]


def small() -> Network:
    return Network(6, (8,))


@pytest.mark.parametrize("loss", ["urank", "ranknet"])
def test_the_loss_falls_and_the_order_gets_better(loss: str) -> None:
    epochs: list[Epoch] = []
    best = train(small(), PAPER_COLUMNS, LISTS, replace(SHORT, epochs=15, loss=loss), on_epoch=epochs.append)
    assert epochs[-1].loss < 0.8 * epochs[0].loss
    assert best[0] == max(epoch.validation[0] for epoch in epochs) > 0.6


def test_an_interrupted_training_ends_at_the_same_weights(tmp_path: Path) -> None:
    whole, halves = small(), small()
    figures = train(whole, PAPER_COLUMNS, LISTS, SHORT, tmp_path / "whole.pt")
    train(small(), PAPER_COLUMNS, LISTS, replace(SHORT, epochs=3), tmp_path / "halves.pt")
    epochs: list[Epoch] = []
    assert train(halves, PAPER_COLUMNS, LISTS, SHORT, tmp_path / "halves.pt", epochs.append) == figures
    assert [epoch.number for epoch in epochs] == [4, 5, 6]
    assert weights(halves) == weights(whole)


def test_a_training_stops_when_nothing_gets_better_and_keeps_the_best_network() -> None:
    epochs: list[Epoch] = []
    network = small()
    train(network, PAPER_COLUMNS, LISTS, replace(SHORT, epochs=100, patience=2, rate=0.0), on_epoch=epochs.append)
    assert [epoch.number for epoch in epochs] == [1, 2, 3]
    assert weights(network) == weights(small())


def test_a_checkpoint_of_another_training_or_a_torn_one_is_refused(tmp_path: Path) -> None:
    file = tmp_path / "a.pt"
    train(small(), PAPER_COLUMNS, LISTS, replace(SHORT, epochs=1), file)
    with pytest.raises(LearningError, match="is of a training with other lists or settings"):
        train(small(), PAPER_COLUMNS, (LISTS[0][1:], LISTS[1]), SHORT, file)
    file.write_bytes(file.read_bytes()[:100])
    with pytest.raises(LearningError, match="cannot be read"):
        train(small(), PAPER_COLUMNS, LISTS, SHORT, file)


def test_a_checkpoint_that_cannot_be_written_is_told_in_a_sentence(tmp_path: Path) -> None:
    with pytest.raises(LearningError, match=r"checkpoint .*a\.pt: cannot be written"):
        train(small(), PAPER_COLUMNS, LISTS, SHORT, tmp_path / "nowhere" / "a.pt")


def test_lists_of_one_candidate_are_no_lists_to_train_with() -> None:
    with pytest.raises(LearningError, match="no list to validate with"):
        train(small(), PAPER_COLUMNS, (LISTS[0], [drawn_list(1, 1)]), SHORT)
