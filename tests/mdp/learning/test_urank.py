from math import e, log

import numpy as np
import pytest

torch = pytest.importorskip("torch", reason="the extra `train` is not installed")

from mdp.learning.urank import OBJECTIVES, Network, ranknet_loss, scores, urank_loss
from mdp.ranking.features import PAPER_COLUMNS
from tests.mdp.learning.records import drawn_list
from tests.mdp.learning.reference import reference_lists

pytestmark = pytest.mark.train


def rows(*lists: list[float]) -> torch.Tensor:
    return torch.nn.utils.rnn.pad_sequence([torch.tensor(values, dtype=torch.float64) for values in lists], batch_first=True)


def test_the_loss_of_two_candidates_is_the_better_one_s_log_likelihood_times_its_gain() -> None:
    loss = urank_loss(rows([2.0, 1.0]), rows([5, 4]), torch.ones(1, 2, dtype=torch.bool))
    assert float(loss) == pytest.approx(31 * -log(e / (e + 1)))


def test_the_loss_of_an_untrained_full_list_is_known() -> None:
    ratings = rows([5, 4, 3, 2, 1, *[0] * 45])
    loss = urank_loss(torch.zeros(1, 50), ratings, torch.ones(1, 50, dtype=torch.bool))
    assert float(loss) == pytest.approx((31 * log(50) + 15 * log(49) + 7 * log(48) + 3 * log(47) + log(46)) / 5)


def test_candidates_of_equal_rating_do_not_compete() -> None:
    loss = urank_loss(rows([7.0, 0.0, 0.0]), rows([1, 1, 0]), torch.ones(1, 3, dtype=torch.bool))
    assert float(loss) == pytest.approx(log(1 + e**-7) + log(2))


def test_padding_adds_nothing_and_a_list_of_one_rating_costs_nothing() -> None:
    given, ratings = rows([0.5, 0.2, 0.9], [0.1]), rows([2, 1, 3], [5])
    present = torch.tensor([[True, True, True], [True, False, False]])
    for loss in (urank_loss, ranknet_loss):
        alone = loss(given[:1], ratings[:1], present[:1])
        assert loss(given, ratings, present).tolist() == [float(alone), 0.0]


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


def test_ranknet_s_loss_is_the_mean_over_pairs() -> None:
    loss = ranknet_loss(rows([0.0, 1.0, 0.0]), rows([1, 0, 0]), torch.ones(1, 3, dtype=torch.bool))
    assert float(loss) == pytest.approx((log(1 + e) + log(2)) / 2)


def test_the_network_is_the_paper_s() -> None:
    network = Network(6)
    assert sum(weight.size + bias.size for weight, bias in network.weights()) == 10_901
    assert all(not bias.any() for _, bias in network.weights())
    assert abs(network.weights()[1][0]).max() == pytest.approx((6 / 200) ** 0.5, rel=1e-2)


def test_a_list_is_scored_alike_alone_and_in_a_batch() -> None:
    network, lists = Network(6), [drawn_list(1, 9), drawn_list(2, 4)]
    with torch.no_grad():
        batch = network(OBJECTIVES["urank"].pad(lists, PAPER_COLUMNS).features).numpy()
    assert np.allclose(scores(network, PAPER_COLUMNS)(lists[1]), batch[1, :4], atol=1e-6)
