"""Training: steps over shuffled batches of lists until the validation lists are ordered no better.

Adam, the norm of all gradients together cut off. The network with the highest figures on the validation lists is kept.
One thread, and an order of lists drawn anew from seed and epoch: the same lists give the same weights.
"""

from collections.abc import Callable, Sequence
from copy import deepcopy
from dataclasses import dataclass

import torch

from mdp.learning.lists import RatedList
from mdp.learning.networks import Network
from mdp.learning.objective import OBJECTIVES, Figures, Objective, Padded, thin
from profiles.errors import UserError


@dataclass(frozen=True)
class Schedule:
    """How to train.

    loss: name of an objective; patience: epochs without a gain; batch: lists a step; rate: Adam's; clip: largest norm of the
    gradients; decay: of the weights, added to the gradients.
    """

    loss: str = "urank"
    epochs: int = 1000
    patience: int = 50
    batch: int = 8
    rate: float = 1e-4
    clip: float = 5.0
    decay: float = 0.0
    seed: int = 0


SCHEDULES = {
    "urank": Schedule(),
    "regret": Schedule("regret", epochs=100, patience=25, batch=64, rate=2e-3, decay=1e-3),
}


@dataclass(frozen=True)
class Epoch:
    """An epoch's number from 1, mean training loss, figures on the validation lists and their names; the best epoch so far."""

    number: int
    loss: float
    validation: Figures
    measures: tuple[str, ...]
    best: int


def train(
    network: Network,
    columns: Sequence[str],
    lists: tuple[Sequence[RatedList], Sequence[RatedList]],
    schedule: Schedule,
    on_epoch: Callable[[Epoch], None] | None = None,
) -> Figures:
    """Train a network in place on the named features of lists for training and for validation; the best figures.

    Lists of one candidate are left out. Raises UserError if no others remain.
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
        if on_epoch is not None:
            on_epoch(Epoch(epoch, loss, figures, objective.measures, best_epoch))
        if epoch - best_epoch >= schedule.patience:
            break
    network.load_state_dict(best_weights)
    return best


def _steps(network: Network, adam: torch.optim.Optimizer, lists: Padded, schedule: Schedule, epoch: int) -> float:
    """One epoch; the mean loss of the lists, each as its step met it."""
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
