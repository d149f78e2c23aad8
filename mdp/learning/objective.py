"""Objective: what a training asks of a network: what it is given of a list, the loss of its scores, and when it has got better.

Lists of different lengths are padded to one length, so that a step takes many of them at once.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import torch
from numpy.typing import NDArray
from torch.nn.utils.rnn import pad_sequence

from mdp.learning.labels import RatedList, Singles
from mdp.mesh import Floats, Ints

FAR_BELOW = -1e30  # a score that no exponential sees, finite so that gradients stay numbers

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


def all_present(present: torch.Tensor, generator: torch.Generator) -> torch.Tensor:
    """(L, n) a step sees every candidate."""
    del generator
    return present


def as_it_is(network: torch.nn.Module, lists: Padded) -> None:
    """Nothing is to be done to a network before its training."""
    del network, lists


def by_itself(network: torch.nn.Module, features: torch.Tensor, present: torch.Tensor) -> torch.Tensor:
    """(L, n) scores of a network that looks at no candidate beside another."""
    del present
    scores: torch.Tensor = network(features)
    return scores


@dataclass(frozen=True)
class Objective:
    """What a training asks for.

    given: (n, F) what a network gets of a list, from the named columns; targets: (n,) what its scores are held against; loss:
    (L,) of scores, targets and present; figures: what scores of a list are worth by `measures`, each the better the higher;
    thin: which candidates a step sees; score: runs the network on features and present; prepare: what is done to a new network
    with the training lists.
    """

    given: Callable[[RatedList, Sequence[str]], Singles]
    targets: Callable[[RatedList], Targets]
    loss: Loss
    figures: Callable[[Floats, Targets], Figures]
    measures: tuple[str, ...]
    thin: Callable[[torch.Tensor, torch.Generator], torch.Tensor] = all_present
    score: Callable[[torch.nn.Module, torch.Tensor, torch.Tensor], torch.Tensor] = by_itself
    prepare: Callable[[torch.nn.Module, Padded], None] = as_it_is

    def pad(self, lists: Sequence[RatedList], columns: Sequence[str]) -> Padded:
        """Lists side by side."""
        targets = [self.targets(rated) for rated in lists]
        return Padded(
            _beside([self.given(rated, columns) for rated in lists]),
            _beside(targets),
            pad_sequence([torch.ones(len(array), dtype=torch.bool) for array in targets], batch_first=True),
        )


def _beside(arrays: Sequence[NDArray[Any]]) -> torch.Tensor:
    return pad_sequence([torch.from_numpy(array) for array in arrays], batch_first=True)
