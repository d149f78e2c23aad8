"""Networks trained in torch and exported as ONNX files that take raw features, prepare them in the graph and return scores.

The graph is written node by node, so a search runs exactly the code below, and torch's exporter is not needed.
"""

from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence
from itertools import pairwise
from pathlib import Path

import numpy as np
import onnx
import torch
from onnx import TensorProto, helper, numpy_helper

from mdp.learning.lists import SMALLEST_RANGE, RatedList, Singles
from mdp.learning.ndcg import Scores
from mdp.mesh import Floats
from mdp.ranking.ranker import INPUT, OUTPUT
from profiles.errors import UserError
from profiles.files import SHARED, write_whole

OPSET, IR_VERSION = 13, 8  # old enough for every onnxruntime of recent years
TRADE_OFFS = (1.0, 4.0, 16.0)  # weights of M6 relative to M2
LEAST_RANGE = 1e-4  # added to a feature's range: a difference of 1e-4 of the model is insignificant
SMALLEST_SPREAD = 1e-6  # inputs with a smaller standard deviation count as constant


class Network(torch.nn.Module, ABC):
    """Dense layers with ReLU between them, plus a linear term in some subclasses; subclasses prepare the inputs."""

    def __init__(self, inputs: int, hidden: Sequence[int]) -> None:
        super().__init__()
        self.layers = torch.nn.ModuleList(torch.nn.Linear(*pair) for pair in pairwise((inputs, *hidden, 1)))
        self.line: torch.nn.Linear | None = None

    def prepare(self, features: torch.Tensor, present: torch.Tensor) -> None:
        """Set what depends on the training lists; nothing by default."""

    def forward(self, features: torch.Tensor, present: torch.Tensor) -> torch.Tensor:
        """(L, n) scores of (L, n, F) features; present: (L, n) true for candidates, false for padding."""
        rows = inputs = self.inputs(features, present)
        for layer in self.layers[:-1]:
            rows = torch.relu(layer(rows))
        scores: torch.Tensor = self.layers[-1](rows)
        return (scores if self.line is None else scores + self.line(inputs)).squeeze(-1)

    @abstractmethod
    def inputs(self, features: torch.Tensor, present: torch.Tensor) -> torch.Tensor:
        """(L, n, inputs) inputs of the first layer."""

    @abstractmethod
    def inputs_in(self, graph: "Graph") -> str:
        """Name of the (n, inputs) value in a graph that feeds the first layer."""


class PaperNetwork(Network):
    """The paper's network: scores each candidate by its features, scaled over its list; Glorot-uniform weights."""

    def __init__(self, columns: Sequence[str], hidden: Sequence[int] = (100, 100), seed: int = 0) -> None:
        """columns: names of the features."""
        super().__init__(len(columns), hidden)
        generator = torch.Generator().manual_seed(seed)
        for layer in self.layers:
            torch.nn.init.xavier_uniform_(layer.weight, generator=generator)
            torch.nn.init.zeros_(layer.bias)

    def inputs(self, features: torch.Tensor, present: torch.Tensor) -> torch.Tensor:
        """(L, n, F) the features scaled by list."""
        return scaled(features, present, SMALLEST_RANGE)

    def inputs_in(self, graph: "Graph") -> str:
        """Add the scaling of the inputs to an ONNX graph; returns the name of its output."""
        return graph.scaled(INPUT, SMALLEST_RANGE)


class RegretNetwork(Network):
    """Our network. Inputs: features unscaled and scaled by list, and M2 - k M6 relative to the best of the list for several k,
    standardised.

    M2 - k M6 is what a cut saves less what it loses for good: the trade-offs that the slots of a beam follow.
    """

    def __init__(self, columns: Sequence[str], hidden: Sequence[int] = (32, 32), seed: int = 0) -> None:
        """columns: names of the features, M2 and M6 among them."""
        inputs = 2 * len(columns) + len(TRADE_OFFS)
        super().__init__(inputs, hidden)
        self.register_buffer("contrasts", torch.from_numpy(contrasts(columns)))
        self.register_buffer("mean", torch.zeros(inputs))
        self.register_buffer("spread", torch.ones(inputs))
        self.line = torch.nn.Linear(inputs, 1, bias=False)
        generator = torch.Generator().manual_seed(seed)
        for layer in (*self.layers, self.line):
            most = layer.in_features**-0.5
            for parameter in layer.parameters():
                torch.nn.init.uniform_(parameter, -most, most, generator=generator)

    def prepare(self, features: torch.Tensor, present: torch.Tensor) -> None:
        """Compute mean and spread of the inputs."""
        inputs = self.inputs(features, present)[present].double()
        spread, mean = torch.std_mean(inputs, dim=0, correction=0)
        self.mean.copy_(mean)
        self.spread.copy_(torch.where(spread < SMALLEST_SPREAD, 1.0, spread))

    def inputs(self, features: torch.Tensor, present: torch.Tensor) -> torch.Tensor:
        """(L, n, 2F + TRADE_OFFS) inputs of the first layer, with mean 0 and spread 1 once the network is prepared."""
        saved = features @ self.contrasts
        most = torch.where(present.unsqueeze(-1), saved, -torch.inf).amax(dim=1, keepdim=True)
        whole = torch.cat([features, scaled(features, present, LEAST_RANGE), saved - most], dim=-1)
        return (whole - self.mean) / self.spread

    def inputs_in(self, graph: "Graph") -> str:
        """Add the preparation of the inputs to an ONNX graph; returns the name of its output."""
        saved = graph.add("MatMul", INPUT, graph.constant(self.contrasts))
        below = graph.add("Sub", saved, graph.add("ReduceMax", saved, axes=[0], keepdims=1))
        inputs = graph.add("Concat", INPUT, graph.scaled(INPUT, LEAST_RANGE), below, axis=1)
        centred = graph.add("Sub", inputs, graph.constant(self.mean))
        return graph.add("Div", centred, graph.constant(self.spread))


