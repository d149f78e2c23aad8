"""Training: steps over shuffled batches of lists until the order of the validation lists no longer improves.

Adam with a limit on the norm of all gradients together. The network with the highest figures on the validation lists is kept. One
thread, and an order of lists drawn from seed and epoch: equal lists give equal weights.

uRank (Zhu and Klabjan 2020) as the 2020 paper uses it; the paper prints the loss without its minus sign, and calls the number of
distinct ratings |R|. Regret, ours: the expected regret of a candidate drawn by the softmax of the scores, so candidates that are
nearly as good as the best cost nearly nothing, wherever they are placed. A step of it uses part of each list, since searches meet
short ones. Lists are padded to one length, so that a step takes many at once.
"""

from collections.abc import Callable, Sequence
from copy import deepcopy
from dataclasses import dataclass

import numpy as np
import torch
from torch.nn.functional import softplus
from torch.nn.utils.rnn import pad_sequence

from mdp.learning.lists import RatedList
from mdp.learning.ndcg import ndcg, order
from mdp.learning.networks import Network
from mdp.mesh import Floats, Ints
from profiles.errors import UserError

FAR_BELOW = -1e30  # a score without weight in an exponential, finite so that gradients stay numbers
CUTS = (1, 3, 5)  # cutoffs of the NDCG by which uRank is validated
FIRST = (1, 2)  # numbers of first candidates whose best regret validates a training with the regret loss
LEAST_PART = 0.3  # least share of a list that a step with the regret loss uses
PERCENT, MOST_REGRET, ENTROPY_WEIGHT = 100.0, 1.0, 0.005  # a list costs 1 at most; the entropy term keeps scores bounded

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
        """A selection of the lists, padded to the longest of them."""
        longest = int(self.present[rows].sum(dim=1).max())
        return Padded(self.features[rows, :longest], self.targets[rows, :longest], self.present[rows, :longest])


@dataclass(frozen=True, eq=False)
class Objective:
    """A training objective.

    targets: (n,) targets for the scores of a list; loss: (L,) from scores, targets and present; figures: values of `measures` for
    the scores of a list, where higher is better; thins: whether a step uses only a part of each list.
    """

    targets: Callable[[RatedList], Targets]
    loss: Loss
    figures: Callable[[Floats, Targets], Figures]
    measures: tuple[str, ...]
    thins: bool

    def pad(self, lists: Sequence[RatedList], columns: Sequence[str]) -> Padded:
        """Lists padded to one length, with the named features."""
        targets = [torch.from_numpy(self.targets(rated)) for rated in lists]
        features = [torch.from_numpy(rated.table(columns)) for rated in lists]
        present = [torch.ones(len(array), dtype=torch.bool) for array in targets]
        return Padded(*(pad_sequence(arrays, batch_first=True) for arrays in (features, targets, present)))


def urank_loss(scores: torch.Tensor, ratings: torch.Tensor, present: torch.Tensor) -> torch.Tensor:
    """(L,) uRank loss of each list: every candidate against all of lower rating, weighted by its gain, divided by the number of
    distinct ratings less one.

    1/(U-1) sum_i (2^r_i - 1) softplus(logsumexp_{j: r_j < r_i} s_j - s_i), U the number of distinct ratings of the list.
    """
    lower = (ratings.unsqueeze(1) < ratings.unsqueeze(2)) & present.unsqueeze(1) & present.unsqueeze(2)
    rivals = torch.where(lower, scores.unsqueeze(1), FAR_BELOW).logsumexp(dim=2)
    gains = torch.where(present & lower.any(dim=2), torch.exp2(ratings.to(scores.dtype)) - 1.0, 0.0)
    ordered = torch.where(present, ratings, ratings.amax(dim=1, keepdim=True)).sort(dim=1).values
    steps = (ordered.diff(dim=1) > 0).sum(dim=1).clamp(min=1)
    return (gains * softplus(rivals - scores)).sum(dim=1) / steps


