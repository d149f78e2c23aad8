from dataclasses import replace
from math import e, log
from typing import Any

import numpy as np
import pytest

torch = pytest.importorskip("torch", reason="the extra `train` is not installed")

from mdp.learning.networks import PaperNetwork
from mdp.learning.training import Schedule, regret_loss, thin, train, urank_loss
from mdp.ranking.features import PAPER_COLUMNS
from profiles.errors import UserError
from tests.mdp.learning.records import drawn_list
from tests.mdp.learning.reference import reference_lists

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


def rows(*lists: list[float]) -> torch.Tensor:
    return torch.nn.utils.rnn.pad_sequence([torch.tensor(values, dtype=torch.float64) for values in lists], batch_first=True)


def test_urank_s_loss_of_two_candidates_is_the_better_one_s_log_likelihood_times_its_gain() -> None:
    loss = urank_loss(rows([2.0, 1.0]), rows([5, 4]), torch.ones(1, 2, dtype=torch.bool))
    assert float(loss) == pytest.approx(31 * -log(e / (e + 1)))


def test_urank_s_loss_of_an_untrained_full_list_is_known() -> None:
    ratings = rows([5, 4, 3, 2, 1, *[0] * 45])
    loss = urank_loss(torch.zeros(1, 50), ratings, torch.ones(1, 50, dtype=torch.bool))
    assert float(loss) == pytest.approx((31 * log(50) + 15 * log(49) + 7 * log(48) + 3 * log(47) + log(46)) / 5)


def test_candidates_of_equal_rating_do_not_compete() -> None:
    loss = urank_loss(rows([7.0, 0.0, 0.0]), rows([1, 1, 0]), torch.ones(1, 3, dtype=torch.bool))
    assert float(loss) == pytest.approx(log(1 + e**-7) + log(2))


def test_padding_adds_nothing_and_a_list_of_one_rating_costs_nothing() -> None:
    given, ratings = rows([0.5, 0.2, 0.9], [0.1]), rows([2, 1, 3], [5])
    present = torch.tensor([[True, True, True], [True, False, False]])
    alone = urank_loss(given[:1], ratings[:1], present[:1])
    assert urank_loss(given, ratings, present).tolist() == [float(alone), 0.0]


def test_scores_far_apart_neither_overflow_nor_lose_their_gradient() -> None:
    given = rows([-500.0, 500.0], [3.0, 1.0]).requires_grad_()
    losses = urank_loss(given, rows([1, 0], [0, 0]), torch.ones(2, 2, dtype=torch.bool))
    losses.sum().backward()
    assert losses.tolist() == [1000, 0]
    assert given.grad.tolist() == [[-1, 1], [0, 0]]


def test_the_published_scores_have_the_known_loss_and_equal_ones_a_higher_one() -> None:
    lists = reference_lists()
    ratings = rows(*[labels for _, labels in lists])
    present = rows(*[[1] * len(labels) for _, labels in lists]) > 0
    published = rows(*[given for given, _ in lists])
    assert float(urank_loss(published, ratings, present).mean()) == pytest.approx(30.680, abs=5e-4)
    assert float(urank_loss(torch.zeros_like(published), ratings, present).mean()) == pytest.approx(37.70, abs=5e-3)


def test_our_loss_is_the_expected_regret_in_percent() -> None:
    given = rows([np.log(3.0), 0.0])
    loss = regret_loss(given, rows([0.0, 0.04]), torch.ones(1, 2, dtype=torch.bool))
    entropy = -(0.75 * np.log(0.75) + 0.25 * np.log(0.25))
    assert loss.tolist() == pytest.approx([100 * 0.25 * 0.04 - 0.005 * entropy], abs=1e-6)


def test_regret_is_measured_against_the_best_that_a_step_sees() -> None:
    present = torch.tensor([[False, True, True]])
    far = regret_loss(rows([0.0, 50.0, 0.0]), rows([0.0, 0.1, 0.3]), present)
    assert far.tolist() == pytest.approx([0.0], abs=1e-3)


def test_padding_does_not_change_our_loss() -> None:
    given, regrets = rows([0.5, 0.2, 0.9], [0.1, 0.4]), rows([0.0, 0.1, 0.3], [0.2, 0.0])
    present = torch.tensor([[True, True, True], [True, True, False]])
    alone = regret_loss(given[1:, :2], regrets[1:, :2], present[1:, :2])
    assert regret_loss(given, regrets, present)[1].tolist() == pytest.approx(float(alone))


def test_a_step_sees_a_part_of_each_list_and_of_short_ones_all() -> None:
    present = torch.arange(50).expand(400, 50) < torch.tensor([50, 2] * 200).unsqueeze(1)
    seen = thin(present, torch.Generator().manual_seed(1))
    assert not (seen & ~present).any()
    assert 0.6 < seen[::2].double().mean() < 0.7
    assert seen[1::2].sum(dim=1).tolist() == [2] * 200