NETWORKS = {"urank": PaperNetwork, "regret": RegretNetwork}


def contrasts(columns: Sequence[str]) -> Singles:
    """(F, TRADE_OFFS) matrix that turns features into M2 - k M6."""
    matrix = np.zeros((len(columns), len(TRADE_OFFS)), np.float32)
    matrix[columns.index("M2")] = 1.0
    matrix[columns.index("M6")] = np.negative(TRADE_OFFS)
    return matrix


def scaled(features: torch.Tensor, present: torch.Tensor, smallest_range: float) -> torch.Tensor:
    """(L, n, F) features scaled to 0 to 1 over their list, as in `mdp.learning.lists.scale`."""
    here = present.unsqueeze(-1)
    low = torch.where(here, features, torch.inf).amin(dim=1, keepdim=True)
    high = torch.where(here, features, -torch.inf).amax(dim=1, keepdim=True)
    return (features - low) / (high - low + smallest_range)


def scores(networks: Sequence[Network], columns: Sequence[str]) -> Scores:
    """Mean score of several networks for the candidates of a list, from the named features."""

    def of_list(rated: RatedList) -> Floats:
        features = torch.from_numpy(rated.table(columns)).unsqueeze(0)
        present = torch.ones(features.shape[:2], dtype=torch.bool)
        with torch.no_grad():
            given = torch.stack([network(features, present)[0] for network in networks])
        mean: Floats = given.mean(dim=0).numpy().astype(np.float64)
        return mean

    return of_list


class Graph:
    """An ONNX graph built node by node; values are referred to by name."""

    def __init__(self) -> None:
        self._nodes: list[onnx.NodeProto] = []
        self._constants: list[onnx.TensorProto] = []

    def add(self, operator: str, *inputs: str, **attributes: object) -> str:
        """Add a node with one output; returns the output's name."""
        name = f"{operator.lower()}_{len(self._nodes)}"
        self._nodes.append(helper.make_node(operator, inputs, [name], **attributes))
        return name

    def constant(self, tensor: torch.Tensor) -> str:
        """Add a constant tensor; returns its name."""
        name = f"constant_{len(self._constants)}"
        self._constants.append(numpy_helper.from_array(tensor.detach().numpy(), name))
        return name

    def scaled(self, features: str, smallest_range: float) -> str:
        """Add the scaling of (n, F) columns to 0 to 1 over their list; returns the name of its output."""
        low, high = (self.add(operator, features, axes=[0], keepdims=1) for operator in ("ReduceMin", "ReduceMax"))
        smallest = self.constant(torch.tensor(smallest_range))
        return self.add("Div", self.add("Sub", features, low), self.add("Add", self.add("Sub", high, low), smallest))

    def model(self, columns: Sequence[str], scores: str, metadata: Mapping[str, str]) -> bytes:
        """The file's content. scores: name of the (n,) output value; columns: names of the (n, F) features."""
        self._nodes.append(helper.make_node("Identity", [scores], [OUTPUT]))
        given = helper.make_tensor_value_info(INPUT, TensorProto.FLOAT, ["candidates", len(columns)])
        taken = helper.make_tensor_value_info(OUTPUT, TensorProto.FLOAT, ["candidates"])
        graph = helper.make_graph(self._nodes, "ranker", [given], [taken], self._constants)
        model = helper.make_model(graph, opset_imports=[helper.make_opsetid("", OPSET)], producer_name="tiltprint")
        model.ir_version = IR_VERSION
        helper.set_model_props(model, {"features": ",".join(columns), **metadata})
        onnx.checker.check_model(model)
        content: bytes = model.SerializeToString()
        return content


def export(networks: Sequence[Network], columns: Sequence[str], metadata: Mapping[str, str]) -> bytes:
    """The content of an ONNX file that averages the scores of networks of one kind, prepared with the same lists.

    Their weights are stacked, so that each layer is one product: (networks, inputs, outputs). metadata: further information about
    the file (kind, data_set, commit, figures).
    """
    graph = Graph()
    inputs = rows = networks[0].inputs_in(graph)
    for number in range(len(networks[0].layers)):
        if number > 0:
            rows = graph.add("Relu", rows)
        weight = torch.stack([network.layers[number].weight.T for network in networks])
        bias = torch.stack([network.layers[number].bias.unsqueeze(0) for network in networks])
        rows = graph.add("Add", graph.add("MatMul", rows, graph.constant(weight)), graph.constant(bias))
    given = graph.add("ReduceMean", rows, axes=[0], keepdims=0)
    lines = [network.line.weight.T for network in networks if network.line is not None]
    if lines:
        given = graph.add("Add", given, graph.add("MatMul", inputs, graph.constant(torch.stack(lines).mean(dim=0))))
    return graph.model(columns, graph.add("Squeeze", given, graph.constant(torch.tensor([1]))), metadata)


def write(file: Path, content: bytes) -> None:
    """Write a ranker whole or not at all; raises UserError if that fails."""
    try:
        write_whole(file, content, SHARED)
    except OSError as error:
        raise UserError(f"ranker {file} cannot be written ({error.strerror})") from None