def regret_loss(scores: torch.Tensor, regrets: torch.Tensor, present: torch.Tensor) -> torch.Tensor:
    """(L,) regret loss of each list: expected regret under the softmax of the scores in percent, less a little of its entropy."""
    chances = torch.where(present, scores, FAR_BELOW).softmax(dim=1)
    least = torch.where(present, regrets, torch.inf).amin(dim=1, keepdim=True)
    more = torch.where(present, regrets - least, 0.0).to(scores.dtype)
    entropy = torch.special.entr(chances.clamp(min=1e-7)).sum(dim=1)  # the clamp avoids an infinite gradient at a chance of 0
    return PERCENT * (chances * more).sum(dim=1).clamp(max=MOST_REGRET) - ENTROPY_WEIGHT * entropy


def thin(present: torch.Tensor, generator: torch.Generator) -> torch.Tensor:
    """(L, n) random part of each list, between LEAST_PART and all of it; the whole list if fewer than two would remain."""
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


@dataclass(frozen=True)
class Schedule:
    """Schedule of a training.

    loss: name of an objective; patience: epochs without a gain; batch: lists per step; rate: learning rate of Adam; clip:
    greatest norm of the gradients; decay: weight decay, added to the gradients.
    """

    loss: str = "urank"
    epochs: int = 1000
    patience: int = 50
    batch: int = 8
    rate: float = 1e-4
    clip: float = 5.0
    decay: float = 0.0
    seed: int = 0


SCHEDULES = {"urank": Schedule(), "regret": Schedule("regret", epochs=100, patience=25, batch=64, rate=2e-3, decay=1e-3)}


# Called after an epoch with its number from 1, the mean training loss, the figures on the validation lists, and the best epoch.
OnEpoch = Callable[[int, float, Figures, int], None]


def train(
    network: Network,
    columns: Sequence[str],
    lists: tuple[Sequence[RatedList], Sequence[RatedList]],
    schedule: Schedule,
    on_epoch: OnEpoch = lambda number, loss, validation, best: None,
) -> Figures:
    """Train a network in place on the named features of training and validation lists; returns the best figures.

    Lists of one candidate are left out. Raises UserError if none remain.
    """
    torch.set_num_threads(1)
    training, validation = ([rated for rated in side if rated.teaches] for side in lists)
    for side, name in ((training, "train"), (validation, "validate")):
        if not side:
            raise UserError(f"no list to {name} with: record more models, of more repositories and folders")
    objective = OBJECTIVES[schedule.loss]
    padded, held_out = objective.pad(training, columns), objective.pad(validation, columns)
    network.prepare(padded.features, padded.present)
    adam = torch.optim.Adam(network.parameters(), lr=schedule.rate, weight_decay=schedule.decay)
    best: Figures = ()
    best_epoch, best_weights = 0, deepcopy(network.state_dict())
    for epoch in range(1, schedule.epochs + 1):
        loss = _steps(network, adam, padded, schedule, epoch)
        figures = _validate(network, held_out, objective)
        if figures > best:
            best, best_epoch, best_weights = figures, epoch, deepcopy(network.state_dict())
        on_epoch(epoch, loss, figures, best_epoch)
        if epoch - best_epoch >= schedule.patience:
            break
    network.load_state_dict(best_weights)
    return best


def _steps(network: Network, adam: torch.optim.Optimizer, lists: Padded, schedule: Schedule, epoch: int) -> float:
    """Run one epoch; returns the mean loss of the lists, each at the time of its step."""
    total, objective = 0.0, OBJECTIVES[schedule.loss]
    generator = torch.Generator().manual_seed(schedule.seed * 1_000_003 + epoch)
    for rows in torch.randperm(len(lists.targets), generator=generator).split(schedule.batch):
        batch = lists.take(rows)
        seen = thin(batch.present, generator) if objective.thins else batch.present
        losses = objective.loss(network(batch.features, seen), batch.targets, seen)
        adam.zero_grad()
        losses.mean().backward()
        torch.nn.utils.clip_grad_norm_(network.parameters(), schedule.clip)
        adam.step()
        total += float(losses.detach().sum())
    return total / len(lists.targets)


def _validate(network: Network, lists: Padded, objective: Objective) -> Figures:
    with torch.no_grad():
        scores = network(lists.features, lists.present).double().numpy()
    targets, present = lists.targets.numpy(), lists.present.numpy()
    figures = [objective.figures(scores[row][here], targets[row][here]) for row, here in enumerate(present)]
    return tuple(sum(values) / len(figures) for values in zip(*figures, strict=True))
