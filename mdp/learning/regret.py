"""Regret: a network that is asked for little regret of what it puts first, not for an order.

The loss of a list is the regret that one has to expect who draws a candidate by the softmax of the scores, so candidates that are
nearly as good as the best cost nearly nothing, whatever their place. A step sees part of each list, for searches meet short ones.
The network is given the features as they are, scaled by list, and M2 - k M6 below the best of the list for some k (what a cut
saves less what it loses for ever: the trade-offs that the slots of a beam follow), all of them standardised.
"""

from collections.abc import Mapping, Sequence
from itertools import pairwise

import numpy as np
import torch

from mdp.learning.export import Graph, scale_by_list
from mdp.learning.labels import RatedList, Singles
from mdp.learning.ndcg import Scores, order
from mdp.learning.objective import FAR_BELOW, Figures, Objective, Padded, Targets
from mdp.mesh import Floats
from mdp.ranking.network import INPUT

HIDDEN = (32, 32)  # an ensemble of them stays below 200 kB (mdp.learning.train)
TRADE_OFFS = (1.0, 4.0, 16.0)  # of M6 against M2
SMALLEST_RANGE = 1e-4  # features that differ less over a list are hardly told apart: a share of 1e-4 is no reason
SMALLEST_SPREAD = 1e-6  # an input that spreads less over all lists is the same everywhere
LEAST_PART = 0.3  # of a list that a step sees
PERCENT, MOST_REGRET, ENTROPY_WEIGHT = 100.0, 1.0, 0.005  # a list costs 1 at most; entropy keeps scores from running away
FIRST = (1, 2)  # candidates: by the regret of the best of them a training is validated


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


class Network(torch.nn.Module):
    """Scores every candidate of a list from its own features and the list's ranges: dense layers with ReLU, and a line."""

    def __init__(self, columns: Sequence[str], hidden: Sequence[int] = HIDDEN, seed: int = 0) -> None:
        """columns: names of the features, M2 and M6 among them."""
        super().__init__()
        self.register_buffer("contrasts", torch.from_numpy(contrasts(columns)))
        inputs = 2 * len(columns) + len(TRADE_OFFS)
        self.register_buffer("mean", torch.zeros(inputs))
        self.register_buffer("spread", torch.ones(inputs))
        self.layers = torch.nn.ModuleList(torch.nn.Linear(*pair) for pair in pairwise((inputs, *hidden, 1)))
        self.line = torch.nn.Linear(inputs, 1, bias=False)
        generator = torch.Generator().manual_seed(seed)
        for layer in (*self.layers, self.line):
            most = layer.in_features**-0.5
            for parameter in layer.parameters():
                torch.nn.init.uniform_(parameter, -most, most, generator=generator)

    def inputs(self, features: torch.Tensor, present: torch.Tensor) -> torch.Tensor:
        """(L, n, 2F + TRADE_OFFS) what the features are turned into before they are standardised."""
        here = present.unsqueeze(-1)
        low = torch.where(here, features, torch.inf).amin(dim=1, keepdim=True)
        high = torch.where(here, features, -torch.inf).amax(dim=1, keepdim=True)
        saved = features @ self.contrasts
        most = torch.where(here, saved, -torch.inf).amax(dim=1, keepdim=True)
        return torch.cat([features, (features - low) / (high - low + SMALLEST_RANGE), saved - most], dim=-1)

    def standardise(self, lists: Padded) -> None:
        """Take mean and spread of the inputs from lists."""
        inputs = self.inputs(lists.features, lists.present)[lists.present].double()
        spread, mean = torch.std_mean(inputs, dim=0, correction=0)
        self.mean.copy_(mean)
        self.spread.copy_(torch.where(spread < SMALLEST_SPREAD, 1.0, spread))

    def forward(self, features: torch.Tensor, present: torch.Tensor) -> torch.Tensor:
        """(L, n, F) features and (L, n) which candidates are there -> (L, n) scores."""
        inputs = (self.inputs(features, present) - self.mean) / self.spread
        rows = inputs
        for layer in self.layers[:-1]:
            rows = torch.relu(layer(rows))
        scores: torch.Tensor = (self.layers[-1](rows) + self.line(inputs)).squeeze(-1)
        return scores


def contrasts(columns: Sequence[str]) -> Singles:
    """(F, TRADE_OFFS) what features are multiplied by to get M2 - k M6."""
    matrix = np.zeros((len(columns), len(TRADE_OFFS)), np.float32)
    matrix[columns.index("M2")] = 1.0
    matrix[columns.index("M6")] = np.negative(TRADE_OFFS)
    return matrix


def scores(networks: Sequence[Network], columns: Sequence[str]) -> Scores:
    """The mean of what networks give the candidates of a list."""

    def of_list(rated: RatedList) -> Floats:
        features = torch.from_numpy(rated.table(columns)).unsqueeze(0)
        present = torch.ones(features.shape[:2], dtype=torch.bool)
        with torch.no_grad():
            given = torch.stack([network(features, present)[0] for network in networks])
        mean: Floats = given.mean(dim=0).numpy().astype(np.float64)
        return mean

    return of_list


def export(networks: Sequence[Network], columns: Sequence[str], metadata: Mapping[str, str]) -> bytes:
    """The content of an ONNX file that scores by the mean of networks that were standardised by the same lists.

    Their weights are stacked, so that all of them are one product a layer: (networks, inputs, outputs).
    """
    graph, first = Graph(), networks[0]
    saved = graph.add("MatMul", INPUT, graph.constant(_array(first.contrasts)))
    below = graph.add("Sub", saved, graph.add("ReduceMax", saved, axes=[0], keepdims=1))
    inputs = graph.add("Concat", INPUT, scale_by_list(graph, INPUT, SMALLEST_RANGE), below, axis=1)
    centred = graph.add("Sub", inputs, graph.constant(_array(first.mean)))
    inputs = rows = graph.add("Div", centred, graph.constant(_array(first.spread)))
    for number in range(len(first.layers)):
        if number > 0:
            rows = graph.add("Relu", rows)
        weight = np.stack([_array(network.layers[number].weight).T for network in networks])
        bias = np.stack([_array(network.layers[number].bias)[np.newaxis] for network in networks])
        rows = graph.add("Add", graph.add("MatMul", rows, graph.constant(weight)), graph.constant(bias))
    line: Singles = np.stack([_array(network.line.weight).T for network in networks]).mean(axis=0)
    mean = graph.add("ReduceMean", rows, axes=[0], keepdims=0)
    total = graph.add("Add", mean, graph.add("MatMul", inputs, graph.constant(line)))
    return graph.model(columns, graph.add("Squeeze", total, graph.constant(np.array([1], np.int64))), metadata)


def _array(tensor: torch.Tensor) -> Singles:
    values: Singles = tensor.detach().numpy()
    return values


def _figures(given: Floats, regrets: Targets) -> Figures:
    ordered = regrets[order(given)]
    return tuple(1.0 - float(ordered[:first].min()) for first in FIRST)


OBJECTIVE = Objective(
    given=lambda rated, columns: rated.table(columns),
    targets=lambda rated: rated.regrets,
    loss=regret_loss,
    figures=_figures,
    measures=tuple(f"1 - regret@{first}" for first in FIRST),
    thin=thin,
    score=lambda network, features, present: network(features, present),
    prepare=lambda network, lists: network.standardise(lists),
)
