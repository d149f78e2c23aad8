"""Objectives: what a training asks of a network: the loss of the scores of a list, and when a network has got better.

uRank (Zhu and Klabjan 2020) as the 2020 paper uses it; the paper prints the loss without its minus sign and calls |R| what is
the number of distinct ratings. Regret, ours: the regret that one has to expect who draws a candidate by the softmax of the
scores, so candidates that are nearly as good as the best cost nearly nothing, whatever their place. A step of it sees part of
each list, for searches meet short ones. Lists of different lengths are padded to one length, so that a step takes many at once.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
import torch
from torch.nn.functional import softplus
from torch.nn.utils.rnn import pad_sequence

from mdp.learning.lists import RatedList
from mdp.learning.ndcg import ndcg, order
from mdp.mesh import Floats, Ints

FAR_BELOW = -1e30  # a score that no exponential sees, finite so that gradients stay numbers
CUTS = (1, 3, 5)  # of the NDCG by which uRank is validated
FIRST = (1, 2)  # candidates: by the regret of the best of them a training for little regret is validated
LEAST_PART = 0.3  # of a list that a step for little regret sees
PERCENT, MOST_REGRET, ENTROPY_WEIGHT = 100.0, 1.0, 0.005  # a list costs 1 at most; entropy keeps scores from running away

Loss = Callable[[torch.Tensor, torch.Tensor, torch.Tensor], torch.Tensor]
Targets = Floats | Ints
Figures = tuple[float, ...]


@dataclass(frozen=True, eq=False)
class Padded:
    """L lists padded to n candidates: features (L, n, F), targets (L, n), present (L, n) true for candidates."""

    features: torch.Tensor
    targets: torch.Tensor
    present: torch.Tensor

    def take(self, rows: torch.Tensor) -> "Padded":
        """Some of the lists, no longer than the longest of them needs."""
        longest = int(self.present[rows].sum(dim=1).max())
        return Padded(self.features[rows, :longest], self.targets[rows, :longest], self.present[rows, :longest])


@dataclass(frozen=True, eq=False)
class Objective:
    """What a training asks for.

    targets: (n,) what the scores of a list are held against; loss: (L,) of scores, targets and present; figures: what scores of
    a list are worth by `measures`, each the better the higher; thins: whether a step sees only a part of each list.
    """

    targets: Callable[[RatedList], Targets]
    loss: Loss
    figures: Callable[[Floats, Targets], Figures]
    measures: tuple[str, ...]
    thins: bool

    def pad(self, lists: Sequence[RatedList], columns: Sequence[str]) -> Padded:
        """Lists side by side, with the named features."""
        targets = [torch.from_numpy(self.targets(rated)) for rated in lists]
        features = [torch.from_numpy(rated.table(columns)) for rated in lists]
        present = [torch.ones(len(array), dtype=torch.bool) for array in targets]
        return Padded(*(pad_sequence(arrays, batch_first=True) for arrays in (features, targets, present)))


def urank_loss(scores: torch.Tensor, ratings: torch.Tensor, present: torch.Tensor) -> torch.Tensor:
    """(L,) loss of each list: every candidate against all of lower rating, weighted by its gain, over the ratings but one.

    1/(U-1) sum_i (2^r_i - 1) softplus(logsumexp_{j: r_j < r_i} s_j - s_i), U the number of distinct ratings of the list.
    """
    lower = (ratings.unsqueeze(1) < ratings.unsqueeze(2)) & present.unsqueeze(1) & present.unsqueeze(2)
    rivals = torch.where(lower, scores.unsqueeze(1), FAR_BELOW).logsumexp(dim=2)
    gains = torch.where(present & lower.any(dim=2), torch.exp2(ratings.to(scores.dtype)) - 1.0, 0.0)
    ordered = torch.where(present, ratings, ratings.amax(dim=1, keepdim=True)).sort(dim=1).values
    steps = (ordered.diff(dim=1) > 0).sum(dim=1).clamp(min=1)
    return (gains * softplus(rivals - scores)).sum(dim=1) / steps


def regret_loss(scores: torch.Tensor, regrets: torch.Tensor, present: torch.Tensor) -> torch.Tensor:
    """(L,) loss of each list: expected regret under the softmax of the scores in percent, less a little of its entropy."""
    chances = torch.where(present, scores, FAR_BELOW).softmax(dim=1)
    least = torch.where(present, regrets, torch.inf).amin(dim=1, keepdim=True)
    more = torch.where(present, regrets - least, 0.0).to(scores.dtype)
    entropy = torch.special.entr(chances.clamp(min=1e-7)).sum(dim=1)  # the clamp: no gradient without end at a chance of 0
    return PERCENT * (chances * more).sum(dim=1).clamp(max=MOST_REGRET) - ENTROPY_WEIGHT * entropy


def thin(present: torch.Tensor, generator: torch.Generator) -> torch.Tensor:
    """(L, n) a part of each list, drawn anew, between LEAST_PART and all of it; all where fewer than two would be left."""
    parts = LEAST_PART + (1.0 - LEAST_PART) * torch.rand(len(present), 1, generator=generator)
    some = present & (torch.rand(present.shape, generator=generator) < parts)
    return torch.where(some.sum(dim=1, keepdim=True) >= 2, some, present)


def _ndcgs(scores: Floats, ratings: Targets) -> Figures:
    return tuple(ndcg(scores, ratings.astype(np.int32), cut) for cut in CUTS)


def _without_regret(scores: Floats, regrets: Targets) -> Figures:
    ordered = regrets[order(scores)]
    return tuple(1.0 - float(ordered[:first].min()) for first in FIRST)


OBJECTIVES = {
    "urank": Objective(lambda rated: rated.ratings, urank_loss, _ndcgs, tuple(f"NDCG@{cut}" for cut in CUTS), thins=False),
    "regret": Objective(
        lambda rated: rated.regrets, regret_loss, _without_regret, tuple(f"1 - regret@{first}" for first in FIRST), thins=True
    ),
}
