"""Export: a trained network as an ONNX file, raw features in, scores out; scaling by list is part of the graph.

The graph is written node by node, so what a search runs is what stands here, and torch's exporter is not needed.
"""

from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np
import onnx
from numpy.typing import NDArray
from onnx import TensorProto, helper, numpy_helper

from mdp.learning.labels import SMALLEST_RANGE, Singles
from mdp.ranking.network import INPUT, OUTPUT
from profiles.errors import LearningError
from profiles.files import SHARED, write_whole

OPSET, IR_VERSION = 13, 8  # old enough for every onnxruntime of the last years

Layer = tuple[Singles, Singles]  # weight (outputs, inputs) and bias (outputs,)


class Graph:
    """An ONNX graph that grows node by node; values are known by their names."""

    def __init__(self) -> None:
        self._nodes: list[onnx.NodeProto] = []
        self._constants: list[onnx.TensorProto] = []

    def add(self, operator: str, *inputs: str, **attributes: object) -> str:
        """A node with one output; the output's name."""
        name = f"{operator.lower()}_{len(self._nodes)}"
        self._nodes.append(helper.make_node(operator, inputs, [name], **attributes))
        return name

    def constant(self, array: NDArray[np.generic]) -> str:
        """A tensor of numbers that stay; its name."""
        name = f"constant_{len(self._constants)}"
        self._constants.append(numpy_helper.from_array(array, name))
        return name

    def model(self, columns: Sequence[str], scores: str, metadata: Mapping[str, str]) -> bytes:
        """The file's content; scores: name of the (n,) value that is given out; columns: names of the (n, F) features."""
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


def scale_by_list(graph: Graph, features: str, smallest_range: float = SMALLEST_RANGE) -> str:
    """(n, F) every column from 0 to 1 over its list, as `mdp.learning.labels.scale`."""
    low, high = (graph.add(operator, features, axes=[0], keepdims=1) for operator in ("ReduceMin", "ReduceMax"))
    smallest = graph.constant(np.array(smallest_range, np.float32))
    return graph.add("Div", graph.add("Sub", features, low), graph.add("Add", graph.add("Sub", high, low), smallest))


def dense(graph: Graph, rows: str, layer: Layer) -> str:
    """(n, inputs) -> (n, outputs)."""
    weight, bias = (graph.constant(array) for array in layer)
    return graph.add("Gemm", rows, weight, bias, transB=1)


def perceptron(graph: Graph, rows: str, layers: Sequence[Layer]) -> str:
    """(n, inputs) -> (n,) through dense layers with ReLU between them; the last one has one output."""
    for layer in layers[:-1]:
        rows = graph.add("Relu", dense(graph, rows, layer))
    return graph.add("Squeeze", dense(graph, rows, layers[-1]), graph.constant(np.array([1], np.int64)))


def export(layers: Sequence[Layer], columns: Sequence[str], metadata: Mapping[str, str]) -> bytes:
    """The content of an ONNX file that scales the named features by list and scores them by dense layers.

    metadata: what else a person may want to know of it (kind, data_set, commit, figures).
    """
    graph = Graph()
    return graph.model(columns, perceptron(graph, scale_by_list(graph, INPUT), layers), metadata)


def write(file: Path, content: bytes) -> None:
    """Write a ranker whole or not at all; LearningError where that cannot be done."""
    try:
        write_whole(file, content, SHARED)
    except OSError as error:
        raise LearningError(f"ranker {file}: cannot be written ({error.strerror})") from None
