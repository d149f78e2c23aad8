"""uRank (Zhu and Klabjan 2020) as the 2020 paper uses it: the network and its loss; and RankNet's loss beside it.

The paper prints the loss without its minus sign and calls |R| what is the number of distinct ratings.
"""

from collections.abc import Sequence
from itertools import pairwise

import numpy as np
import torch
from torch.nn.functional import softplus

from mdp.learning.labels import RatedList, Singles, scale
from mdp.learning.ndcg import Scores, ndcg
from mdp.learning.objective import FAR_BELOW, Figures, Loss, Objective, Targets
from mdp.mesh import Floats

HIDDEN = (100, 100)  # as the paper's network
CUTS = (1, 3, 5)  # of the NDCG that a training is validated by


class Network(torch.nn.Module):
    """Scores every candidate by itself: dense layers with biases, ReLU between them, a linear output; Glorot-uniform weights."""

    def __init__(self, inputs: int, hidden: Sequence[int] = HIDDEN, seed: int = 0) -> None:
        super().__init__()
        widths = (inputs, *hidden, 1)
        self.layers = torch.nn.ModuleList(torch.nn.Linear(*pair) for pair in pairwise(widths))
        generator = torch.Generator().manual_seed(seed)
        for layer in self.layers:
            torch.nn.init.xavier_uniform_(layer.weight, generator=generator)
            torch.nn.init.zeros_(layer.bias)

    def forward(self, features: torch.Tensor) -> torch.Tensor:
        """(..., F) features scaled by list -> (...) scores."""
        for layer in self.layers[:-1]:
            features = torch.relu(layer(features))
        return self.layers[-1](features).squeeze(-1)

    def weights(self) -> list[tuple[Singles, Singles]]:
        """Weight (outputs, inputs) and bias (outputs,) of every layer."""
        return [(layer.weight.detach().numpy(), layer.bias.detach().numpy()) for layer in self.layers]


def urank_loss(scores: torch.Tensor, ratings: torch.Tensor, present: torch.Tensor) -> torch.Tensor:
    """(L,) loss of each list: every candidate against all of lower rating, weighted by its gain, over the ratings but one.

    1/(U-1) sum_i (2^r_i - 1) softplus(logsumexp_{j: r_j < r_i} s_j - s_i), U the number of distinct ratings of the list.
    """
    lower = _lower(ratings, present)
    rivals = torch.where(lower, scores.unsqueeze(1), FAR_BELOW).logsumexp(dim=2)
    gains = torch.where(present & lower.any(dim=2), torch.exp2(ratings.to(scores.dtype)) - 1.0, 0.0)
    steps = (_distinct(ratings, present) - 1).clamp(min=1)
    return (gains * softplus(rivals - scores)).sum(dim=1) / steps


def ranknet_loss(scores: torch.Tensor, ratings: torch.Tensor, present: torch.Tensor) -> torch.Tensor:
    """(L,) loss of each list: the mean over pairs of different rating of softplus(s_lower - s_higher) (Burges 2005)."""
    lower = _lower(ratings, present)
    pairs = torch.where(lower, softplus(scores.unsqueeze(1) - scores.unsqueeze(2)), 0.0)
    return pairs.sum(dim=(1, 2)) / lower.sum(dim=(1, 2)).clamp(min=1)


def _lower(ratings: torch.Tensor, present: torch.Tensor) -> torch.Tensor:
    """(L, n, n) true at i, j where candidate j is rated lower than candidate i."""
    return (ratings.unsqueeze(1) < ratings.unsqueeze(2)) & present.unsqueeze(1) & present.unsqueeze(2)


def _distinct(ratings: torch.Tensor, present: torch.Tensor) -> torch.Tensor:
    """(L,) how many different ratings each list has."""
    ordered = torch.where(present, ratings, ratings.amax(dim=1, keepdim=True)).sort(dim=1).values
    return (ordered.diff(dim=1) > 0).sum(dim=1) + 1


def _figures(scores: Floats, ratings: Targets) -> Figures:
    return tuple(ndcg(scores, ratings.astype(np.int32), cut) for cut in CUTS)


def _objective(loss: Loss) -> Objective:
    measures = tuple(f"NDCG@{cut}" for cut in CUTS)
    return Objective(lambda rated, columns: scale(rated.table(columns)), lambda rated: rated.ratings, loss, _figures, measures)


OBJECTIVES = {"urank": _objective(urank_loss), "ranknet": _objective(ranknet_loss)}


def scores(network: torch.nn.Module, columns: Sequence[str]) -> Scores:
    """What a network gives the candidates of a list from the named features."""

    def of_list(rated: RatedList) -> Floats:
        with torch.no_grad():
            given: Floats = network(torch.from_numpy(scale(rated.table(columns)))).numpy().astype(np.float64)
        return given

    return of_list
