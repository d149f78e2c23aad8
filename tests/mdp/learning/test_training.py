from dataclasses import replace
from typing import Any

import pytest

torch = pytest.importorskip("torch", reason="the extra `train` is not installed")

from mdp.learning.networks import PaperNetwork
from mdp.learning.training import Schedule, train
from mdp.ranking.features import PAPER_COLUMNS
from profiles.errors import UserError
from tests.mdp.learning.records import drawn_list

pytestmark = pytest.mark.train

LISTS = ([drawn_list(seed, 12) for seed in range(40)], [drawn_list(seed, 12) for seed in range(40, 60)])
SHORT = Schedule(epochs=6, batch=8, rate=3e-3)


def weights(network: PaperNetwork) -> list[list[float]]:
    return [array.detach().ravel().tolist() for array in network.parameters()]


def small() -> PaperNetwork:
    return PaperNetwork(PAPER_COLUMNS, (8,))


def test_the_loss_falls_and_the_order_gets_better() -> None:
    epochs: list[tuple[Any, ...]] = []
    best = train(small(), PAPER_COLUMNS, LISTS, replace(SHORT, epochs=15), on_epoch=lambda *told: epochs.append(told))
    assert epochs[-1][1] < 0.8 * epochs[0][1]
    assert best[0] == max(epoch[2][0] for epoch in epochs) > 0.6


def test_the_same_lists_and_seed_give_the_same_weights() -> None:
    first, again, other = small(), small(), small()
    for network, seed in ((first, 1), (again, 1), (other, 2)):
        train(network, PAPER_COLUMNS, LISTS, replace(SHORT, seed=seed))
    assert weights(first) == weights(again) != weights(other)


def test_a_training_stops_when_nothing_gets_better_and_keeps_the_best_network() -> None:
    epochs: list[tuple[Any, ...]] = []
    network = small()
    train(
        network,
        PAPER_COLUMNS,
        LISTS,
        replace(SHORT, epochs=100, patience=2, rate=0.0),
        on_epoch=lambda *told: epochs.append(told),
    )
    assert [epoch[0] for epoch in epochs] == [1, 2, 3]
    assert weights(network) == weights(small())


def test_lists_of_one_candidate_are_no_lists_to_train_with() -> None:
    with pytest.raises(UserError, match="no list to validate with"):
        train(small(), PAPER_COLUMNS, (LISTS[0], [drawn_list(1, 1)]), SHORT)
